"""`percussion calibrate`: files in, a calibrated scene out."""

from __future__ import annotations

import json
import math
import os
import re
import time

import numpy as np
import pytest
from fitting_data import (
    DEPTH,
    DRAWN,
    POWER,
    POWER_DRAWN,
    SHALLOW,
    TRUTH,
    bit,
    drawn_truth,
    drops,
    noisy_curve,
)
from typer.testing import CliRunner

from percussion_model import Scene
from percussion_model.analysis.fitting import FitError
from percussion_model.analysis.fitting.found import DAMPING, ENERGY, LAWS, NAMES
from percussion_model.analysis.fitting.likelihood import (
    EXPONENTS,
    RATIO,
    STIFFNESS,
    coordinates,
    decades,
)
from percussion_model.interface.cli import app
from percussion_model.interface.measured_files import read_curve, read_drop, read_reading
from percussion_model.simulation.uncertain import in_digits

LONG = "PERCUSSION_LONG" in os.environ
# Trials: cells of the bit (None: as by default), samples of a drop, seeds. Truths are made with
# the same cells, so few of them are as good a trial of the intervals; by the power law, which has
# more parameters, they save hours.
SUITE = (4, 200, range(8))
WHOLE = {"bilinear": (None, 450, range(30)), "power": (4, 450, range(30))}
# Of each law: changes of the scene, what truths are drawn from, peaks of the slow tests [m].
TRIALS = {
    "bilinear": ({}, DRAWN, (DEPTH,)),
    "power": (POWER, POWER_DRAWN, (DEPTH, SHALLOW)),
}
# 95 % intervals of those called determined cover so often at least.
LEAST_COVERED = 0.85
# Nothing is off by more than this without a word; an exponent by its logarithm to the base ten.
OFF = 2.0
# Verdicts that call a parameter determined, and how many powers of ten their intervals may span.
TOLD, WIDEST = ("determined", "rival"), 1.0


def written(path, heading, *columns, separator=","):
    rows = zip(*(np.asarray(column).tolist() for column in columns), strict=True)
    lines = [heading, *(separator.join(map(repr, row)) for row in rows)]
    text = "\n".join(lines) + "\n"
    path.write_text(text if separator == "," else text.replace(".", ","), encoding="utf-8")
    return str(path)


def calibrated(folder, scene, seed, truth, samples, peaks):
    """Run the command on slow tests and two drops, from the reference's rock; its JSON."""
    words = ["calibrate", str(folder / "scene.toml"), "--json", "-"]
    for k, depth in enumerate(peaks):
        curve = noisy_curve(seed + 500 * k, truth, depth=depth)
        slow = written(
            folder / f"slow{k}.csv",
            "penetration [mm],force [kN]",
            curve.penetration * 1e3,
            curve.force / 1e3,
        )
        words += ["--curve", slow]
    for k, test in enumerate(drops(scene, seed, truth, samples)):
        heading = "time [ms],bit_position [um]"
        file = written(folder / f"{k}.csv", heading, test.time * 1e3, test.values * 1e6)
        words += ["--drop", f"{file}@{test.speed}"]
    scene.to_toml(folder / "scene.toml")
    ended = CliRunner().invoke(app, [*words, "--out", str(folder / "found.toml")])
    assert ended.exit_code == 0, ended.output
    return json.loads(ended.stdout)


def covers_often_enough(trials):
    for key in trials[0][1]["estimates"]:
        pairs = [(truth[key], fit["estimates"][key]) for truth, fit in trials]
        told = [(x, one) for x, one in pairs if one["verdict"] in TOLD]
        covered = sum(holds(key, x, one) for x, one in told)
        halved = sum(holds(key, x, one, 0.5) for x, one in told)
        width = np.median([decades(key, one["low"], one["high"]) for _, one in told])
        far = sum(abs(decades(key, x, one["value"])) > math.log10(OFF) for x, one in pairs)
        usual = width if key in EXPONENTS else 10.0**width
        print(
            f"{key}: {len(told)} of {len(pairs)} determined, {covered} hold the truth, {halved} "
            f"half as wide, usual width {usual:.4g}, far off {far}"
        )
        assert covered >= LEAST_COVERED * len(told), (key, told)


