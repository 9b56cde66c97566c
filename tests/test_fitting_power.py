"""Fits of the power law: exponents come back from data that tell them, and from no others."""

from __future__ import annotations

import json
import math
import os
from dataclasses import replace

import numpy as np
import pytest
from fitting_data import (
    DATUM,
    DEPTH,
    POWER,
    POWER_DRAWN,
    POWER_TRUTH,
    SHALLOW,
    TRUTH,
    bit,
    drawn_truth,
    drops,
    given_back,
    noisy_curve,
    rock_of,
)
from typer.testing import CliRunner

from percussion_model import Scene
from percussion_model.analysis.fitting import FitError, Reading, fit_rock
from percussion_model.analysis.fitting.curve import best_datum_and_peak, first_sight, slow_force
from percussion_model.analysis.fitting.likelihood import (
    EXPONENT,
    RATIO,
    SLOW,
    STIFFNESS,
    UNLOADING,
    decades,
)
from percussion_model.analysis.fitting.predictions import predicted_reading
from percussion_model.interface.cli import app
from percussion_model.interface.plotting.calibration import draw_calibration

LONG = "PERCUSSION_LONG" in os.environ
SCENE = bit("wave", **POWER)


def two_curves(seed, truth=POWER_TRUTH, noise=4e3):
    return [
        noisy_curve(seed + 500 * k, truth, noise, depth) for k, depth in enumerate((DEPTH, SHALLOW))
    ]


