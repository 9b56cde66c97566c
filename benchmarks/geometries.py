"""Cost of a mode and a step in drawn geometries, by the reference's.

`python -m benchmarks.geometries` prints a table. A step is one that the modal solver counts, a
look or a leap. The reference takes its turn before every run of a geometry, so that a machine
that slows down slows both.
"""

from __future__ import annotations

import statistics
import time

from percussion_model import Scene, Simulation
from tests.accuracy.drawn_geometries import DURATION, SETTLE, drawn, modal

REPEATS = 9
# Cost of a mode and a step by that of the reference.
BOUND = 1.5


def cost(scene: Scene) -> tuple[float, int, int]:
    """Run a scene.

    Returns
    -------
    cost : float
        Processor time of a mode and a step [s].
    modes, steps : int
    """
    simulation = Simulation(scene, record_events=False)
    began = time.process_time()
    simulation.advance(DURATION)
    spent = time.process_time() - began
    counts = simulation.statistics()
    modes, steps = sum(simulation.solver.cells.values()), counts["steps"] + counts["leaps"]
    return spent / (modes * steps), modes, steps


def compare(reference: Scene, scene: Scene) -> tuple[list[float], list[float], int, int]:
    """Costs of repeated runs of the reference and of a scene, in turn, and its modes and steps."""
    cost(reference)
    _, modes, steps = cost(scene)
    pairs = [(cost(reference)[0], cost(scene)[0]) for _ in range(REPEATS)]
    return [one for one, _ in pairs], [one for _, one in pairs], modes, steps


def main() -> None:
    """Print a table."""
    times = {"run.duration": DURATION, "run.settle": SETTLE}
    reference = modal(Scene().replace(**times))
    ratios, usual = [], []
    for k, scene in enumerate(drawn()):
        before, here, modes, steps = compare(reference, modal(scene))
        usual += before
        ratios.append(statistics.median(here) / statistics.median(before))
        print(
            f"{k:2d}  {modes:3d} modes {steps:8d} steps "
            f"{1e9 * statistics.median(here):6.2f} ns, reference "
            f"{1e9 * statistics.median(before):6.2f} ns: {ratios[-1]:.2f}",
            flush=True,
        )
    _, modes, steps = cost(reference)
    print(
        f"reference {modes} modes {steps} steps {1e9 * statistics.median(usual):.2f} ns, "
        f"{1e9 * min(usual):.2f} to {1e9 * max(usual):.2f}"
    )
    above = sum(ratio > BOUND for ratio in ratios)
    print(f"ratios {min(ratios):.2f} to {max(ratios):.2f}, above {BOUND}: {above} of {len(ratios)}")


if __name__ == "__main__":
    main()
