"""A string that twists between motor and bit, against closed forms (docs/model.md, eq. 20j)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model import Scene, SceneError, Simulation
from percussion_model.components.rotation import turn
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks import rock
from percussion_model.scene.rocks.breaking import parameters_under
from percussion_model.solvers.rigid.records import RIGID_PAR, RIGID_STATE

STIFFNESS, INERTIA, SPEED, NEEDED = 7000.0, 0.2, 5.7, 180.0
RATE = math.sqrt(STIFFNESS / INERTIA)
HELD = NEEDED / STIFFNESS  # twist at which the bit gives way


def turned(period, twist=0.0, speed=SPEED, needed=NEEDED, stall=0.0, inertia=INERTIA):
    par, s = np.zeros(1, RIGID_PAR)[0], np.zeros(1, RIGID_STATE)[0]
    par["rotation_string_stiffness"], par["rotation_inertia"] = STIFFNESS, inertia
    par["rotation_stall_torque"] = stall
    s["rotation_turning_speed"], s["rotation_needed_torque"] = speed, needed
    s["rotation_twist"] = twist
    return turn(par, s, period)


@pytest.mark.parametrize("period", [1e-3, 0.01, 0.033, 0.2])
def test_a_bit_that_nothing_holds_is_a_pendulum_on_its_string(period):
    found, phase = turned(period, needed=0.0), RATE * period
    assert found.twist == pytest.approx(SPEED / RATE * math.sin(phase), rel=1e-12)
    assert found.angle == pytest.approx(SPEED * period - found.twist, rel=1e-9)
    assert found.speed == pytest.approx(SPEED * (1.0 - math.cos(phase)), rel=1e-9)


def test_a_bit_that_is_held_winds_its_string_until_it_gives_way():
    period = 0.5 * HELD / SPEED
    still = turned(period)
    assert (still.angle, still.speed) == (0.0, 0.0)
    assert still.twist == pytest.approx(0.5 * HELD, rel=1e-12)
    assert still.torque == pytest.approx(0.25 * NEEDED, rel=1e-12)
    after = turned(HELD / SPEED + 0.004)
    assert after.angle == pytest.approx(
        SPEED * 0.004 - SPEED / RATE * math.sin(RATE * 0.004), rel=1e-9
    )


@pytest.mark.parametrize("period", [math.pi / RATE, 0.1])
def test_a_wound_string_lets_the_bit_swing_by_twice_its_excess(period):
    found = turned(period, twist=1.5 * HELD, speed=0.0)
    assert found.angle == pytest.approx(HELD, rel=1e-12)
    assert found.twist == pytest.approx(0.5 * HELD, rel=1e-12)
    assert found.speed == pytest.approx(0.0, abs=1e-12)


def test_the_motor_of_a_stuck_bit_stalls_at_its_static_twist():
    twist = 0.0
    for _ in range(20):
        found = turned(0.03, twist, needed=900.0, stall=600.0)
        twist = found.twist
        assert found.angle == 0.0
    assert twist == 600.0 / STIFFNESS
    assert found.torque == 600.0


@pytest.mark.parametrize("seed", range(8))
def test_what_the_motor_does_is_kept_or_spent(seed):
    """Against small steps of the same law, and by energies exactly."""
    rng = np.random.default_rng(seed)
    needed, speed, inertia = 10 ** rng.uniform((1, -1, -2), (3, 1, 0))
    twist, period = rng.uniform(0.0, 2.0) * needed / STIFFNESS, 10 ** rng.uniform(-2, -1)
    found = turned(period, twist, speed, needed, inertia=inertia)
    kept = 0.5 * STIFFNESS * (found.twist**2 - twist**2) + 0.5 * inertia * found.speed**2
    work = found.torque * speed * period
    assert work == pytest.approx(kept + needed * found.angle, rel=1e-11, abs=1e-12)
    steps, now, v, angle = 20_000, twist, 0.0, 0.0
    h = period / steps
    for _ in range(steps):
        torque = STIFFNESS * now
        v = 0.0 if v <= 0.0 and torque <= needed else max(v + (torque - needed) / inertia * h, 0.0)
        angle, now = angle + v * h, now + (speed - v) * h
    assert found.angle == pytest.approx(angle, rel=2e-3, abs=1e-4 * speed * period)
    assert found.twist == pytest.approx(now, rel=2e-3, abs=1e-4 * speed * period)


# -------------------------------------------------------------------- in runs

BASE = hammer("dth5")
BASE = BASE.replace(**parameters_under(rock("kuru-granite"), BASE))
STRING = {"rotation.string_stiffness": STIFFNESS, "rotation.inertia": INERTIA}


def run(duration, **changes):
    simulation = Simulation(BASE.computed_by("rigid", **{"run.settle": 0.0, **changes}))
    simulation.advance(duration)
    return simulation


def mean(simulation, column):
    blows = simulation.blows
    return blows[column][len(blows) // 3 :].mean()


def test_a_stiff_string_of_a_light_bit_is_none():
    rigid = run(1.0)
    stiff = run(1.0, **{"rotation.string_stiffness": 1e9, "rotation.inertia": 1e-7})
    for column in ("rotation_torque", "rotation_index", "hole_advance"):
        assert mean(stiff, column) == pytest.approx(mean(rigid, column), rel=1e-3)


def test_blows_that_stop_the_bit_cost_torque():
    """The motor does the work of climb and friction, and gives the bit its speed anew."""
    simulation = run(3.0, **STRING)
    given = simulation.energy()["climb"] + simulation.energy()["turning"]
    blows = simulation.blows
    work = (blows["rotation_torque"] * blows["period"]).sum() * BASE["rotation.speed"]
    assert work == pytest.approx(given, rel=0.02)  # a row is of the torque of the blow before
    assert mean(simulation, "rotation_torque") > 1.02 * mean(run(3.0), "rotation_torque")
    assert abs(simulation.energy()["residual_relative"]) < 1e-9


def test_a_jam_twists_the_string_and_comes_free_again():
    motor = {"rotation.stall_torque": 600.0, "rotation.full_torque": 400.0}
    simulation = run(1.0, **STRING, **motor)
    free = mean(simulation, "hole_advance")
    simulation.set_inputs(feed_force=60e3)
    simulation.advance(4.0)
    seen, count = simulation.observe(), len(simulation.blows)
    assert (seen["rotation_index"], seen["rotation_torque"]) == (0.0, 600.0)
    assert seen["rotation_twist"] == pytest.approx(600.0 / STIFFNESS, rel=1e-12)
    simulation.set_inputs(feed_force=11e3)
    simulation.advance(7.0)
    assert simulation.blows["hole_advance"][count + 30 :].mean() == pytest.approx(free, rel=0.05)


def test_a_string_needs_something_to_turn():
    with pytest.raises(SceneError, match=r"rotation\.inertia, the moment of inertia"):
        BASE.replace(**{"rotation.string_stiffness": 7000.0})
    with pytest.raises(SceneError, match=r"rotation\.string_stiffness"):
        Scene().replace(**{"rotation.string_stiffness": -1.0})
