"""Compilation of all kernels, those of the FMU too, so that later starts only load them.

`python -m fmu_src.warm_up` is a part of the installation from a clone. The FMU brings
its own copy of the sources along, so its kernels are compiled for themselves.
"""

from __future__ import annotations

import tempfile
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

from fmu_src.hammer.build import build_hammer
from fmu_src.run import run_fmu
from percussion_model.scene.scene import Scene
from percussion_model.simulation.warm_up import (
    COARSE,
    SOLVERS,
    compile_blow_map,
    compile_kernels,
    empty_table,
)
from percussion_model.solvers.blow_map.table import BlowTable

# Long enough for a contact, a change of mode and a reading [s].
SHORT = 1e-3


def compile_fmu(model: str) -> None:
    """Run a moment of an FMU with elastic or rigid bodies."""
    _run_fmu(Scene().replace(**{"piston.model": model, "bit.model": model}), None, SHORT)


def compile_fmu_of_blow_map() -> None:
    """Initialise an FMU on the blow map, which compiles its kernels."""
    scene = Scene().computed_by("blow-map", **COARSE)
    _run_fmu(scene, empty_table(scene), 1e-9)


def _run_fmu(scene: Scene, blow_map: BlowTable | None, duration: float) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "PercussiveHammer.fmu"
        build_hammer(scene, path, blow_map)
        run_fmu(path, stop_time=duration, step_size=duration)


def main() -> None:
    """Compile the kernels of all solvers, two at a time, the longest first."""
    with ProcessPoolExecutor(max_workers=2) as pool:
        jobs: list[Future[Any]] = [pool.submit(compile_fmu, m) for m in ("elastic", "rigid")]
        jobs += [pool.submit(compile_kernels, solver) for solver in SOLVERS]
        jobs += [pool.submit(compile_fmu_of_blow_map), pool.submit(compile_blow_map)]
        for job in jobs:
            job.result()


if __name__ == "__main__":
    main()
