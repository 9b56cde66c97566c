"""Fits to measurements: known parameters come back, within intervals that tell the truth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from fitting_data import DATUM, DEPTH, KEYS, TRUTH, bit, drawn_truth, drops, noisy_curve, rock_of
from scipy.stats import binom

from percussion_model import Scene
from percussion_model.analysis.fitting import (
    Curve,
    DropTest,
    FitError,
    Reading,
    drop_test_signal,
    fit_rock,
    slow_force,
)
from percussion_model.analysis.fitting.curve import best_datum_and_peak
from percussion_model.analysis.fitting.found import (
    DETERMINED,
    OPEN,
    OPEN_ABOVE,
    WIDE,
    Estimate,
    Rival,
)
from percussion_model.analysis.fitting.likelihood import (
    DAMPING,
    ENERGY,
    RATIO,
    STIFFNESS,
    Likelihood,
    Series,
    curve_series,
    drop_series,
)
from percussion_model.analysis.fitting.notes import interval_notes
from percussion_model.analysis.fitting.predictions import (
    DropOnRocks,
    predicted_reading,
)
from percussion_model.analysis.fitting.search import descend, roughness
from percussion_model.interface.calibrated_scene import commented_fit
from percussion_model.interface.plotting.calibration import draw_calibration

# Of that many trials so many cover, but for one chance in a thousand on either side.
CHANCE = 1e-3
CURVE = noisy_curve(0)


def test_force_rises_with_one_slope_and_falls_with_another():
    p = np.array([0.0, 1e-4, 4e-4, 5e-4, 4.5e-4, 3e-4])
    force = slow_force(p, rock_of({STIFFNESS: 1e9, RATIO: 4.0}), datum=1e-4)
    assert force == pytest.approx([0.0, 0.0, 3e5, 4e5, 2e5, 0.0])


def test_datum_and_peak_of_a_curve_without_noise_are_found():
    curve = noisy_curve(0, noise=0.0)
    found = best_datum_and_peak(curve, rock_of(TRUTH), (0.0, DEPTH))[:2]
    assert found == pytest.approx((DATUM, DATUM + DEPTH), rel=1e-9)


def test_a_curve_without_noise_gives_its_parameters_back():
    fit = fit_rock(Scene(), noisy_curve(0, noise=0.0))
    assert fit.changes() == pytest.approx({key: TRUTH[key] for key in (STIFFNESS, RATIO)}, rel=1e-6)
    assert not [text for text in fit.warnings if "rough" in text or "neighbouring" in text]
    assert not fit.is_widened


def test_an_interval_that_roughness_widens_is_not_called_by_its_confidence():
    """In figure, JSON and calibrated scene; chi-square of two reaches 5.99."""
    pytest.importorskip("matplotlib")
    fit = fit_rock(Scene(), CURVE)
    assert fit.quantile == pytest.approx(-2.0 * math.log(0.05))
    for found, widened in ((fit, False), (replace(fit, threshold=560.0), True)):
        labels = [
            text.get_text()
            for part in draw_calibration(found).subfigs
            for legend in part.legends
            for text in legend.get_texts()
        ]
        assert ("95 % interval" in labels) == (not widened)
        assert any("deviance of 560 (95 % alone: 5.99)" in one for one in labels) == widened
        assert found.summary()["widened"] == widened
        text = commented_fit(found, {}, "scene.toml")
        assert ("their widened intervals" in text, "their 95 % intervals" in text) == (
            widened,
            not widened,
        )


def test_estimates_have_the_digits_that_are_known():
    shown = {
        Estimate(20123.4, 4217.0, math.inf, OPEN_ABOVE): ("≈20000", "4200", "inf"),
        Estimate(0.05123, 0.0, 0.3456, OPEN): ("≈0.051", "0", "0.35"),
        Estimate(20123.4, 4217.0, 61234.0, WIDE): ("≈20000", "4200", "61000"),
        Estimate(7.5123e8, 7.4123e8, 7.6123e8, DETERMINED): ("7.51e+08", "7.41e+08", "7.61e+08"),
        Estimate(6.0312, 5.512, 6.612, DETERMINED): ("6.03", "5.51", "6.61"),
        Estimate(6.0, 6.0, 6.0, DETERMINED): ("6.000", "6.000", "6.000"),
    }
    for estimate, texts in shown.items():
        assert estimate.texts() == texts


def test_what_is_not_determined_has_two_digits_wherever_it_is_written():
    """In notes and in the comments of the calibrated scene."""
    fit = fit_rock(Scene(), CURVE)
    unsure = Estimate(12.3456, 3.4567, 98.7654, OPEN_ABOVE)
    assert "≈12 in 3.5 to 99, open above" in commented_fit(
        replace(fit, estimates={RATIO: unsure}), {}, "scene.toml"
    )
    like = Likelihood(Scene(), [], [RATIO], np.array([[0.0, 5.0]]), lambda: None)
    (note,) = interval_notes({RATIO: unsure}, like)
    assert note.endswith("it is above 3.5")


def test_the_legend_names_other_minima_only_where_some_are_drawn():
    pytest.importorskip("matplotlib")
    fit = fit_rock(Scene(), CURVE)
    values = {key: 1.01 * one.value for key, one in fit.estimates.items()}
    for share, is_drawn in ((0.5, True), (5.0, False)):
        rival = Rival(values, share * fit.threshold)
        figure = draw_calibration(replace(fit, rivals=[rival]))
        (legend,) = [legend for part in figure.subfigs for legend in part.legends]
        labels = [text.get_text() for text in legend.get_texts()]
        assert ("other minimum" in labels) == is_drawn
        assert len(labels) == len(set(labels))


def test_a_figure_draws_the_ends_of_intervals_that_are_not_open():
    fit = fit_rock(Scene(), CURVE)
    one = fit.estimates[RATIO]
    for verdict, ends in (
        (DETERMINED, [one.low, one.high]),
        (OPEN_ABOVE, [one.low]),
        (OPEN, []),
    ):
        estimates = fit.estimates | {RATIO: one._replace(verdict=verdict)}
        figure = draw_calibration(replace(fit, estimates=estimates))
        ax = next(ax for ax in figure.axes if "gamma" in ax.get_xlabel())
        drawn = [line.get_xdata()[0] for line in ax.lines if line.get_label() == "its ends"]
        assert drawn == ends


def test_progress_promises_no_number_of_computations():
    done = []
    fit = fit_rock(Scene(), CURVE, progress=done.append)
    assert done == list(range(1, fit.runs + 1))


def test_stages_of_a_fit_are_told_with_the_computations_that_they_take():
    """Those of the search are a bound, of which much is done; those of the walks are exact."""
    scene = bit()
    done, told = [0], []
    sources = {
        "drop": (None, drops(scene, 0, samples=60, speeds=(5.25,)), [DAMPING]),
        "both": (CURVE, drops(scene, 0, samples=60, speeds=(5.25,)), [RATIO, ENERGY]),
        "curve": (CURVE, [], None),
    }
    for curve, fallen, names in sources.values():
        told.clear()
        done[:] = [0]
        fit = fit_rock(scene, curve, fallen, (), names, progress=done.append,
                       stage=lambda name, most: told.append((name, most, done[-1])))  # fmt: skip
        ends = [at for *_, at in told[1:]] + [fit.runs]
        taken = {name: (most, end - at) for (name, most, at), end in zip(told, ends, strict=True)}
        most, surveyed = taken["search of the whole range"]
        assert 0.6 * most <= surveyed <= most
        for walk, share in (("walk 1 of 2", 0.4), ("walk 2 of 2", 0.6)):
            most, walked = taken[walk]
            assert most == share * 250 * 2 ** len(fit.estimates)
            assert 0.9 * most <= walked <= most + 1
        assert taken["check with finer cells"] == (0, 0)


def test_an_interval_over_the_whole_range_is_called_that():
    like = Likelihood(Scene(), [], [DAMPING], np.log([[1e2, 1e7]]), lambda: None)
    (note,) = interval_notes({DAMPING: Estimate(1.5e4, 1e2, 1e7, OPEN)}, like)
    assert "reaches over the whole range that was searched" in note
    assert "nothing" not in note


@pytest.mark.slow
def test_intervals_of_a_curve_cover_as_often_as_they_say():
    """They hold together: the box that they span has the region of all parameters in it."""
    trials, confidence, both, halved = 60, 0.8, 0, 0
    keys = (STIFFNESS, RATIO)
    for seed in range(trials):
        fit = fit_rock(Scene(), noisy_curve(seed), confidence=confidence)
        found = [(TRUTH[key], fit.estimates[key]) for key in keys]
        both += all(one.low <= truth <= one.high for truth, one in found)
        halved += all(
            one.low + one.value <= 2.0 * truth <= one.high + one.value for truth, one in found
        )
    least = binom.ppf(CHANCE, trials, confidence)
    assert least <= both
    assert not least <= halved  # intervals half as wide are found out
    assert both < trials  # and those that are far too wide


def test_data_that_say_nothing_of_a_parameter_leave_it_open():
    """Within 8 ms the bit has bounced once: C_R and W_R took next to nothing of its energy."""
    tests = drops(bit(), 0, samples=40, end=8e-3, speeds=(5.25,))
    truth = {key: TRUTH[key] for key in (STIFFNESS, RATIO)}
    fit = fit_rock(bit(**truth), None, tests, parameters=[DAMPING])
    assert not fit.estimates[DAMPING].determined
    assert fit.changes() == {}
    assert DAMPING in fit.changes(undetermined=True)
    assert any("C_R" in text and "not determined" in text for text in fit.warnings)


def test_one_parameter_is_found_in_its_whole_range():
    truth = {key: TRUTH[key] for key in (STIFFNESS, RATIO, DAMPING)}
    tests = drops(bit(), 0, samples=60)
    fit = fit_rock(bit(**truth), None, tests, parameters=[ENERGY])
    one = fit.estimates[ENERGY]
    assert one.determined
    assert one.low <= TRUTH[ENERGY] <= one.high < 1.6 * one.low
    for explained in fit.explained:
        assert explained.noise == pytest.approx(1e-5, rel=0.4)  # four standard errors of 60 data


def test_a_rebound_velocity_tells_the_unloading_ratio():
    """A rigid bit of this rock rebounds by 1/sqrt(gamma), but for its weight and feed."""
    scene = bit(**{"effects.barrier": True} | TRUTH)
    there = predicted_reading(scene, Reading("rebound_velocity", 1.0, 0.1, 5.25))
    assert there == pytest.approx(5.25 / math.sqrt(TRUTH[RATIO]), rel=0.01)
    reading = Reading("rebound_velocity", there, 0.01 * there, 5.25)
    guess = scene.replace(**{RATIO: 9.0})
    one = fit_rock(guess, readings=[reading], parameters=[RATIO]).estimates[RATIO]
    assert one.value == pytest.approx(TRUTH[RATIO], rel=1e-3)
    # 1 % of velocity is 2 % of gamma, 1.96 of them to a side
    assert one.high / one.low == pytest.approx(math.exp(4.0 * 0.01 * 1.96), rel=0.01)


def test_the_force_at_a_gauge_is_read_where_it_is():
    """Until the wave comes back from the free top, it is that of the rock a transit earlier."""
    scene = bit("wave", **{"solver.cells": 80})
    length, speed = scene.bit.length, scene.bit.length / scene.bit.transit_time
    place = 0.5 * length
    times = np.linspace(2e-5, 5.5e-5, 9)
    at_gauge = drop_test_signal(scene, times, 5.25, "gauge_force", place)
    at_rock = drop_test_signal(scene, times - (length - place) / speed, 5.25, "bit_force")
    assert at_gauge == pytest.approx(at_rock, abs=0.02 * at_rock.max())


@pytest.mark.parametrize("solver", ["wave", "modal", "fem", "rigid"])
@pytest.mark.parametrize("gap", [0.0, 1e-3])
def test_one_solver_serves_drops_on_other_rock(solver, gap):
    """As a solver of its own for each rock, whether the bit starts on the rock or above it."""
    scene = bit(solver, **{"start.rock_gap": gap})
    drop = drops(scene, 0, samples=60, end=0.012, noise=0.0)[0]
    drop_on = DropOnRocks(drop, drop.time)
    for seed in (3, 4):
        rock = scene.replace(**drawn_truth(seed))
        for energy in (0.05, 0.2):
            rock = rock.replace(**{ENERGY: energy})
            alone = drop_test_signal(rock, drop.time, drop.speed)
            assert np.ptp(alone) > 1e-3
            assert drop_on(rock) == pytest.approx(alone, abs=1e-9)


def test_least_squares_weigh_each_series_by_its_own_noise():
    """Of two series of one number the one with less noise decides, as their variances say."""
    rng = np.random.default_rng(3)
    noisy, quiet = 1e9 + rng.normal(0.0, 5e7, 400), 1e9 + rng.normal(0.0, 1e6, 100)

    def series(name, data):
        return Series(name, data, None, lambda scene: np.full(len(data), scene[STIFFNESS]))

    both = [series("noisy", noisy), series("quiet", quiet)]
    ranges = np.log([[1e8, 1e10]])
    like = Likelihood(Scene(), both, [STIFFNESS], ranges, lambda: None)
    best, spread = descend(like, np.log([7e8]), [0])
    assert math.exp(best.at[0]) == pytest.approx(quiet.mean(), abs=2e4)
    assert best.noise == pytest.approx([noisy.std(), quiet.std()], rel=0.01)
    assert max(roughness(like, best, spread)) < 0.1


def test_a_deviance_that_jumps_everywhere_is_called_rough():
    data = np.linspace(-1.0, 1.0, 50)

    def jumpy(scene):
        return 1e-2 * np.sin(1e9 * scene[STIFFNESS] * np.arange(50))

    like = Likelihood(
        Scene(), [Series("x", data, 0.01, jumpy)], [STIFFNESS], np.log([[1e8, 1e9]]), lambda: None
    )
    assert roughness(like, like.at(np.log([7e8])), np.array([[1e-6]]))[0] > 10.0


@pytest.mark.parametrize("curves", [0, 1])
def test_a_drop_without_noise_that_is_explained_to_all_digits_is_not_rough(curves):
    """Alone; beside a noisy series only that one tells of dips."""
    series = [drop_series(one) for one in drops(bit(), 0, samples=40, end=8e-3, noise=0.0)]
    series += curves * [curve_series(CURVE, (DATUM, DATUM + DEPTH))]
    like = Likelihood(bit(**TRUTH), series, [ENERGY], np.log([[1e-3, 1.0]]), lambda: None)
    best, spread = descend(like, np.log([TRUTH[ENERGY]]), [0])
    assert like.at(best.at + 1e-5).deviance - best.deviance > 10.0
    assert max(roughness(like, best, spread)) < 1e-6


def test_residuals_that_follow_from_each_other_are_warned_of():
    assert not any("neighbouring" in text for text in fit_rock(Scene(), noisy_curve(3)).warnings)
    drifting = noisy_curve(3)
    drift = 2e4 * np.sin(np.linspace(0.0, 12.0, len(drifting.force)))
    fit = fit_rock(Scene(), Curve(drifting.penetration, drifting.force + drift))
    assert any("neighbouring residuals are alike" in text for text in fit.warnings)


P, F = CURVE.penetration, CURVE.force


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
        (P, -F + 1.0, "curve: force: the sign is reversed: multiply the column by -1"),
        (-P, F, "curve: penetration: the sign is reversed: multiply the column by -1"),
        (P[::-1], F[::-1], "the rows must be in the order of time"),
        (1e3 * P, F / 1e3, r'perhaps "penetration \[mm\]", "force \[kN\]"'),
        (P, F / 1e3, r'perhaps "penetration \[m\]", "force \[kN\]"'),
        (1e3 * P, F, r'perhaps "penetration \[mm\]", "force \[N\]"'),
    ],
)
def test_bad_curves_are_refused(penetration, force, words):
    with pytest.raises(FitError, match=words):
        fit_rock(Scene(), Curve(penetration, force))


TIMES = np.linspace(0.0, 0.04, 20)


@pytest.mark.parametrize(
    ("scene", "test", "arguments", "words"),
    [
        ({"effects.barrier": False}, None, {}, "no energy barrier"),
        ({}, None, {"confidence": 95}, "confidence = 95"),
        ({}, None, {"parameters": ["loss.time"]}, "loss.time cannot be fitted: must be one of"),
        ({}, None, {"parameters": []}, "parameters: at least one"),
        ({}, None, {"ranges": {DAMPING: (1e4, 1e3)}}, "must rise"),
        ({}, None, {"ranges": {"loss.time": (1, 2)}}, "it is not fitted"),
        ({}, DropTest(TIMES, TIMES, 5.0, "gap"), {}, "signal = 'gap': must be one of bit_position"),
        ({}, DropTest(TIMES[::-1], TIMES, 5.0), {}, "time of drop: must rise"),
        ({}, DropTest(TIMES, TIMES[1:], 5.0), {}, "of one length"),
        ({}, DropTest(TIMES, TIMES, -5.0), {}, "speed of drop = -5.0 m/s"),
        ({}, DropTest(1e3 * TIMES, TIMES, 5.0), {}, r'perhaps "time \[ms\]"'),
        ({}, DropTest(TIMES, 1e3 * TIMES, 5.0), {}, "write its unit into the heading"),
    ],
)
def test_senseless_drop_tests_are_refused(scene, test, arguments, words):
    with pytest.raises(FitError, match=words):
        fit_rock(bit(**scene), None, [test or DropTest(TIMES, TIMES, 5.0)], **arguments)


@pytest.mark.parametrize(
    ("reading", "words"),
    [
        (Reading("rebound_velocity", 2100.0, 50.0, 5.25), "possible is 0.001 to 100 m/s"),
        (Reading("rebound_velocity", 2.1, 0.0, 5.25), "must be above 0"),
        (Reading("rebound_velocity", 2.1, 0.1), "speed of the drop is needed"),
        (Reading("penetration_per_blow", 7e-4, 1e-5, 5.0), "is of the hammer"),
        (Reading("penetration_per_blow", 7e-4, 1e-5), "the scene has no piston"),
    ],
)
def test_senseless_readings_are_refused(reading, words):
    with pytest.raises(FitError, match=words):
        fit_rock(bit(), readings=[reading])


def test_nothing_is_refused():
    with pytest.raises(FitError, match="nothing to fit"):
        fit_rock(bit())


def test_a_place_is_given_up_only_where_it_is_above_the_limit():
    """Without computing the rest: what was given up lies above, what was not is the same."""
    scene = bit()
    sources = [noisy_curve(0), *drops(scene, 0, samples=40, end=8e-3)]
    box = np.log([[1e8, 2e9], [2.0, 20.0], [1e3, 1e6], [1e-3, 1.0]])
    computed = []

    def series(k, source):
        made = curve_series(source, (DATUM, DATUM + DEPTH)) if k == 0 else drop_series(source)
        return replace(made, model=lambda scene: computed.append(k) or made.model(scene))

    every = [series(k, source) for k, source in enumerate(sources)]
    like, other = (Likelihood(scene, every, KEYS, box, lambda: None) for _ in range(2))
    best = like.at(np.log([TRUTH[key] for key in KEYS]))
    # nothing is known of what was never computed
    assert other.below(best.at, best.deviance + 1.0, 0.0).deviance == best.deviance
    generator, given_up = np.random.default_rng(1), 0
    for _ in range(20):
        at = best.at + 0.3 * generator.standard_normal(4)
        computed.clear()
        found = like.below(at, best.deviance + 50.0, 10.0)
        whole = other.at(at)
        if found is None:
            given_up += len(computed) < 2 * len(every)
            assert whole.deviance > best.deviance + 50.0
        else:
            assert found.deviance == whole.deviance
    assert given_up
