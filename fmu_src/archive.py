"""Writes an FMU: the same inputs give the same bytes.

pythonfmu's own builder stamps the hour into archive and description and brings its
package along under its plain name; so its parts are put together here.
"""

from __future__ import annotations

import errno
import hashlib
import io
import zipfile
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import distribution
from pathlib import Path

from fmu_src.description import About, write_description
from fmu_src.staging import LIBRARY, Bundle, script
from fmu_src.variables import Variable
from percussion_model.physics.user_cache import is_clone
from percussion_model.scene.writing import write_whole
from percussion_model.simulation.files import reason

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
# The oldest date that a zip archive can hold.
DATE = (1980, 1, 1, 0, 0, 0)
PERMISSIONS = 0o644 << 16
# The export library: what a host loads of an FMU that runs Python.
BINARIES = LIBRARY / "resources" / "binaries"
# All that the native library needs to know of a scene.
MODEL = "resources/model.bin"
# The scene that an FMU of the hammer was made of.
SCENE = "resources/scene.json"


def write_fmu(
    path: Path,
    about: About,
    variables: Sequence[Variable],
    bundle: Bundle,
    slave: type,
    resources: dict[str, str | bytes],
    page: str,
    model: Callable[[str], bytes] | None = None,
) -> str:
    """Write an FMU and return its GUID.

    Parameters
    ----------
    slave : type
        Class of this package that runs in it.
    resources : dict of str
        Further files for the folder `resources`.
    page : str
        Documentation, HTML.
    model : callable, optional
        Gives `resources/model.bin` for a GUID with its braces; it is asked for an empty one as
        well, whose tables are part of what the GUID is a hash of.
    """
    module, text = script(bundle, slave)
    entries: dict[str, bytes] = {
        f"resources/{name}": content if isinstance(content, bytes) else content.encode()
        for name, content in {
            **bundle.files, **resources, f"{module}.py": text, "slavemodule.txt": module,
        }.items()
    }  # fmt: skip
    for source in sorted(BINARIES.rglob("*")):
        if source.suffix not in (".so", ".dll", ".dylib"):
            continue
        platform = source.parent.relative_to(BINARIES).as_posix()
        entries[f"binaries/{platform}/{about.model}{source.suffix}"] = source.read_bytes()
    entries["documentation/index.html"] = page.encode()
    entries["documentation/licenses/license.txt"] = licence()
    entries["model.png"] = (HERE / "icon.png").read_bytes()
    if model is not None:
        entries[MODEL] = model("")
    guid, xml = write_description(about, variables, digest(entries))
    if model is not None:
        entries[MODEL] = model(f"{{{guid}}}")
    write_described(path, xml, entries)
    return guid


def export_platforms() -> list[str]:
    """Platforms of the export library, as FMI 2.0 calls them: there an FMU of Python can start."""
    return sorted(one.name for one in BINARIES.iterdir() if one.is_dir())


def licence() -> bytes:
    """Text of the licence, which FMUs bring along: that of the clone, or of what is installed."""
    if is_clone():
        return (ROOT / "LICENSE").read_bytes()
    text = distribution("percussion_model").read_text("licenses/LICENSE")
    if text is None:
        raise FileNotFoundError(errno.ENOENT, "", "LICENSE of percussion_model")
    return text.encode()


def digest(entries: Mapping[str, bytes]) -> bytes:
    """Hash of names and contents, whatever their order."""
    found = hashlib.sha256()
    for name, content in sorted(entries.items()):
        found.update(name.encode() + b"\0" + hashlib.sha256(content).digest())
    return found.digest()


def write_described(path: Path, xml: bytes, entries: Mapping[str, bytes]) -> None:
    """Write an FMU; the description comes first, so that tools find it at once."""
    write_archive(path, {"modelDescription.xml": xml} | dict(sorted(entries.items())))


def state_of(path: Path, before: bytes | None) -> str:
    """What has become of a file: written, replaced or unchanged.

    Parameters
    ----------
    before : bytes or None
        What it held before (`content`).
    """
    if before is None:
        return "written"
    return "unchanged" if before == content(path) else "replaced"


def fault(error: Exception) -> str:
    """Words of an error; of one of the operating system the file and the reason."""
    name = getattr(error, "filename", None)
    return f"{name}: {reason(error)}" if name else reason(error)


def content(path: Path) -> bytes | None:
    """What a file holds; None where there is none."""
    return path.read_bytes() if path.is_file() else None


def write_archive(path: Path, entries: Mapping[str, bytes]) -> None:
    """Write a zip archive whole or not at all; the same entries give the same bytes."""
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w") as archive:
        for name, content in entries.items():
            info = zipfile.ZipInfo(name, DATE)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = PERMISSIONS
            archive.writestr(info, content)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, whole.getvalue())
