"""What a run, a scene and the clone say of themselves: nothing in vain, nothing left out."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest

import percussion_model
from percussion_model import Result, Scene, Simulation, compare, settled, simulate
from percussion_model.analysis.effect_study import EffectsStudy, Variant, VariantRun
from percussion_model.analysis.study import Study, grid
from percussion_model.analysis.study.response import ROW
from percussion_model.coupling.coupled_run import CoupledRun
from percussion_model.interface.terminal import show_settled, show_summary
from percussion_model.verification.hard_cases.collection import Collection

ROOT = Path(__file__).parents[1]
REFERENCE = Scene.from_toml(ROOT / "scenarios" / "reference.toml")
RIGID = Scene.from_toml(ROOT / "scenarios" / "rigid.toml")
DROP = Scene.from_toml(ROOT / "scenarios" / "drop_test.toml")


@pytest.fixture(scope="module")
def drop():
    return simulate(DROP)


def test_a_drop_test_tells_its_depth_and_rebound_in_place_of_dashes(drop, capsys):
    show_summary(drop)
    shown = capsys.readouterr().out
    assert not re.search(r"│\s+-\s+│", shown)
    for name in ("Depth of the bit's end", "First contact", "rebound velocity", "Stands still"):
        assert name in shown
    assert re.search(rf" {1e3 * drop.fall['depth']:.3f}\d* ± ", shown)


def test_a_table_shows_no_more_digits_than_are_known(capsys, monkeypatch):
    """Two of the error where it stands beside it, and three where nothing is known of it."""
    monkeypatch.setenv("COLUMNS", "80")
    show_summary(simulate(REFERENCE, 1.0, settle=0.2))
    told = [line for line in capsys.readouterr().out.splitlines() if "±" in line]
    assert len(told) >= 10
    for line in told[:-1]:  # the last is the note
        assert len(line.split("±")[1].split()[0].replace(".", "").strip("0")) <= 2, line
    show_summary(simulate(REFERENCE, 1.0, settle=0.2, error_estimate=False))
    seen = 0
    for line in capsys.readouterr().out.splitlines():
        _, name, number, *_ = [*line.split("│"), "", ""]
        if "±" in number or not re.fullmatch(r"[\d.e+-]+", number.strip()):
            continue
        digits = number.strip().partition("e")[0].replace(".", "").strip("0")
        assert len(digits) <= 3, line
        seen += "Blow" in name or "Peak" in name
    assert seen >= 4


@pytest.mark.parametrize("solver", ["wave", "rigid"])
def test_the_fall_of_a_bit_is_that_of_its_samples(solver):
    """Rebound: the fastest rise of the bit in a fine trace; contact: where the force begins."""
    scene = DROP.computed_by(solver, **{"piston.model": "absent"})
    fall = simulate(scene, trace=1e-6, duration=0.03, settle=0.0)
    trace, found = fall.trace, fall.fall
    early = trace["time"] < 2e-3
    assert found["rebound_velocity"] == pytest.approx(-trace["bit_velocity"][early].min(), rel=1e-3)
    first = trace["time"][np.argmax(trace["bit_force"] > 0.0)]
    assert found["first_contact"] == pytest.approx(first, abs=1.1e-6)
    assert not {"rest_time", "depth"} & set(found)  # it still bounces
    rest = simulate(scene, trace=1e-5, duration=0.05, settle=0.0)
    depth = rest.trace["bit_end_position"][-1] - scene.start.rock_gap
    assert rest.fall["depth"] == pytest.approx(depth, rel=1e-9)
    assert rest.fall["rest_time"] < 0.05


def test_a_fall_has_the_errors_of_its_grid(drop, capsys):
    """A grid of ten times as many cells lies within them."""
    fine = simulate(DROP.replace(**{"solver.cells": 200}))
    assert set(drop.errors) == set(drop.fall) == set(fine.fall)
    for name, value in drop.fall.items():
        assert 0.0 < drop.errors[name] < 0.01 * value
        assert abs(value - fine.fall[name]) <= drop.errors[name], name
    show_summary(drop)
    shown = capsys.readouterr().out
    for name in ("Depth of the bit's end in the rock", "First contact", "Energy to crush rock"):
        (line,) = [text for text in shown.splitlines() if name in text]
        assert "±" in line
    assert "discretisation error; without it" in " ".join(shown.split())
    # rigid bodies have no grid
    exact = simulate(DROP.computed_by("rigid", **{"piston.model": "absent"}))
    assert set(exact.errors.values()) == {0.0}
    show_summary(exact)
    assert "Rigid bodies have no cells" in capsys.readouterr().out


def test_a_bit_in_the_air_has_no_depth(drop):
    def said(result):
        assert "depth" not in result.fall
        (text,) = [text for text in result.warnings if "it has no depth" in text]
        return text

    assert not any("no depth" in text for text in drop.warnings)
    gone = said(simulate(DROP.replace(**{"feed.force": -9000.0})))
    assert "moving up" in gone
    assert "it flew off" in gone
    rebound = said(simulate(DROP, 0.02))
    assert "flew off" not in rebound
    assert "a longer run.duration" in rebound


@pytest.mark.parametrize(("duration", "whose"), [(0.1, "this"), (0.15, "these")])
def test_one_blow_is_no_mean(duration, whose, capsys):
    result = simulate(REFERENCE, duration, settle=0.025)
    assert 0 < len(result.counted) < 3
    (text,) = [text for text in result.warnings if "whole blow" in text]
    assert f"how far other blows differ from {whose} is not known" in text
    show_summary(result)
    shown = " ".join(capsys.readouterr().out.split())
    assert "so few blows that neither error nor scatter is known" in shown


def test_rigid_bodies_are_said_to_have_no_cells(capsys):
    show_summary(simulate(RIGID, 1.0, settle=0.5))
    shown = " ".join(capsys.readouterr().out.split())
    assert "Rigid bodies have no cells" in shown
    assert "discretisation" not in shown
    assert "How far rigid bodies are from real ones" in shown


def test_a_fall_is_kept_with_a_result(drop, tmp_path):
    drop.save(tmp_path / "out")
    again = Result.load(tmp_path / "out")
    assert again.fall == drop.fall
    assert again.fall["rest_time"] > again.fall["first_contact"] > 0.0
    assert simulate(RIGID, 0.5, settle=0.1).fall == {}


def test_settled_names_the_time_that_was_simulated_and_the_error_of_its_rate(capsys):
    found = settled(RIGID)
    show_settled(found)
    shown = capsys.readouterr().out
    assert "Multiplier" not in shown
    assert re.search(r"Stability multiplier +│ -?[\d.]+ ± [\d.]+ *│", shown)
    assert f"{len(found.blows)} in {found.duration:.4g} s of simulated time" in shown
    assert re.search(r"Rate of penetration +│ 16\.\d+ ± 0\.0\d+ mm/s", shown)


# ------------------------------------------------------------------ in vain


def warned(scene):
    result = simulate(scene, 0.2, settle=0.0, error_estimate=False)
    return [text for text in result.warnings if "without effect" in text]


def test_nobody_is_warned_of_what_a_change_of_solver_leaves_without_effect():
    for solver in ("rigid", "fem"):
        scene = REFERENCE.replace(**{"solver.cells": 20}).computed_by(solver)
        assert "solver.cells" in scene.unused  # which `explain` still tells
        assert warned(scene) == []


def test_what_is_given_for_the_solver_in_vain_is_warned_of():
    scene = REFERENCE.computed_by("rigid", **{"loss.time": 1e-7})
    assert warned(scene) == ["given, but without effect in this scene: loss.time"]
    later = REFERENCE.computed_by("rigid").replace(**{"loss.time": 1e-7})
    assert warned(later) == warned(scene)
    before = REFERENCE.replace(**{"drive.external_force": 5.0}).computed_by("rigid")
    assert warned(before) == ["given, but without effect in this scene: drive.external_force"]


# ---------------------------------------------------------- representations


def test_public_objects_are_represented_in_a_few_lines(drop):
    result = simulate(RIGID, 1.0, settle=0.2)
    points = grid({"feed.force": np.linspace(1e3, 5e3, 300)})
    trial = VariantRun(Variant("", "as it is"), result, 1.0, None)
    simulation = Simulation(RIGID)
    made = [
        REFERENCE, DROP, result, drop, compare(RIGID, ["rigid"], 1.0, 0.2), settled(RIGID),
        simulation.save(), points, Study(RIGID, points, np.zeros(300, ROW), ["oh"] * 300),
        trial, EffectsStudy(RIGID, trial, [trial] * 12, {"a": "because"}),
        Collection([{"case": "one", "rate": 1.0}] * 99),
        CoupledRun({"time": np.zeros(9), "depth": np.zeros(9)}, 1e-3, 9),
    ]  # fmt: skip
    for one in made:
        assert is_dataclass(one)
        text = repr(one)
        assert text.startswith(type(one).__name__)
        assert len(text) < 400, text
        assert "array" not in text
    assert {type(one).__name__ for one in made} >= {
        name for name in percussion_model.__all__
        if is_dataclass(kind := getattr(percussion_model, name)) and len(fields(kind)) > 0
    } - {"BitBar", "PistonBar", "Section"}  # fmt: skip
    assert repr(DROP) == (
        "Scene('Drop test of the bit', effects.drive='none', piston.model='absent', "
        "run.duration=0.1, run.settle=0.0, start.bit_velocity=5.25)"
    )


# ---------------------------------------------------------------- the clone


def test_files_of_ones_own_are_not_linted():
    """Names that ruff looks at: all within the folders of the project."""
    own, ours = ROOT / "notes_of_a_test", ROOT / "tests" / "test_words.py"
    own.mkdir()
    try:
        (own / "mine.py").write_text("import os\n")
        done = subprocess.run(
            [sys.executable, "-m", "ruff", "check", "--show-files"],
            cwd=ROOT, capture_output=True, text=True, check=True,
        )  # fmt: skip
    finally:
        (own / "mine.py").unlink()
        own.rmdir()
    files = {Path(line) for line in done.stdout.splitlines()}
    assert own / "mine.py" not in files
    assert {ours, ROOT / "build.py", ROOT / "percussion_model" / "__init__.py"} <= files


def test_the_communication_step_of_the_readme_is_set_by_an_option_that_sets_it():
    """fmpy's `--step-size` is of its integrators for model exchange."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if "fmpy simulate" in line]
    words = shlex.split(line)
    assert "--step-size" not in words
    assert words[words.index("--output-interval") + 1] == "1e-3"


def test_a_rebound_is_told_only_of_a_bit_that_nothing_can_strike(drop):
    """That of a short run with a piston went with its duration."""
    assert drop.fall["rebound_velocity"] > 2.0
    for duration in (1e-3, 5e-3):
        assert "rebound_velocity" not in simulate(REFERENCE, duration, settle=0.0).fall