@pytest.mark.parametrize("exponent", [1.0, 1.6, 3.0])
@pytest.mark.parametrize("unloading", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("depth", [5e-5, 8e-4, 2e-3])
def test_a_slow_test_is_that_of_the_power_law(exponent, unloading, depth):
    """In closed form, for three buttons; weak peaks unload as stiffly as they load there."""
    truth = POWER_TRUTH | {EXPONENT: exponent, UNLOADING: unloading}
    peak, back = 3.0 * 6e8 * 1e-3 * (depth / 1e-3) ** exponent, given_back(truth, depth) * depth
    p = np.array([0.0, 0.5, 1.0, 1.0, 1.0]) * depth - np.array([0.0, 0.0, 0.0, 0.3, 1.1]) * back
    found = slow_force(p + 1e-4, rock_of(truth | {"rock.buttons": 3}), datum=1e-4)
    assert found == pytest.approx([0.0, peak * 0.5**exponent, peak, 0.7 * peak, 0.0], rel=1e-9)


def test_a_slow_test_chips():
    """Above 2e5 N the rock gives way for 0.2 mm, and goes on where it was then."""
    truth = POWER_TRUTH | {"rock.chipping_force": 2e5, "rock.chipping_penetration": 2e-4}
    begins = 1e-3 * (2e5 / 6e5) ** (1.0 / 1.6)
    found = slow_force([begins, begins + 1e-4, begins + 2e-4, 1e-3], rock_of(truth))
    assert found[:3] == pytest.approx(2e5, rel=1e-3)
    assert found[3] == pytest.approx(6e5 * 0.8**1.6, rel=1e-3)


def test_datum_and_peak_are_found_far_from_the_guess():
    curve = noisy_curve(0, POWER_TRUTH, noise=0.0)
    found = best_datum_and_peak(curve, rock_of(POWER_TRUTH), (2e-4, 9e-4))[:2]
    assert found == pytest.approx((DATUM, DATUM + DEPTH), rel=1e-9)


def test_first_sight_is_near_for_exponents_all_over_their_range():
    for n in (1.0, 1.5, 2.5, 3.9):
        for q in (0.0, 0.5):
            truth = POWER_TRUTH | {EXPONENT: n, UNLOADING: q, RATIO: 60.0}
            rock = first_sight(two_curves(1, truth, noise=0.0), SCENE).rock
            assert rock[EXPONENT] == pytest.approx(n, abs=0.03)
            assert rock[STIFFNESS] == pytest.approx(6e8, rel=0.02)
            assert rock[RATIO] == pytest.approx(60.0, rel=0.05)
            assert rock[UNLOADING] == pytest.approx(q, abs=0.05)


def test_one_peak_keeps_q_and_tells_gamma_there():
    """What it tells is how much this peak gives back, whatever q is."""
    curves = [noisy_curve(seed, POWER_TRUTH, noise=400.0) for seed in (0, 1)]
    for q, given in ((0.0, curves[:1]), (0.8, curves)):
        fit = fit_rock(SCENE.replace(**{UNLOADING: q}), given)
        assert UNLOADING not in fit.estimates
        (note,) = (text for text in fit.warnings if text.startswith("q = "))
        assert note.startswith(f"q = {q:g} kept: peaks of about one force do not determine it")
        assert any(text.startswith("P_0 = 0.001 m kept") for text in fit.warnings)
        shares = [given_back(one, DEPTH) for one in (fit.changes() | {UNLOADING: q}, POWER_TRUTH)]
        assert shares[0] == pytest.approx(shares[1], rel=0.005)
    with pytest.raises(
        FitError, match=f"{UNLOADING}: peaks of about one force do not determine it"
    ):
        fit_rock(SCENE, curves, parameters=[RATIO, UNLOADING])


def test_what_is_known_of_q_leaves_gamma_an_interval_as_wide_as_it_makes_it():
    """gamma at the reference, and q, lie on a line that the force of the one peak gives."""
    known = (0.2, 0.4)
    fit = fit_rock(
        SCENE.replace(**{key: POWER_TRUTH[key] for key in (STIFFNESS, EXPONENT)}),
        noisy_curve(0, POWER_TRUTH, noise=100.0),
        parameters=[RATIO, UNLOADING],
        ranges={UNLOADING: known},
    )
    assert not fit.estimates[UNLOADING].determined
    relative = math.log(DEPTH / 1e-3) * POWER_TRUTH[EXPONENT]
    one = fit.estimates[RATIO]
    ends = [6.0 * math.exp((0.3 - q) * relative) for q in known]
    assert [one.low, one.high] == pytest.approx(sorted(ends), rel=0.01)


def test_a_bilinear_rock_has_exponents_at_the_ends_of_the_power_law():
    """There intervals are closed: the law has no values beyond. Their axes are linear."""
    fit = fit_rock(SCENE, two_curves(3, TRUTH))
    scales = {ax.get_xlabel(): ax.get_xscale() for ax in draw_calibration(fit).axes}
    assert scales["$q$"] == scales["$n$"] == "linear"
    n, q = fit.estimates[EXPONENT], fit.estimates[UNLOADING]
    assert (n.low, q.low) == (1.0, 0.0)
    assert n.determined
    assert q.determined
    assert n.high < 1.2
    assert q.high < 0.2


def test_peaks_that_unload_as_they_load_leave_q_undetermined():
    """Where it unloads as stiffly as it loads the share is 1/n, whatever gamma and q are."""
    truth = POWER_TRUTH | {RATIO: 1.1, UNLOADING: 1.0}
    assert given_back(truth, DEPTH) == 1.0 / 1.6
    fit = fit_rock(SCENE, two_curves(2, truth), parameters=[UNLOADING, RATIO])
    assert not fit.estimates[UNLOADING].determined


@pytest.mark.parametrize("seed", range(60) if LONG else [1])
def test_intervals_of_two_slow_tests_hold_the_truth(seed):
    truth = drawn_truth(seed, POWER_DRAWN)
    fit = fit_rock(SCENE, two_curves(seed, truth))
    for key in SLOW:
        one = fit.estimates[key]
        assert one.low <= truth[key] <= one.high, (key, truth[key], one)
    for key in (STIFFNESS, EXPONENT):  # peaks that unload as they load tell no more
        assert decades(key, fit.estimates[key].low, fit.estimates[key].high) < 0.6


def test_two_drops_tell_both_exponents():
    """Of rock whose other parameters are known, by sensors that are."""
    scene = bit("wave", **POWER, **{"solver.cells": 2})
    known = {key: value for key, value in POWER_TRUTH.items() if key not in (EXPONENT, UNLOADING)}
    tests = [
        replace(drop, offset=0.0, drift=0.0, delay=0.0)
        for drop in drops(scene, 0, POWER_TRUTH, samples=60, end=5e-3)
    ]
    fit = fit_rock(scene.replace(**known), None, tests, parameters=[EXPONENT, UNLOADING])
    for key in (EXPONENT, UNLOADING):
        one = fit.estimates[key]
        assert one.determined
        assert one.low <= POWER_TRUTH[key] <= one.high < one.low + 0.1


@pytest.mark.parametrize("speed", [0.2, 5.25])
def test_a_rigid_bit_rebounds_with_what_the_peak_gives_back(speed):
    """E = F p e / 2 of F p / (n + 1), but for weight and feed."""
    scene = bit(**POWER, **POWER_TRUTH, **{"feed.force": 1.0, "effects.gravity": False})
    scene = scene.replace(**{"effects.barrier": False})
    n, place, energy = POWER_TRUTH[EXPONENT], 1e-3, 0.5 * scene.bit.mass * speed**2
    depth = place * ((n + 1.0) * energy / (6e8 * place**2)) ** (1.0 / (n + 1.0))
    share = given_back(POWER_TRUTH, depth)
    found = predicted_reading(scene, Reading("rebound_velocity", 1.0, 0.1, speed))
    assert found == pytest.approx(speed * math.sqrt(0.5 * (n + 1.0) * share), rel=1e-3)


def test_other_laws_of_the_rock_are_not_fitted():
    with pytest.raises(FitError, match="must be one of bilinear, power"):
        fit_rock(bit(**{"effects.rock": "spring", "effects.barrier": False}), noisy_curve(0))
    with pytest.raises(FitError, match=f"{EXPONENT} cannot be fitted"):
        fit_rock(bit(), noisy_curve(0), parameters=[EXPONENT])
    with pytest.raises(FitError, match=f"range of {EXPONENT} = 0.5 to 2"):
        fit_rock(SCENE, two_curves(0), ranges={EXPONENT: (0.5, 2.0)})


def test_the_command_takes_several_slow_tests_and_draws_them(tmp_path):
    words = ["calibrate", str(tmp_path / "scene.toml")]
    for k, curve in enumerate(two_curves(5)):
        file = tmp_path / f"{k}.csv"
        rows = zip(curve.penetration.tolist(), curve.force.tolist(), strict=True)
        lines = ["penetration,force", *(f"{p!r},{f!r}" for p, f in rows)]
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        words += ["--curve", str(file)]
    scene = SCENE.replace(**{STIFFNESS: 6e8, RATIO: 6.0})
    scene.to_toml(tmp_path / "scene.toml")
    words += ["--only", EXPONENT, "--only", UNLOADING]
    words += ["--out", str(tmp_path / "out.toml"), "--json", str(tmp_path / "out.json")]
    ended = CliRunner().invoke(app, [*words, "--figure", str(tmp_path / "fit.png")])
    assert ended.exit_code == 0, ended.output
    found = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert found["law"] == "power"
    rock = Scene.from_toml(tmp_path / "out.toml")
    for key in (EXPONENT, UNLOADING):
        assert rock[key] == found["estimates"][key]["value"] != SCENE[key]
    text = (tmp_path / "out.toml").read_text(encoding="utf-8")
    assert f"#   {UNLOADING} (q): 0." in text
    assert f"#   {RATIO} (gamma): not fitted, kept" in text
    assert (tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")
