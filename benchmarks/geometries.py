"""Cost of a mode and a step in drawn geometries, by the reference's.

`python -m benchmarks.geometries` prints a table. A step is one that the modal solver counts, a
look or a leap; looks side by side cost little, those near an event much, so that rock, feed and
drive decide. Each geometry is held against the reference, and against the reference's bars under
its own rock, feed and drive. All three take turns, so that a machine that slows down slows all.
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


def costs_in_turn(scenes: list[Scene]) -> tuple[list[list[float]], list[tuple[int, int]]]:
    """Costs of repeated runs of scenes, in turn, and the modes and steps of each."""
    sizes = [cost(scene)[1:] for scene in scenes]
    rounds = [[cost(scene)[0] for scene in scenes] for _ in range(REPEATS)]
    return [list(costs) for costs in zip(*rounds, strict=True)], sizes


def main() -> None:
    """Print a table."""
    bars = Scene()
    times = {"run.duration": DURATION, "run.settle": SETTLE}
    reference = modal(bars.replace(**times))
    ratios, fair = [], []
    for k, drawn_scene in enumerate(drawn()):
        same_rock = drawn_scene.replace(
            **{"piston.sections": bars.piston.sections, "bit.sections": bars.bit.sections}
        )
        costs, sizes = costs_in_turn([reference, modal(same_rock), modal(drawn_scene)])
        usual, beside, here = (statistics.median(one) for one in costs)
        modes, steps = sizes[-1]
        ratios.append(here / usual)
        fair.append(here / beside)
        print(
            f"{k:2d}  {modes:3d} modes {steps:8d} steps {1e9 * here:6.2f} ns; reference "
            f"{1e9 * usual:5.2f} ns: {ratios[-1]:.2f}; its bars on this rock "
            f"{1e9 * beside:5.2f} ns: {fair[-1]:.2f}",
            flush=True,
        )
    for name, found in (("the reference", ratios), ("its bars on the same rock", fair)):
        above = sum(ratio > BOUND for ratio in found)
        print(
            f"by {name}: {min(found):.2f} to {max(found):.2f}, above {BOUND}: "
            f"{above} of {len(found)}"
        )


if __name__ == "__main__":
    main()