def holds(key, truth, one, share=1.0):
    """Whether an interval, or this share of it to either side of the value, holds the truth."""
    low, value, high = coordinates([key] * 3, [one["low"], one["value"], one["high"]])
    (at,) = coordinates([key], [truth])
    return value - share * (value - low) <= at <= value + share * (high - value)


def nothing_is_far_off_without_a_word(truth, fit):
    for key, one in fit["estimates"].items():
        if not abs(decades(key, truth[key], one["value"])) < math.log10(OFF):
            assert any(NAMES[key] in text for text in fit["warnings"]), (key, truth, fit)


def what_is_determined_is_written_and_the_rest_kept(fit, before, after):
    for key, one in fit["estimates"].items():
        assert after[key] == (one["value"] if one["verdict"] in TOLD else before[key])


def what_is_called_determined_is_narrow(fit):
    for key, one in fit["estimates"].items():
        narrow = decades(key, one["low"], one["high"]) <= WIDEST
        assert narrow or one["verdict"] not in TOLD, (key, one)
        # the warnings say the same
        said = any(f"({key}) is not determined" in text for text in fit["warnings"])
        assert said == (one["verdict"] not in TOLD), (key, one, fit["warnings"])


def trial(folder, seed, cells, samples, law="bilinear"):
    """Truth and fit of a drawn rock; the checks that hold for each one alone."""
    changes, drawn, peaks = TRIALS[law]
    scene = bit("wave", **({"solver.cells": cells} if cells else {}), **changes)
    truth, began = drawn_truth(seed, drawn), time.process_time()
    fit = calibrated(folder, scene, seed, truth, samples, peaks)
    assert tuple(fit["estimates"]) == LAWS[law]
    print(seed, f"{time.process_time() - began:.0f} s", *lines(truth, fit), sep="\n    ")
    nothing_is_far_off_without_a_word(truth, fit)
    what_is_called_determined_is_narrow(fit)
    written_scene = Scene.from_toml(folder / "found.toml")
    what_is_determined_is_written_and_the_rest_kept(fit, scene, written_scene)
    return truth, fit


@pytest.mark.slow
@pytest.mark.parametrize("seed", SUITE[2] if LONG else SUITE[2][::3])
def test_rocks_that_are_known_are_found_again(seed, tmp_path):
    """Each trial is a test, so that processors share them: all intervals must cover."""
    truth, fit = trial(tmp_path, seed, *SUITE[:2])
    for key, one in fit["estimates"].items():
        assert one["verdict"] not in TOLD or holds(key, truth[key], one), (key, one)


@pytest.mark.skipif(not LONG, reason="half an hour each; set PERCUSSION_LONG=1")
@pytest.mark.parametrize("law", TRIALS)
def test_intervals_of_known_rocks_cover_often_enough(law, tmp_path):
    """`-s` prints how often intervals cover the truth."""
    cells, samples, seeds = WHOLE[law]
    trials = []
    for seed in seeds:
        (tmp_path / str(seed)).mkdir()
        trials.append(trial(tmp_path / str(seed), seed, cells, samples, law))
    covers_often_enough(trials)


def lines(truth, fit):
    """What a trial found, by its truth."""
    for key, one in fit["estimates"].items():
        shown = (one[name] / truth[key] for name in ("value", "low", "high"))
        yield f"{key} {{:.4g}} [{{:.4g}}, {{:.4g}}] {one['verdict']}".format(*shown)


def test_what_is_not_determined_is_written_when_asked_alone(tmp_path):
    scene = bit(**{STIFFNESS: TRUTH[STIFFNESS], RATIO: TRUTH[RATIO]})
    (test,) = drops(scene, 0, samples=40, end=8e-3, speeds=(5.25,))
    file = written(tmp_path / "a.csv", "time,bit position", test.time, test.values)
    scene.to_toml(tmp_path / "scene.toml")
    words = ["calibrate", str(tmp_path / "scene.toml"), "--drop", f"{file}@5.25", "--only", DAMPING]
    out = tmp_path / "out.toml"
    ended = CliRunner().invoke(app, [*words, "--out", str(out)])
    assert ended.exit_code == 0, ended.output
    assert Scene.from_toml(out)[DAMPING] == scene[DAMPING]
    assert "C_R" in ended.output
    assert f"keeps {DAMPING}" in " ".join(ended.stderr.split())
    assert f"wrote {out}" in ended.stderr
    ended = CliRunner().invoke(app, [*words, "--out", str(out), "--write-undetermined", "--force"])
    assert ended.exit_code == 0, ended.output
    assert Scene.from_toml(out)[DAMPING] != scene[DAMPING]


