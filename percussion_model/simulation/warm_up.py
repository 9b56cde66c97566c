"""Compilation of all kernels, once, so that later starts only load them.

`python -m percussion_model.simulation.warm_up` is a part of the installation.
"""

from __future__ import annotations

import gc
from concurrent.futures import ProcessPoolExecutor

from percussion_model.scene.scene import Scene
from percussion_model.simulation.orphans import end_with_parent
from percussion_model.simulation.simulate import Simulation

# Long enough for a contact, a change of mode and a reading [s].
SHORT = 1e-4
SOLVERS = ("wave", "modal", "fem", "rigid")


def compile_kernels(solver: str) -> str:
    """Run a moment of the reference scene with one of the solvers."""
    gc.disable()  # it would take a tenth of the time, and find nothing
    model = "rigid" if solver == "rigid" else "elastic"
    changes = {"solver.name": solver, "piston.model": model, "bit.model": model}
    simulation = Simulation(Scene().replace(**changes))
    simulation.advance(SHORT)
    simulation.observe()
    simulation.sample([2.0 * SHORT])
    simulation.energy()
    return solver


def main() -> None:
    """Compile the kernels of all solvers, two at a time."""
    with ProcessPoolExecutor(max_workers=2, initializer=end_with_parent) as pool:
        jobs = [pool.submit(compile_kernels, solver) for solver in SOLVERS]
        for job in jobs:
            job.result()


if __name__ == "__main__":
    main()
