"""The native FMUs of a scene, with their reference results."""

from __future__ import annotations

import functools
import tempfile
from pathlib import Path

from fmu_src.flat_names import flat_name
from fmu_src.hammer.build import about_hammer, hammer_name
from fmu_src.native.archive import Version, write_native_fmu
from fmu_src.native.compare import refuse_difference
from fmu_src.native.reference_results import add_reference_results
from fmu_src.native.tables import model_tables
from fmu_src.run import run_fmu
from fmu_src.slave.native import this_platform
from percussion_model.scene.scene import Scene
from percussion_model.scene.writing import move_whole, own_prefix

# Files by version of FMI: what follows the name of the scene's FMU.
SUFFIXES: dict[Version, str] = {"2.0": "-native", "3.0": "-fmi3"}


def native_files(scene: Path, folder: Path) -> dict[Version, Path]:
    """Native FMUs of a scene's file by version of FMI."""
    stem = hammer_name(scene).removesuffix(".fmu")
    return {version: folder / f"{stem}{suffix}.fmu" for version, suffix in SUFFIXES.items()}


def build_native(
    scene: Scene,
    path: Path,
    version: Version,
    libraries: dict[str, bytes],
    flat: bool = False,
) -> str:
    """Write the native FMU of a scene, with reference results; return its GUID.

    Parameters
    ----------
    libraries : dict of bytes
        By platform.
    flat : bool
        Whether names of variables have no dots.
    """
    # the name of the file is no identifier, that of the model is
    about = about_hammer(scene, path.with_name(f"{path.stem.partition('-')[0]}.fmu"), flat)
    tables = functools.partial(model_tables, scene)
    path.parent.mkdir(parents=True, exist_ok=True)
    # in a folder beside it, so that an interruption leaves what was there
    with tempfile.TemporaryDirectory(prefix=own_prefix(path.parent), dir=path.parent) as folder:
        draft = Path(folder) / path.name
        guid = write_native_fmu(draft, version, about, scene, libraries, tables)
        if this_platform() in libraries:
            named = flat_name if flat else str
            refuse_difference(scene, draft, named)
            add_reference_results(draft, scene, functools.partial(run_fmu, draft), named)
        move_whole(draft, path)
    return guid
