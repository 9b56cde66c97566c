"""Force and motion at the end of a bar, made out from two gauges."""

import numpy as np
import pytest

from percussion_model import SceneError, Simulation
from percussion_model.analysis.two_gauges import at_end
from percussion_model.scene.hammers import bar_test
from percussion_model.simulation.gauge import gauge_force

STEP = 2e-7


def test_waves_that_overlap_are_told_apart():
    """A wave down and another up, both known: any force at the end comes out right."""
    time, z, apart, below = np.arange(0.0, 8e-4, STEP), 4.0e4, 7e-5, 5e-5

    def incident(t):
        return np.where(t > 0.0, np.sin(2e4 * t) ** 2, 0.0)

    def reflected(t):
        return np.where(t > 0.0, 0.5 * np.sin(1.3e4 * t) ** 2, 0.0)

    arrival = apart + below
    upper = z * (incident(time) - reflected(time - 2.0 * arrival))
    lower = z * (incident(time - apart) - reflected(time - arrival - below))
    found = at_end(time, upper, lower, z, apart, below)
    d, u = incident(found.time - arrival), reflected(found.time - arrival)
    assert found.force == pytest.approx(z * (d - u), abs=1e-4 * z)
    assert found.velocity == pytest.approx(d + u, abs=1e-4)
    assert found.incident == pytest.approx(z * STEP * np.sum(d**2), rel=1e-3)
    assert found.reflected == pytest.approx(z * STEP * np.sum(u**2), rel=1e-3)


def test_the_rock_of_a_bar_test_is_found_from_two_gauges():
    scene = bar_test().replace(
        **{"solver.name": "wave", "solver.cells": 80, "loss.time": 1e-8, "effects.loss": True}
    )
    times = np.arange(0.0, 6e-4, STEP)
    places, (bar,) = (0.4, 0.8), scene.bit.sections
    upper, lower = (gauge_force(Simulation(scene), times, place) for place in places)
    apart, below = np.diff([*places, bar.length]) / bar.wave_speed
    found = at_end(times, upper, lower, bar.impedance, apart, below)
    true = Simulation(scene).sample(found.time)
    # its fronts are sharp: a cell early or late they would differ by all of their height
    off = np.sqrt(np.mean((found.force - true["bit_force"]) ** 2))
    assert off < 0.15 * np.sqrt(np.mean(true["bit_force"] ** 2))
    depth = true["bit_end_position"]
    assert np.max(np.abs(found.displacement - depth)) < 0.01 * depth.max()
    impulse = np.cumsum(found.force) * STEP
    assert np.max(np.abs(impulse - true["bit_impulse"])) < 0.01 * true["bit_impulse"].max()
    assert 0.0 < found.reflected < found.incident


def test_gauges_between_two_samples_are_refused():
    times = np.arange(0.0, 1e-4, STEP)
    with pytest.raises(SceneError, match="between two samples"):
        at_end(times, times, times, 1.0, 0.5 * STEP, STEP)