def test_one_number_of_known_error_leaves_what_it_does_not_tell(tmp_path):
    """Two parameters of one number: what is kept, given, and taken to be right is said.

    A rebound bounds gamma from above, by a barrier that takes nothing; of W_R it tells nothing.
    """
    bit().to_toml(tmp_path / "scene.toml")
    words = ["calibrate", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "out.toml")]
    words += ["--measured", "rebound_velocity=2.1+-0.05 m/s @5.25", "--only", RATIO]
    numbers = tmp_path / "numbers.json"
    ended = CliRunner().invoke(app, [*words, "--only", ENERGY, "--json", str(numbers)])
    assert ended.exit_code == 0, ended.output
    shown = " ".join(ended.output.split())
    assert "0.05 m/s given" in shown
    assert "estimated" not in shown
    assert "K_R = 7.5e+08 N/m, C_R = 1e+04 N s/m kept: the intervals hold only if" in shown
    assert ended.output.count(f"wrote {numbers}") == 1
    said = json.loads(numbers.read_text(encoding="utf-8"))
    found, least = said["estimates"], 2.1 - 0.05 * math.sqrt(said["threshold"])
    assert found[RATIO]["high"] == pytest.approx((5.25 / least) ** 2, rel=1e-3)
    text = (tmp_path / "out.toml").read_text(encoding="utf-8")
    assert f"#   {DAMPING} (C_R): not fitted, kept as in scene.toml" in text
    # no more digits than are known
    value = in_digits(found[ENERGY]["value"], 2)
    assert f"#   {ENERGY} (W_R): ≈{value} in 0.00010 to 10 J, open; kept" in text
    assert "rebound_velocity at 5.25 m/s: 1 number, noise 0.05 m/s (given)" in text
    assert Scene.from_toml(tmp_path / "out.toml")[ENERGY] == bit()[ENERGY]


def test_a_curve_alone_says_that_it_tells_nothing_of_the_barrier(tmp_path):
    curve = noisy_curve(2)
    slow = written(tmp_path / "slow.csv", "penetration,force", curve.penetration, curve.force)
    bit().to_toml(tmp_path / "scene.toml")
    ended = CliRunner().invoke(app, ["calibrate", str(tmp_path / "scene.toml"), "--curve", slow])
    shown = " ".join(ended.output.split())
    assert "C_R = 1e+04 N s/m, W_R = 0.05 J kept: a slow test does not determine them" in shown
    assert "hold only if" not in shown


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        (["rock.stiffness"], "rock.stiffness cannot be fitted: must be one of rock.loading_stiff"),
        ([RATIO, RATIO], f"{RATIO} is to be fitted 2 times: name it once"),
    ],
)
def test_only_what_can_be_fitted_is(keys, says, tmp_path):
    curve = noisy_curve(2)
    slow = written(tmp_path / "slow.csv", "penetration,force", curve.penetration, curve.force)
    bit().to_toml(tmp_path / "scene.toml")
    words = ["calibrate", str(tmp_path / "scene.toml"), "--curve", slow]
    for key in keys:
        words += ["--only", key]
    with pytest.raises(FitError, match=re.escape(says)):
        CliRunner().invoke(app, words, catch_exceptions=False)


