"""Top hammers: speed, cost of long rods, and waves against elements.

`python -m benchmarks.top_hammer` tells how many times faster than real time the presets of four
rods run, and what thirty metres of rods cost beside three. With `--elements SECONDS` the rates of
two presets are compared with those of explicit elements over so long. The kernels should be
compiled before (`python3 build.py setup`). Take figures for the record on an idle machine.
"""

from __future__ import annotations

import argparse
import statistics
import time

from percussion_model import Scene, Simulation
from percussion_model.scene.hammers import hammer
from percussion_model.simulation.rate import rate_of_blows

# Runs of each, in turn, and how long each is [s].
REPETITIONS, SIMULATED = 7, 4.0
TOP_HAMMERS = ("t38", "t45", "hc25")
# Time that does not count for a rate [s], and elements in the piston.
SETTLE, ELEMENTS = 1.0, 40


def cost(scene: Scene, simulated: float = SIMULATED) -> float:
    """Processor time of a simulated second [s]."""
    run = Simulation(scene, record_events=False)
    began = time.process_time()
    run.advance(simulated)
    return (time.process_time() - began) / simulated


def costs(scenes: dict[str, Scene]) -> dict[str, list[float]]:
    """Costs of repeated runs, in turn."""
    for scene in scenes.values():
        cost(scene, 0.05)
    rounds = [{name: cost(scene) for name, scene in scenes.items()} for _ in range(REPETITIONS)]
    return {name: [one[name] for one in rounds] for name in scenes}


def speeds() -> None:
    """How many times faster than real time the presets run."""
    for name, times in costs({name: hammer(name, 4) for name in TOP_HAMMERS}).items():
        ratios = sorted(1.0 / one for one in times)
        print(f"{name}, four rods: {statistics.median(ratios):.1f} times real time "
              f"({ratios[0]:.1f} to {ratios[-1]:.1f})")  # fmt: skip


def long_rods() -> None:
    """What thirty metres of rod cost beside three, and ten joined rods of three metres."""
    tree = hammer("t38", 1).given_values()
    body = {"area": 1029e-6, "youngs_modulus": 206e9}
    shank, rod = tree["string"]["rods"]

    def scene(*lengths: float) -> Scene:
        rods = [shank, *({**rod, "sections": [{**body, "length": one}]} for one in lengths)]
        effects = tree["effects"] | {"damper": False}
        changes = {"solver": {"cells": 20}, "string": {"rods": rods}, "effects": effects}
        return Scene(**tree | changes)

    scenes = {
        "3 m": scene(3.0), "30 m in one": scene(30.0), "30 m in ten": scene(*[3.0] * 10),
    }  # fmt: skip
    medians = {name: statistics.median(times) for name, times in costs(scenes).items()}
    for name, median in medians.items():
        print(f"{name}: {1e3 * median:.1f} ms a simulated second, "
              f"{median / medians['3 m']:.2f} times that of 3 m")  # fmt: skip


def against_elements(simulated: float) -> None:
    """Rates of two presets by waves and by explicit elements."""
    from percussion_model.verification.accuracy.explicit import ExplicitSolver

    for name in ("t38", "t45"):
        scene, found = hammer(name, 4), {}
        for kind, solver in (
            ("waves", None), ("elements", ExplicitSolver(scene, ELEMENTS)),
        ):  # fmt: skip
            run = Simulation(scene, record_events=False, solver=solver)
            run.advance(simulated)
            blows = run.blows[run.blows["time"] > SETTLE]
            found[kind] = rate, error = rate_of_blows(blows)
            print(f"{name}, {kind}: {1e3 * rate:.3f} +- {1e3 * error:.3f} mm/s, "
                  f"{len(blows)} blows", flush=True)  # fmt: skip
        (one, e1), (other, e2) = found["waves"], found["elements"]
        print(f"{name}: waves are off by {100.0 * (one / other - 1.0):+.2f} % "
              f"+- {100.0 * (e1**2 + e2**2) ** 0.5 / other:.2f} %")  # fmt: skip


def main() -> None:
    """Measure and tell."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--elements", type=float, default=0.0, metavar="SECONDS")
    chosen = parser.parse_args()
    speeds()
    long_rods()
    if chosen.elements > 0.0:
        against_elements(chosen.elements)


if __name__ == "__main__":
    main()
