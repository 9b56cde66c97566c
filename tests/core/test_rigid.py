"""The rigid option against closed forms, an ODE solver, and itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from percussion_model.engine.solvers import RigidSolver
from percussion_model.physics.ledger import complete_ledger, energies
from percussion_model.physics.records import (
    BLOW,
    EVENT,
    READING,
    SAMPLE_FIELDS,
    EventKind,
    Status,
)
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene
from percussion_model.solvers.rigid.motion import fall_time, oscillate, oscillate_with_loss
from percussion_model.solvers.rigid.restitution import restitution, st_venant_restitution
from tests.state_bits import state_bits

RIGID = {"piston": {"model": "rigid"}, "bit": {"model": "rigid"}}
BIT_ONLY = {
    "piston": {"model": "absent"},
    "bit": {"model": "rigid"},
}
M_P, M_B = 7850 * 5.5e-3 * 0.175, 7850 * 5.5e-3 * 0.20125


def make(bodies=RIGID, **groups):
    return RigidSolver(Scene(**bodies, **groups))


def run(solver, times, room=(1000, 100000), state=None):
    """Advance through `times`; return state, blows and events."""
    state = solver.new_state() if state is None else state
    blows, events = np.zeros(room[0], BLOW), np.zeros(room[1], EVENT)
    all_blows, all_events = [], []
    for t in np.atleast_1d(times):
        status = Status.BLOWS_FULL
        while status in (Status.BLOWS_FULL, Status.EVENTS_FULL):
            status, n_blows, n_events = solver.advance(state, t, blows, events, True)
            all_blows.append(blows[:n_blows].copy())
            all_events.append(events[:n_events].copy())
        assert status == Status.DONE
    return state, np.concatenate(all_blows), np.concatenate(all_events)


def plain(found):
    """State, blows and events as bytes."""
    state, blows, events = found
    return state_bits(state), blows.tobytes(), events.tobytes()


def look(solver, state, times):
    """Samples of a state at times; a state far behind runs on in the copies that are read."""
    rows = np.zeros((len(times), len(SAMPLE_FIELDS)))
    solver.sample(state, np.asarray(times, float), rows)
    return {name: rows[:, i] for i, name in enumerate(SAMPLE_FIELDS)}


def relative_residual(solver, state, t):
    return abs(complete_ledger(energy(solver, state, t))["residual_relative"])


def energy(solver, state, t):
    reading = np.zeros(1, READING)
    solver.read(state, t, reading)
    return energies(reading)


def kinds(events, kind):
    return events[events["kind"] == kind]


def drop(force, v, barrier=False, **rock):
    """A bit that meets the rock at v under a constant force."""
    return make(
        BIT_ONLY,
        effects={"drive": "none", "gravity": False, "barrier": barrier},
        feed={"force": force},
        rock=rock,
        start={"bit_velocity": v, "rock_gap": 0.0},
    )


@pytest.mark.parametrize("beta", [0.0, 0.3, 0.9999, 1.0, 1.00001, 4.0])
def test_oscillation_solves_its_equation(beta):
    for tau in (1e-6, 0.7, 9.0):
        y, v, square = oscillate_with_loss(0.4, -1.3, beta, 1.0, tau)
        ode = solve_ivp(
            lambda t, x: (x[1], -2 * beta * x[1] - x[0], x[1] ** 2),
            (0, tau),
            (0.4, -1.3, 0.0),
            method="DOP853",
            rtol=1e-13,
            atol=1e-15,
        )
        np.testing.assert_allclose((y, v, square), ode.y[:, -1], rtol=1e-9, atol=1e-11)
        assert (y, v) == pytest.approx(oscillate(0.4, -1.3, beta, 1.0, tau), abs=1e-14)
        if beta > 0:
            lost = 0.5 * (1.3**2 + 0.4**2 - v * v - y * y)
            assert 2 * beta * square == pytest.approx(lost, abs=1e-12)


@pytest.mark.parametrize("beta", [0.0, 0.3, 1.0, 4.0])
@pytest.mark.parametrize("start", [(1.0, -0.5), (1.0, 2.0), (0.3, 0.0)])
def test_fall_time_is_the_first(beta, start):
    level = start[0] - 1e-3
    t = fall_time(*start, beta, 1.0, level)
    assert oscillate(*start, beta, 1.0, t)[0] == pytest.approx(level, abs=1e-14)
    before = [oscillate(*start, beta, 1.0, s)[0] for s in np.linspace(0, t, 1000)[:-1]]
    assert min(before) > level


@pytest.mark.parametrize("force", [0.0, 2500.0, 1e5])
def test_bilinear_drop(force):
    """Oracle 4: peak penetration; restitution 1/sqrt(gamma) whatever the force is."""
    K, gamma, v = 7.5e8, 5.0, 5.25
    solver = drop(force, v, loading_stiffness=K, unloading_ratio=gamma)
    state, _, events = run(solver, 4e-4)
    p_s = force / K
    p_max = p_s + math.sqrt(p_s**2 + v * v * M_B / K)
    peak = kinds(events, EventKind.MODE_BC)[0]
    assert peak["bit_position"] == pytest.approx(p_max, rel=1e-12)
    lift = kinds(events, EventKind.MODE_FF)[0]["time"]
    rebound = look(solver, solver.new_state(), [lift])["bit_velocity"][0]
    assert -rebound == pytest.approx(v / math.sqrt(gamma), rel=1e-11)
    assert relative_residual(solver, state, 4e-4) < 1e-12


def test_barrier_drop():
    """Oracle 5: KE_{n+1} = (KE_n - W_R)/gamma while the barrier is overcome."""
    gamma, w_r = 5.0, 0.05
    solver = drop(2500.0, 5.25, barrier=True, unloading_ratio=gamma, barrier_energy=w_r)
    state, _, events = run(solver, 0.1)
    starts = kinds(events, EventKind.MODE_DFC)["time"]
    assert len(starts) >= 4
    v = look(solver, solver.new_state(), starts)["bit_velocity"]
    moving = 0.5 * M_B * v**2
    spent = len(kinds(events, EventKind.MODE_FC))
    for n in range(min(spent, len(starts) - 1)):
        assert moving[n + 1] == pytest.approx((moving[n] - w_r) / gamma, rel=1e-9)
    assert energy(solver, state, 0.1)["barrier"] == pytest.approx(spent * w_r, rel=0.2)


def test_pressure_law_over_a_bit_at_rest():
    """Oracle 7: eq. 12 of the paper; a rigid wall keeps the bit at rest."""
    f_0, d_1, v_0 = 3000.0, 0.040, -3.0
    solver = make(
        effects={"rock": "wall", "gravity": False},
        contact={"restitution": 0.35},
        start={"piston_velocity": v_0, "gap": 0.0, "rock_gap": 0.0, "drive_direction": -1},
    )
    state, _, events = run(solver, 0.06)
    closed = kinds(events, EventKind.CONTACT_CLOSED)[0]
    mu = M_P * v_0**2 / (2 * f_0 * d_1)
    scale = math.sqrt(f_0 * d_1 / M_P)
    assert closed["value"] == pytest.approx(scale * math.sqrt(4 + 2 * mu), rel=1e-12)
    factor = math.sqrt(4 + 2 * mu) + 2 * math.sqrt(2 * mu + 2) - math.sqrt(2 * mu)
    assert closed["time"] == pytest.approx(math.sqrt(d_1 * M_P / f_0) * factor, rel=1e-12)
    blows = run(solver, 0.2)[1]
    v_1 = 0.35 * closed["value"]
    assert blows["rebound_velocity"][0] == pytest.approx(-v_1, rel=1e-12)
    stroke = d_1 * (2 + M_P * v_1**2 / (2 * f_0 * d_1))
    assert blows["stroke"][0] == pytest.approx(stroke, rel=1e-12)
    assert relative_residual(solver, state, 0.06) < 1e-13


def test_impulse_balance_over_periods():
    """Oracle 8, from velocities and forces that are found apart from each other."""
    solver = make(rock={"unloading_ratio": 5.0})
    _, blows, _ = run(solver, 4.0)
    first, last = blows["time"][[-30, -1]]
    rows = look(solver, solver.new_state(), [first - 1e-6, last - 1e-6])
    weight = (last - first) * 10.0
    bit, contact, drive = (
        float(np.diff(rows[f"{name}_impulse"])[0]) for name in ("bit", "contact", "drive")
    )
    feed = 2500.0 * (last - first)
    assert bit == pytest.approx(feed + (M_P + M_B) * weight + drive, rel=1e-6)
    assert contact == pytest.approx(M_P * weight + drive, rel=1e-6)
    assert np.sum(blows["bit_impulse"][-30:-1]) == pytest.approx(bit, rel=1e-6)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.87, 0.999])
@pytest.mark.parametrize("rock", ["wall", "bilinear", "spring"])
def test_piston_comes_to_rest_on_the_bit(restitution, rock):
    """Bounces shrink for ever, yet end in time, and then F_C = F_0 + M_p G."""
    solver = make(
        effects={"rock": rock, "drive": "external"},
        drive={"external_force": 3000.0},
        contact={"restitution": restitution},
        start={"piston_velocity": 1.0},
    )
    state, _, events = run(solver, 2.0, room=(100, 2000000))
    now = {name: values[0] for name, values in look(solver, state, [2.0]).items()}
    if rock != "spring":  # an undamped spring keeps ringing
        held = 3000.0 + M_P * 10.0
        assert now["contact_force"] == pytest.approx(held, rel=1e-9)
        assert now["bit_force"] == pytest.approx(held + 2500.0 + M_B * 10.0, rel=1e-9)
        assert now["gap"] == 0.0
        assert events["time"][-1] < 1.5
    assert relative_residual(solver, state, 2.0) < 1e-12


@pytest.mark.parametrize("drive", ["external", "pressure"])
def test_piston_that_starts_at_rest_on_the_bit(drive):
    solver = make(
        effects={"rock": "wall", "drive": drive},
        drive={"external_force": 3000.0} if drive == "external" else {},
        start={"piston_velocity": 0.0, "gap": 0.0, "rock_gap": 0.0},
    )
    state, _, events = run(solver, 1.0)
    if drive == "pressure":
        # u_r = 0 is reached from the start, so the drive lifts at once (docs/model.md, eq. 13)
        assert (events["time"][0], events["kind"][0]) == (0.0, EventKind.DRIVE_UP)
        assert (events["time"][1], events["kind"][1]) == (0.0, EventKind.CONTACT_OPENED)
        return
    assert look(solver, state, [1.0])["contact_force"][0] == pytest.approx(3000.0 + M_P * 10.0)


def test_reference_scene():
    solver = make()
    state, blows, events = run(solver, 4.0)
    settled = blows[blows["time"] > 1.0]
    assert restitution(numbers_of(solver.scene)) == pytest.approx(20 / 23, rel=1e-14)
    assert st_venant_restitution(2.0, 1.0, 1.0, 1.0) == pytest.approx(1.0)
    assert np.all(settled["contacts"] == 2)
    np.testing.assert_allclose(settled["standstill_force"], 2586.9, rtol=1e-4)
    assert np.all(np.isnan(settled["peak_contact_force"]))
    assert np.ptp(settled["period"]) < 1e-9
    assert np.all(np.diff(events["time"]) >= 0)
    assert relative_residual(solver, state, 4.0) < 1e-12
    rows = look(solver, solver.new_state(), np.linspace(0, 0.3, 20001))
    assert rows["gap"].min() > -1e-15
    assert rows["bit_force"].min() > -1e-9
    e = energy(solver, state, 4.0)
    assert e["loss"] == e["numerical"] == 0.0


def test_any_partition_gives_the_same_bits():
    solver = make()
    whole = plain(run(solver, 1.0))
    for seed in range(3):
        times = np.append(np.sort(np.random.default_rng(seed).uniform(0, 1, 3000)), 1.0)
        parts = run(solver, times, room=(1 + seed, 4 + 7 * seed))
        assert plain(parts) == whole


def test_reading_does_not_touch_and_copies_repeat():
    solver = make()
    state, _, _ = run(solver, 0.5)
    bits, saved = state.words.tobytes(), state.copy()
    look(solver, state, np.linspace(0.5, 0.9, 100))
    energy(solver, state, 0.8)
    assert state.words.tobytes() == bits
    assert plain(run(solver, 1.0, state=state)) == plain(run(solver, 1.0, state=saved))


def test_inputs_act_at_once_or_at_the_next_cycle():
    solver = make()
    state, _, _ = run(solver, 0.52)
    solver.commit(state, 0.52, np.zeros(1, BLOW), np.zeros(1, EVENT), False)
    before = look(solver, state, [0.52])
    solver.set_inputs(state, feed_force=3500.0, drive_force=4000.0, loading_stiffness=1.5e9)
    after = look(solver, state, [0.52])
    assert after["bit_position"] == before["bit_position"]
    assert abs(after["drive_force"][0]) == 4000.0
    assert state.record["k_r"][0] == 7.5e8
    state, blows, _ = run(solver, 3.0, state=state)
    assert state.record["k_r"][0] == 1.5e9
    assert blows["standstill_force"][-1] == pytest.approx(3500.0 + M_B * 10.0, rel=1e-4)
    assert relative_residual(solver, state, 3.0) < 1e-12


def test_depth_does_not_enter():
    shallow, deep = make(), make(start={"depth": 60.0})
    assert run(shallow, 1.0)[1].tobytes() == run(deep, 1.0)[1].tobytes()


def test_trends_of_the_paper():
    """Rates ~ K_R**-0.55, and ~ D_1**-0.36 at constant power F_0**3 D_1."""
    stiffness = exponent("rock.loading_stiffness", np.geomspace(2e8, 3e9, 7))
    assert stiffness == pytest.approx(-0.55, abs=0.03)
    distance = exponent("drive.reversal_distance", np.geomspace(0.008, 0.08, 7))
    assert distance == pytest.approx(-0.36, abs=0.03)


def exponent(key, values):
    rates = []
    for value in values:
        scene = Scene(**RIGID).replace(**{key: float(value)})
        if key.startswith("drive"):
            scene = scene.replace(**{"drive.force": float(3000.0 * (0.04 / value) ** (1 / 3))})
        blows = run(RigidSolver(scene), 6.0)[1]
        ends = blows[blows["time"] > 1.0][[0, -1]]
        rates.append(np.diff(ends["bit_position"])[0] / np.diff(ends["time"])[0])
    return np.polyfit(np.log(values), np.log(rates), 1)[0]
