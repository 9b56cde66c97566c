"""Cost of hammers, in turn, so that a machine that slows down slows all: `-m benchmarks.hammers`.

How many times faster than real time the top hammers of four rods run, what thirty metres of rods
cost beside three, and what a blow on chambers costs beside one by a pressure law. Kernels should be
compiled before (`python3 build.py setup`). Take figures for the record on an idle machine.
"""

from __future__ import annotations

import itertools
import math
import statistics
import time
from typing import NamedTuple

import numpy as np

from percussion_model import Scene, Simulation
from percussion_model.scene.hammers import hammer, with_chambers

TOP_HAMMERS, RODS = ("t38", "t45", "hc25"), 4
ON_AIR = {"dth4": 24e5, "dth5": 24e5, "dth6": 24e5}  # supply [Pa]
ROUNDS, SIMULATED = 7, 4.0  # of each scene, and how long one is [s]
FORCES, DISTANCES = np.linspace(6e3, 14e3, 17), np.linspace(0.03, 0.1, 15)


class Cost(NamedTuple):
    """Processor times: of a simulated second in each round [s], and the least of a blow [s]."""

    seconds: list[float]
    blow: float


def costs(scenes: dict[str, Scene]) -> dict[str, Cost]:
    """Costs of repeated runs, in turn."""

    def run(scene: Scene, simulated: float = SIMULATED) -> tuple[float, int]:
        simulation = Simulation(scene, record_events=False)
        began = time.process_time()
        simulation.advance(simulated)
        return time.process_time() - began, len(simulation.blows)

    for scene in scenes.values():
        run(scene, 0.05)
    rounds = [{name: run(scene) for name, scene in scenes.items()} for _ in range(ROUNDS)]
    found = {}
    for name in scenes:
        times, blows = zip(*(one[name] for one in rounds), strict=True)
        found[name] = Cost([one / SIMULATED for one in times], min(times) / blows[0])
    return found


def speeds() -> None:
    """How many times faster than real time the top hammers run."""
    for name, one in costs({name: hammer(name, RODS) for name in TOP_HAMMERS}).items():
        ratios = sorted(1.0 / second for second in one.seconds)
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
    medians = {name: statistics.median(one.seconds) for name, one in costs(scenes).items()}
    for name, median in medians.items():
        print(f"{name}: {1e3 * median:.1f} ms a simulated second, "
              f"{median / medians['3 m']:.2f} times that of 3 m")  # fmt: skip


def same_blow(scene: Scene, like: Scene) -> Scene:
    """Scene with the pressure law whose blows come nearest to those of another."""

    def blow(scene: Scene) -> tuple[float, float]:
        simulation = Simulation(scene)
        simulation.advance(1.0)
        blows = simulation.blows[8:]
        return float(blows["impact_velocity"].mean()), float(blows["period"].mean())

    def law(force: float, distance: float) -> Scene:
        return scene.replace(**{"drive.force": force, "drive.reversal_distance": distance})

    velocity, period = blow(like)

    def far(one: Scene) -> float:
        found = blow(one)
        return math.hypot(found[0] / velocity - 1.0, found[1] / period - 1.0)

    return min(itertools.starmap(law, itertools.product(FORCES, DISTANCES)), key=far)


def chambers() -> None:
    """What a blow on air costs beside one by a law, of hammers that of `percussion drive-map`."""
    reference = Scene()
    air = reference.replace(**{"effects.drive": "pneumatic"})
    pairs = {
        "reference": (air, reference),
        "reference, same blow": (air, same_blow(reference, air)),
    }
    for name, pressure in ON_AIR.items():
        one = with_chambers(name, pressure)
        pairs[name] = one, one.replace(**{"effects.drive": "pressure"})
    for name, pair in pairs.items():
        on_air, by_law = (one.blow for one in costs(dict(zip("ab", pair, strict=True))).values())
        print(f"{name}: {1e6 * on_air:.0f} us a blow on air, {1e6 * by_law:.0f} by a law: "
              f"{on_air / by_law:.2f}")  # fmt: skip


if __name__ == "__main__":
    speeds()
    long_rods()
    chambers()
