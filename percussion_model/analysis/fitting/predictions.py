"""What the model says would be measured."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from percussion_model.analysis.fitting.measurements import DropTest, Reading
from percussion_model.physics.records import EventKind
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene
from percussion_model.simulation.gauge import gauge_force, gauge_stress
from percussion_model.simulation.simulate import Simulation, simulate
from percussion_model.solvers.wave.resolution import cells_for

# The bit has left the rock for the first time after that many half-periods on its spring.
HALF_PERIODS = 3.0


def bit_alone(scene: Scene) -> Scene:
    """Return the scene of a drop test with the bit and the rock of a scene."""
    if scene.piston.model == "absent":
        return scene
    wanted = scene.solver.accuracy
    alone = {"piston.model": "absent", "effects.drive": "none"}
    if wanted is None:
        return scene.replace(**alone)
    # a bit alone has no rate that an accuracy could be of: it takes the cells that this asks for
    scene = scene.replace(**alone, **{"solver.accuracy": None, "run.check": False})
    if scene.solver_name != "wave":
        return scene
    return scene.replace(**{"solver.cells": cells_for(numbers_of(scene), wanted)[0]})


def drop_test_signal(
    scene: Scene,
    times: np.ndarray,
    speed: float,
    signal: str = "bit_position",
    gauge: float | None = None,
    leaps: bool = True,
) -> np.ndarray:
    """Compute what would be measured in a drop test.

    Parameters
    ----------
    scene : Scene
        Of a bit alone.
    times : ndarray
        [s].
    speed : float
        Of the bit at the start [m/s].
    signal : str
        One of `SIGNALS`.
    gauge : float, optional
        Distance of the gauge from the top of the bit [m]; default its middle.
    leaps : bool
        False: without them, even where the scene has them.

    Returns
    -------
    ndarray
        SI units.
    """
    simulation = _falling(scene, speed, **({} if leaps else {"solver.leaps": False}))
    if signal == "gauge_force":
        return gauge_force(simulation, times, gauge)
    if signal == "gauge_stress":
        return gauge_stress(simulation, times, gauge)
    return simulation.sample(times)[signal]


def predicted_drop(
    scene: Scene, drop: DropTest, times: np.ndarray, leaps: bool = True
) -> np.ndarray:
    """What a drop would show at given times; see `drop_test_signal`."""
    return drop_test_signal(scene, times, drop.speed, drop.signal, drop.gauge, leaps)


def predicted_reading(scene: Scene, reading: Reading) -> float:
    """What a single measured number would be.

    Parameters
    ----------
    scene : Scene
        Of the hammer for the penetration per blow, else of a bit alone.
    reading : Reading

    Returns
    -------
    float
        SI units; NaN where the hammer makes no whole blow.
    """
    if reading.speed is None:
        result = simulate(scene, record_events=False, error_estimate=False)
        value: Any = result.summary()["penetration_per_blow"]
        return math.nan if value is None else float(value)
    if reading.quantity == "penetration":
        ended = _falling(scene, reading.speed).sample(np.array([scene.run.duration]))
        return float(ended["bit_end_position"][0]) - scene.start.rock_gap
    return _rebound_velocity(scene, reading.speed)


def _rebound_velocity(scene: Scene, speed: float) -> float:
    """Greatest upward mean velocity of the bit, which it has when it leaves the rock [m/s]."""
    half_period = math.pi * math.sqrt(scene.bit.mass / scene.rock.loading_stiffness)
    end = scene.start.rock_gap / speed + HALF_PERIODS * half_period
    first = _falling(scene, speed, record_events=True)
    first.advance(end)
    events = first.events
    leaves = events["time"][events["kind"] == EventKind.MODE_FF]
    times = np.append(leaves, end)
    return float(-_falling(scene, speed).sample(times)["bit_velocity"].min())


def _falling(scene: Scene, speed: float, record_events: bool = False, **changes: Any) -> Simulation:
    return Simulation(scene.replace(**{"start.bit_velocity": speed}, **changes), record_events)
