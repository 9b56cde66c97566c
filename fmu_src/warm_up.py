"""Compile the kernels of the package and of its FMU once, so that later starts only load them.

`python -m fmu_src.warm_up` is a part of the installation from a clone. The FMU brings
its own copy of the sources along, so its kernels are compiled for themselves.
"""

from __future__ import annotations

import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from fmpy import simulate_fmu

from fmu_src.hammer.build import build_hammer
from percussion_model.scene.scene import Scene
from percussion_model.simulation.warm_up import (
    COARSE,
    SOLVERS,
    compile_blow_map,
    compile_kernels,
    empty_table,
)

# Long enough for a contact, a change of mode and a reading [s].
SHORT = 1e-3


def compile_fmu(model: str) -> str:
    """Run a moment of an FMU with elastic or rigid bodies."""
    scene = Scene().replace(**{"piston.model": model, "bit.model": model})
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "PercussiveHammer.fmu"
        build_hammer(scene, path)
        simulate_fmu(str(path), stop_time=SHORT, step_size=SHORT)
    return model


def compile_fmu_of_blow_map() -> str:
    """Initialise an FMU on the blow map, which compiles its kernels."""
    scene = Scene().computed_by("blow-map", **COARSE)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "PercussiveHammer.fmu"
        build_hammer(scene, path, empty_table(scene))
        simulate_fmu(str(path), stop_time=1e-9, step_size=1e-9)
    return "blow-map"


def main() -> None:
    """Compile the kernels of all solvers, two at a time, the longest first."""
    with ProcessPoolExecutor(max_workers=2) as pool:
        of_fmu = [pool.submit(compile_fmu, model) for model in ("elastic", "rigid")]
        of_package = [pool.submit(compile_kernels, solver) for solver in SOLVERS]
        of_map = [pool.submit(compile_fmu_of_blow_map), pool.submit(compile_blow_map)]
        for job in [*of_fmu, *of_package, *of_map]:
            job.result()


if __name__ == "__main__":
    main()
