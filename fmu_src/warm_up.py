"""Compile the kernels of the FMU once, so that later instances only load them.

`python -m fmu_src.warm_up` is a part of the installation, beside that of the package:
the FMU brings its own copy of the sources along.
"""

from __future__ import annotations

import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from fmpy import simulate_fmu

from fmu_src.hammer import build_hammer
from percussion_model.scene import Scene

# Long enough for a contact, a change of mode and a reading [s].
SHORT = 1e-3


def compile_kernels(model: str) -> str:
    """Run a moment of an FMU with elastic or rigid bodies."""
    scene = Scene().replace(**{"piston.model": model, "bit.model": model})
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "PercussiveHammer.fmu"
        build_hammer(scene, path)
        simulate_fmu(str(path), stop_time=SHORT, step_size=SHORT)
    return model


def main() -> None:
    """Compile the kernels of all solvers, two at a time."""
    with ProcessPoolExecutor(max_workers=2) as pool:
        list(pool.map(compile_kernels, ("elastic", "rigid")))


if __name__ == "__main__":
    main()
