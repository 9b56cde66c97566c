"""The native FMU against the Python package: they must agree to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from fmu_src.hammer.motion import Gauge, Motion
from fmu_src.hammer.outputs import OUTPUTS
from fmu_src.run import run_fmu
from percussion_model.scene.numbers import section_numbers
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.solvers.cells import find_cell

# Two steps of a power of two, whose sums have no rounding [s].
STEP = 2.0**-10
STEPS = 256


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
