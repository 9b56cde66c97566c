"""Numbers that say how sure they are: tables, JSON, maps, pages, Python."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from percussion_model import Scene, Settled, compare, settled, simulate
from percussion_model.analysis.change import Change, change_error, change_of
from percussion_model.analysis.comparison import Comparison
from percussion_model.analysis.effect_study import EffectsStudy, Variant, VariantRun
from percussion_model.analysis.study import Study, grid, table
from percussion_model.analysis.study.response import KINDS, ROW
from percussion_model.coupling.verdict import _jump
from percussion_model.interface.commands.effects import table_of
from percussion_model.interface.explore import study as report_study
from percussion_model.interface.plotting.compared_blows import draw_comparison
from percussion_model.interface.plotting.effect_bars import draw_effects
from percussion_model.interface.plotting.overview import draw_overview
from percussion_model.interface.plotting.paper import _points
from percussion_model.interface.report import headline_rows, render_report
from percussion_model.interface.terminal import show_comparison, show_settled, show_summary
from percussion_model.simulation.error_estimate import LARGE, Estimate, _large_error
from percussion_model.simulation.uncertain import (
    change_text,
    in_digits,
    in_few_characters,
    is_undecided,
    rate_text,
    with_error,
)
from percussion_model.simulation.validity import numerical_note

RIGID = Scene().computed_by("rigid")
BOUNCING = RIGID.replace(**{"feed.force": 150.0})


@pytest.fixture(scope="module")
def aperiodic():
    return simulate(BOUNCING, 4.0, settle=1.0)


@pytest.fixture(scope="module")
def periodic():
    return simulate(RIGID, 4.0, settle=1.0)


def hidden_in(result):
    """The same run with advances of the hole in which nobody sees a rate."""
    blows = result.blows.copy()
    blows["hole_advance"] = 0.0
    blows["hole_advance"][len(blows) // 2 :: len(blows) // 2] = 1e-3
    found = replace(result, blows=blows, rate_of_penetration_relative_error=math.nan)
    off = found.rate_of_penetration_standard_error / found.rate_of_penetration
    return replace(found, rate_of_penetration_relative_error=2.0 * off)


@pytest.fixture(scope="module")
def hidden(aperiodic):
    return hidden_in(aperiodic)


# ------------------------------------------------------------------------------ text


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (13.3, 0.32, "13.30 ± 0.32"),
        (16.349, 0.0, "16.349"),
        (0.0, 0.0, "0"),
        (13.3, 318.0, "undecided, 10 ± 320"),
        (963743.0, 1927.0, "963700 ± 1900"),
        (1e-6, 5e-6, "undecided, 0.0000010 ± 0.0000050"),
    ],
)
def test_a_number_with_its_error(value, error, shown):
    assert with_error(value, error) == shown


def test_what_an_error_hides():
    assert is_undecided(-41.7, 318.0)
    assert not is_undecided(0.0, 0.0)  # nothing is crushed, and that is known
    assert not is_undecided(1.0, math.nan)


@pytest.mark.parametrize(
    ("change", "error", "shown"),
    [
        (-0.528, 0.3, "-50±30"),
        (0.021, 0.003, "+2.1±0.3"),
        (-0.0141, 0.0096, "-1.4±1.0"),
        (0.2, 0.014, "+20.0±1.4"),
        (-0.01, 0.09, "undecided"),
        (-0.2041, 0.1983, "undecided"),  # -20±20
        (0.0123, None, "+1.23"),
        (0.0123, 1e-7, "+1.23"),
        (1e-6, 0.0, "0.00"),
        (None, None, "-"),
    ],
)
def test_a_change_with_its_error(change, error, shown):
    assert change_text(change, error) == shown


def test_zeros_that_are_known_are_shown():
    assert [in_digits(value, 4) for value in (0.852, 22.0, 1020.0, 59500.0)] == [
        "0.8520", "22.00", "1020", "59500",
    ]  # fmt: skip
    assert [in_digits(value, 2) for value in (750.0, 110.0, 0.0, 1.5e9)] == [
        "750", "110", "0", "1.5e+09",
    ]  # fmt: skip


def test_large_shares_have_no_exponent():
    (said,) = _large_error(Estimate(grid=7.5, scatter=0.0, floor=0.0), "wave")
    assert f"{LARGE} 750 %, as coarser runs show" in said
    (said,) = numerical_note(1.0, "wave")
    assert said.startswith("100 % of the energy put in is taken")
    (found,) = _jump("bit.position", 1.1, 1e-3)
    assert found.text.startswith("bit.position changes by 110 % of")


def test_a_number_of_a_narrow_column():
    assert in_few_characters(16.3494, 1e-7) == "16.35"
    assert in_few_characters(17.53, 0.412) == "17.5±0.4"
    assert in_few_characters(1.0, 2.0) == "undecided"
    assert in_few_characters(None, 1.0) == "-"


def test_a_rate_without_estimate_says_what_is_known():
    base = {"rate_of_penetration": 0.0175, "rate_of_penetration_error": None}
    assert rate_text(base) == "17.5, error not estimated"
    scattered = base | {"rate_of_penetration_standard_error": 4e-4}
    assert rate_text(scattered) == "17.50 ± 0.40 (scatter alone)"
    assert rate_text(base | {"rate_of_penetration_standard_error": 1.0}).startswith("undecided")
    assert rate_text(scattered, 3600.0).startswith("63.0 ± 1.4")


# -------------------------------------------------------------------------- a run


def test_summary_has_the_error_beside_the_rate(aperiodic, periodic, hidden):
    found = aperiodic.summary()
    assert found["rate_of_penetration_error"] == pytest.approx(
        found["rate_of_penetration"] * found["rate_of_penetration_relative_error"]
    )
    assert found["rate_of_penetration_undecided"] is False
    assert hidden.summary()["rate_of_penetration_undecided"] is True
    json.dumps(found, allow_nan=False)
    # how far means of other stretches of that many blows lie apart
    count = len(aperiodic.counted)
    velocity = simulate(BOUNCING, 120.0, settle=4.0).counted["impact_velocity"]
    means = velocity[: len(velocity) // count * count].reshape(-1, count).mean(axis=1)
    assert len(means) > 30
    stated = found["standard_errors"]["impact_velocity"]
    assert stated == pytest.approx(np.std(means), rel=0.5)
    assert periodic.summary()["standard_errors"]["impact_velocity"] < 1e-2 * stated


def test_the_window_that_is_fixed_is_known_to_a_blow(periodic, aperiodic):
    off = periodic.rate_of_penetration_fixed_window - periodic.rate_of_penetration
    error = periodic.rate_of_penetration_fixed_window_error
    assert abs(off) <= error <= 0.05 * periodic.rate_of_penetration
    # the bit bounces by more than it drills
    assert aperiodic.rate_of_penetration_fixed_window_error > aperiodic.rate_of_penetration


def test_tables_of_runs(aperiodic, hidden, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    show_summary(aperiodic)
    shown = capsys.readouterr().out
    for name in ("Rate of penetration", "Blow period", "Impact velocity", "Blow energy"):
        (line,) = [text for text in shown.splitlines() if name in text]
        assert "±" in line
    show_summary(hidden)
    assert "undecided" in capsys.readouterr().out
    show_settled(settled(BOUNCING, most_blows=60))
    shown = capsys.readouterr().out
    # rate, period, frequency, velocity, efficiency, three in the units of drillers, what ± is
    assert sum("±" in line for line in shown.splitlines()) == 9
    assert "by the scatter of blows alone" in " ".join(shown.split())


def test_a_rate_in_one_line_of_python(aperiodic, hidden):
    assert rate_text(aperiodic.summary()) in repr(aperiodic)
    assert "undecided" in repr(hidden)
    found = settled(RIGID)
    assert "rate='1" in repr(found)
    assert not found.rate_of_penetration_undecided
    blind = Settled("aperiodic", 0, 1e-3, 2e-3, math.nan, found.cycle[:0], found.blows, 1.0, 1.0)
    assert blind.summary()["rate_of_penetration_undecided"] is True
    assert "undecided" in repr(blind)


@pytest.fixture(scope="module")
def undamped():
    return simulate(Scene().replace(**{"effects.loss": False}), 0.8, settle=0.2)


def test_a_rate_of_the_cells_is_undecided_wherever_it_is_shown(undamped, capsys, monkeypatch):
    """Without loss it must not be trusted, as a warning says, however small its error is."""
    monkeypatch.setenv("COLUMNS", "80")
    error = undamped.rate_of_penetration_standard_error
    assert 0.0 < error < 0.5 * undamped.rate_of_penetration
    summary = undamped.summary()
    assert summary["rate_of_penetration_undecided"] is True
    assert rate_text(summary).startswith("undecided, at this resolution ")
    assert "±" in rate_text(summary)  # its scatter is known
    assert "undecided" in repr(undamped)
    show_summary(undamped)
    shown = capsys.readouterr().out
    assert [line.split("│")[1].strip() for line in shown.splitlines() if "undecided" in line] == [
        "Rate of penetration",
        "Rate in an hour",
        "Penetration per blow",
    ]
    rows = {name: texts for name, *texts in headline_rows(summary)}
    for name in ("Rate of penetration", "Penetration per blow"):
        assert all(text.startswith("undecided") for text in rows[name])
    page = render_report(undamped, [])
    card = page[page.index('<div class="card">') :]
    assert card.index("undecided, at this resolution") < card.index("</b>")
    label = draw_overview(undamped).axes[1].get_legend().get_texts()[0].get_text()
    assert "undecided" in label


def test_differences_to_a_rate_of_the_cells_are_undecided(undamped, periodic, capsys):
    found = Comparison({"wave": undamped, "rigid": periodic})
    assert {"rate_of_penetration", "penetration_per_blow"} <= set(found.undecided()["rigid"])
    show_comparison(found)
    lines = capsys.readouterr().out.splitlines()
    (line,) = [one for one in lines if "Rate of penetration" in one]
    assert line.rstrip(" │").endswith("undecided")


def test_a_run_without_loss_claims_no_error_by_its_cells(undamped, capsys):
    assert undamped.errors == {}
    assert not any("--accuracy" in text for text in undamped.warnings)
    show_summary(undamped)
    shown = " ".join(capsys.readouterr().out.split())
    assert "No error by them is known" in shown


def test_a_stationary_rate_of_the_cells_is_undecided():
    found = settled(Scene().replace(**{"effects.loss": False}), most_blows=40)
    assert found.summary()["rate_of_penetration_undecided"] is True
    assert "undecided, at this resolution" in repr(found)


# --------------------------------------------------------------------- comparison


def test_an_error_of_a_ratio():
    rng = np.random.default_rng(3)
    a, b = rng.normal(5.0, 0.05, 200_000), rng.normal(4.0, 0.08, 200_000)
    assert change_error(5.0, 0.05, 4.0, 0.08) == pytest.approx(np.std(a / b), rel=0.01)
    # however large the errors: 5 ± 1 and 15 ± 13 are not known to differ
    assert change_error(5.0, 1.0, 15.0, 13.0) >= abs(5.0 / 15.0 - 1.0)
    assert change_error(1.0, None, 2.0, None) is None
    assert change_error(None, 1.0, 2.0, 1.0) is None


def test_one_known_error_is_enough_to_hide_a_change():
    base = {"a": 2.0, "a_error": 0.3}
    here = {"a": 2.1, "a_error": None, "a_standard_error": None}
    found = change_of(here, base, "a")
    assert (found.error, found.is_undecided, found.text()) == (None, True, "undecided")
    found = change_of(here | {"a": 2.8}, base, "a")
    assert (found.is_rough, found.text()) == (True, "≈+40")  # no digit that is not known
    assert change_of(here, {"a": 2.0}, "a").text() == "≈+5.0"
    assert change_of(here | {"a": 2.0001}, {"a": 2.0}, "a").text() == "≈0"


def test_scatter_of_a_change_is_a_verdict_beyond_three_standard_errors():
    base = {"a": 1.0, "a_error": 0.03, "a_standard_error": 0.03}
    for change, hidden in ((0.04, True), (-0.08, True), (0.16, False)):
        here = {"a": 1.0 + change, "a_error": 0.03, "a_standard_error": 0.03}
        assert change_of(here, base, "a").is_undecided == hidden
    # two numbers of which scatter alone is known
    here = {"a": 1.3, "a_standard_error": 0.2}
    assert change_of(here, {"a": 1.0, "a_standard_error": 0.1}, "a").is_undecided


def test_runs_on_the_same_grid_differ_by_scatter_alone():
    base = {"a": 1.0, "a_error": 0.2, "a_standard_error": 1e-3}
    here = base | {"a": 1.1}
    assert change_of(here, base, "a").is_undecided
    found = change_of(here, base, "a", same_grid=True)
    assert found.error == pytest.approx(math.hypot(1e-3, 1.1e-3))
    assert not found.is_undecided


def test_a_change_that_shows_in_no_digit_is_none():
    assert Change(1e-9, 1e-7, 1e-7).text() == "0.00"
    assert Change(1e-3, 1e-2, 1e-2).text() == "undecided"


def test_differences_have_the_errors_of_both(aperiodic, periodic, capsys, monkeypatch):
    same = simulate(BOUNCING, 4.0, settle=1.5)  # the same motion, and fewer of its blows
    found = Comparison({"wave": aperiodic, "fem": periodic, "rigid": same})
    errors = found.difference_errors()["fem"]["rate_of_penetration"]
    base = aperiodic.rate_of_penetration
    parts = periodic.rate_of_penetration_error, aperiodic.rate_of_penetration_error
    ratio = periodic.rate_of_penetration / base
    assert errors == pytest.approx(math.hypot(parts[0], ratio * parts[1]) / base)
    assert "rate_of_penetration" in found.undecided()["rigid"]
    assert "rate_of_penetration" not in found.undecided()["fem"]
    plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert plain["undecided"]["rigid"]
    monkeypatch.setenv("COLUMNS", "80")
    show_comparison(found)
    (line,) = [one for one in capsys.readouterr().out.splitlines() if "Rate of pen" in one]
    assert line.count("±") == 3  # two rates and a difference; the periodic rate has no scatter
    assert line.rstrip(" │").endswith("undecided")


def test_equal_runs_differ_by_nothing():
    found = compare(RIGID, ["rigid"], 1.0, 0.2).results["rigid"]
    assert set(Comparison({"a": found, "b": found}).differences()["b"].values()) <= {0.0, None}


def test_effects_tell_changes_with_errors(aperiodic, periodic, hidden):
    def trial(result, name):
        return VariantRun(Variant(name, "off"), result, 1.0, None)

    trials = [trial(periodic, "a"), trial(hidden, "b")]
    found = EffectsStudy(RIGID, trial(aperiodic, ""), trials, {})
    headings, rows, _ = table_of(found)
    place = headings.index("rate\n%")
    assert "±" in rows[1][place]
    assert rows[2][place] == "undecided"
    told = found.to_dict()["effects"]
    assert told[0]["change_errors"]["rate_of_penetration"] > 0.0
    assert told[1]["rate_of_penetration_undecided"] is True
    drawn = [text.get_text() for ax in draw_effects(found).axes for text in ax.texts]
    assert any("±" in text for text in drawn)


def test_effects_know_the_error_that_the_grid_makes():
    """Lengths that fit no common cell: the rate is known to a per cent, and so is a change."""
    lengths = {"piston.sections.0.length": 0.287, "bit.sections.0.length": 0.411}
    scene = Scene().computed_by("wave", **lengths, **{"run.duration": 1.0, "run.settle": 0.4})
    result = simulate(scene, record_events=False)
    base = VariantRun(Variant("", "as it is"), result, 1.0, None)
    without = simulate(scene.replace(**{"effects.gravity": False}), record_events=False)
    found = EffectsStudy(
        scene, base, [VariantRun(Variant("gravity", "off"), without, 1.0, None)], {}
    )
    assert base.numbers()["rate_of_penetration_error"] == result.rate_of_penetration_error
    headings, rows, _ = table_of(found)
    assert "±" in rows[0][headings.index("rate\nmm/s")]
    error = found.change_errors(found.trials[0])["rate_of_penetration"]
    assert error > 0.9 * result.rate_of_penetration_relative_error > 5e-3
    assert found.warnings() == result.warnings  # and nothing twice


def test_a_difference_without_errors_is_no_verdict(periodic, capsys):
    other = RIGID.replace(**{"feed.force": 4000.0})
    lone = simulate(other, 3.0, settle=1.0, error_estimate=False)
    found = Comparison({"wave": periodic, "fem": lone})
    assert found.difference_errors()["fem"]["blow_period"] is None
    show_comparison(found)
    (line,) = [one for one in capsys.readouterr().out.splitlines() if "Blow period" in one]
    assert "≈" in line


def test_falls_are_compared_by_their_depth(capsys):
    drop = Scene().replace(**{"piston.model": "absent", "effects.drive": "none"})
    drop = drop.replace(**{"start.bit_velocity": 5.25, "run.duration": 0.1, "run.settle": 0.0})
    found = compare(drop, ["wave", "rigid"])
    assert set(found.differences()["rigid"]) == set(found.difference_errors()["rigid"])
    depths = [result.fall["depth"] for result in found.results.values()]
    off = found.differences()["rigid"]["depth"]
    assert off == pytest.approx(depths[1] / depths[0] - 1.0)
    show_comparison(found)
    shown = capsys.readouterr().out
    assert "Depth of the bit" in shown
    assert "Impact velocity" not in shown
    assert " - " not in shown
    # what is known of rigid bodies
    assert "a number is exact to the digits shown" in " ".join(shown.split())
    titles = " ".join(
        ax.get_title(loc="left") + ax.get_title() for ax in draw_comparison(found).axes
    )
    assert "piston" not in titles
    assert "blow" not in titles


def test_what_is_said_of_errors_is_that_of_the_solvers(periodic, aperiodic, capsys):
    show_comparison(Comparison({"rigid": periodic}))
    shown = capsys.readouterr().out
    assert "Rigid bodies have no cells" in shown
    assert "by discretisation and" not in shown
    assert "stands before a difference" not in shown


# ------------------------------------------------------------------- pages, figures


def test_report_says_errors_in_each_unit(aperiodic, hidden):
    rows = {name: (si, other) for name, si, other in headline_rows(aperiodic.summary())}
    for text in rows["Rate of penetration"] + rows["Blow period"]:
        assert "±" in text
    page = render_report(hidden, [])
    hour = page[page.index("rate of penetration (") :]
    assert hour[: hour.index("</span>")].count("undecided") == 1
    card = page[page.index('<div class="card">') :]
    assert card.index("undecided") < card.index("</b>")


def test_overview_draws_the_mean_with_its_error(aperiodic, hidden):
    def words(result):
        ax = draw_overview(result).axes[1]
        return ax.get_legend().get_texts()[0].get_text(), len(ax.lines)

    text, lines = words(aperiodic)
    assert rate_text(aperiodic.summary()) in text
    word, fewer = words(hidden)
    assert "undecided" in word
    # the advance of the hole, the mean, and no more; an empty entry of the legend beside it
    assert (lines, fewer) == (2, 2)
    ax = draw_overview(aperiodic).axes[1]
    rate = aperiodic.blows["hole_advance"] / aperiodic.blows["period"]
    assert ax.lines[0].get_ydata() == pytest.approx(1e3 * rate)


def made_study(points, blind):
    rows = np.zeros(len(points), ROW)
    rows["rate_of_penetration"] = np.linspace(1e-2, 2e-2, len(points))
    rows["rate_of_penetration_error"] = np.where(blind, 3e-2, 1e-4)
    rows["kind"] = KINDS.index("aperiodic")
    return Study(RIGID, points, rows, [""] * len(points))


def test_a_study_knows_what_is_undecided():
    points = grid({"feed.force": [1e2, 1e3, 2e3], "drive.reversal_distance": [0.01, 0.02]})
    blind = np.array([True, False, False, False, False, True])
    found = made_study(points, blind)
    assert found.undecided.tolist() == blind.tolist()
    lines = dict(found.headlines())
    assert "±" in lines["Lowest rate"]
    assert "feed.force = 100 N, drive.reversal_distance = 0.02 m" in lines["Lowest rate"]
    assert lines["Undecided"].startswith("2 ")
    assert found.to_pandas()["undecided"].tolist() == blind.tolist()
    assert found.to_xarray()["undecided"].values.ravel().tolist() == blind.tolist()


def test_a_study_without_loss_tells_no_rate():
    """Rates of waves without loss are of the cells; of rigid bodies they are not."""
    lossy = Scene()
    bare = lossy.replace(**{"effects.loss": False})
    points = grid({"feed.force": [1e3, 2e3], "loss.time": [0.0, 5e-6, 1e-5]})
    sure = made_study(points, np.zeros(6, bool))
    assert not sure.undecided.any()
    of_cells = points.values[:, points.keys.index("loss.time")] == 0.0
    assert np.count_nonzero(of_cells) == 2
    assert replace(sure, scene=lossy).undecided.tolist() == of_cells.tolist()
    assert replace(sure, scene=bare).undecided.all()
    lines = dict(replace(sure, scene=bare).headlines())
    assert lines["Undecided"] == "6 rates: without loss in the bars they depend on the cells"
    assert "Lowest rate" not in lines


def test_a_report_carries_what_it_must_not_colour():
    points = grid({"feed.force": [1e2, 1e3, 2e3], "drive.reversal_distance": [0.01, 0.02]})
    blind = np.array([True, False, False, False, False, True])
    carried = report_study.data(made_study(points, blind))
    assert carried["undecided"] == blind.astype(int).tolist()
    assert "rate" in carried["hideable"]
    known = [text for text, grey in zip(carried["rates"], blind, strict=True) if not grey]
    assert all("±" in text for text in known)
    assert report_study.data(made_study(points, np.zeros(6, bool)))["undecided"] == [0] * 6


def test_error_bars_of_figure_9_stay_in_the_panel():
    found = made_study(table({"feed.force": [1e2, 1e3, 2e3]}), np.array([True, False, False]))
    found.rows["rate_of_penetration_error"][1] = 0.99 * found.rows["rate_of_penetration"][1]
    found.rows["rate_of_penetration_error"][2] = 0.9 * found.rows["rate_of_penetration"][2]
    ax = Figure().subplots()
    _points(ax, found)
    low, high = ax.get_ylim()
    rate, error = (1e3 * found.rows[f"rate_of_penetration{end}"][1:] for end in ("", "_error"))
    assert low <= np.min(rate - error)
    assert high >= np.max(rate + error)
