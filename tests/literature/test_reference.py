"""The reference drill, its trends and its endurance, against the paper.

The paper prints a period of 45.5 ms and two contacts a blow. Rate and period are the
limit that refined waves and refined finite elements share (docs/data/accuracy.md, section 2).
"""

from __future__ import annotations

import math
import os

import numpy as np
import pytest

from percussion_model import Result, Scene, Simulation, simulate

RATE, PERIOD = 0.0163494, 0.0455948
# Power laws of Fig. 9, and how far the exponents may be off.
EXPONENT_K, EXPONENT_D, NEAR = -0.55, -0.36, 0.03


def rate(scene=None, duration=2.5, **changes):
    """Rate of penetration after half a second [m/s]."""
    scene = (scene or Scene()).replace(**changes)
    return simulate(scene, duration, settle=0.5, record_events=False).rate_of_penetration


@pytest.mark.parametrize("solver", ["wave", "modal"])
def test_reference(solver, reference_by_waves, reference):
    found = {one.solver: one for one in (reference_by_waves, reference)}[solver]
    summary = found.summary()
    assert summary["rate_of_penetration"] == pytest.approx(RATE, rel=3e-4)
    assert summary["blow_period"] == pytest.approx(PERIOD, rel=1e-4)
    assert summary["contacts_per_blow"] == 2
    assert summary["standstill_bit_force"] == pytest.approx(2586.9, rel=1e-3)
    assert summary["warnings"] == []
    assert abs(summary["energy"]["residual_relative"]) < 1e-6
    if solver == "wave":
        assert 0 < summary["energy"]["numerical_relative"] < 3e-4
    else:
        assert 0 <= summary["energy"]["numerical_relative"] < 1e-8
    assert len(found.counted) > 60


def test_finer_cells_do_not_change_the_answer(reference_by_waves):
    """And less is lost to averaging the finer they are."""
    waves = reference_by_waves
    default = waves.cells["piston"]
    lost = [waves.energy["numerical_relative"]]
    whole = rate(waves.scene)
    for factor in (2, 4):
        scene = waves.scene.replace(**{"solver.cells": factor * default})
        result = simulate(scene, 2.5 if factor == 2 else 1.0, settle=0.5)
        compared = whole if factor == 2 else rate(waves.scene, duration=1.0)
        assert result.rate_of_penetration == pytest.approx(compared, rel=3e-4)
        lost.append(result.energy["numerical_relative"])
    assert lost[0] > lost[1] > lost[2] > 0


def test_rate_rises_with_feed():
    rates = [rate(**{"feed.force": force}) for force in (500.0, 1e3, 2.5e3, 5e3, 1e4, 2e4)]
    assert np.all(np.diff(rates) > 0)


def exponent(values, rates):
    return float(np.polyfit(np.log(values), np.log(rates), 1)[0])


@pytest.mark.parametrize("solver", ["wave", "modal", "rigid"])
def test_exponent_of_loading_stiffness(solver):
    """Fig. 9a, from soft rock to 1.6 times the reference."""
    values = np.array([1.0, 2.0, 4.0, 7.5, 12.0]) * 1e8
    base = Scene().computed_by(solver)
    rates = [rate(base, **{"rock.loading_stiffness": float(k)}) for k in values]
    assert exponent(values, rates) == pytest.approx(EXPONENT_K, abs=NEAR)
    assert np.all(np.diff(rates) < 0)


@pytest.mark.parametrize("solver", ["wave", "modal", "rigid"])
def test_exponent_of_reversal_distance_at_constant_power(solver):
    """Fig. 9d: F_0^3 D_1 stays as it is; periodic above 3 mm."""
    values = np.array([4.0, 8.0, 20.0, 40.0, 80.0]) * 1e-3
    base = Scene().computed_by(solver)
    rates = []
    for d in values:
        force = 3000.0 * (0.040 / d) ** (1 / 3)
        changes = {"drive.reversal_distance": float(d), "drive.force": force}
        rates.append(rate(base, **changes))
    assert exponent(values, rates) == pytest.approx(EXPONENT_D, abs=NEAR)


def test_undamped_scene_is_finite_and_warns():
    result = simulate(Scene().replace(**{"effects.loss": False}), 1.0, settle=0.2)
    assert math.isfinite(result.rate_of_penetration)
    assert any("structural loss is off" in text for text in result.warnings)
    assert abs(result.energy["residual_relative"]) < 1e-9
    assert result.rate_of_penetration > 2 * RATE


def drill(duration):
    """Every blow of a long run comes when the one before said so."""
    simulation = Simulation(Scene(), record_events=False)
    # the switches of the drive are seen in the impulses of the blows
    simulation.advance(duration)
    blows = simulation.blows
    assert len(blows) == pytest.approx(duration / PERIOD, rel=3e-3, abs=2)
    settled = blows[blows["time"] > 1.0]
    assert np.abs(settled["period"] / PERIOD - 1).max() < 0.02
    assert np.all(settled["contacts"] == 2)
    # up and down phases as long as the stroke asks for: no switch was missed
    expected = settled["drive_impulse"].mean()
    assert np.abs(settled["drive_impulse"] / expected - 1).max() < 0.05
    ends = settled["time"][:-1] + settled["period"][:-1]
    np.testing.assert_allclose(ends, settled["time"][1:], rtol=1e-12)
    last, first = settled[-1], settled[0]
    speed = (last["bit_position"] - first["bit_position"]) / (last["time"] - first["time"])
    assert speed == pytest.approx(RATE, rel=3e-3)
    assert abs(simulation.energy()["residual_relative"]) < 1e-9


def test_a_minute_of_drilling():
    drill(60.0)


@pytest.mark.slow
@pytest.mark.skipif("PERCUSSION_LONG" not in os.environ, reason="set PERCUSSION_LONG=1")
def test_a_thousand_seconds_of_drilling():
    drill(1000.0)


@pytest.fixture(scope="module")
def paper_numerics() -> Result:
    """The paper's own numerics, its defaults: 50 + 58 elements, 5 CFL, K_C = 1e12 N/m."""
    return simulate(Scene().replace(**{"solver.name": "fem"}), 1.5, settle=0.5)


def test_the_paper_s_numerics_give_what_others_found_with_them(paper_numerics):
    """A separate prototype of the same elements and scheme found 16.423 mm/s and 45.673 ms."""
    summary = paper_numerics.summary()
    assert summary["rate_of_penetration"] == pytest.approx(0.016423, rel=2e-3)
    assert summary["blow_period"] == pytest.approx(0.04567, rel=2e-3)
    assert summary["cells"] == {"piston": 50, "bit": 58}
    assert summary["time_step"] == pytest.approx(3.35e-6, rel=2e-3)
    assert abs(summary["energy"]["residual_relative"]) < 1e-8


def test_at_the_cfl_step_the_period_is_that_of_the_waves(paper_numerics, reference_by_waves):
    scene = Scene().replace(**{"solver.name": "fem", "fem.courant": 1.0})
    fine = simulate(scene, 0.6, settle=0.2).summary()
    assert fine["blow_period"] == pytest.approx(0.04560, rel=2e-4)
    waves = reference_by_waves.summary()["blow_period"]
    coarse = paper_numerics.summary()["blow_period"]
    assert abs(fine["blow_period"] - waves) < 0.2 * abs(coarse - waves)


def test_interpenetration_is_that_of_the_paper(paper_numerics):
    """Of the order of 1e-3 mm (section 4.3)."""
    force = paper_numerics.summary()["peak_contact_force"]
    assert force / paper_numerics.scene.fem.contact_stiffness == pytest.approx(1e-6, rel=0.1)
