"""What the model says would be measured."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from percussion_model.analysis.fitting.measurements import DropTest, Reading
from percussion_model.physics.records import EventKind
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.parameters import GROUPS
from percussion_model.scene.scene import Scene
from percussion_model.simulation.gauge import gauge_force, gauge_stress
from percussion_model.simulation.simulate import Simulation, simulate
from percussion_model.solvers.base import Solver, make_solver
from percussion_model.solvers.modal.resolution import modes_for
from percussion_model.solvers.wave.resolution import steps_for

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
    # a bit alone has no rate that an accuracy could be of: it takes what this asks for
    scene = scene.replace(**alone, **{"solver.accuracy": None, "run.check": False})
    if scene.solver_name == "modal":
        return scene.replace(**{"solver.cells": modes_for(numbers_of(scene), wanted)})
    if scene.solver_name == "wave":
        return scene.replace(**{"solver.cells": steps_for(wanted, scene.effects.string)})
    return scene


def drop_test_signal(
    scene: Scene,
    times: np.ndarray,
    speed: float,
    signal: str = "bit_position",
    gauge: float | None = None,
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

    Returns
    -------
    ndarray
        SI units.
    """
    return _signal(_falling(scene, speed), times, signal, gauge)


def _signal(
    simulation: Simulation, times: np.ndarray, signal: str, gauge: float | None
) -> np.ndarray:
    if signal == "gauge_force":
        return gauge_force(simulation, times, gauge)
    if signal == "gauge_stress":
        return gauge_stress(simulation, times, gauge)
    return simulation.sample(times)[signal]


class DropOnRocks:
    """What a drop test shows on one rock after the other.

    A solver serves rocks that differ in W_R alone: it comes as a changed input, which acts from
    the first drilling cycle on. Of another rock the maps of standstill have to be made anew;
    drops on it share them.

    Parameters
    ----------
    drop : DropTest
    times : ndarray
        [s].
    """

    def __init__(self, drop: DropTest, times: np.ndarray) -> None:
        self._drop, self._times = drop, times
        self._scene: Scene | None = None
        self._start: tuple[Scene, Solver] | None = None

    def __call__(self, scene: Scene) -> np.ndarray:
        """Compute the signal on the rock of a scene, SI units."""
        scene = bit_alone(scene)
        if self._scene is None or self._start is None or not self._serves(self._scene, scene):
            changes = {"run.duration": float(self._times[-1]), "run.settle": 0.0}
            start = scene.replace(**changes, **{"start.bit_velocity": self._drop.speed})
            self._scene, self._start = scene, (start, make_solver(start))
        first, solver = self._start
        simulation = Simulation(first, False, solver)
        if scene.rock != first.rock:
            simulation.set_inputs(barrier_energy=scene.rock.barrier_energy)
        return _signal(simulation, self._times, self._drop.signal, self._drop.gauge)

    @staticmethod
    def _serves(scene: Scene, other: Scene) -> bool:
        """Whether the solver of one scene serves another."""
        if any(getattr(scene, name) != getattr(other, name) for name in GROUPS if name != "rock"):
            return False
        # for a bit that starts on the rock the first cycle may have begun
        rock = scene.rock
        if scene.start.rock_gap > 0.0:
            rock = replace(rock, barrier_energy=other.rock.barrier_energy)
        return rock == other.rock


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
        value: Any = result.summary()[reading.quantity]
        return math.nan if value is None else float(value)
    if reading.quantity == "penetration":
        ended = _falling(scene, reading.speed).sample(np.array([scene.run.duration]))
        return float(ended["bit_end_position"][0]) - scene.start.rock_gap
    return _rebound_velocity(scene, reading.speed)


def run_error(scene: Scene, reading: Reading) -> float:
    """Estimated error of a number of the hammer, by cells and scatter of the blows; NaN: unknown.

    Parameters and unit as of `predicted_reading`.
    """
    summary = simulate(scene, record_events=False).summary()
    known = summary["errors"] | {"rate_of_penetration": summary["rate_of_penetration_error"]}
    value = known.get(reading.quantity)
    return math.nan if value is None else float(value)


def _rebound_velocity(scene: Scene, speed: float) -> float:
    """Greatest upward mean velocity of the bit, which it has when it leaves the rock [m/s]."""
    end = scene.start.rock_gap / speed + HALF_PERIODS * _half_period(scene, speed)
    first = _falling(scene, speed, record_events=True)
    first.advance(end)
    events = first.events
    leaves = events["time"][events["kind"] == EventKind.MODE_FF]
    times = np.append(leaves, end)
    return float(-_falling(scene, speed).sample(times)["bit_velocity"].min())


def _half_period(scene: Scene, speed: float) -> float:
    """Time of loading and of unloading at most, of a rigid bit without feed [s].

    pi/2 each by the greatest penetration over the speed where the force is in proportion to
    penetration; by the power law less.
    """
    rock, stiffness = scene.rock, scene.loading_stiffness
    if scene.effects.rock != "power":
        return math.pi * math.sqrt(scene.bit.mass / stiffness)
    n, place = rock.loading_exponent, rock.reference_penetration
    share = 0.5 * (n + 1.0) * scene.bit.mass * speed**2 / (stiffness * place**2)
    most = place * share ** (1.0 / (n + 1.0)) + rock.chipping_penetration
    return math.pi * most / speed


def _falling(scene: Scene, speed: float, record_events: bool = False) -> Simulation:
    return Simulation(scene.replace(**{"start.bit_velocity": speed}), record_events)
