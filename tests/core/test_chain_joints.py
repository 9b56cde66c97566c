"""Joints between bars against closed forms; what is sent and met in whole cells is exact."""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model.solvers.wave.records import Has
from tests.core.chain_scenes import (
    AREA,
    CELL,
    DT,
    F0,
    ROUNDING,
    Z,
    after,
    bar,
    driven,
    mean_of_exponential,
    of_joint,
    sent_down,
)


def at_joint(first, ratio=1.0, force=F0, steps=1000, run=140):
    """Force that passes the joint below a rod and that comes back, in each step since arrival.

    The rod has 60 cells and the bit more, of another cross-section.
    """
    simulation = driven(first, bar(200, ratio * AREA), steps=steps, force=force)
    passed = sent_down(simulation, "bit", 60 + run)[60:]
    # up-going waves of the last steps, beside the incident wave
    count = min(run, 60)
    back = simulation.fields()["rod 1_force"][-count:] - force
    return simulation, passed, back


def test_equal_bars_pass_everything():
    """A perfect joint of equal bars is not there."""
    _, passed, back = at_joint(bar(60))
    np.testing.assert_allclose(passed, F0, rtol=ROUNDING)
    np.testing.assert_allclose(back, 0.0, atol=ROUNDING * F0)


@pytest.mark.parametrize("kind", ["perfect", "contact", "threaded"])
@pytest.mark.parametrize("ratio", [0.3, 2.5])
def test_other_impedance_sends_back_a_part(kind, ratio):
    """Force passes by 2 Z2/(Z1 + Z2) and comes back by (Z2 - Z1)/(Z1 + Z2)."""
    simulation, passed, back = at_joint(bar(60, joint=kind), ratio)
    np.testing.assert_allclose(passed, 2 * ratio / (1 + ratio) * F0, rtol=ROUNDING)
    np.testing.assert_allclose(back, (ratio - 1) / (1 + ratio) * F0, rtol=ROUNDING)
    assert abs(simulation.energy()["residual"]) < 1e-10


@pytest.mark.parametrize("ratio", [0.3, 2.5])
def test_sections_of_a_bar_are_as_a_perfect_joint(ratio):
    """The same where the cross-section changes within a bar."""
    sections = [{"length": 60 * CELL, "area": AREA}, {"length": 60 * CELL, "area": ratio * AREA}]
    simulation = driven({"sections": sections}, bar(80, ratio * AREA), steps=1000)
    force = after(simulation, 100)["rod 1_force"]
    np.testing.assert_allclose(force[60:100], 2 * ratio / (1 + ratio) * F0, rtol=ROUNDING)
    np.testing.assert_allclose(force[20:60] - F0, (ratio - 1) / (1 + ratio) * F0, rtol=ROUNDING)


@pytest.mark.parametrize("share", [0.2, 0.85])
@pytest.mark.parametrize("ratio", [1.0, 2.5])
def test_lossy_joint_passes_a_share_and_relaxes(share, ratio):
    """A front passes by its share, a lasting wave as by a perfect joint: (1 - (1 - T) exp(-t/tau)).

    Both signs, and what comes back is the rest of the force at the joint.
    """
    tau = 30 * DT
    first = bar(60, joint="lossy", transmission=share, relaxation=tau)
    wanted = 2 * ratio / (1 + ratio) * (1 - (1 - share) * mean_of_exponential(1 / tau, 140))
    for sign in (1, -1):
        simulation, passed, back = at_joint(first, ratio, sign * F0)
        np.testing.assert_allclose(passed, sign * F0 * wanted, rtol=1e-10)
        np.testing.assert_allclose(back, sign * F0 * (wanted[-60:] - 1), atol=1e-10 * F0)
        assert abs(simulation.energy()["residual"]) < 1e-10
        assert simulation.energy()["joints"] > 0.0


def test_lossy_joint_takes_what_a_dashpot_takes():
    """The dashpot c beside a spring K takes c v^2 = c (Y G exp(-t/tau))^2.

    G is by how much the force at first differs from the last one.
    """
    share, tau, run = 0.4, 30 * DT, 100
    simulation, _, _ = at_joint(bar(60, joint="lossy", transmission=share, relaxation=tau), run=run)
    y = 2 / Z
    damping = share / ((1 - share) * y)
    speed = y * (1 - share) * F0
    taken = damping * speed**2 * tau / 2 * -math.expm1(-2 * run * DT / tau)
    assert simulation.energy()["joints"] == pytest.approx(taken, rel=1e-10)


