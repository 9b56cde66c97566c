"""The controller alone: PI, void, jam, ratio, and the seeker on hills that are known."""

from __future__ import annotations

import math

import pytest
from models import make_model, start_inputs


def drive(control, count, **inputs):
    """Hold inputs for so many milliseconds; return the outputs."""
    given = start_inputs("DrillController") | inputs
    for _ in range(count):
        control.step(given, 1e-3)
    return control.outputs()


def test_the_pi_is_a_pi_and_does_not_wind_up():
    control = make_model("DrillController", feed_force=2500.0)
    p = control.parameters
    found = drive(control, 100, feed_setpoint=2500.0, feed_force=2400.0)
    wanted = p["pi.gain"] * 100.0 * (1.0 + 0.1 / p["pi.time"])
    assert found["force_command"] == pytest.approx(wanted, rel=1e-9)
    found = drive(control, 100_000, feed_setpoint=2500.0, feed_force=0.0)
    assert found["force_command"] <= p["force_limit"]
    found = drive(control, 300, feed_setpoint=2500.0, feed_force=5000.0)
    assert found["force_command"] < p["force_limit"] - 1000.0


def test_a_void_cuts_percussion_back_until_there_is_rock():
    control = make_model("DrillController")
    found = drive(control, 500, head_velocity=0.3, feed_force=300.0)
    assert found["mode"] == 1
    assert found["pressure_command"] == control.parameters["cutback.pressure"]
    found = drive(control, 500, head_velocity=0.0, feed_force=300.0)
    assert found["mode"] == 1
    found = drive(control, 500, head_velocity=0.0, feed_force=2000.0)
    assert found["mode"] == 0
    assert found["pressure_command"] == 2e6


def test_a_jam_is_answered_by_a_retract():
    control = make_model("DrillController", retract__force=-1500.0)
    assert drive(control, 50, rotation_torque=400.0)["mode"] == 0
    found = drive(control, 300, rotation_torque=400.0)
    assert found["mode"] == 2
    # at the start nothing was wanted of the rig beside 2.5 kN of feed
    assert found["force_command"] == pytest.approx(-2500.0 - 1500.0)
    assert drive(control, 400, rotation_torque=20.0)["mode"] == 0


def test_a_retract_that_does_not_help_goes_on():
    """A PI that wound up in a void takes too much for the weights; the bit must come free."""
    control = make_model("DrillController", start__force=6000.0)
    first = drive(control, 300, rotation_torque=400.0, feed_force=9000.0)
    assert first["mode"] == 2
    assert first["force_command"] > 2000.0
    later = drive(control, 400, rotation_torque=400.0, feed_force=9000.0)
    assert later["force_command"] < 0.0


def test_pressure_follows_the_feed_where_it_is_told_to():
    control = make_model("DrillController", ratio__on=True)
    found = drive(control, 1000, feed_force=2000.0)
    assert found["pressure_command"] == pytest.approx(2000.0 * 800.0)
    found = drive(control, 1000, feed_force=0.0)
    assert found["pressure_command"] == control.parameters["ratio.lowest"]


@pytest.mark.parametrize("start", [1000.0, 2500.0, 6000.0])
def test_the_seeker_climbs_a_known_hill(start):
    """R = F exp(-F/3000) is best at 3000 N; the feed arrives 0.25 s late."""
    control = make_model("DrillController", seek__on=True, feed_setpoint=start)
    inputs = start_inputs("DrillController") | {"feed_setpoint": start}
    late = [start] * 25
    for _ in range(12_000):
        late.append(control.outputs()["feed_wanted"])
        feed = late.pop(0)
        inputs |= {"feed_force": feed, "rate_of_penetration": feed * math.exp(-feed / 3000.0)}
        control.step(inputs, 1e-2)
    assert control.outputs()["seek.centre"] == pytest.approx(3000.0, rel=0.03)


