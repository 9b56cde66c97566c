"""Cost of a blow with chambers beside one without: `python -m benchmarks.chambers`.

On the reference the chambers are the preset ones; "same blow" is its pressure law with force and
distance so that piston and period are those with chambers. The hammers' laws are those that
`percussion drive-map` made. All are timed in turn, in one process.
"""

from __future__ import annotations

import itertools
import math
import time
from pathlib import Path

import numpy as np

from percussion_model import Scene, Simulation
from percussion_model.scene.hammers import with_chambers

REFERENCE = Path(__file__).resolve().parent.parent / "scenarios" / "reference.toml"
HAMMERS = {"dth4": 24e5, "dth5": 24e5, "dth6": 24e5}
ROUNDS, PIECE = 100, 0.5  # s of drilling at a time
FORCES, DISTANCES = np.linspace(6e3, 14e3, 17), np.linspace(0.03, 0.1, 15)


def blow(scene: Scene) -> tuple[float, float]:
    """Mean velocity of impact [m/s] and period [s] of a second of drilling."""
    simulation = Simulation(scene)
    simulation.advance(1.0)
    blows = simulation.blows[8:]
    return float(blows["impact_velocity"].mean()), float(blows["period"].mean())


def same_blow(scene: Scene, like: Scene) -> Scene:
    """Scene with the pressure law whose blows come nearest to those of another."""
    velocity, period = blow(like)

    def law(force: float, distance: float) -> Scene:
        return scene.replace(**{"drive.force": force, "drive.reversal_distance": distance})

    def far(one: Scene) -> float:
        found = blow(one)
        return math.hypot(found[0] / velocity - 1.0, found[1] / period - 1.0)

    return min(itertools.starmap(law, itertools.product(FORCES, DISTANCES)), key=far)


def scenes() -> dict[str, dict[str, Scene]]:
    """Scenes with chambers and without, by name."""
    reference = Scene.from_toml(REFERENCE)
    air = reference.replace(**{"effects.drive": "pneumatic"})
    pairs = {
        "reference": {"chambers": air, "own law": reference},
        "reference, same blow": {"chambers": air, "law": same_blow(reference, air)},
    }
    for name, pressure in HAMMERS.items():
        one = with_chambers(name, pressure)
        pairs[name] = {"chambers": one, "law": one.replace(**{"effects.drive": "pressure"})}
    return pairs


def cost(pair: dict[str, Scene]) -> list[float]:
    """Cost of a blow of each [us], that of the fastest twentieth of the pieces."""
    simulations = [Simulation(scene) for scene in pair.values()]
    spent: list[list[float]] = [[] for _ in simulations]
    for k in range(ROUNDS + 2):
        for simulation, times in zip(simulations, spent, strict=True):
            began = time.perf_counter()
            simulation.advance((k + 1) * PIECE)
            times.append(time.perf_counter() - began)
    rows = [len(simulation.blows) / (ROUNDS + 2) for simulation in simulations]
    return [1e6 * float(np.quantile(t[2:], 0.05)) / n for t, n in zip(spent, rows, strict=True)]


def main() -> None:
    for name, pair in scenes().items():
        chambers, law = cost(pair)
        print(f"{name:24s} {chambers:6.0f} us a blow, {law:6.0f} without: {chambers / law:.2f}")


if __name__ == "__main__":
    main()
