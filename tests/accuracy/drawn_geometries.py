"""Twelve geometries drawn by a seed, and their rates by refined explicit elements.

`python -m tests.accuracy.drawn_geometries` computes the rates anew and stores all of them, or,
if it is stopped before, none.
"""

from __future__ import annotations

import json
import math
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from percussion_model import Scene, Simulation
from percussion_model.scene.numbers import numbers_of
from percussion_model.simulation.files import staged_file
from percussion_model.solvers.base import Solver
from percussion_model.solvers.modal.resolution import in_first_bar
from percussion_model.verification.accuracy.explicit import ExplicitSolver

STORE = Path(__file__).with_name("drawn_geometries.json")
SEED, COUNT = 18, 12
# Young's modulus [Pa] and density [kg/m^3] of the one section that is not of steel.
MATERIALS = {
    "aluminium": (70e9, 2700.0),
    "titanium": (114e9, 4430.0),
    "tungsten carbide": (600e9, 14900.0),
}
# A section is no shorter than this share of an equal part of its bar.
LEAST_SHARE = 0.3
DURATION, SETTLE = 2.0, 1.0
# Modes in the bar with the shorter transit time.
MODES = 30


class Plan(NamedTuple):
    """Runs of explicit elements that a truth rests on.

    Attributes
    ----------
    meshes : tuple of (int, float)
        Elements in the piston and share of the stable step, the finest last.
    duration : float
        Simulated time [s]; long where no blow is like the one before.
    """

    meshes: tuple[tuple[int, float], ...]
    duration: float = DURATION


USUAL = ((100, 0.6), (200, 0.6), (400, 0.9))
# In 0, 3, 4 and 7 no blow is like the one before; 9 and 10 converge slowly.
PLANS = {
    0: Plan(((100, 0.6), (150, 0.6)), 60.0),
    3: Plan(((100, 0.6), (150, 0.6)), 60.0),
    4: Plan(((100, 0.6), (150, 0.6)), 60.0),
    7: Plan(((80, 0.6), (120, 0.6)), 150.0),
    9: Plan((*USUAL, (600, 0.9), (800, 0.9))),
    10: Plan((*USUAL, (600, 0.9))),
}


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def bar(rng: np.random.Generator, length: float) -> list[dict[str, float]]:
    """Draw a bar of one to three sections."""
    count = int(rng.integers(1, 4))
    shares = rng.uniform(LEAST_SHARE, 1.0, count)
    areas = [between(rng, 2e-3, 8e-3) for _ in range(count)]
    lengths = (length * shares / shares.sum()).tolist()
    return [{"length": one, "area": area} for one, area in zip(lengths, areas, strict=True)]


def draw(rng: np.random.Generator) -> dict[str, Any]:
    """Draw a scene, by dotted key; the drive's power is that of the reference."""
    length = float(rng.uniform(0.15, 0.35))
    bars = bar(rng, length), bar(rng, length * between(rng, 0.7, 2.5))
    sections = [section for one in bars for section in one]
    other = sections[int(rng.integers(len(sections)))]
    stiffness, density = list(MATERIALS.values())[int(rng.integers(len(MATERIALS)))]
    other |= {"youngs_modulus": stiffness, "density": density}
    reversal = between(rng, 4e-3, 0.1)
    return {
        "piston.sections": bars[0],
        "bit.sections": bars[1],
        "rock.loading_stiffness": between(rng, 1e8, 3e9),
        "rock.unloading_ratio": between(rng, 2.0, 40.0),
        "feed.force": between(rng, 500.0, 3e4),
        "drive.reversal_distance": reversal,
        "drive.force": 3000.0 * (0.04 / reversal) ** (1.0 / 3.0),
    }


def drawn() -> list[Scene]:
    """Scenes of all that are drawn."""
    rng = np.random.default_rng(SEED)
    times = {"run.duration": DURATION, "run.settle": SETTLE}
    return [Scene().replace(**draw(rng), **times) for _ in range(COUNT)]


def plan_of(k: int) -> Plan:
    """Runs that tell the truth on a geometry."""
    return PLANS.get(k, Plan(USUAL))


def modal(scene: Scene, modes: int = MODES) -> Scene:
    """The scene by so many modes in the shorter bar."""
    count = in_first_bar(numbers_of(scene), modes)
    return scene.computed_by("modal", **{"solver.cells": count})


def run(scene: Scene, duration: float, solver: Solver | None = None) -> dict[str, Any]:
    """Rate of penetration and its standard error [m/s], blows, and drilling cycles of a blow."""
    simulation = Simulation(scene, record_events=False, solver=solver)
    simulation.advance(duration)
    result = simulation.result(SETTLE)
    return {
        "rate": result.rate_of_penetration,
        "standard_error": result.rate_of_penetration_standard_error,
        "blows": len(result.counted),
        "cycles": float(np.mean(result.counted["drilling_cycles"])),
    }


def refined(k: int, scene: Scene) -> list[dict[str, Any]]:
    """Runs of explicit elements, coarse to fine."""
    plan, runs = plan_of(k), []
    for elements, share in plan.meshes:
        began = time.perf_counter()
        solver = ExplicitSolver(scene, elements, share)
        made = {"piston": solver.cells["piston"], "bit": solver.cells["bit"], "share": share}
        runs.append({**made, "duration": plan.duration, **run(scene, plan.duration, solver)})
        spent = time.perf_counter() - began
        print(f"{k} {elements} {1e3 * runs[-1]['rate']:.6f} mm/s {spent:.0f} s", flush=True)
    return runs


def numbers(scene: Scene) -> dict[str, Any]:
    """What was drawn of a scene, as plain values."""
    given = scene.given_values()
    return {group: given[group] for group in ("piston", "bit", "rock", "feed", "drive")}


def main() -> None:
    """Compute all truths, then store them."""
    found = [
        {"drawn": numbers(scene), "runs": refined(k, scene)} for k, scene in enumerate(drawn())
    ]
    made = {"date": time.strftime("%Y-%m-%d"), "settle": SETTLE}
    made |= {name: version(name) for name in ("percussion_model", "numpy", "numba")}
    tree = {"seed": SEED, "made": made, "geometries": found}
    staged_file(STORE, json.dumps(tree, indent=1) + "\n")


if __name__ == "__main__":
    main()