def climb(control, rate, seconds, feed_by_pressure=0.0, late=25, step=1e-2):
    """Let a controller seek on a hill; feed and pressure arrive late, the rate later."""
    found, inputs = control.outputs(), start_inputs("DrillController")
    wanted, first = found["feed_wanted"], found["pressure_command"]
    inputs |= {"feed_setpoint": wanted, "pressure_setpoint": first}
    feeds, pressures, rates = [wanted] * late, [first] * late, [rate(wanted, first)] * 5
    for _ in range(round(seconds / step)):
        found = control.outputs()
        feeds.append(found["feed_wanted"])
        pressures.append(found["pressure_command"])
        pressure = pressures.pop(0)
        # what the drive's reaction takes from the feed
        feed = feeds.pop(0) - feed_by_pressure * (pressure - first)
        rates.append(rate(feed, pressure))
        inputs |= {"feed_force": feed, "supply_pressure": pressure}
        control.step(inputs | {"rate_of_penetration": rates.pop(0)}, step)
    return control.outputs()


BEST_FEED, BEST_PRESSURE = 3000.0, 1.8e6


def ridge(feed, pressure):
    """A hill with its top at 3 kN and 1.8 MPa, its axes askew: more pressure wants more feed."""
    x, y = math.log(feed / BEST_FEED), math.log(pressure / BEST_PRESSURE)
    return 0.02 * math.exp(-2.0 * x * x - 1.5 * y * y + x * y)


@pytest.mark.parametrize("start", [(1500.0, 1.2e6), (2500.0, 2.0e6), (5000.0, 2.8e6)])
@pytest.mark.parametrize("shaken", [0.0, 5e-4])
def test_two_swings_climb_a_known_hill(start, shaken):
    """Feed and pressure at once, though the pressure shakes the feed."""
    control = make_model(
        "DrillController", seek__on=True, seek__pressure_on=True, seek__period=3.0,
        feed_setpoint=start[0], pressure_setpoint=start[1],
    )  # fmt: skip
    found = climb(control, ridge, 150.0, shaken)
    assert found["seek.pressure_centre"] == pytest.approx(BEST_PRESSURE, rel=0.03)
    # the reaction of another pressure shifts the feed that is measured
    feed = found["seek.centre"] - shaken * (found["seek.pressure_centre"] - start[1])
    assert feed == pytest.approx(BEST_FEED, rel=0.03)
    assert abs(found["seek.gradient"]) < 0.15
    assert abs(found["seek.pressure_gradient"]) < 0.15


def test_the_seeker_tells_the_two_slopes_apart():
    """A rate that follows one of the two has no slope over the other."""
    control = make_model(
        "DrillController", seek__on=True, seek__pressure_on=True, seek__gain=0.0,
        seek__pressure_gain=0.0, seek__period=3.0,
    )  # fmt: skip
    found = climb(control, lambda feed, pressure: 1e-8 * feed**2, 20.0, late=1)
    assert found["seek.gradient"] == pytest.approx(2.0, rel=0.05)
    assert found["seek.pressure_gradient"] == pytest.approx(0.0, abs=0.05)


def test_pressure_stays_where_it_is_not_sought():
    control = make_model("DrillController", seek__on=True)
    found = climb(control, ridge, 30.0)
    assert found["pressure_command"] == found["seek.pressure_centre"] == 2e6


def test_a_void_ends_the_window_of_the_seeker():
    control = make_model("DrillController", seek__on=True)
    climb(control, ridge, 5.0)
    before = control.state["centres"][0]
    inputs = start_inputs("DrillController") | {"feed_setpoint": 2500.0}
    for _ in range(300):
        control.step(inputs | {"head_velocity": 0.3, "rate_of_penetration": 9.0}, 1e-2)
    assert control.outputs()["mode"] == 1
    assert control.state["centres"][0] == before
    assert control.state["phase"] == 0.0


def test_the_state_of_the_seeker_is_saved():
    control = make_model("DrillController", seek__on=True)
    climb(control, ridge, 4.5)
    saved = control.save()
    first = climb(control, ridge, 4.0)
    control.restore(saved)
    assert climb(control, ridge, 4.0) == first
