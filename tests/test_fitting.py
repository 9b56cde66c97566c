"""Fits to measurements: known parameters come back, within intervals that tell the truth."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest
from fitting_data import BARRIER, CURVE, DATUM, RATIO, STIFFNESS, bit, drops, noisy_curve, way
from scipy.stats import binom, chi2

from percussion_model import Scene
from percussion_model.analysis.fitting import (
    ROCK,
    DropTest,
    FitError,
    bilinear_force,
    fit_drop_tests,
    fit_force_penetration,
)
from percussion_model.analysis.fitting.least_squares import (
    CountedModel,
    profile_intervals,
    student_width,
)

CONFIDENCE = 0.95
# Of that many trials so many cover, but for one chance in a thousand on either side.
CHANCE = 1e-3
LONG, WHY = "PERCUSSION_LONG" in os.environ, "takes minutes: PERCUSSION_LONG=1 runs it"


def plausible(covered, trials):
    """Whether intervals of the stated confidence cover so often by chance."""
    low, high = binom.ppf([CHANCE, 1.0 - CHANCE], trials, CONFIDENCE)
    return low <= covered <= high


def right_size(deviations, factor=1.0):
    """Whether intervals have the width that the scatter of the estimates asks for, but for chance.

    Intervals that are far too wide cover always, which is no rare thing in so few trials. Their
    widths tell: deviations by them have a variance of one, and their squares sum to chi-square.

    Parameters
    ----------
    deviations : sequence of float
        Of estimates from the truth, in standard errors as the intervals have them.
    factor : float
        Takes intervals so many times as wide as they are.
    """
    low, high = chi2.ppf([CHANCE, 1.0 - CHANCE], len(deviations))
    return low <= np.sum(np.square(deviations)) / factor**2 <= high


def deviation(fit, key, truth, scale=float):
    """Estimate less truth by half its interval, in widths of one standard error."""
    value, low, high = (scale(getattr(fit.estimates[key], n)) for n in ("value", "low", "high"))
    width = student_width(fit.confidence, len(fit.residuals) - len(fit.estimates))
    return (value - scale(truth)) / (0.5 * (high - low) / width)


def covers(fit, truth):
    found = fit.estimates
    return {key: found[key].low <= value <= found[key].high for key, value in truth.items()}


def test_force_rises_with_one_slope_and_falls_with_another():
    p = np.array([0.0, 1e-4, 4e-4, 5e-4, 4.5e-4, 3e-4])
    force = bilinear_force(p, 1e9, 4.0, datum=1e-4)
    assert force == pytest.approx([0.0, 0.0, 3e5, 4e5, 2e5, 0.0])


def test_a_curve_without_noise_gives_its_parameters_back():
    p = way()
    fit = fit_force_penetration(p, bilinear_force(p, STIFFNESS, RATIO, DATUM, peak=8.5e-4))
    assert {key: fit.estimates[key].value for key in CURVE} == pytest.approx(CURVE, rel=1e-7)
    assert fit.estimates["peak"].value == pytest.approx(8.5e-4, rel=1e-7)
    assert fit.changes() == {key: fit.estimates[key].value for key in list(CURVE)[:2]}


def test_intervals_of_a_curve_cover_as_often_as_they_say():
    trials = 200
    counts, halved = dict.fromkeys(CURVE, 0), 0
    off = {key: [] for key in CURVE}
    for seed in range(trials):
        fit = fit_force_penetration(*noisy_curve(seed), CONFIDENCE)
        for key, covered in covers(fit, CURVE).items():
            counts[key] += covered
            off[key].append(deviation(fit, key, CURVE[key]))
        value, _error, low, high = fit.estimates["rock.loading_stiffness"]
        halved += low + value <= 2.0 * STIFFNESS <= high + value
    assert all(plausible(count, trials) for count in counts.values()), counts
    assert not plausible(halved, trials)  # intervals half as wide are found out
    assert all(right_size(found) for found in off.values()), off
    assert not any(right_size(found, 1.4) for found in off.values())  # and wider ones


@pytest.mark.parametrize(
    "solver", ["rigid", pytest.param("wave", marks=pytest.mark.skipif(not LONG, reason=WHY))]
)
def test_intervals_of_drop_tests_cover_as_often_as_they_say(solver):
    trials = 60
    counts, off = dict.fromkeys(BARRIER, 0), {key: [] for key in BARRIER}
    scene = bit(solver)
    guess = scene.replace(**{"rock.barrier_damping": 8.5e3, "rock.barrier_energy": 0.55})
    for seed in range(trials):
        fit = fit_drop_tests(guess, drops(scene, seed), span=1.5, steps=5, confidence=CONFIDENCE)
        for key, covered in covers(fit, BARRIER).items():
            counts[key] += covered
            off[key].append(deviation(fit, key, BARRIER[key], math.log))  # as they are fitted
        assert fit.noise == pytest.approx(1e-5, rel=0.2)
    assert all(plausible(count, trials) for count in counts.values()), counts
    assert all(right_size(found) for found in off.values()), off
    assert not any(right_size(found, 1.7) for found in off.values())  # wider ones are found out


def test_the_whole_law_is_found_from_a_far_guess():
    guess = {"rock.barrier_damping": 3e4, "rock.barrier_energy": 0.2}
    guess |= {"rock.loading_stiffness": 7.47e8, "rock.unloading_ratio": 5.03}
    fit = fit_drop_tests(bit().replace(**guess), drops(bit(), 0), ROCK, span=4.0, steps=5)
    truth = BARRIER | {"rock.loading_stiffness": STIFFNESS, "rock.unloading_ratio": RATIO}
    assert all(covers(fit, truth).values()), fit.estimates
    for key, found in fit.estimates.items():
        assert found.high - found.low < 0.2 * truth[key]


def test_data_without_noise_that_the_guess_explains_give_it_back():
    fit = fit_drop_tests(bit(), drops(bit(), 0, noise=0.0, step=2e-3), span=1.0)
    for key, found in fit.estimates.items():
        assert found == pytest.approx((BARRIER[key], 0.0, BARRIER[key], BARRIER[key]), abs=1e-9)


def test_an_elastic_bit_is_fitted_as_well():
    scene = bit("wave")
    tests = drops(scene, 1, noise=5e-6, step=5e-4)
    guess = scene.replace(**{"rock.barrier_damping": 1.03e4, "rock.barrier_energy": 0.48})
    fit = fit_drop_tests(guess, tests, span=1.0)
    for key, found in fit.estimates.items():
        assert abs(found.value - BARRIER[key]) < 4.0 * found.standard_error


def test_an_interval_reaches_to_where_the_misfit_has_grown():
    """Above 1 the model is as steep as its Jacobian says, below 1 a fifth of it."""
    x = np.linspace(1.0, 2.0, 20)
    noise = np.resize([0.05, -0.05], len(x))
    noise -= x * (noise @ x) / (x @ x)  # so that the minimum is at 1
    model = CountedModel(lambda at: x * (at[0] if at[0] > 1.0 else 1.0 - 0.2 * (1.0 - at[0])))
    at, data = np.array([1.0]), x + noise
    error = np.sqrt(model.misfit(data, at) / (len(x) - 1) / (x @ x))
    ends, best = profile_intervals(model, data, at, np.array([[error**2]]), 2.0)
    assert best is at
    assert ends[0, 1] == pytest.approx(1.0 + 2.0 * error)
    assert 9.4 * error < 1.0 - ends[0, 0] < 12.0 * error


def test_residuals_that_follow_from_each_other_are_warned_of():
    p, force = noisy_curve(3)
    assert fit_force_penetration(p, force).warnings == []
    drifting = force + 2e4 * np.sin(np.linspace(0.0, 12.0, len(p)))
    (note,) = fit_force_penetration(p, drifting).warnings
    assert "neighbouring residuals are alike" in note


P, F = noisy_curve(0)


@pytest.mark.parametrize(
    ("penetration", "force", "words"),
    [
        (P[:5], F[:5], "5 data, at least 10"),
        (P, F[:-1], "of one length: penetration 100, force 99"),
        (P, np.where(np.arange(100) == 7, np.nan, F), "force: number 7 of the row"),
        (P, ["much"] * 100, "force: must be numbers"),
        (P.reshape(2, 50), F, "penetration: must be one row"),
        (P[:60], F[:60], "data of unloading under force, at least 3"),
        (P[60:], F[60:], "data of loading under force, at least 3"),
        (np.full(100, 1e-3), F, "penetration: does not change"),
        (P, -np.abs(F), "force: never positive"),
        (P[::-1], F[::-1], "the rows must be in the order of time"),
    ],
)
def test_bad_curves_are_refused(penetration, force, words):
    with pytest.raises(FitError, match=words):
        fit_force_penetration(penetration, force)


TIMES = np.linspace(0.0, 0.04, 20)


@pytest.mark.parametrize(
    ("scene", "test", "arguments", "words"),
    [
        (Scene(), None, {}, "a drop test is of a bit alone"),
        ({"effects.barrier": False}, None, {}, "no energy barrier"),
        ({}, None, {"signal": "gap"}, "signal = 'gap': must be one of bit_position"),
        ({}, None, {"span": 0.5}, "span = 0.5: must be a factor"),
        ({}, None, {"steps": 2}, "steps = 2"),
        ({}, None, {"confidence": 95}, "confidence = 95"),
        ({}, None, {"parameters": ["loss.time"]}, "parameters: loss.time must be one of"),
        ({}, None, {"parameters": []}, "parameters: at least one"),
        ({}, DropTest(TIMES[::-1], TIMES, 5.0), {}, "time of test 0: must rise"),
        ({}, DropTest(TIMES, TIMES[1:], 5.0), {}, "of one length"),
        ({}, DropTest(TIMES, TIMES, -5.0), {}, "speed of test 0 = -5.0 m/s"),
    ],
)
def test_senseless_drop_tests_are_refused(scene, test, arguments, words):
    scene = bit(**scene) if isinstance(scene, dict) else scene
    with pytest.raises(FitError, match=words):
        fit_drop_tests(scene, [test or DropTest(TIMES, TIMES, 5.0)], **arguments)


def test_no_drop_test_is_refused():
    with pytest.raises(FitError, match="at least one drop test"):
        fit_drop_tests(bit(), [])


def test_data_that_tell_nothing_are_refused():
    """Before it touches the rock the bit falls alike on every rock."""
    times = np.linspace(0.0, 1e-3, 20)
    scene = bit(**{"start.rock_gap": 0.1})
    with pytest.raises(FitError, match=r"rock\.barrier_damping cannot be told from these data"):
        fit_drop_tests(scene, [DropTest(times, 5.0 * times, 5.0)], span=1.0)
