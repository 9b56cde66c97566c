"""A casing below a rod, and its shoulder (components/shoulder.py), against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.integrate import solve_ivp

from percussion_model import Scene, Simulation
from percussion_model.components.shoulder import DEGREES, follow
from percussion_model.solvers.rigid.records import RIGID_PAR, RIGID_STATE

MASS, IMPEDANCE, SPAN, FORCE = 40.0, 97444.0, 5e-4, 3000.0
PLACES, WEIGHTS = legendre.leggauss(40)
SQUARES = 1.0 / (2.0 * np.arange(DEGREES) + 1.0)


def casing(**values):
    """A casing that no shoulder holds back."""
    par, s = np.zeros(1, RIGID_PAR)[0], np.zeros(1, RIGID_STATE)[0]
    par["shoulder_casing_mass"], s["shoulder_impedance"] = MASS, IMPEDANCE
    par["shoulder_stiffness"], par["shoulder_step"], par["mass_b"] = 1.0, 2e-5, 8.69
    s["shoulder_wave_span"], s["feed"] = SPAN, FORCE
    for name, value in values.items():
        s[name] = value
    return par, s


def give(s, shares, begin=0.0):
    s["shoulder_wave_begin"] = begin
    for k, share in enumerate(shares):
        s[f"shoulder_wave_{k + 1}"] = share


def returned(s):
    return np.array([s[f"shoulder_returned_{k + 1}"] for k in range(DEGREES)])


def go(par, s, *pieces):
    s["path_b"] = 1.0  # far below: the shoulder does not touch
    for h in pieces:
        follow(par, s, h)


def exact(shares, velocity=0.0, force=FORCE):
    """Velocity and way at places of a step, by a general integrator."""
    times = 0.5 * SPAN * (PLACES + 1.0)

    def rates(t, y):
        down = legendre.legval(2.0 * t / SPAN - 1.0, shares)
        return [(IMPEDANCE * (2.0 * down - y[0]) + force) / MASS, y[0], y[0] * (2.0 * down - y[0])]

    found = solve_ivp(
        rates, (0.0, SPAN), [velocity, 0.0, 0.0], "DOP853", [*times, SPAN], rtol=1e-12, atol=1e-15
    )
    return found.y


def test_a_steady_force_brings_the_casing_to_the_speed_that_the_rod_takes():
    par, s = casing()
    give(s, [0.0] * DEGREES)
    go(par, s, *[SPAN / 7] * 7)
    faded = math.exp(-IMPEDANCE * SPAN / MASS)
    assert s["shoulder_velocity"] == pytest.approx(FORCE / IMPEDANCE * (1.0 - faded), rel=1e-12)
    way = FORCE / IMPEDANCE * (SPAN - MASS / IMPEDANCE * (1.0 - faded))
    assert s["shoulder_position"] == pytest.approx(way, rel=1e-12)


@pytest.mark.parametrize("pieces", [[SPAN], [2e-5] * 25, [3.1e-4, 1e-9, 1.9e-4 - 1e-9]])
def test_any_wave_moves_the_casing_as_a_general_integrator_has_it(pieces):
    shares = np.random.default_rng(3).normal(0.0, 0.02, DEGREES)
    par, s = casing(shoulder_velocity=0.03)
    give(s, shares)
    go(par, s, *pieces)
    v, way, work = exact(shares, velocity=0.03)
    assert s["shoulder_velocity"] == pytest.approx(v[-1], rel=1e-10)
    assert s["shoulder_position"] == pytest.approx(way[-1], rel=1e-10)
    assert s["shoulder_rod_work"] == pytest.approx(IMPEDANCE * work[-1], rel=1e-9)
    up = v[:-1] - legendre.legval(PLACES, shares)
    projection = (
        (up * WEIGHTS) @ legendre.legvander(PLACES, DEGREES - 1) * (np.arange(DEGREES) + 0.5)
    )
    np.testing.assert_allclose(returned(s), projection, rtol=0.0, atol=2e-5 * np.abs(up).max())


def test_the_port_never_makes_energy():
    rng, lost, off = np.random.default_rng(7), [], []
    for _ in range(200):
        shares = rng.normal(0.0, 0.05, DEGREES)
        par, s = casing(shoulder_velocity=rng.normal(0.0, 0.1), feed=rng.normal(0.0, 1e5))
        give(s, shares)
        go(par, s, *[SPAN / 4] * 4)
        energy = IMPEDANCE * SPAN * np.array([shares**2 @ SQUARES, returned(s) ** 2 @ SQUARES])
        lost.append((energy[0] - energy[1] - s["shoulder_rod_work"]) / energy.sum())
        gone_up = IMPEDANCE * SPAN * s["shoulder_returned_square"]
        off.append(abs(energy[0] - gone_up - s["shoulder_rod_work"]) / energy.sum())
    assert min(lost) > -1e-12
    assert max(off) < 1e-12


def test_a_step_that_ends_late_gives_the_rest_back_with_the_next():
    """Momentum and energy are kept, though the rest was moved by a wave that was over."""
    par, s = casing()
    first, second = np.zeros((2, DEGREES))
    first[:3], second[:2] = (0.01, 0.002, 0.001), (0.014, 0.001)
    give(s, first)
    go(par, s, SPAN + 3e-6)
    up, squared, way = returned(s)[0], s["shoulder_returned_square"], s["shoulder_position"]
    give(s, second, begin=SPAN)
    go(par, s, SPAN - 3e-6)
    assert 0.0 < way < s["shoulder_position"]
    down = first + second
    pushed = IMPEDANCE * SPAN * (down[0] - up - returned(s)[0])
    got = MASS * s["shoulder_velocity"] - 2.0 * SPAN * FORCE
    assert pushed == pytest.approx(got, abs=1e-6 * abs(IMPEDANCE * SPAN * down[0]))
    energy = IMPEDANCE * SPAN * (first**2 @ SQUARES + second**2 @ SQUARES)
    gone_up = IMPEDANCE * SPAN * (squared + s["shoulder_returned_square"])
    assert energy - gone_up == pytest.approx(s["shoulder_rod_work"], abs=1e-12 * energy)


def test_clocks_do_not_part_in_an_hour():
    """A sum of times after 3600 s would be off by 2e-10 s in each step."""
    par, s = casing()
    s["shoulder_returned_begin"] = s["shoulder_now_begin"] = s["shoulder_returned_until"] = 3600.0
    give(s, [0.0] * DEGREES, begin=3600.0)
    go(par, s, *[SPAN / 2000] * 2000)
    assert s["shoulder_returned_until"] == pytest.approx(3600.0 + SPAN, abs=1e-12)


SCENE = {
    "feed.force": 0.0, "effects.shoulder": True, "shoulder.impedance": IMPEDANCE,
    "shoulder.start_force": 3000.0, "shoulder.wave_1": 0.01334,
}  # fmt: skip


@pytest.mark.parametrize("solver", ["modal", "wave", "rigid", "fem"])
def test_what_the_casing_loses_the_bit_gets(solver):
    scene = Scene().computed_by(solver).replace(**SCENE)
    simulation = Simulation(scene, record_events=False)
    end = 4e-3
    simulation.advance(end)
    seen = simulation.observe()
    weight = MASS * scene["gravity.acceleration"]
    # a wave that stays as it is
    rod = IMPEDANCE * (2.0 * 0.01334 * end - seen["shoulder_position"])
    lost = weight * end + rod - seen["recoil_impulse"] - MASS * seen["shoulder_velocity"]
    mass = scene.bit.mass
    got = mass * (seen["bit_velocity"] - scene["gravity.acceleration"] * end)
    got += seen["bit_impulse"] - seen["contact_impulse"]
    assert got == pytest.approx(lost, rel=1e-3)
    assert simulation.energy()["residual_relative"] == pytest.approx(0.0, abs=1e-9)


def test_a_casing_without_a_rod_rests_on_the_shoulder_under_feed_and_weight():
    off = {"effects.drive": "none", "piston.model": "absent", "start.rock_gap": 0.0}
    off |= {"shoulder.damping": 4000.0}  # critical
    scene = Scene().computed_by("rigid").replace(**{"effects.shoulder": True, **off})
    simulation = Simulation(scene, record_events=False)
    simulation.advance(1.0)
    seen, g = simulation.observe(), scene["gravity.acceleration"]
    assert seen["shoulder_push"] == pytest.approx(scene["feed.force"] + MASS * g, rel=1e-3)
    assert seen["bit_force"] == pytest.approx(seen["shoulder_push"] + scene.bit.mass * g, rel=1e-3)
