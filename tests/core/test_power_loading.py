"""The power law of the rock against closed forms, a general integrator and its energies."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from percussion_model import Scene, simulate
from percussion_model.physics.curved_loading import load, time_to_break
from percussion_model.physics.power_law import loading_force, loading_work
from percussion_model.physics.records import Mode, RockKind
from percussion_model.physics.rock import (
    crush,
    end_loading,
    hole_depth,
    recoverable,
    resume_cycle,
    spring_force,
)
from percussion_model.solvers.wave.records import WAVE_PAR, WAVE_STATE

K, GAMMA, REFERENCE, Z = 7.5e8, 5.0, 1e-3, 3e5


def make(exponent: float, unloading: float = 0.0, p: float = 0.0, mode: int = Mode.FC):
    """Parameters and state of a rock by the power law, at a penetration."""
    par, s = np.zeros(1, WAVE_PAR)[0], np.zeros(1, WAVE_STATE)[0]
    par["rock"], par["power"], par["reference_penetration"] = RockKind.BILINEAR, 1, REFERENCE
    par["exponent"], par["unloading_exponent"] = exponent, unloading
    s["mode"], s["p"] = mode, p
    s["k_r"] = s["next_k_r"] = K
    s["gamma"] = s["next_gamma"] = GAMMA
    par["buttons"] = 1.0
    return par, s


@pytest.mark.parametrize("exponent", [1.3, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("start", [0.0, 2e-5, 4e-4])
def test_a_stretch_is_that_of_a_general_integrator(exponent, start):
    par, s = make(exponent, p=start)
    push = 6e5

    def motion(_, y):
        v = (push - K * REFERENCE * (y[0] / REFERENCE) ** exponent) / Z
        return [v, v * v]

    for time in (2e-6, 3e-5, 1e-3):
        found = solve_ivp(motion, (0.0, time), [start, 0.0], "DOP853", rtol=1e-12, atol=1e-18)
        d, q = load(par, s, push, Z, time)
        assert d == pytest.approx(found.y[0, -1] - start, rel=1e-7)
        assert q == pytest.approx(found.y[1, -1], rel=1e-7)


@pytest.mark.parametrize(
    ("exponent", "reference", "stiffness", "z", "chipping"),
    [
        # far beyond the blow; within micrometres; stiff rock under a thin bar
        (1.5, 0.04, 7e10, 2e5, (0.0, 0.0)),
        (4.0, 3e-3, 4e11, 2e5, (0.0, 0.0)),
        (3.0, 1e-6, 7.5e8, 2e5, (0.0, 0.0)),
        (1.5, 1e-3, 3e11, 2e3, (0.0, 0.0)),
        # from next to no stiffness to that of a wall, in the middle of a step
        (1.5, 1e-3, 3e11, 2e3, (4e-8, 5e-5)),
        (4.0, 1e-4, 1e11, 2e5, (4e-8, 5e-5)),
    ],
)
def test_a_stretch_is_right_for_any_rock(exponent, reference, stiffness, z, chipping):
    par, s = make(exponent)
    par["reference_penetration"], s["k_r"] = reference, stiffness
    s["chipping_from"], par["chipping_penetration"] = chipping
    push = 10.0 * z

    def motion(_, y):
        v = (push - float(loading_force(par, s, y[0]))) / z
        return [v, v * v]

    for time in (1e-6, 8e-6, 4e-5):
        settings = {"rtol": 1e-10, "atol": 1e-20, "max_step": 5e-8}
        found = solve_ivp(motion, (0.0, time), [0.0, 0.0], "Radau", **settings)
        d, q = load(par, s, push, z, time)
        assert d == pytest.approx(found.y[0, -1], rel=1e-6)
        assert q == pytest.approx(found.y[1, -1], rel=1e-6)
        given = push * d - z * q
        assert given == pytest.approx(float(loading_work(par, s, d)), rel=1e-6, abs=1e-8 * push * d)


def test_the_square_law_has_a_closed_form():
    # z dp/dt = F - K p^2 / P from p = 0: a hyperbolic tangent
    par, s = make(2.0)
    push = 6e5
    most = math.sqrt(push * REFERENCE / K)
    for time in (1e-6, 1e-5, 1e-4):
        d, _ = load(par, s, push, Z, time)
        assert d == pytest.approx(most * math.tanh(push * time / (Z * most)), rel=1e-9)


def test_the_barrier_breaks_when_its_dashpot_has_taken_its_energy():
    par, s = make(1.5, p=1e-5, mode=Mode.DFC)
    s["c_r"], s["w_r"], s["w"] = 1e4, 0.05, 0.01
    push, rest = 6e5, 3e-5
    _, square = load(par, s, push, Z + 1e4, rest)
    t = time_to_break(par, s, push, Z + 1e4, rest, square)
    _, q = load(par, s, push, Z + 1e4, t)
    assert 0.0 < t < rest
    assert s["w"] + s["c_r"] * q == pytest.approx(s["w_r"], rel=1e-10)


@pytest.mark.parametrize("unloading", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0])
def test_loading_is_crushed_or_given_back(exponent, unloading):
    par, s = make(exponent, unloading)
    crushed = 0.0
    for p in np.linspace(1e-6, 2e-3, 40):
        before, s["p"] = s["p"], p
        crushed += crush(par, s, before)
        assert crush(par, s, before) >= -1e-12 * loading_work(par, s, p)
    assert crushed + recoverable(par, s) == pytest.approx(loading_work(par, s, s["p"]), rel=1e-12)


@pytest.mark.parametrize("unloading", [0.0, 0.5])
@pytest.mark.parametrize("exponent", [1.5, 3.0])
def test_force_energy_and_depth_go_on_where_the_mode_changes(exponent, unloading):
    par, s = make(exponent, unloading, p=8e-4)

    def now():
        return [float(f(par, s)) for f in (spring_force, recoverable, hole_depth)]

    loaded = now()
    end_loading(par, s)
    assert now() == pytest.approx(loaded, rel=1e-12)
    s["p"] -= 0.3 * (s["p"] - s["p_u"])  # unloaded in part, on a straight line
    part = now()
    assert part == pytest.approx([0.7 * loaded[0], 0.49 * loaded[1], loaded[2]], rel=1e-12)
    resume_cycle(par, s)
    assert s["mode"] == Mode.FC
    assert now() == pytest.approx(part, rel=1e-12)
    assert float(loading_force(par, s, s["p"])) == pytest.approx(part[0], rel=1e-12)


def test_the_part_that_is_given_back_falls_with_the_peak():
    shares = []
    for peak in (2e-4, 1e-3, 2e-3):
        par, s = make(1.5, 0.5, p=peak)
        end_loading(par, s)
        shares.append((s["p"] - s["p_u"]) / peak)
    # 1/gamma at the reference penetration, whose force is K times it
    assert shares[1] == pytest.approx(1.0 / GAMMA, rel=1e-12)
    assert shares[2] == pytest.approx(2.0 ** (-1.5 * 0.5) / GAMMA, rel=1e-12)
    assert shares[0] > shares[1] > shares[2]


@pytest.mark.parametrize("exponent", [1.5, 3.0])
def test_rigid_bodies_crush_what_the_law_does_not_give_back(exponent):
    """Of a drop W all but (n + 1)/(2 gamma) W; following lines takes nothing and gives nothing."""
    scene = Scene().replace(**{
        "piston.model": "absent", "bit.model": "rigid", "effects.drive": "none",
        "effects.gravity": False, "effects.feed": False, "effects.barrier": False,
        "effects.rock": "power", "rock.loading_exponent": exponent, "start.bit_velocity": 8.0,
    })  # fmt: skip
    result = simulate(scene, 0.01, settle=0.0, error_estimate=False)
    drop = 32.0 * scene.bit.mass
    left = 1.0 - (exponent + 1.0) / (2.0 * scene.rock.unloading_ratio)
    assert result.energy["crushing"] == pytest.approx(left * drop, rel=1e-5)
    assert result.energy["numerical"] == 0.0
    assert abs(result.energy["residual_relative"]) < 1e-12
