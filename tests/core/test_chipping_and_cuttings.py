"""Chipping and cuttings in the rock law: closed forms, a general integrator, energies."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from percussion_model import Scene, simulate
from percussion_model.physics.curved_loading import load
from percussion_model.physics.place import move_place
from percussion_model.physics.power_law import (
    CHIPPING_SLOPE,
    loading_force,
    loading_work,
    next_kink,
    part_at,
)
from percussion_model.physics.records import Cuttings, Mode, RockKind
from percussion_model.physics.rock import (
    close_interface,
    crush,
    end_loading,
    hole_depth,
    recoverable,
    resume_cycle,
    spring_force,
)
from percussion_model.solvers.wave.records import WAVE_PAR, WAVE_STATE

K, GAMMA, P_0 = 7.5e8, 5.0, 1e-3
DROP = {
    "piston.model": "absent", "bit.model": "rigid", "effects.drive": "none",
    "effects.gravity": False, "effects.barrier": False, "start.bit_velocity": 8.0,
    "run.settle": 0.0,
}  # fmt: skip

BY_CYCLE = {"effects.cuttings": True, "rock.removed_by": "cycle"}


def make(exponent=1.0, unloading=0.0, chipping=(0.0, 0.0), removed=None, by=Cuttings.BY_CYCLE):
    """Parameters and state of a bit that flies right above the rock."""
    par, s = np.zeros(1, WAVE_PAR)[0], np.zeros(1, WAVE_STATE)[0]
    par["rock"], par["power"], par["buttons"] = RockKind.BILINEAR, 1, 1.0
    par["exponent"], par["unloading_exponent"], par["reference_penetration"] = (
        exponent,
        unloading,
        P_0,
    )
    par["chipping_force"], par["chipping_penetration"] = chipping
    par["cuttings"] = Cuttings.NONE if removed is None else by
    par["left"] = par["places"] = par["cuttings"] > Cuttings.BY_CYCLE
    par["removed_share"], par["removal_exponent"] = removed or 0.0, 1.0
    s["mode"], s["k_r"], s["next_k_r"], s["gamma"], s["next_gamma"] = Mode.FF, K, K, GAMMA, GAMMA
    return par, s


def press(par, s, wanted):
    """Push the bit on until the rock has taken an energy, and let it rebound; the peak."""
    close_interface(par, s, 1.0)
    start = loading_work(par, s, s["p"])
    before, s["p"] = (
        s["p"],
        brentq(
            lambda p: loading_work(par, s, p) - start - wanted, s["p"], 1.0, xtol=1e-18, rtol=1e-15
        ),
    )
    crushed = crush(par, s, before)
    assert crushed + recoverable(par, s) == pytest.approx(wanted, rel=1e-9)
    peak = float(s["p"])
    end_loading(par, s)
    s["mode"], s["p"] = Mode.FF, s["p_u"]
    return peak


# -------------------------------------------------------------------- chipping


@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0])
def test_work_is_the_integral_of_the_force(exponent):
    par, s = make(exponent, chipping=(3e5, 2e-4))
    close_interface(par, s, 1.0)
    start = float(part_at(par, K, 3e5))
    for p in (0.5 * start, start + 1e-4, start + 5e-4):
        found, _ = quad(
            lambda x: float(loading_force(par, s, x)), 0.0, p, points=[start, start + 2e-4],
            epsabs=1e-12, epsrel=1e-12,
        )  # fmt: skip
        assert loading_work(par, s, p) == pytest.approx(found, rel=1e-10)


def test_the_rock_chips_at_its_force_over_its_way():
    par, s = make(2.0, chipping=(3e5, 2e-4))
    close_interface(par, s, 1.0)
    start = P_0 * math.sqrt(3e5 / (K * P_0))
    assert float(next_kink(par, s, 0.0)) == pytest.approx(start, rel=1e-12)
    assert float(next_kink(par, s, start + 1e-5)) == pytest.approx(start + 2e-4, rel=1e-12)
    for way in (0.0, 1e-4, 2e-4):
        assert loading_force(par, s, start + way) == pytest.approx(3e5, rel=1e-3)
    # beyond, the old curve from the new place on
    beyond = K * P_0 * ((start + 3e-4 - (1.0 - CHIPPING_SLOPE) * 2e-4) / P_0) ** 2
    assert loading_force(par, s, start + 3e-4) == pytest.approx(beyond, rel=1e-12)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_stretch_over_the_chipping_is_that_of_a_general_integrator(exponent):
    par, s = make(exponent, chipping=(3e5, 2e-4))
    close_interface(par, s, 1.0)
    push, z = 9e5, 3e5

    def motion(_, y):
        v = (push - float(loading_force(par, s, y[0]))) / z
        return [v, v * v]

    for time in (1e-4, 3e-4, 1e-3):
        found = solve_ivp(
            motion, (0.0, time), [0.0, 0.0], "DOP853", rtol=1e-11, atol=1e-16, max_step=1e-6
        )
        d, q = load(par, s, push, z, time)
        assert d == pytest.approx(found.y[0, -1], rel=1e-7)
        assert q == pytest.approx(found.y[1, -1], rel=1e-7)


@pytest.mark.parametrize("speed", [2.0, 5.0, 9.0])  # below, while and after it chips
def test_the_peak_of_a_drop_is_that_of_its_energy(speed):
    rock = {
        "effects.rock": "power", "effects.feed": False, "rock.chipping_force": 4e5,
        "rock.chipping_penetration": 3e-4, "start.bit_velocity": speed, "run.duration": 1e-3,
    }  # fmt: skip
    scene = Scene().replace(**{**DROP, **rock})
    start = P_0 * (4e5 / (K * P_0)) ** (1 / 1.5)

    def force(p):
        way = min(max(p - start, 0.0), 3e-4)
        return K * P_0 * ((p - (1.0 - CHIPPING_SLOPE) * way) / P_0) ** 1.5

    def work(p):
        return quad(force, 0.0, p, points=[start, start + 3e-4], epsrel=1e-12)[0]

    energy = 0.5 * scene.bit.mass * speed**2
    peak = brentq(lambda p: work(p) - energy, 1e-6, 5e-3, xtol=1e-15)
    events = simulate(scene, error_estimate=False).events
    turn = events["value"][events["kind"] == Mode.BC][0]
    assert turn == pytest.approx(force(peak), rel=1e-6)


def test_buttons_share_the_force():
    one = simulate(Scene().replace(**{**DROP, "effects.rock": "power", "run.duration": 0.02}))
    ten = one.scene.replace(**{
        "rock.buttons": 10, "rock.loading_stiffness": one.scene.rock.loading_stiffness / 10.0,
    })  # fmt: skip
    assert simulate(ten).end["hole_depth"] == pytest.approx(one.end["hole_depth"], rel=1e-12)


# -------------------------------------------------------------------- cuttings


@pytest.mark.parametrize("removed", [0.0, 0.3, 0.8, 1.0])
def test_blows_come_to_the_advance_of_their_energy_balance(removed):
    par, s = make(removed=removed)
    energy = 300.0
    for _ in range(300):
        before = float(hole_depth(par, s))
        peak = press(par, s, energy)
    # E = K p^2 [1 - (1 - share)^2 (gamma - 1)/gamma]/2, advance = share P_u
    left = (1.0 - removed) ** 2 * (GAMMA - 1.0) / GAMMA
    steady = math.sqrt(2.0 * energy / (K * (1.0 - left)))
    assert peak == pytest.approx(steady, rel=1e-9)
    advance = removed * (GAMMA - 1.0) / GAMMA * steady
    assert float(hole_depth(par, s)) - before == pytest.approx(advance, rel=1e-9, abs=1e-12)


def flushed(par, depth):
    """What flushing takes of a crater, by eq. 20d."""
    share, exponent = float(par["removed_share"]), float(par["removal_exponent"])
    return min(share * 1e-3 * (depth / 1e-3) ** exponent, depth)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("removal_exponent", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("removed", [0.0, 0.3, 1.0])
def test_by_blow_flushing_leaves_the_share_of_its_law(removed, removal_exponent, exponent):
    """All cuttings stay between the cycles of a blow; after it eq. 20d says what is left."""
    par, s = make(exponent, removed=removed, by=Cuttings.BY_BLOW)
    par["removal_exponent"] = removal_exponent
    press(par, s, 300.0)
    crater, depth, crushed = (float(x) for x in (s["p_u"], hole_depth(par, s), s["e_crushing"]))
    press(par, s, 0.2 * 300.0 / GAMMA)  # a weak cycle of this blow comes back whole
    assert s["e_crushing"] == pytest.approx(crushed, rel=1e-9)
    assert s["p_u"] == pytest.approx(crater, rel=1e-9)
    place = float(s["x_r"] + s["p_u"])
    move_place(par, s, 0.03)
    left = crater - flushed(par, crater)
    assert s["p_u"] == pytest.approx(left, rel=1e-9, abs=1e-18)
    assert s["x_r"] + s["p_u"] == pytest.approx(place, rel=1e-12)
    assert float(hole_depth(par, s)) == pytest.approx(depth, rel=1e-9)
    # up to the peak that would leave so much, the next blow is given back
    if exponent == 1.0 and removed < 1.0:
        peak = left * GAMMA / (GAMMA - 1.0)
        for share, crushes in ((0.99, False), (1.01, True)):
            press(par, s, share * 0.5 * K * peak**2 / GAMMA)
            assert (s["e_crushing"] > crushed * (1.0 + 1e-9)) == crushes


@pytest.mark.parametrize("removed", [0.3, 0.8, 1.0])
def test_by_blow_equal_blows_of_one_cycle_advance_as_by_cycle(removed):
    one, two = make(removed=removed), make(removed=removed, by=Cuttings.BY_BLOW)
    for blow in range(30):
        peaks = [press(par, s, 300.0) for par, s in (one, two)]
        assert peaks[1] == pytest.approx(peaks[0], rel=1e-9)
        move_place(*two, 0.03 * (blow + 1))
        assert hole_depth(*two) == pytest.approx(hole_depth(*one), rel=1e-9)


def test_by_blow_flushing_leaves_what_carries_the_bit():
    par, s = make(removed=0.9, by=Cuttings.BY_BLOW)
    close_interface(par, s, 1.0)
    before, s["p"] = float(s["p"]), 1e-3
    crush(par, s, before)
    move_place(par, s, 0.01)  # rock under load stays as it is
    assert (s["p"], s["x_r"]) == (1e-3, 0.0)
    end_loading(par, s)
    crater = float(s["p_u"])
    s["p"] -= 0.5 * (s["p"] - crater)
    force, place = float(spring_force(par, s)), float(s["x_r"] + s["p"])
    move_place(par, s, 0.03)
    # of a crater this deep a loading to the force has left so much
    assert s["p_u"] == pytest.approx(force / K * (1.0 - 1.0 / GAMMA), rel=1e-9)
    assert s["p_u"] > 0.1 * crater
    assert spring_force(par, s) == pytest.approx(force, rel=1e-9)
    assert s["x_r"] + s["p"] == pytest.approx(place, rel=1e-12)


@pytest.mark.parametrize("unloading", [0.0, 0.5])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_what_is_left_unloads_as_it_was_loaded(exponent, unloading):
    par, s = make(exponent, unloading, chipping=(2e5, 1e-4), removed=0.4)
    press(par, s, 300.0)
    depth = float(hole_depth(par, s))
    # a weak blow on what is left: all of it comes back
    crushed = float(s["e_crushing"])
    weak = 0.2 * 300.0 / GAMMA
    press(par, s, weak)
    assert s["e_crushing"] == pytest.approx(crushed, rel=1e-9)
    assert float(hole_depth(par, s)) == pytest.approx(depth, rel=1e-9)
    assert s["p_u"] == pytest.approx(0.6 * depth, rel=1e-6)


@pytest.mark.parametrize("peak", [1.02, 1.5])
def test_force_energy_and_depth_go_on_where_a_cycle_resumes(peak):
    par, s = make(1.5, 0.3, removed=0.5)
    press(par, s, 300.0)
    close_interface(par, s, 1.0)
    s["p"] = peak * s["reload_from"]

    def now():
        return [float(f(par, s)) for f in (spring_force, recoverable, hole_depth)]

    loaded = now()
    end_loading(par, s)
    assert now() == pytest.approx(loaded, rel=1e-9)
    s["p"] -= 0.3 * (s["p"] - s["p_u"])
    part = now()
    resume_cycle(par, s)
    assert now() == pytest.approx(part, rel=1e-9)


def bounces(scene, removed, cycles):
    """Depth after each drilling cycle of a rigid bit, by a general integrator."""
    mass, feed = scene.bit.mass, scene.feed.force
    x, v, surface, bottom, depths = 0.0, 8.0, 0.0, 0.0, []
    x = -scene.start.rock_gap

    def fly(_, y):
        return [y[1], feed / mass]

    def turns(_, y):
        return y[1]

    for _ in range(cycles):
        found = solve_ivp(
            fly, (0.0, 1.0), [x, v], "DOP853", rtol=1e-12, atol=1e-15,
            events=_ends(lambda _, y, at=bottom: y[0] - at, 1.0),
        )  # fmt: skip
        x, v = found.y[:, -1]
        surface += removed * (bottom - surface)  # eq. 20d
        left = bottom - surface
        reach = GAMMA * left / (GAMMA - 1.0)

        def load_(_, y, surface=surface, left=left, reach=reach):
            p = y[0] - surface
            force = GAMMA * K * (p - left) if p < reach else K * p
            return [y[1], (feed - force) / mass]

        found = solve_ivp(
            load_, (0.0, 1.0), [x, v], "DOP853", rtol=1e-12, atol=1e-15, max_step=1e-6,
            events=_ends(turns, -1.0),
        )  # fmt: skip
        x = found.y[0, -1]
        p = x - surface
        bottom = surface + ((GAMMA - 1.0) / GAMMA * p if p > reach else left)
        depths.append(bottom)

        def unload(_, y, bottom=bottom):
            return [y[1], (feed - GAMMA * K * (y[0] - bottom)) / mass]

        found = solve_ivp(
            unload, (0.0, 1.0), [x, 0.0], "DOP853", rtol=1e-12, atol=1e-15, max_step=1e-6,
            events=_ends(lambda _, y, at=bottom: y[0] - at, -1.0),
        )  # fmt: skip
        x, v = found.y[:, -1]
    return depths


def _ends(function, direction):
    function.terminal, function.direction = True, direction
    return function


@pytest.mark.parametrize("removed", [0.2, 0.7])
def test_a_bouncing_bit_is_that_of_a_general_integrator(removed):
    scene = Scene().replace(
        **{**DROP, **BY_CYCLE, "rock.removed_share": removed, "run.duration": 0.08}
    )
    result = simulate(scene, error_estimate=False)
    wanted = bounces(scene, removed, 3)
    loads = result.events["time"][result.events["kind"] == Mode.FC]
    assert len(loads) > 3
    until = scene.replace(**{"run.duration": float(loads[3]) - 1e-7})
    assert simulate(until).end["hole_depth"] == pytest.approx(wanted[2], rel=1e-6)


@pytest.mark.parametrize("cells", [24, 40])
def test_waves_drill_with_cuttings_as_elements_do(cells):
    """By lumped masses with a law of their own, 50 and 100 in the piston: 14.853, 14.855 mm/s."""
    changes = {**BY_CYCLE, "rock.removed_share": 0.5, "solver.cells": cells}
    result = simulate(Scene().computed_by("wave", **changes), 2.0, record_events=False)
    assert result.summary()["drilling_cycles_per_blow"] == 6.0
    off = abs(result.rate_of_penetration - 14.856e-3)
    assert off < min(0.004e-3, result.rate_of_penetration_error)


def test_full_removal_is_the_law_without_cuttings_to_the_last_bit():
    short = Scene().replace(**{"run.duration": 0.3, "run.settle": 0.1, "solver.name": "wave"})
    full = short.replace(**{**BY_CYCLE, "rock.removed_share": 1.0})
    plain, flushed = (simulate(one, error_estimate=False) for one in (short, full))
    assert plain.blows.tobytes() == flushed.blows.tobytes()
