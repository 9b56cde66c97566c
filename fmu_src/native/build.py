"""The native FMUs of a scene, which agree with the package to the last bit, with their results."""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fmu_src.flat_names import flat_name
from fmu_src.hammer.build import about_hammer, hammer_name
from fmu_src.hammer.motion import Gauge, Motion
from fmu_src.hammer.outputs import OUTPUTS
from fmu_src.native.archive import Version, write_native_fmu
from fmu_src.native.reference_results import add_reference_results
from fmu_src.native.tables import model_tables
from fmu_src.run import run_fmu
from fmu_src.slave.native import this_platform
from percussion_model.scene.numbers import section_numbers
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.scene.writing import move_whole, own_prefix
from percussion_model.solvers.cells import find_cell

# Files by version of FMI: what follows the name of the scene's FMU.
SUFFIXES: dict[Version, str] = {"2.0": "-native", "3.0": "-fmi3"}
# Two steps of a power of two, whose sums have no rounding [s].
STEP = 2.0**-10
STEPS = 256


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


def package_outputs(scene: Scene, steps: int = STEPS, step: float = STEP) -> np.ndarray:
    """Outputs by the Python package, shape (steps, outputs)."""
    motion = Motion(scene, None)
    grid = motion.solver.grid_of("bit")
    if grid is not None:
        find = getattr(find_cell, "py_func", find_cell)  # as Python, which needs no numba
        place = find(section_numbers(scene.bit), grid.mass, 0.5 * scene.bit.length)
        motion.gauge = Gauge("bit", *place)
    reads = [one.read for one in OUTPUTS.values()]
    rows = []
    for k in range(1, steps + 1):
        motion.advance_to(k * step, step, {})
        rows.append([float(read(motion)) for read in reads])
    return np.array(rows)


def fmu_outputs(
    path: Path, steps: int = STEPS, step: float = STEP, named: Callable[[str], str] = str
) -> np.ndarray:
    """The same by an FMU in fmpy; `named` gives the names that its variables have."""
    names = list(map(named, OUTPUTS))
    found = run_fmu(
        path, stop_time=steps * step, step_size=step, output_interval=step, output=names
    )
    return np.array([[float(row[name]) for name in names] for row in found[1:]])


def refuse_difference(scene: Scene, path: Path, named: Callable[[str], str] = str) -> None:
    """Raise `SceneError` if an FMU differs from the Python package in any bit."""
    there, here = fmu_outputs(path, named=named), package_outputs(scene)
    names = [name for k, name in enumerate(OUTPUTS) if not np.array_equal(there[:, k], here[:, k])]
    if names:
        raise SceneError(
            f"{path}: differs from the Python package in {', '.join(names)}: an error of the build"
        )
