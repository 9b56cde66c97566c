"""The gallery: every example runs in its quick form, and the formulas in them hold."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from threading import Event

import matplotlib.image
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from examples import bifurcation, chambers, drill_design, motions, rate_map
from examples.all import EXAMPLES
from examples.shared import command_line, figure_of, tell, write_example
from percussion_model import Scene, SceneError, Simulation, settled
from percussion_model.interface import progress
from percussion_model.interface.commands.common import BAD_INPUT
from percussion_model.simulation.files import to_json

ROOT = Path(__file__).resolve().parent.parent
SHARED = {"__init__", "all", "motions", "shared"}
NAMES = {path.stem for path in (ROOT / "examples").glob("*.py")} - SHARED


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """What each example found, run once."""
    kept = {}

    def run(name):
        if name not in kept:
            out = tmp_path_factory.mktemp(name)
            kept[name] = out, importlib.import_module(f"examples.{name}").main(out, quick=True)
        return kept[name]

    return run


def test_all_examples_are_in_the_list():
    assert {example.NAME for example in EXAMPLES} == NAMES


@pytest.mark.parametrize("name", sorted(NAMES))
def test_example_runs_and_draws(name, found):
    out, numbers = found(name)
    assert json.loads(to_json(numbers))
    picture = matplotlib.image.imread(out / f"{name}.png")
    assert picture.shape[0] > 500
    assert picture.shape[1] > 800
    assert np.std(picture) > 0.05  # something is on it


@pytest.mark.parametrize("name", sorted(NAMES))
def test_the_gallery_shows_every_example(name):
    page = (ROOT / "docs" / "data" / "gallery.md").read_text(encoding="utf-8")
    assert f"images/gallery_{name}.png" in page
    assert f"python -m examples.{name}" in page


def test_examples_are_short():
    for name in NAMES:
        lines = (ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8").splitlines()
        assert len(lines) <= 150, name


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (KeyboardInterrupt(), 130, "interrupted before there was a result"),
        (SceneError("solver.cells = 0"), 2, "solver.cells = 0"),
    ],
)
def test_an_example_ends_with_a_message(error, code, words, tmp_path, monkeypatch, capsys):
    def main(out, quick):
        raise error

    monkeypatch.setattr("sys.argv", ["example", "--out", str(tmp_path / "x")])
    with pytest.raises(SystemExit) as ended:
        command_line(main, "example")
    assert ended.value.code == code
    assert capsys.readouterr().err.endswith(f"examples.example: {words}\n")


def test_command_line_refuses_what_it_does_not_know():
    words = [sys.executable, "-m", "examples.calibration", "--fast"]
    ended = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert "unrecognized arguments: --fast" in ended.stderr


def test_an_example_says_on_a_pipe_that_it_runs(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(progress, "EVERY", 1e-2)

    def slow(out, quick):
        tell("the first part")
        Event().wait(0.2)
        out.mkdir()
        (out / "example.png").touch()
        return {}

    write_example(slow, "example", tmp_path / "out", True, False)
    assert "the first part" in capsys.readouterr().err


# ------------------------------------------------------------------------- bifurcation


@pytest.mark.parametrize("order", [1, 2, 3, 8])
def test_blows_that_go_round_some_values_are_counted(order):
    noise = np.random.default_rng(0).normal(0.0, 1e-3 if order > 1 else 1e-5, 48)
    assert motions.order_of(np.resize(8.0 + np.arange(order), 48) + noise) == order


def test_blows_without_order_have_none():
    noise = np.random.default_rng(1).uniform(-1.0, 1.0, 48)
    assert motions.order_of(8.0 + 2.0 * noise) == 0
    kinds = [motions.kind_of(8.0 + size * noise) for size in (2.0, 0.1, 1e-3)]
    assert [list(motions.KINDS)[k] for k in kinds] == [
        "no order",
        "nearly alike",
        "every blow alike",
    ]


def test_rates_of_a_branch_have_their_errors(found):
    _, numbers = found("bifurcation")
    ways = [key for key in numbers if key != "errors"]
    assert {"distance_falling", "distance_rising", "feed_falling", "feed_rising"} <= set(ways)
    branches = [branch for way in ways for branch in numbers[way]]
    for branch in branches:
        assert len(branch["rate_standard_error"]) == len(branch["rate"]) == len(branch["values"])
        assert min(branch["rate_standard_error"]) >= 0.0
    # at the least feed no blow is like another
    assert numbers["feed_rising"][0]["rate_standard_error"][0] > 0.0
    assert "scatter" in numbers["errors"]


def test_the_way_up_and_the_way_down_can_differ(found):
    """Between 300 and 600 N the hammer keeps striking evenly if it did so before.

    From a feed at which blows have no order it is a matter of chance (docs/data/gallery.md).
    """

    def spread(start):
        way = np.array([start, 450.0])
        branch = bifurcation.follow(way, lambda f: {"feed_force": f}, 60, 30)
        return np.ptp(branch.impact_velocity[-1])

    assert spread(900.0) < 0.2 < 1.0 < max(map(spread, (180.0, 220.0, 250.0)))


# ---------------------------------------------------------------------------- rate map


@pytest.mark.parametrize("changes", [{}, {"feed.force": 12e3, "drive.force": 1500.0}])
def test_work_of_the_drive_is_that_of_the_ledger(changes):
    """Between the starts of two blows of the settled motion, where u_r is 0 at both."""
    scene = Scene().replace(**changes)
    simulation = Simulation(scene)
    simulation.advance(3.0)
    blows = simulation.blows[20:]
    works = []
    simulation = Simulation(scene)
    for time in blows["time"][[0, -1]]:
        simulation.advance(float(time))
        works.append(simulation.energy()["drive"])
    work = rate_map.drive_work(
        scene.drive.force, scene.drive.reversal_distance, blows["penetration"][:-1]
    )
    # The bit still moves a little, by microns, when the drive turns downward. Without the
    # penetration in the formula it would be a hundredth.
    assert works[1] - works[0] == pytest.approx(np.sum(work), rel=1e-3)


# ---------------------------------------------------------------------------- chambers


def test_loops_of_the_chambers_have_the_work_of_the_gas():
    """Which the gas makes out step by step, not of the loops."""
    found = sum(chambers.indicated_work(*loop) for loop in chambers.diagrams().values())
    simulation = Simulation(chambers.SCENE)
    simulation.advance(0.5)
    blow, works = simulation.blows[-2], []
    simulation = Simulation(chambers.SCENE)
    for time in (blow["time"], blow["time"] + blow["period"]):
        simulation.advance(float(time))
        works.append(simulation.observe()["pneumatic_expanded"])
    assert found == pytest.approx(works[1] - works[0], rel=5e-3)


def test_the_tuned_port_takes_the_air_that_was_given(found):
    _, numbers = found("chambers")
    best, fitted = (numbers["at_20_m3_min"][which] for which in ("best", "fitted"))
    assert best["pressure"] <= chambers.MOST_PRESSURE
    keys = (chambers.SUPPLY, chambers.EDGE)
    scene = chambers.SCENE.replace(**dict(zip(keys, (best["pressure"], best["edge"]), strict=True)))
    blow = settled(scene).counted[-1]
    # four pressures of the quick form are far apart
    assert blow["pneumatic_air"] / 1.2923 * 60.0 == pytest.approx(20.0, rel=3e-2)
    assert blow["blow_energy"] == pytest.approx(best["blow_energy"], rel=3e-2)
    assert best["blow_energy"] >= fitted["blow_energy"]


# ------------------------------------------------------------------------ drill design


def test_a_stepped_piston_keeps_length_and_mass():
    scene = drill_design.design(drill_design.stepped(0.3, 0.4), 7.5e8)
    uniform = drill_design.design([(drill_design.STEPPED_RATIO, 1.0)], 7.5e8)
    assert scene.piston.length == pytest.approx(uniform.piston.length)
    assert scene.piston.mass == pytest.approx(uniform.piston.mass)
    upper, lower = scene.piston.sections
    assert lower.area / upper.area == pytest.approx(0.4)
    assert lower.length / scene.piston.length == pytest.approx(0.3)


def test_the_first_wave_has_its_known_best():
    """Oracle 6 of docs/model.md: the share 0.814529 at beta 1.256431, less what springs back."""
    ratio = np.linspace(0.5, 30.0, 20_001)
    share = drill_design.first_wave(ratio, 7.5e8)
    assert share.max() == pytest.approx(0.814529 * (1.0 - 1.0 / 5.0), rel=1e-6)


def test_no_word_of_the_figure_lies_on_another(tmp_path, monkeypatch):
    """Labels with rates and their errors are wider than the bars that they belong to."""
    figures = []

    @contextmanager
    def kept(*words):
        with figure_of(*words) as fig:
            figures.append(fig)
            yield fig

    monkeypatch.setattr(drill_design, "figure_of", kept)
    drill_design.main(tmp_path, quick=True)
    canvas = FigureCanvasAgg(figures[0])
    canvas.draw()
    renderer = canvas.get_renderer()
    right = figures[0].axes[2]
    assert "±" in "".join(text.get_text() for text in right.get_yticklabels())
    shown = [
        text
        for text in (*right.get_xticklabels(), *right.get_yticklabels(), *right.texts)
        if text.get_text()
    ]
    boxes = [text.get_window_extent(renderer) for text in shown]
    for k, box in enumerate(boxes):
        assert box.x0 >= 0.0
        assert box.x1 <= figures[0].bbox.x1
        for other in boxes[:k]:
            assert not box.overlaps(other)


def test_an_example_does_not_write_into_the_folder_of_another_result(tmp_path):
    (tmp_path / "kept.json").write_text("{}")
    words = [sys.executable, "-m", "examples.drill_design", "--quick", "--out", str(tmp_path)]
    ended = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == BAD_INPUT
    assert "holds files of unknown origin (kept.json)" in ended.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["kept.json"]