def test_contact_passes_compression_and_sends_tension_back():
    """To tension the joint is a free end, whose gap grows by 2 F0/Z."""
    simulation, passed, back = at_joint(bar(60, joint="contact"), force=-F0, run=50)
    np.testing.assert_array_equal(passed, 0.0)
    np.testing.assert_allclose(back, F0, rtol=ROUNDING)
    assert of_joint(simulation, Has.CLOSED) == 0.0
    assert of_joint(simulation, Has.GAP) == pytest.approx(2 * F0 / Z * 50 * DT, rel=1e-10)


@pytest.mark.parametrize("kind", ["contact", "threaded"])
def test_gap_holds_a_wave_up_until_it_is_closed(kind):
    """The end is free for g Z/(2 F0), within a step at last; what comes later passes."""
    gap = 2 * F0 / Z * 12.3 * DT
    simulation, passed, _ = at_joint(bar(60, joint=kind, gap=gap))
    wanted = F0 * np.concatenate([np.zeros(12), [0.7], np.ones(127)])
    np.testing.assert_allclose(passed, wanted, atol=1e-9 * F0)
    assert (of_joint(simulation, Has.CLOSED), of_joint(simulation, Has.GAP)) == (1.0, 0.0)


@pytest.mark.parametrize("ratio", [1.0, 0.5])
def test_preload_lets_tension_pass_up_to_it(ratio):
    """A joint that its thread pulls together by P passes tension to P, and more of it to P."""
    whole = 2 * ratio / (1 + ratio) * F0  # what would pass a perfect joint
    for preload, closed in ((1.01 * whole, 1.0), (0.6 * whole, 0.0)):
        first = bar(60, joint="threaded", preload=preload)
        simulation, passed, back = at_joint(first, ratio, -F0)
        force = -min(whole, preload)
        np.testing.assert_allclose(passed, force, rtol=ROUNDING)
        np.testing.assert_allclose(back, force + F0, atol=ROUNDING * F0)
        assert of_joint(simulation, Has.CLOSED) == closed
        speed = 2 * F0 / Z - (1 + 1 / ratio) / Z * -force  # with which the shoulders part
        wanted = 0.0 if closed else speed * 140 * DT
        assert of_joint(simulation, Has.GAP) == pytest.approx(wanted, rel=1e-9)
        assert abs(simulation.energy()["residual"]) < 1e-10


@pytest.mark.parametrize("ratio", [1.0, 0.5])
def test_thread_of_parted_shoulders_pulls_like_a_spring(ratio):
    """Force -(P + k g) tends from -P to that of a perfect joint by exp(-Y k t)."""
    whole, y = 2 * ratio / (1 + ratio) * F0, (1 + 1 / ratio) / Z
    preload, k = 0.4 * whole, 1 / (y * 25 * DT)
    first = bar(60, joint="threaded", preload=preload, thread_stiffness=k)
    simulation, passed, _ = at_joint(first, ratio, -F0)
    fade = mean_of_exponential(y * k, 140)
    np.testing.assert_allclose(passed, -whole + (whole - preload) * fade, rtol=1e-10)
    gap = (whole - preload) / k * -math.expm1(-y * k * 140 * DT)
    assert of_joint(simulation, Has.GAP) == pytest.approx(gap, rel=1e-10)
    assert abs(simulation.energy()["residual"]) < 1e-10


def test_thread_closes_its_shoulders_again():
    """After a wave of tension a thread pulls the shoulders together by Y P, then carries more.

    Without stiffness the gap grows by 2 F0/Z - Y P for T and falls by Y P.
    """
    preload, duration = 0.75 * F0, 30
    first = bar(60, joint="threaded", preload=preload)
    simulation, passed, _ = at_joint(first, force=-F0, steps=duration, run=120)
    opened, closing = 2 * F0 / Z - 2 / Z * preload, 2 / Z * preload
    until = duration + opened * duration / closing  # 40 steps
    t = np.arange(120)
    np.testing.assert_allclose(passed, np.where(t < until - 0.5, -preload, 0.0), atol=1e-9 * F0)
    assert of_joint(simulation, Has.CLOSED) == 1.0