def test_the_table_fits_a_narrow_terminal_and_the_figure_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    curve = noisy_curve(2)
    slow = written(tmp_path / "slow.csv", "penetration,force", curve.penetration, curve.force)
    bit().to_toml(tmp_path / "scene.toml")
    words = ["calibrate", str(tmp_path / "scene.toml"), "--curve", slow]
    ended = CliRunner().invoke(app, [*words, "--figure", str(tmp_path / "fit.png")])
    assert ended.exit_code == 0, ended.output
    assert "…" not in ended.output
    for word in ("K_R", "N/m", "gamma", "determined", "slow.csv"):
        assert word in ended.output
    assert (tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")
    assert f"wrote {tmp_path / 'fit.png'}" in ended.stderr


@pytest.mark.parametrize(
    ("heading", "separator", "lengths", "forces"),
    [
        ("penetration,force", ",", 1.0, 1.0),
        ("penetration [mm],force [kN]", ",", 1e3, 1e-3),
        ("Force (kN);Penetration (µm)", ";", 1e6, 1e-3),
        ("penetration [in]\tforce [lbf]", "\t", 1.0 / 0.0254, 1.0 / 4.4482216152605),
    ],
)
def test_units_and_separators_of_a_curve(tmp_path, heading, separator, lengths, forces):
    curve = noisy_curve(0)
    columns = [curve.penetration * lengths, curve.force * forces]
    if heading.startswith("Force"):
        columns.reverse()
    file = tmp_path / "slow.csv"
    written(file, heading, *columns, separator=separator)
    found = read_curve(file)
    assert found.penetration == pytest.approx(curve.penetration, rel=1e-12)
    assert found.force == pytest.approx(curve.force, rel=1e-12)


def test_units_of_a_drop_and_of_a_reading(tmp_path):
    file = written(tmp_path / "a.csv", "time [us],gauge force [kN]", [1.0, 2.0], [3.0, 4.0])
    drop = read_drop(f"{file}@5.25", 0.1)
    assert (drop.signal, drop.speed, drop.gauge) == ("gauge_force", 5.25, 0.1)
    assert drop.time == pytest.approx([1e-6, 2e-6])
    assert drop.values == pytest.approx([3e3, 4e3])
    reading = read_reading("penetration=0.85±0.02 mm @ 3")
    assert reading.speed == 3.0
    assert (reading.value, reading.error) == pytest.approx((8.5e-4, 2e-5))
    assert read_reading("penetration_per_blow=0.7+-0.1mm").speed is None


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--curve", "none.csv"], "none.csv: cannot be read"),
        (["--curve", "{swapped}"], "no column is penetration: penetration and force are wanted"),
        (["--curve", "{ragged}"], "row 3 has 1 columns, the heading 2"),
        (["--curve", "{mixed}"], "row 2 has 3 columns, the heading 2, separated by ','"),
        (["--curve", "{words}"], "row 2, column 2 (force): 'much' is no number"),
        (["--curve", "{unit}"], "unit 'kg' must be one of N, kN"),
        (["--curve", "{empty}"], "is empty"),
        (["--drop", "drop.csv"], "--drop drop.csv: must be CSV@SPEED"),
        (["--drop", "{swapped}@5"], "row 1, column 1: 'force' is none of the columns: time is"),
        (["--drop", "{gap}@5"], "no column is a signal: time is wanted, and one of the signals"),
        (["--measured", "rebound=2+-1@5"], "rebound must be one of rebound_velocity"),
        (["--measured", "rebound_velocity=2"], "must be QUANTITY=VALUE+-ERROR"),
        (["--measured", "penetration=2+-1 kg@5"], "unit 'kg' must be one of m, mm"),
    ],
)
def test_the_command_refuses_bad_files(words, says, tmp_path):
    texts = {
        "swapped": "force,depth\n1,2\n",
        "ragged": "penetration,force\n1,2\n3\n",
        "mixed": "penetration,force\n0,1;2,5\n",
        "words": "penetration,force\n1,much\n",
        "unit": "penetration,force [kg]\n1,2\n",
        "gap": "time,gap\n1,2\n",
        "empty": "",
    }
    files = {name: tmp_path / f"{name}.csv" for name in texts}
    for name, text in texts.items():
        files[name].write_text(text, encoding="utf-8")
    bit().to_toml(tmp_path / "scene.toml")
    words = [word.format(**files) for word in words]
    with pytest.raises(FitError, match=re.escape(says)):
        CliRunner().invoke(
            app, ["calibrate", str(tmp_path / "scene.toml"), *words], catch_exceptions=False
        )


def test_the_command_wants_something_to_fit(tmp_path):
    bit().to_toml(tmp_path / "scene.toml")
    ended = CliRunner().invoke(app, ["calibrate", str(tmp_path / "scene.toml")])
    assert ended.exit_code == 2
    assert "nothing to fit" in ended.output
