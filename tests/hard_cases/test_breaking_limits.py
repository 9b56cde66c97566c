"""Hard cases of breaking, rotation and the casing, each with the limit that it must come to."""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model import Scene, Simulation
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks import rock
from percussion_model.scene.rocks.breaking import parameters_under

SOLVERS = ("modal", "wave", "rigid")
RPM = 2.0 * math.pi / 60.0
HAMMER = hammer("dth5")
HAMMER = HAMMER.replace(**parameters_under(rock("kuru-granite"), HAMMER))
LENGTH = 1.0  # about 33 blows [s]


def started(solver, **changes):
    """A run of the 5 inch hammer in granite."""
    return Simulation(HAMMER.computed_by(solver, **{"run.settle": 0.0, **changes}))


def go(simulation, until):
    """Advance, and see that all is finite and the ledger closed; rows of blows since before."""
    before = len(simulation.blows)
    simulation.advance(until)
    assert abs(simulation.energy()["residual_relative"]) < 1e-9
    assert all(math.isfinite(value) for value in simulation.energy().values())
    seen = simulation.observe()
    assert all(np.isfinite(value) for name, value in seen.items() if name != "contact_force")
    blows = simulation.blows[before:]
    for name in blows.dtype.names:
        if name.startswith(("breaking", "rotation")) or name in ("hole_advance", "bit_position"):
            assert np.all(np.isfinite(blows[name])), name
    return blows


def rate_of(blows):
    return blows["hole_advance"].sum() / blows["period"].sum()


