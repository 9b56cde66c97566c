"""Error against core-seconds of what scenes are computed for: a coupled run, and a map.

`python -m docs.make accuracy coupled map` computes both. Waves and explicit elements go through the
same loops; truth is where both lead when refined, its bar half of what is left between them.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from percussion_model import Scene, SceneError, Simulation
from percussion_model.solvers.base import Solver, make_solver
from percussion_model.solvers.wave.resolution import STEPS_OF_TWO
from percussion_model.verification.accuracy.explicit import ExplicitSolver
from percussion_model.verification.accuracy.problems import PERIODIC, RATE, Run, pose

# Powers of two add up without rounding [s].
DURATION, STEPS = 0.5, tuple(2.0**-k for k in (13, 11, 9, 7))
FINEST = 2.0**-14
# Drill string: stiffness [N/m], speed of its upper end [m/s], load at the start [N].
STIFFNESS, LOWERING, LOAD = 2e5, 0.0165, 2500.0
FEEDS = np.geomspace(1e3, 10e3, 6)  # [N]
ROCKS = np.geomspace(1e8, 2e9, 6)  # [N/m]
# Points whose references differ by more are left out; errors above this are counted.
MOST_APART, GROSS = 3e-3, 1e-2

Way = Callable[[Scene], Solver]


def waves(steps: int) -> Way:
    """Waves that cross the piston in so many steps."""
    return lambda scene: make_solver(scene.computed_by("wave", **{"solver.cells": steps}))


def explicit(elements: int) -> Way:
    """Explicit elements, so many in the piston."""
    return partial(ExplicitSolver, elements=elements)


METHODS: dict[str, Way] = {
    f"wave, {STEPS_OF_TWO} steps": waves(STEPS_OF_TWO),
    "wave, 40 steps": waves(40),
    "explicit, 20 elements": explicit(20),
    "explicit, 40 elements": explicit(40),
}
REFINED = (waves(60), explicit(80))


def hang(way: Way, step: float) -> tuple[float, float]:
    """Run the reference hammer on a drill string that is lowered.

    Parameters
    ----------
    way : Way
        What computes the hammer.
    step : float
        Between two looks at the bit, from which the feed follows [s].

    Returns
    -------
    advance : float
        Of the bit [m].
    second : float
        Processor time of a simulated second [s].
    """
    simulation = Simulation(Scene(), record_events=False, solver=way(Scene()))
    simulation.observe()
    began = time.process_time()
    for k in range(round(DURATION / step)):
        stretch = LOWERING * k * step - simulation.observe()["bit_position"]
        simulation.set_inputs(feed_force=max(0.0, LOAD + STIFFNESS * stretch))
        simulation.advance((k + 1) * step)
    cost = time.process_time() - began
    return simulation.observe()["bit_position"], cost / DURATION


def coupled(say: Callable[[str], None]) -> dict[str, Any]:
    """Coupled runs: error of the advance and time, by method and communication step."""
    say("coupled runs: reference")
    limits = [hang(way, FINEST)[0] for way in REFINED]
    truth = statistics.fmean(limits)
    rows = []
    for step in STEPS:
        for name, way in METHODS.items():
            say(f"coupled run: {name}, {step:.2g} s")
            advance, second = hang(way, step)
            error = abs(advance / truth - 1.0)
            rows.append({"method": name, "step": step, "error": error, "second": second})
    bar = 0.5 * abs(limits[0] - limits[1]) / abs(truth)
    return {"duration": DURATION, "finest": FINEST, "bar": bar, "rows": rows}


def points_map(say: Callable[[str], None]) -> dict[str, Any]:
    """Map over feed and rock: errors of the rate and core-seconds, by method."""
    errors: dict[str, list[float]] = {name: [] for name in METHODS}
    costs = dict.fromkeys(METHODS, 0.0)
    bars = []
    for feed in FEEDS:
        say(f"map: feed {feed:.0f} N")
        for rock in ROCKS:
            scene = Scene().replace(
                **{"feed.force": float(feed), "rock.loading_stiffness": float(rock)}
            )
            found = point(scene)
            if found is None:
                continue
            bar, here = found
            bars.append(bar)
            for name, (error, cost) in here.items():
                errors[name].append(error)
                costs[name] += cost
    rows = [
        {
            "method": name,
            "core_seconds": costs[name],
            "median": statistics.median(found),
            "greatest": max(found),
            "above": sum(error > GROSS for error in found),
            "points": len(found),
        }
        for name, found in errors.items()
    ]
    count = len(FEEDS) * len(ROCKS)
    return {
        "points": count,
        "left_out": count - len(bars),
        "most_apart": MOST_APART,
        "bar": statistics.median(bars),
        "rows": rows,
    }


def point(scene: Scene) -> tuple[float, dict[str, tuple[float, float]]] | None:
    """Bar of the reference, and error and cost of each method; None where there is no reference."""
    try:
        problem = pose(scene)
    except SceneError:
        return None
    if problem.kind != PERIODIC:
        return None

    def rate(way: Way) -> tuple[float, Run]:
        run = Run(problem, problem.scene, way)
        return run.answer().values[RATE], run

    limits = [rate(way)[0] for way in REFINED]
    truth = statistics.fmean(limits)
    bar = 0.5 * abs(limits[0] - limits[1]) / abs(truth)
    if not math.isfinite(bar) or bar > 0.5 * MOST_APART:
        return None
    here = {}
    for name, way in METHODS.items():
        value, run = rate(way)
        here[name] = abs(value / truth - 1.0), run.setup_time + run.cost()
    return bar, here
