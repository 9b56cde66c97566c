"""What each effect costs and changes: what is turned, what is told, what is not."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from percussion_model import Scene, simulate
from percussion_model.analysis.change import Change
from percussion_model.analysis.effect_study import (
    NOISE,
    EffectsStudy,
    VariantRun,
    effect_variants,
    step_costs,
    study_effects,
)
from percussion_model.interface.cli import app
from percussion_model.interface.commands import effects
from percussion_model.interface.commands.effects import (
    LONGEST_NAME,
    show_effects,
    table_of,
)
from percussion_model.interface.plotting import effect_bars
from percussion_model.simulation.uncertain import with_short_error

DROP = Path(__file__).parents[1] / "scenarios" / "drop_test.toml"
RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
# Effects that a scene calls by the name of their variant.
TURNED = ("gravity", "feed", "drive", "barrier", "cuttings", "rock", "loss")
SHORT = {"run.duration": 0.6, "run.settle": 0.1}


def variant_of(scene, effect):
    return next(variant for variant in effect_variants(scene) if variant.effect == effect)


def names(scene):
    return {variant.effect: variant.setting for variant in effect_variants(scene)}


# ---------------------------------------------------------------------------- variants


def test_every_effect_of_the_reference_is_turned():
    found = names(Scene())
    assert found == {
        "": "as it is",
        "gravity": "off",
        "feed": "off",
        "drive": "off",
        "barrier": "off",
        "standstill tension": "as in the paper",
        "loading": "n = 1.5",
        "unloading": "q = 0.5",
        "chipping": "by 0.1 mm",
        "cuttings": "half removed",
        "rock law": "linear spring",
        "rock": "off",
        "loss": "off",
        "piston": "rigid",
        "piston and bit": "rigid",
        "leaps": "off",
        "shoulder": "on",
    }
    # whatever a scene calls an effect has a variant
    assert set(Scene().effects_on) <= set(found)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"effects.barrier": True},
        {"effects.gravity": False, "effects.feed": False, "effects.drive": "none"},
        {"effects.loss": False, "effects.barrier": False, "solver.leaps": False},
        {"effects.rock": "none"},
        {"effects.rock": "spring"},
        {"effects.rock": "wall"},
        {"effects.rock": "power", "rock.buttons": 12, "rock.loading_exponent": 1.0},
        {
            "effects.rock": "power",
            "rock.chipping_penetration": 1e-3,
            "rock.unloading_exponent": 2.0,
        },
        {"effects.cuttings": True, "rock.removed_share": 0.0},
        {"piston.model": "rigid"},
        {"piston.model": "absent", "effects.drive": "none"},
        {"solver.name": "fem"},
        {"loss.time": 0.0, "rock.barrier_energy": 0.0},
        RIGID,
    ],
)
def test_each_turn_makes_a_scene_that_differs_in_it(changes):
    scene = Scene().replace(**changes)
    base, *rest = effect_variants(scene)
    assert base.apply(scene) == scene
    assert len({variant.effect for variant in rest}) == len(rest)
    for variant in rest:
        changed = variant.apply(scene)
        assert changed != scene
        gone = set(scene.effects_on) - set(changed.effects_on)
        new = set(changed.effects_on) - set(scene.effects_on)
        if variant.effect in TURNED:
            assert variant.effect in (gone if variant.setting == "off" else new)
            assert variant.off == (variant.setting == "off")


def test_parts_of_the_power_law_change_that_part_alone():
    """Without any of them the law is the bilinear one, under as many buttons."""
    keys = {"loading": "loading_exponent", "unloading": "unloading_exponent",
            "chipping": "chipping_penetration"}  # fmt: skip
    changes = {"effects.rock": "power", "rock.buttons": 12, "rock.loading_stiffness": 6e7}
    for scene in (Scene(), Scene().replace(**changes)):
        for effect, key in keys.items():
            rock = variant_of(scene, effect).apply(scene).rock
            found = {name for name in keys.values() if getattr(rock, name) not in (0.0, 1.0)}
            was_on = {"loading_exponent"} if scene.effects.rock == "power" else set()
            assert found == was_on ^ {key}
            assert rock.buttons == scene.rock.buttons
    spring = variant_of(scene, "rock law").apply(scene)
    assert spring.loading_stiffness == scene.loading_stiffness == 12 * 6e7


def test_the_blows_of_the_reference_reach_the_force_at_which_rock_chips(rigid):
    trial = next(trial for trial in rigid.trials if trial.variant.effect == "chipping")
    chipping = trial.result.scene.rock.chipping_force
    assert np.all(trial.result.counted["peak_bit_force"] > 1.5 * chipping)
    assert rigid.changes(trial)["rate_of_penetration"] > 0.0


# ---------------------------------------------------------------------------- study


@pytest.fixture(scope="module")
def rigid():
    """A study that compiles no waves; rate and period as two runs by hand give them."""
    return study_effects(Scene().replace(**RIGID, **SHORT))


def test_changes_are_those_of_two_runs(rigid):
    scene = rigid.scene
    trial = next(trial for trial in rigid.trials if trial.variant.effect == "barrier")
    with_it = simulate(scene)
    without = simulate(scene.replace(**{"effects.barrier": False}))
    expected = without.rate_of_penetration / with_it.rate_of_penetration - 1.0
    assert abs(expected) > 1e-3
    assert rigid.changes(trial)["rate_of_penetration"] == pytest.approx(expected, rel=1e-12)
    assert trial.numbers()["events"] == without.statistics["events"]
    assert trial.numbers()["blow_time"] == pytest.approx(trial.wall_time / len(without.blows))
    assert rigid.base.numbers()["events"] == with_it.statistics["events"]


def test_what_an_effect_makes_something_else_is_not_compared(rigid):
    by_name = {trial.variant.effect: trial for trial in rigid.trials}
    for effect, word in (("drive", "nothing throws"), ("rock", "no rock"), ("rock law", "spring")):
        trial = by_name[effect]
        assert trial.numbers()["rate_of_penetration"] is None
        assert rigid.changes(trial)["rate_of_penetration"] is None
        assert word in trial.reason
    assert by_name["drive"].numbers()["blow_time"] is None
    assert by_name["rock law"].numbers()["blow_period"] is not None
    assert by_name["gravity"].reason == ""


def test_a_rate_that_scatter_hides_is_no_change(rigid):
    blows = rigid.base.result.blows.copy()
    blows["hole_advance"] *= 1.0 + 40.0 * (-1.0) ** (blows["time"] * 1e6).astype(int)
    hidden = replace(rigid.trials[0], result=replace(rigid.base.result, blows=blows))
    assert hidden.undecided
    assert rigid.changes(hidden)["rate_of_penetration"] is None
    assert "aperiodic" in hidden.reason


def test_a_short_run_does_not_hide_that_the_rate_cannot_be_trusted():
    scene = Scene().replace(**{"effects.loss": False, "solver.cells": 4})
    result = simulate(scene, 0.05, settle=0.0)
    reason = VariantRun(variant_of(Scene(), "loss"), result, result.wall_time, None).reason
    assert "structural loss is off" in reason
    assert "whole blow" in reason


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (17.53, 0.412, "17.5 ± 0.4"),
        (44.8, 40.0, "40 ± 40"),
        (44.8, 30.0, "45 ± 30"),
        (19.3, 2.5, "19.3 ± 2.5"),
        (9.31, 0.96, "9.3 ± 1.0"),
        (16.3691, 0.0096, "16.369 ± 0.010"),
        (-3.21, 1.4, "-3.2 ± 1.4"),
    ],
)
def test_a_value_has_the_digits_that_its_error_leaves(value, error, shown):
    assert with_short_error(value, error) == shown


def test_the_table_fits_a_terminal_and_cuts_no_number(rigid, monkeypatch, capsys):
    rows = table_of(rigid)[1]
    for columns in (80, 40):
        monkeypatch.setenv("COLUMNS", str(columns))
        show_effects(rigid)
        shown = capsys.readouterr().out
        assert "…" not in shown
        for name, *cells in rows:
            lines = [text for text in shown.splitlines() if text.startswith(name.split()[0])]
            for cell in cells:
                assert any(cell in line for line in lines) or len(name) > LONGEST_NAME
                assert cell in shown
        assert max(len(line) for line in shown.splitlines()) <= columns


def test_the_table_of_a_wide_scene_is_one_block(rigid, monkeypatch, capsys):
    """Rows of the reference, whose numbers are as wide as those of any scene that ships."""
    headings, _, _ = table_of(rigid)
    rows = [
        ["standstill tension: as in the paper", "68.5*", "280", "7200", "261825", "undecided",
         "+52.00±0.06", "+0.107±0.008", "-17.0"],
        ["piston: rigid", "123", "0.91", "10", "9457", "12.8±0.3", "-21.9±1.6", "", "+125"],
    ]  # fmt: skip
    monkeypatch.setattr(effects, "table_of", lambda found: (headings, rows, {}))
    monkeypatch.setenv("COLUMNS", "80")
    effects.show_effects(rigid)
    lines = capsys.readouterr().out.splitlines()
    assert sum("standstill" in line for line in lines) == 1
    assert all(any(word in line for line in lines) for row in rows for word in row[1:])


def test_a_dearer_step_is_marked_where_something_was_turned_off(rigid, capsys):
    scene = Scene()
    base = replace(rigid.base, step=1e-7)
    off, tension = variant_of(scene, "feed"), variant_of(scene, "standstill tension")
    trial = replace(rigid.trials[0], variant=off, step=1.01 * NOISE * 1e-7)
    study = EffectsStudy(scene, base, [trial], {})
    assert study.is_costlier(trial)
    assert study.to_dict()["effects"][0]["step_dearer"]
    assert table_of(study)[1][1][1].endswith("*")
    show_effects(study)
    assert "*: turning the effect off made a time step costlier" in capsys.readouterr().out
    assert not study.is_costlier(replace(trial, step=0.99 * NOISE * 1e-7))
    assert not study.is_costlier(replace(trial, variant=tension))
    assert not study.is_costlier(replace(trial, step=None))


def test_a_step_is_measured_in_free_flight():
    waves = Scene().computed_by("wave", **{"solver.cells": 4})
    cost, none = step_costs([waves, Scene().replace(**RIGID)], rounds=1)
    assert none is None
    assert 0.0 < cost < 1.0


def test_numbers_are_plain(rigid):
    plain = json.loads(json.dumps(rigid.to_dict(), allow_nan=False))
    assert plain["scene"]["blows"] > 5
    assert {row["effect"] for row in plain["effects"]} >= {"gravity", "feed", "piston and bit"}
    assert all(math.isfinite(row["wall_time"]) for row in plain["effects"])


def test_figure_has_a_bar_for_each_known_number(rigid):
    pytest.importorskip("matplotlib")
    from percussion_model.interface.plotting.effect_bars import draw_effects

    axes = draw_effects(rigid).axes
    panels = {ax.get_title(loc="left") or ax.get_title(): ax for ax in axes}
    assert list(panels) == [
        # the scene itself has no step to compare with
        "Cost of a blow", "Rate of penetration", "Blow period", "Peak bit force",
    ]  # fmt: skip
    rates = [rigid.changes(trial)["rate_of_penetration"] for trial in rigid.trials]
    bars = panels["Rate of penetration"].patches
    assert len(bars) == sum(rate is not None for rate in rates)
    labels = [text.get_text() for text in axes[0].get_yticklabels()]
    assert "barrier off" in labels


def test_command_prints_a_table_and_reasons(tmp_path):
    file = tmp_path / "scene.toml"
    Scene(title="Which are needed").replace(**RIGID, **SHORT).to_toml(file)
    out = tmp_path / "out"
    words = ["effects", str(file), "--out", str(out), "--json", str(tmp_path / "found.json")]
    shown = CliRunner().invoke(app, words)
    assert shown.exit_code == 0, shown.output
    for text in ("Which are needed", "barrier off", "period", "events", "nothing throws"):
        assert text in shown.output
    assert sorted(path.name for path in out.iterdir()) == [
        "effects.png", "effects.svg", "made_by.json",
    ]  # fmt: skip
    assert json.loads((tmp_path / "found.json").read_text())["solver"] == "rigid"


def test_bars_and_numbers_of_the_figure_stay_within_their_panels():
    """Long bars are cut off before the axis ends; numbers stand beside or within theirs."""
    changes = [0.52, 5.33, -0.81, 0.6, 1.25, -0.217, 0.0, None, 0.3, 0.2]
    errors = [0.0006, 0.06, 0.002, 0.0, None, 0.016, 0.0, None, 0.4, None]
    shown = [
        Change(change, error if k != 4 else None, error or 0.0, hidden=k == 9)
        for k, (change, error) in enumerate(zip(changes, errors, strict=True))
    ]
    fig = Figure(figsize=(12.0, 4.6), layout="constrained")
    axes = fig.subplots(1, 5, sharey=True)
    for ax in axes:
        effect_bars._changes(shown, "", ax)
    axes[0].set_yticks(range(10), [f"a long name of {k}" for k in range(10)])
    fig.draw_without_rendering()
    for ax in axes:
        frame = ax.get_window_extent()
        for bar in ax.patches:
            drawn = bar.get_window_extent()
            assert frame.x0 + 2.0 < drawn.x0
            assert drawn.x1 < frame.x1 - 2.0
        for text in ax.texts:
            drawn = text.get_window_extent()
            assert frame.x0 <= drawn.x0, text.get_text()
            assert drawn.x1 <= frame.x1, text.get_text()
        assert [text.get_text() for text in ax.texts[-2:]] == ["undecided"] * 2
        assert ax.texts[4].get_text() == " ≈+120 "  # its error is not known
        assert ax.texts[5].get_text() == " -21.7±1.6 "
        # no number stands on a bar
        for bar, text in zip([ax.patches[k] for k in (0, 1, 2, 5)], ax.texts[:3] + ax.texts[5:6],
                             strict=True):  # fmt: skip
            drawn, place = bar.get_window_extent(), text.get_window_extent()
            assert place.x1 <= drawn.x0 + 1.0 or drawn.x1 - 1.0 <= place.x0, text.get_text()


def test_dashes_of_a_drop_test_have_their_reason():
    bit = Scene().replace(**{"piston.model": "absent", "effects.drive": "none"})
    found = study_effects(bit.replace(**{"run.duration": 0.02, "run.settle": 0.0}))
    assert not found.base.reason
    # what has nothing to tell is left out, and what is left has a reason for each dash
    headings, rows, reasons = table_of(found)
    assert not any("rate" in heading or "period" in heading for heading in headings)
    assert len(reasons) > 1
    assert {name for name, *cells in rows if "-" in cells[3:]} <= set(reasons)
    assert all(len(row) == len(headings) for row in rows)
    axes = effect_bars.draw_effects(found).axes
    assert len(axes) == 2 + len([text for text in headings if text.endswith("%")])
    assert all(ax.patches for ax in axes)


def test_effects_on_a_drop_test_are_shown_as_changes_of_the_fall():
    scene = Scene.from_toml(DROP)
    told = []
    found = study_effects(scene, progress=lambda text, share: told.append(text))
    assert told[:2] == ["the scene as it is", "gravity off"]
    headings, rows, _ = table_of(found)
    assert headings[4:] == ["depth\nmm", "depth\n%", "rebound\n%", "rest\n%"]
    by_name = {name: dict(zip(headings[4:], cells, strict=True)) for name, _, _, _, *cells in rows}
    base = found.base.result
    without = simulate(scene.replace(**{"effects.barrier": False}))
    for name, heading in (("depth", "depth\n%"), ("rebound_velocity", "rebound\n%")):
        change = 100.0 * (without.fall[name] / base.fall[name] - 1.0)
        shown = by_name["barrier off"][heading]
        if shown != "undecided":
            assert float(shown.split("±")[0]) == pytest.approx(change, rel=0.05, abs=0.2)
    # what has no error by its cells is said to have none
    assert by_name["loss off"]["depth\n%"].startswith("≈")
    # a bit in the air has no depth, and this is said
    feed_off = next(trial for trial in found.trials if trial.variant.effect == "feed")
    assert by_name["feed off"]["depth\nmm"] == "-"
    assert "no depth" in feed_off.reason
    assert not found.base.reason
    entry = found.to_dict()["effects"][0]
    assert set(entry["changes"]) == {"depth", "rebound_velocity", "rest_time"}
    titles = [
        ax.get_title(loc="left") or ax.get_title() for ax in effect_bars.draw_effects(found).axes
    ]
    assert {"Depth", "Rebound velocity", "Time of rest"} <= set(titles)
