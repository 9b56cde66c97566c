"""Chains of bars against closed forms.

Waves in whole cells without loss are exact, so that most tolerances here are rounding. Where
the solver takes a mean over a step, the closed form is averaged over it as well; where it takes
what arrives as constant over a step, the order in the time step is measured.

Classical results of one-dimensional waves in bars: B. Lundberg, "Some basic problems in
percussive rock destruction", Chalmers (1971); W. Johnson, "Impact strength of materials" (1972).
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model import Scene
from percussion_model.solvers.wave.taps import turning, weights_of
from tests.core.chain_scenes import (
    AREA,
    C0,
    CELL,
    DT,
    F0,
    ROUNDING,
    Z,
    after,
    bar,
    driven,
    mean_of_exponential,
    rigid,
    sent_down,
    struck,
)

# ----------------------------------------------------------------------- 1: elastic pistons


def test_elastic_striker_of_equal_impedance_sends_a_rectangle():
    """Force Z v/2 for 2 L/c, then the striker rests."""
    v, transit = 8.0, 20
    simulation = struck(bar(transit), bar(150), bar(20), start={"piston_velocity": v})
    found = sent_down(simulation, "rod 1", 100)
    wanted = np.where(np.arange(100) < 2 * transit, Z * v / 2, 0.0)
    np.testing.assert_allclose(found, wanted, atol=ROUNDING * Z * v)
    fields = simulation.fields()
    np.testing.assert_allclose(fields["piston_velocity"], 0.0, atol=ROUNDING * v)
    assert abs(simulation.energy()["residual_relative"]) < 1e-12


@pytest.mark.parametrize("ratio", [0.4, 1.7, 5.0])
def test_striker_of_other_impedance_sends_steps(ratio):
    """Force Z_p Z_r v/(Z_p + Z_r) falls by (Z_p - Z_r)/(Z_p + Z_r) each 2 L/c.

    A striker of lower impedance bounces off after the first transit.
    """
    v, transit, steps = 8.0, 15, 140
    simulation = struck(bar(transit, ratio * AREA), bar(150), bar(20), start={"piston_velocity": v})
    z_p = ratio * Z
    first, factor = z_p * Z / (z_p + Z) * v, max((z_p - Z) / (z_p + Z), 0.0)
    wanted = first * factor ** (np.arange(steps) // (2 * transit))
    found = sent_down(simulation, "rod 1", steps)
    np.testing.assert_allclose(found, wanted, atol=ROUNDING * first)


# ------------------------------------------------------------------------- 2: rigid pistons


def test_rigid_piston_sends_an_exponential():
    """Force Z v exp(-Z t/M); its mean over each step is exact, whatever the step."""
    v, mass, steps = 6.0, 7.5, 120
    simulation = struck(rigid(mass), bar(150), bar(20), start={"piston_velocity": v})
    found = sent_down(simulation, "rod 1", steps)
    wanted = Z * v * mean_of_exponential(Z / mass, steps)
    np.testing.assert_allclose(found, wanted, rtol=1e-10)
    left = simulation.observe()["piston_velocity"]
    assert left == pytest.approx(v * math.exp(-Z * steps * DT / mass), rel=1e-10)


def rigid_on_spring(r, cells, end):
    """Penetrations at all steps up to a time after the wave arrives at the spring."""
    mass, v = 5.0, 6.0
    K = Z * Z / (r * mass)
    simulation = struck(
        rigid(mass), bar(100), bar(100),
        effects={"rock": "spring"}, rock={"loading_stiffness": K},
        start={"piston_velocity": v}, solver={"cells": cells},
    )  # fmt: skip
    dt = simulation.solver.time_step
    t = dt * np.arange(1, int(end / dt) + 1)
    found = simulation.sample(2.0 / C0 + t)["penetration"]
    return t, found, K, 0.5 * mass * v * v, v


@pytest.mark.parametrize("r", [0.25, 1.0, 3.0])
def test_rigid_piston_rod_and_spring_have_the_known_efficiency(r):
    """Work on the spring by the first wave: 4 r^((1+r)/(1-r)), r = Z^2/(K M).

    With a = Z/M and b = K/Z the end obeys x' + b x = 2 v exp(-a t).
    """
    errors, works = [], []
    best = 4 * math.exp(-2) if r == 1 else 4 * r ** ((1 + r) / (1 - r))
    for cells in (50, 100, 200):
        t, found, K, energy, v = rigid_on_spring(r, cells, 3.5e-4)
        a, b = Z / 5.0, K / Z
        if r == 1:
            wanted = 2 * v * t * np.exp(-a * t)
        else:
            wanted = 2 * v * (np.exp(-a * t) - np.exp(-b * t)) / (b - a)
        errors.append(np.abs(found - wanted).max() / wanted.max())
        works.append(abs(0.5 * K * found.max() ** 2 / energy - best))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.01)
    assert errors[-1] < 1e-4
    assert works[-1] < 1e-4


# -------------------------------------------------------------------- 3: rectangles on a spring


def rectangle_on_spring(s, duration=32, steps=64):
    """Spring forces at the steps after a rectangle arrives, with K T/Z = s."""
    K = s * Z / (duration * DT)
    simulation = driven(
        bar(60), bar(60), steps=duration, bottom="rock",
        effects={"rock": "spring"}, rock={"loading_stiffness": K},
    )  # fmt: skip
    t = DT * np.arange(1, steps + 1)
    return t, K * simulation.sample(120 * DT + t)["penetration"], K, simulation


@pytest.mark.parametrize("s", [0.3, 1.2564312086, 4.0])
def test_rectangle_on_a_spring(s):
    """F = 2 F0 (1 - exp(-K t/Z)) while it lasts, then that fades; work 2 (1 - exp(-s))^2/s."""
    t, found, K, simulation = rectangle_on_spring(s)
    T = 32 * DT
    wanted = -2 * F0 * np.expm1(-K * np.minimum(t, T) / Z) * np.exp(-K / Z * np.maximum(t - T, 0))
    np.testing.assert_allclose(found, wanted, rtol=1e-9)
    came = F0 * F0 * T / Z
    efficiency = 2 * math.expm1(-s) ** 2 / s
    assert found.max() ** 2 / (2 * K) / came == pytest.approx(efficiency, rel=1e-9)
    assert simulation._state.record[0]["i_came"] == pytest.approx(came, rel=1e-9)


def test_best_rectangle_on_a_spring_gives_four_fifths():
    """Greatest where exp(s) = 1 + 2 s: 0.8145 at K T/Z = 1.2564."""
    s = 1.0
    for _ in range(100):
        s = math.log1p(2 * s)
    assert s == pytest.approx(1.2564, abs=1e-4)
    works = []
    for factor in (0.99, 1.0, 1.01):
        _, found, K, _ = rectangle_on_spring(factor * s)
        works.append(found.max() ** 2 / (2 * K) * Z / (F0 * F0 * 32 * DT))
    assert works[1] == pytest.approx(0.814529, abs=1e-6)
    assert works[0] < works[1] > works[2]


# --------------------------------------------------------------------------- 4: growing wave


@pytest.mark.parametrize("steps", [40, 80, 160])
def test_growing_wave_is_taken_almost_whole(steps):
    """A wave F0 exp(K t/Z) for T gives 1 - exp(-2 K T/Z) of its energy to the spring.

    By superposition: a spring that a wave of one step has pushed stays in contact and pushes
    back for good, so that the response is linear. Waves of one step are means of the wave over
    it, what is lost by that is of the second order.
    """
    s = 1.5  # K T/Z
    _, answer, K, _ = rectangle_on_spring(s / steps, duration=1, steps=steps)
    rate = K / Z
    wave = np.exp(rate * steps * DT) * mean_of_exponential(rate, steps)[::-1]
    force = np.convolve(wave, answer)[:steps]  # the answer is to F0
    t = DT * np.arange(1, steps + 1)
    shape = F0 * (np.exp(rate * t) - np.exp(-rate * t))
    error = np.abs(force - shape).max() / shape.max()
    came = F0 * F0 / (2 * K) * math.expm1(2 * s)
    efficiency = force[-1] ** 2 / (2 * K) / came
    assert error < 0.2 * (s / steps) ** 2
    assert abs(efficiency - (1 - math.exp(-2 * s))) < 0.2 * (s / steps) ** 2


# ------------------------------------------------------------------------------- 5: open ends


@pytest.mark.parametrize("force", [F0, -F0])
def test_open_ends_send_nothing_back(force):
    """A wave comes in by one end and leaves by the other, and the ledger says so."""
    duration = 25
    simulation = driven(bar(40), bar(40), steps=duration, force=force)
    energy = F0 * F0 * duration * DT / Z
    fields = after(simulation, 60)
    assert simulation.energy()["ends"] == pytest.approx(-energy, rel=1e-11)
    assert simulation.energy()["stored"] == pytest.approx(energy, rel=1e-11)
    fields = after(simulation, 81 + duration)
    for name, values in fields.items():
        scale = F0 if name.endswith("force") else F0 / Z
        np.testing.assert_allclose(values, 0.0, atol=ROUNDING * scale)
    assert simulation.energy()["ends"] == pytest.approx(0.0, abs=1e-11 * energy)


def test_wave_that_an_impedance_sends_back_leaves_by_the_top():
    """What comes back from below goes out above, without a third wave."""
    simulation = driven(bar(40), bar(40, 3 * AREA), steps=10)
    came = F0 * F0 * 10 * DT / Z
    after(simulation, 70)  # a part is on its way up, the other on its way down
    stored = simulation.energy()["stored"]
    assert stored == pytest.approx(came, rel=1e-11)
    after(simulation, 100)
    assert simulation.energy()["stored"] == pytest.approx(0.0, abs=1e-11 * came)


def test_free_top_doubles_what_comes_up_and_open_top_does_not():
    """A pulse from a free top goes down alike; what comes back up is sent down again."""
    for top, twice in (("free", 1.0), ("open", 0.0)):
        end = {"top": top, "pulse_force": F0, "pulse_duration": 10 * DT, "bottom": "open"}
        simulation = struck(
            bar(40), bar(60, 3 * AREA), piston={"model": "absent"}, string=end
        )  # fmt: skip
        force = after(simulation, 115)["rod 1_force"]
        # of (Z2 - Z1)/(Z1 + Z2) F0 that came back, with the other sign
        np.testing.assert_allclose(force[25:35], -0.5 * F0 * twice, atol=ROUNDING * F0)


# --------------------------------------------------------------- 6: odd lengths, and loss


@pytest.mark.parametrize("part", [0.0, 0.013, 0.37, 0.5, 0.999])
def test_wave_through_an_odd_length_comes_on_time(part):
    """The centre of a wave comes L/c later however the length lies between the steps."""
    length = 23 + part
    simulation = driven(bar(40), bar(length), bar(120), steps=3)
    found = sent_down(simulation, "bit", 110)
    t = np.arange(110)
    assert found.sum() == pytest.approx(3 * F0, rel=1e-11)
    assert found @ t / found.sum() - 1.0 == pytest.approx(40 + length, rel=1e-11)
    ledger = simulation.energy()
    assert abs(ledger["residual"]) < 1e-11 * abs(ledger["ends"])
    lost = DT / Z * (3 * F0 * F0 - found @ found)  # by mixing what was sent in several steps
    taken = ledger["numerical"] + ledger["loss"]
    assert taken == pytest.approx(lost, rel=1e-9, abs=1e-11 * abs(ledger["ends"]))
    assert lost > -1e-11 * abs(ledger["ends"])


def test_loss_that_is_off_takes_nothing():
    """What an odd length takes where loss is off is numerical."""
    simulation = driven(bar(40), bar(23.37), bar(120), steps=3)
    after(simulation, 110)
    ledger = simulation.energy()
    assert ledger["numerical"] > 0.0
    assert ledger["loss"] == 0.0


@pytest.mark.parametrize("transit", [1.0, 2.02, 2.5, 3.7, 20.01, 20.5, 57.93])
@pytest.mark.parametrize("variance", [0.0, 0.02, 0.3, 2.0])
def test_weights_keep_time_and_make_no_energy(transit, variance):
    """Weights have the sum one and the mean T/dt, and let no frequency grow."""
    delay, weights, spread = weights_of(transit, variance)
    times = delay + np.arange(len(weights))
    assert delay >= 1
    assert weights.sum() == pytest.approx(1.0, abs=1e-14)
    assert weights @ times == pytest.approx(transit, rel=1e-12)
    assert weights @ (times - transit) ** 2 == pytest.approx(spread, abs=1e-9)
    if variance <= 0.25 * transit and transit > 3:
        assert spread == pytest.approx(variance, abs=1e-9)
    if variance > 0.0 and transit > 20:
        third = 2.25 * variance**2 / transit
        assert weights @ (times - transit) ** 3 == pytest.approx(third, abs=1e-9)
    w = np.linspace(0.0, math.pi, 200)
    assert np.abs(np.exp(-1j * np.outer(w, times)) @ weights).max() < 1 + 1e-13


@pytest.mark.parametrize("transit", [1.01, 1.3, 1.5, 1.97])
def test_a_section_of_one_to_two_steps_turns_waves_and_takes_nothing(transit):
    """Its delay is right where waves are long, and its gain is one everywhere."""
    a = turning(transit)
    w = np.linspace(1e-3, math.pi, 200)
    z = np.exp(-1j * w)
    response = z * (a + z) / (1.0 + a * z)
    assert np.abs(response) == pytest.approx(1.0, abs=1e-13)
    assert -np.angle(response[0]) / w[0] == pytest.approx(transit, rel=1e-6)


@pytest.mark.parametrize("cells", [200, 400, 800])
def test_finer_cells_keep_their_loss(cells):
    """The reference loss time in 0.2 m of steel: the gain at 50 mm, whatever the cells."""
    eta, transit = Scene().loss.time, 0.2 / C0
    dt = transit / cells
    delay, weights, spread = weights_of(float(cells), eta * transit / dt**2)
    assert spread == pytest.approx(eta * transit / dt**2, rel=1e-9)
    w = 2 * math.pi * C0 / 0.05
    gain = abs(np.exp(-1j * w * dt * (delay + np.arange(len(weights)))) @ weights)
    assert gain == pytest.approx(math.exp(-0.5 * eta * w * w * transit), rel=2e-2)


@pytest.mark.parametrize("eta", [2e-7, 1e-6])
@pytest.mark.parametrize("length", [0.6, 0.6037])
def test_loss_dampens_a_sine_as_kelvin_voigt_steel_does(eta, length):
    """A wave of angular frequency w arrives by exp(-i w T / sqrt(1 + i eta w)) of itself.

    The answer to a wave of one step, as a Fourier sum: what a burst of any length comes to.
    """
    simulation = driven(
        bar(40), {"sections": [{"length": length, "area": AREA}]}, bar(200), steps=1,
        effects={"loss": True}, loss={"time": eta},
    )  # fmt: skip
    # the rod above and the one below have loss as well
    steps = 1 + 40 + 60 + 99
    came = sent_down(simulation, "bit", steps) / F0
    path = 40 * CELL + length
    for wavelength in (200 * CELL, 50 * CELL, 25 * CELL):
        w = 2 * math.pi * C0 / wavelength
        found = came @ np.exp(-1j * w * DT * np.arange(steps))
        exact = np.exp(-1j * w * path / C0 / np.sqrt(1 + 1j * eta * w))
        # weights on steps differ from that distribution by the fourth order
        fourth = (0.016 + 0.35 * (eta / DT) ** 3) * (w * DT) ** 4 * path / CELL
        assert abs(found) == pytest.approx(abs(exact), rel=fourth + 1e-12)
        # and a part of a step is Lagrange's cubic, the third moment of loss one of differences
        third = 0.1 * (eta / DT) ** 2 * (w * DT) ** 5 * path / CELL
        assert abs(np.angle(found / exact)) < 3e-3 * (w * DT) ** 5 + third + 1e-12
    ledger = simulation.energy()
    assert ledger["loss"] > 0.0
    assert abs(ledger["residual"]) < 1e-11 * abs(ledger["ends"])
