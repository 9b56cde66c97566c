"""Mean motion of bars by waves: where they stand still, and in flight, with structural loss."""

import numpy as np
import pytest

from percussion_model import Scene, Simulation

ALONE = {"piston.model": "absent", "effects.drive": "none"}


def sampled(times, **changes):
    scene = Scene().replace(**ALONE, **changes).computed_by("wave")
    return scene, Simulation(scene, record_events=False).sample(times)


@pytest.mark.parametrize("cells", [9, 24])
def test_a_bit_at_rest_does_not_creep(cells):
    at_rest = {"start.bit_velocity": 0.0, "start.rock_gap": 0.0, "solver.cells": cells}
    scene, seen = sampled(np.array([0.3, 0.6, 0.9]), **at_rest)
    force = scene.feed.force + scene.bit.mass * scene.gravity.acceleration
    assert seen["bit_force"] == pytest.approx(force, rel=1e-12)
    depth = seen["bit_end_position"][0]
    assert np.ptp(seen["bit_end_position"]) < 1e-12 * depth
    # mean of 7e-7 m, each of some 4e5 steps with its rounding
    assert np.ptp(seen["bit_position"]) < 1e-9 * depth
    assert abs(seen["bit_velocity"]).max() < 1e-11


def test_the_mean_follows_the_ends_in_flight():
    free = {"effects.gravity": False, "effects.feed": False, "start.bit_velocity": 3.0}
    times = np.arange(0.0, 3e-3, 2e-6)
    scene, seen = sampled(times, **free)
    last = np.flatnonzero(seen["bit_force"] > 0.0)[-1] + 300  # vibration has died out
    mean, end = seen["bit_position"][last:], seen["bit_end_position"][last:]
    speed, place = np.polyfit(times[last:], mean, 1)
    # without the impulses of loss the mean would be so much behind
    late = abs(speed) * 0.5 * scene.loss.time
    assert np.abs(mean - speed * times[last:] - place).max() < 0.1 * late
    assert abs(np.mean(end - mean)) < 0.1 * late  # it vibrates by some 1e-6 m
    assert seen["bit_velocity"][-1] == pytest.approx(speed, rel=1e-4)
