"""Hints at values far from what is usual."""

from __future__ import annotations

from pathlib import Path

import pytest

from percussion_model import Scene
from percussion_model.interface.cli import _guarded, app
from percussion_model.interface.commands import common
from percussion_model.scene.hammers import bar_test, hammer, hammers
from percussion_model.scene.parameters import HOLE_DIAMETER, parameter_table
from percussion_model.scene.rows import SceneError
from percussion_model.scene.typical import FAR, hint_of, unusual_values

SCENARIOS = Path(__file__).parents[1] / "scenarios"
RIGID = str(SCENARIOS / "rigid.toml")
SCENES = sorted((*SCENARIOS.glob("*.toml"), *SCENARIOS.glob("drawn/*.toml")))


@pytest.fixture
def percussion(capsys, monkeypatch):
    monkeypatch.setattr(common, "_hinted", set())

    def call(*words):
        code = _guarded(lambda: app([str(word) for word in words], standalone_mode=False))
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return call


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_no_ready_made_scene_is_unusual(path):
    assert list(unusual_values(Scene.from_toml(path))) == []


def test_no_hammer_on_the_market_is_unusual():
    for scene in (*map(hammer, hammers()), bar_test(), Scene()):
        assert list(unusual_values(scene)) == []


@pytest.mark.parametrize(
    "row",
    [row for row in (HOLE_DIAMETER, *parameter_table()) if row.typical],
    ids=lambda row: row.key,
)
def test_typical_ranges_are_within_bounds_and_hold_the_default(row):
    low, high = row.typical
    assert row.lower < low < high < row.upper
    assert row.default is None or low <= row.default <= high
    key = row.key.replace("*", "0")
    for usual in (0.0, low, high, -low, low / (0.99 * FAR), high * 0.99 * FAR):
        assert hint_of(key, [usual]) == ""
    for unusual in (low / (1.01 * FAR), high * 1.01 * FAR):
        assert hint_of(key, [low, unusual]).startswith(f"{key} = {unusual:g} {row.unit}: ")


@pytest.mark.parametrize(
    ("key", "value", "meant"),
    [
        ("feed.force", 2.5, "2.5 kN"),
        ("feed.force", -2.5, "-2.5 kN"),
        ("feed.force", 5e6, "5e+06 mN"),
        ("drive.reversal_distance", 40.0, "40 mm"),
        ("rock.loading_stiffness", 750.0, "750 kN/mm"),
        ("rock.loading_stiffness", 0.75e1, ""),
        ("bit.sections.0.youngs_modulus", 210.0, "210 GPa"),
        ("bit.sections.0.density", 7.85, "7.85 g/cm^3"),
        ("string.rods.1.sections.0.length", 3660.0, "3660 mm"),
        ("hole_diameter", 8.255, "8.255 cm"),
    ],
)
def test_a_hint_asks_for_the_unit_that_was_meant(key, value, meant):
    hint = hint_of(key, [value])
    assert f"{key} = {value:g} " in hint
    assert ("did you mean" in hint) == bool(meant)
    assert f"did you mean {meant}?" in hint or not meant
    assert "are usual" in hint


def test_only_what_is_given_and_matters_is_looked_at():
    found = dict(unusual_values(Scene(feed={"force": 2.5}, drive={"reversal_distance": 40})))
    assert set(found) == {"feed.force", "drive.reversal_distance"}
    off = Scene(feed={"force": 2.5}, effects={"feed": False})
    assert list(unusual_values(off)) == []
    assert hint_of("loss.time", [1e-3]) == hint_of("no.key", [1.0]) == ""


def test_a_command_hints_once_for_each_parameter_and_runs(percussion):
    short = "--duration", "0.05", "--settle", "0", "--json", "-"
    code, out, err = percussion("run", RIGID, *short, "--set", "feed.force=2.5")
    assert code == 0
    assert out.startswith("{")
    told = " ".join(err.split())
    assert told == (
        "percussion: hint: feed.force = 2.5 N: did you mean 2.5 kN? 2500 to 18100 N are usual"
    )
    assert percussion("run", RIGID, *short, "--set", "feed.force=2.6")[2] == ""
    sections = "--set", "bit.sections.0.density=7.85", "--set", "piston.sections.0.density=7.85"
    err = percussion("run", RIGID, *short, *sections)[2]
    assert err.count("hint: ") == 2  # of the bit and of the piston


def test_a_study_hints_once_for_an_axis(percussion, tmp_path):
    words = "study", RIGID, "--out", tmp_path / "out", "--processes", "1", "--no-report"
    code, _, err = percussion(*words, "--over", "feed.force=20,2000,2.5,2500")
    assert code == 0
    assert err.count("hint: ") == 1
    assert "feed.force = 2.5 N: did you mean 2.5 kN?" in " ".join(err.split())


def test_bounds_are_still_bounds():
    with pytest.raises(SceneError, match=r"must be a number from 0\.001 to 10 m"):
        Scene(hole_diameter=165)
