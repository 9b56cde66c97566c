"""Scripted scenarios of controllers show what they are about."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from percussion_model.interface import progress
from percussion_model.interface.commands.common import BAD_INPUT
from scenarios import results, rod_addition, unstable_controller, void_cut_back
from scenarios.coupled import print_numbers, run, write

BIG = 40_000  # bytes of a figure with five panels


@pytest.fixture(scope="module")
def void(feed_control):
    return void_cut_back.simulate(feed_control, 3.6)


def test_percussion_is_cut_back_in_a_void(void, tmp_path):
    """The pressure is below half 0.3 s after the void begins; the blows are fewer and weaker."""
    cut, full = (void_cut_back.numbers(found) for found in void.values())
    assert cut["entered"] == full["entered"]
    assert cut["low_after"] < 0.3
    assert math.isnan(full["low_after"])
    assert cut["dry_frequency"] < 0.6 * full["dry_frequency"]
    assert cut["dry_power"] < full["dry_power"] / 3.0
    assert cut["speed"] < 0.8 * full["speed"]
    assert void_cut_back.draw(void, tmp_path / "void.png").stat().st_size > BIG


def test_the_string_lands_softly_after_a_cut_back(void):
    """Without it the integral winds up in the void; with it the feed does not even overshoot."""
    cut, full = (void_cut_back.numbers(found) for found in void.values())
    assert cut["highest"] < 1.05
    assert full["highest"] > 1.5
    assert cut["back_after"] < 1.3
    # both drill on from the floor
    assert all(found["hammer.bit.position"][-1] > void_cut_back.FLOOR for found in void.values())
    assert {float(mode) for mode in void["with cut-back"]["controller.mode"]} == {0.0, 1.0}


def test_a_new_rod_is_taken_off_the_bit(feed_control, tmp_path):
    """Its weight comes at once, and the feed is back within a second."""
    runs = rod_addition.simulate(feed_control, 2.6)
    kept, free = (rod_addition.numbers(found) for found in runs.values())
    rod = 2.4e-3 * 3.0 * 7850.0 * 10.0
    assert kept["weight"] == free["weight"] == pytest.approx(rod, rel=1e-9)
    assert 0.05 < kept["highest"] < 0.2
    assert kept["back_after"] < 1.0
    assert kept["late_feed"] == pytest.approx(3000.0, rel=0.02)
    # left alone, the weight stays on the bit
    assert math.isnan(free["back_after"])
    before = runs["constant force"]["string.feed_force_mean"][100]
    assert free["late_feed"] - before == pytest.approx(rod, rel=0.05)
    assert rod_addition.draw(runs, tmp_path / "rod.png").stat().st_size > BIG


def test_an_unstable_controller_is_seen_to_be(feed_control, tmp_path):
    """Its swing grows by itself and violates the limit of the feed; the other one stays calm."""
    runs = unstable_controller.simulate(feed_control, 3.8)
    calm, wild = (unstable_controller.numbers(found) for found in runs.values())
    assert calm["growth"] < 0.0
    assert calm["violations"] == 0.0
    assert wild["growth"] > 1.0
    assert wild["first_swing"] < 100.0
    assert wild["greatest_swing"] > 10.0 * wild["first_swing"]
    assert wild["violations"] > 0.1
    assert calm["points"] > 99.0
    assert wild["points"] < calm["points"] - 10.0
    assert np.any(list(runs.values())[1]["rig.limited"])
    assert unstable_controller.draw(runs, tmp_path / "unstable.png").stat().st_size > BIG


def test_growth_is_a_rate():
    sizes = 20.0 * np.exp(1.3 * 0.25 * np.arange(12))
    assert unstable_controller.growth(sizes) == pytest.approx(1.3)
    assert unstable_controller.growth(sizes[::-1]) == pytest.approx(-1.3)
    # what comes after saturation does not count
    saturated = np.concatenate([sizes, np.full(8, 0.9 * sizes[-1])])
    assert unstable_controller.growth(saturated) == pytest.approx(1.3)


@pytest.mark.parametrize("scenario", [rod_addition, unstable_controller, void_cut_back])
def test_numbers_are_printed_with_words_and_units(
    scenario, feed_control, monkeypatch, tmp_path, capsys
):
    """As a table that fits; a time that never comes is told so."""
    monkeypatch.setenv("COLUMNS", "80")
    runs = {"one": scenario.simulate(feed_control, 2.6).popitem()[1]}
    numbers = {name: scenario.numbers(run) for name, run in runs.items()}
    assert set(numbers["one"]) == set(scenario.SHOWN)
    print_numbers(numbers | {"two": dict.fromkeys(scenario.SHOWN, math.nan)}, scenario.SHOWN)
    said = capsys.readouterr().out
    assert "{" not in said
    assert said.count("never") >= len(scenario.SHOWN)
    assert max(map(len, said.splitlines())) <= 80
    for words, _, unit in scenario.SHOWN.values():
        assert words.split()[0] in said
        assert unit in said
    assert "was not estimated" in said


def test_a_scenario_says_on_a_pipe_how_far_it_is(feed_control, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(progress, "EVERY", 1e-3)
    monkeypatch.setattr(progress, "RARER", 1.0)
    rod_addition.run(feed_control, 0.5)
    assert "s of 0.5 s simulated" in capsys.readouterr().err


def short(archive):
    return rod_addition.simulate(archive, 2.6)


def call(work, monkeypatch, *words):
    """Run a scenario with the words of a command line; its code."""
    monkeypatch.setattr("sys.argv", ["scenario", *map(str, words)])
    with pytest.raises(SystemExit) as ended:
        work()
    return ended.value.code


def rod():
    write("rod_addition", short, rod_addition.numbers, rod_addition.draw, rod_addition.SHOWN)


def test_a_scenario_of_a_system_keeps_to_its_folder(feed_control, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    assert call(rod, monkeypatch, feed_control) == 0
    folder = tmp_path / "out" / "scenarios" / "rod_addition"
    assert [one.name for one in folder.parent.iterdir()] == ["rod_addition"]
    csv = {f"rod_addition_{run}.csv" for run in ("pi_on_the_feed", "constant_force")}
    assert {one.name for one in folder.iterdir()} == {"rod_addition.png", "made_by.json", *csv}
    made_by = json.loads((folder / "made_by.json").read_text())["made_by"]
    assert made_by["command"] == "python -m scenarios.rod_addition"
    assert "rod_addition.png" in capsys.readouterr().err


def unknown():
    def simulate(archive):
        return {"one": run(archive, 0.1, {"controller.nothing": 1.0})}

    write("rod_addition", simulate, rod_addition.numbers, rod_addition.draw, rod_addition.SHOWN)


def test_a_system_that_a_scenario_cannot_run_is_one_line(
    feed_control, monkeypatch, tmp_path, capsys
):
    """An archive that is not there, one that is none, and one that lacks what is set."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(results, "DIST", tmp_path / "dist")
    (tmp_path / "text.ssp").write_text("text")
    for work, words, told in (
        (
            rod,
            [],
            "FeedControlRigid.ssp: no such file; `percussion system FeedControlRigid` makes it",
        ),
        (rod, ["none.ssp"], "none.ssp: no such file"),
        (rod, ["text.ssp"], "text.ssp: is no SSP archive: there is no SystemStructure.ssd in it"),
        (rod, [feed_control, "more"], "unrecognized arguments: more; see python -m scenarios.rod"),
        (unknown, [feed_control], "controller has no variable nothing"),
    ):
        assert call(work, monkeypatch, *words) == BAD_INPUT
        said = capsys.readouterr().err
        assert said.startswith("scenarios.")
        assert told in said
        assert said.count("\n") == 1, said
    assert [one.name for one in tmp_path.iterdir()] == ["text.ssp"]