@pytest.mark.parametrize("old_line", [False, True])
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_bit_that_does_not_turn_stops_drilling(solver, old_line):
    """At 0 rpm each blow meets its own craters: after the first ones nothing breaks out any more.

    On its old line rock is crushed only by what goes beyond the greatest blow so far.
    """
    blows = go(
        started(solver, **{"rotation.speed": 0.0, "rotation.old_line": old_line}), 2.0 * LENGTH
    )
    assert len(blows) > 30
    assert not blows["rotation_index"].any()
    assert blows["hole_advance"][0] > 1e-4
    assert rate_of(blows[-15:]) < 0.03 * blows["hole_advance"][0] / blows["period"].mean()
    assert np.all(blows["rotation_torque"] >= 0.0)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_bit_that_turns_at_a_thousand_rpm_meets_fresh_rock(solver):
    """Nothing is kept, which is the law with a renewal length of 0."""
    blows = go(started(solver, **{"rotation.speed": 1000.0 * RPM}), LENGTH)
    fresh = go(started(solver, **{"rotation.renewal_length": 0.0}), LENGTH)
    assert blows["rotation_index"][1:].min() > 30.0 * HAMMER["rotation.renewal_length"]
    np.testing.assert_allclose(blows["hole_advance"], fresh["hole_advance"], rtol=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
def test_on_the_old_line_a_thousand_rpm_are_as_good_as_two_thousand(solver):
    """Between blows nothing is kept; these few come before their motion is aperiodic."""
    one, two = (
        go(started(solver, **{"rotation.speed": speed * RPM, "rotation.old_line": True}), 0.15)
        for speed in (1000.0, 2000.0)
    )
    assert len(one) == len(two) >= 3
    np.testing.assert_allclose(one["hole_advance"], two["hole_advance"], rtol=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
def test_an_index_of_the_pitch_of_the_buttons_is_no_special_place(solver):
    """The law is one of the mean: the rate is steady where buttons come upon old craters."""
    pitch = 2.0 * math.pi * HAMMER["rotation.mean_radius"] / HAMMER["breaking.buttons"]
    rates = []
    for share in (0.97, 1.0, 1.03):
        speed = share * pitch * 32.4 / HAMMER["rotation.mean_radius"]
        rates.append(rate_of(go(started(solver, **{"rotation.speed": speed}), LENGTH)[5:]))
    assert max(rates) < 1.02 * min(rates)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_jam_comes_free_where_the_feed_is_lowered(solver):
    """A bit under too much feed needs more torque than the motor has, stands still and breaks
    nothing; under less feed it turns again.
    """
    motor = {"rotation.stall_torque": 600.0, "rotation.full_torque": 400.0}
    simulation = started(solver, **motor)
    free = go(simulation, LENGTH)
    assert free["rotation_torque"].max() < 400.0
    simulation.set_inputs(feed_force=60e3)
    jammed = go(simulation, 4.0 * LENGTH)
    seen = simulation.observe()
    assert seen["rotation_torque"] == 600.0
    assert seen["rotation_needed_torque"] > 600.0
    assert seen["rotation_turning_speed"] < 1e-3 * HAMMER["rotation.speed"]
    assert rate_of(jammed[-10:]) < 0.1 * rate_of(free[5:])
    simulation.set_inputs(feed_force=11e3)
    after = go(simulation, 7.0 * LENGTH)
    assert rate_of(after[-10:]) == pytest.approx(rate_of(free[5:]), rel=0.05)
    assert simulation.observe()["rotation_turning_speed"] == pytest.approx(
        HAMMER["rotation.speed"], rel=1e-3
    )


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_hole_smaller_than_the_ring_of_buttons_is_limited_by_what_is_pressed_in(solver):
    """Nothing forbids it: the volume would be a hole deeper than the buttons go."""
    small = HAMMER["rotation.mean_radius"]  # half the diameter of that ring
    blows = go(started(solver, hole_diameter=0.5 * small), LENGTH)
    pressed = go(
        started(solver, **{"hole_diameter": 0.5 * small, "breaking.crushing_energy": 0.0}), LENGTH
    )
    simulation = started(solver, hole_diameter=0.5 * small)
    simulation.advance(LENGTH)
    assert simulation.observe()["breaking_limited"] > 0.0
    assert np.all(blows["hole_advance"] <= pressed["hole_advance"] * (1.0 + 1e-9))
    assert rate_of(blows[5:]) > 0.5 * rate_of(pressed[5:])


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_threshold_above_any_blow_leaves_no_hole(solver):
    simulation = started(solver, **{"breaking.threshold": 1e4})
    blows = go(simulation, LENGTH)
    assert len(blows) > 20
    assert np.all(np.abs(blows["hole_advance"]) < 1e-15)
    assert simulation.observe()["breaking_volume"] == 0.0
    # all that is pressed in is climbed out of: the bit does not get deeper either
    assert np.ptp(blows["bit_position"][5:]) < 1e-5


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_casing_far_below_recoil_throttles_the_drive(solver):
    """The drive's mean force over blows then is what holds the casing, and the bit has no feed."""
    feed = 2000.0
    simulation = started(solver, **{"feed.force": feed})
    go(simulation, LENGTH)
    blows = go(simulation, 4.0 * LENGTH)
    held = feed + HAMMER["feed.casing_mass"] * HAMMER.gravity.acceleration
    recoil = blows["drive_impulse"].sum() / blows["period"].sum()
    assert recoil == pytest.approx(held, rel=0.15)
    full = go(started(solver), LENGTH)
    assert rate_of(blows) < 0.5 * rate_of(full[5:])
    assert blows["impact_velocity"].mean() < 0.7 * full["impact_velocity"][5:].mean()


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_feed_of_nothing_and_back(solver):
    """Without feed and weight of the casing the drive stops; with feed it drills as before."""
    simulation = started(solver, **{"feed.casing_mass": 0.0})
    before = go(simulation, LENGTH)
    simulation.set_inputs(feed_force=0.0)
    go(simulation, 2.0 * LENGTH)
    assert simulation.observe()["drive_force"] == 0.0
    idle = simulation.observe()["hole_depth"]
    go(simulation, 3.0 * LENGTH)
    assert simulation.observe()["hole_depth"] - idle < 1e-3 * LENGTH * rate_of(before)
    simulation.set_inputs(feed_force=11e3)
    after = go(simulation, 6.0 * LENGTH)
    assert rate_of(after[-10:]) == pytest.approx(rate_of(before[5:]), rel=0.05)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_feed_that_pulls_lifts_the_bit_off(solver):
    """With the feed on the bit, upward beyond drive and weight, only the first blow drills."""
    simulation = started(solver, **{"feed.on": "bit", "feed.force": -20e3})
    go(simulation, 0.5)
    first = simulation.observe()["hole_depth"]
    go(simulation, LENGTH)
    assert simulation.observe()["hole_depth"] == pytest.approx(first, abs=1e-12)


def test_the_wall_and_the_spring_have_no_use_for_them():
    """Nothing is crushed, so nothing breaks and no torque is asked for."""
    for kind in ("wall", "spring"):
        changes = {"effects.rock": kind, "effects.barrier": False}
        simulation = Simulation(Scene().replace(**changes))
        simulation.advance(0.2)
        other = HAMMER.replace(**changes)
        assert not other.matters("breaking.efficiency")
        assert not other.matters("rotation.speed")
        run = Simulation(other)
        run.advance(0.2)
        assert run.observe()["hole_depth"] == 0.0
        assert run.observe()["breaking_volume"] == 0.0
