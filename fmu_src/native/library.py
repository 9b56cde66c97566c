"""Libraries of native FMUs for each platform: compiled once for all scenes, and kept.

It is kept in `dist/native` of a clone, else in the folder `native` of the user's cache
(`PERCUSSION_CACHE`).
"""

from __future__ import annotations

import functools
import sys
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

from fmu_src.archive import ROOT
from percussion_model.engine.compiler import (
    HERE as ENGINE,
)
from percussion_model.engine.compiler import (
    NoCompilerError,
    Report,
    compiler_for,
    hash_of,
    link,
    objects,
    only_one,
    remove_old,
)
from percussion_model.engine.entries import SOLVERS
from percussion_model.engine.library import module_of
from percussion_model.engine.library import stamp as engine_stamp
from percussion_model.engine.platforms import PLATFORMS, this_platform
from percussion_model.physics.user_cache import cache_folder, can_write, is_clone
from percussion_model.scene.scene import SceneError

HERE = Path(__file__).resolve().parent
# What the library follows from, besides the solvers.
SOURCES = ("fmu_src/native", "fmu_src/hammer", "fmu_src/parts")
# Modules with the entries of a library, by what the name of its file begins with.
HAMMER, PARTS = "", "parts-"
OF = {
    HAMMER: ("fmu_src.native.entries", *map(module_of, SOLVERS)),
    PARTS: ("fmu_src.native.part_entries",),
}
MODULES = tuple(module for modules in OF.values() for module in modules)
# What a command says meanwhile.
COMPILING = "compiling the library of FMUs, once for these sources: some minutes"
# Names of platforms that FMI 2.0 has.
ALIASES = {"linux64": "x86_64-linux", "win64": "x86_64-windows", "darwin64": "x86_64-darwin"}


def platform_names(words: Sequence[str]) -> dict[str, str]:
    """Names of platforms as hosts of FMI 3.0 call them, with the words that stand for them.

    Raises
    ------
    SceneError
        If one is not known.
    """
    names = {ALIASES.get(word, word): word for word in map(str.strip, words)}
    for name, word in names.items():
        if name not in PLATFORMS:
            known = ", ".join([*PLATFORMS, *ALIASES])
            raise SceneError(f"--platforms {word}: must be one or more of {known}")
    return names


@functools.cache
def stamp() -> str:
    """Hash of all that the library follows from."""
    files = (file for name in SOURCES for file in (ROOT / name).iterdir())
    own = sorted(file for file in files if file.suffix in (".py", ".c", ".h"))
    return hash_of(own, engine_stamp())


def kept_folder() -> Path:
    """Folder that libraries are kept in; of a clone that cannot be written where it has one."""
    own = ROOT / "dist" / "native"
    if is_clone() and (can_write(own) or (own / stamp()).is_dir()):
        return own
    return cache_folder() / "native"


def brought_file(name: str, which: str = HAMMER) -> Path:
    """Where an installation has the library for a platform, packed, if it brings one."""
    return HERE / "libraries" / f"{which}{name}-{stamp()}{PLATFORMS[name].suffix}.z"


def _content(file: Path) -> bytes:
    """Library of a file; what is brought goes into FMUs alone, so it is packed on disk."""
    content = file.read_bytes()
    return zlib.decompress(content) if file.suffix == ".z" else content


def _file_in(folder: Path, name: str, which: str) -> Path:
    """File of the library for a platform: what is brought, or else in a folder."""
    brought = brought_file(name, which)
    return brought if brought.is_file() else folder / f"{which}{name}{PLATFORMS[name].suffix}"


def libraries(
    names: Sequence[str] | Mapping[str, str],
    kept: Path | None = None,
    report: Report | None = None,
    which: str = HAMMER,
) -> dict[str, bytes]:
    """Libraries by platform: those that are kept, the others compiled now.

    Of several processes one compiles, and the others wait for it.

    Parameters
    ----------
    names : sequence of str, or mapping
        Of `PLATFORMS`, perhaps with the words of the user.
    kept : Path, optional
        Folder; `kept_folder` if left out.
    report : callable, optional
        Takes what is being done, and the share that is done.
    which : str
        Of `OF`.
    """
    words = names if isinstance(names, Mapping) else {name: name for name in names}
    folder = (kept or kept_folder()) / stamp()
    files = {name: _file_in(folder, name, which) for name in words if name in PLATFORMS}
    compilers = {
        name: compiler_for(name, words[name])
        for name in words
        if name not in files or not files[name].is_file()
    }
    if compilers:
        folder.mkdir(parents=True, exist_ok=True)
        with only_one(folder.with_suffix(".lock")):
            left = {name: file for name, file in files.items() if not file.is_file()}
            _compile(left, compilers, report, which)
            remove_old(folder.parent, "*/")
    return {name: _content(files[name]) for name in words}


def _compile(
    files: Mapping[str, Path],
    compilers: Mapping[str, Sequence[str]],
    report: Report | None,
    which: str,
) -> None:
    """Compile libraries by platform."""
    if files:
        objects(OF[which], list(files), report)
    for name, file in files.items():
        link_fmus(name, compilers[name], file, which)


def link_fmus(name: str, command: Sequence[str], file: Path, which: str = HAMMER) -> None:
    """Link a library of FMUs for a platform.

    Parameters
    ----------
    command : sequence of str
        Of a C compiler.
    which : str
        Of `OF`.
    """
    import fmpy

    parts = objects(OF[which], [name])[name]
    headers = f"-isystem{Path(fmpy.__file__).parent / 'c-code'}"
    sources = [*sorted(HERE.glob("*.c")), ENGINE / "memory.c"]
    link(name, command, sources, parts, file, [f"-I{HERE}", headers])


@functools.cache
def library_here() -> dict[str, bytes]:
    """Library for this machine by its platform; none, and a line that says so, without compiler."""
    try:
        return libraries([this_platform()])
    except NoCompilerError as error:
        print(f"FMUs are built without a library and run by Python: {error}", file=sys.stderr)
        return {}
