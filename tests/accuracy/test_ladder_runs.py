"""A study from end to end, with few and cheap rungs."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from percussion_model import Scene, SceneError
from percussion_model.interface.cli import app
from percussion_model.interface.commands.accuracy_tables import show_study
from percussion_model.verification.accuracy import study
from percussion_model.verification.accuracy.integrators import GeneralRun
from percussion_model.verification.accuracy.ladders import LADDERS, fem_scene, ladders
from percussion_model.verification.accuracy.problems import APERIODIC, HISTORY, RATE, Run, pose
from percussion_model.verification.accuracy.timing import interleaved

# The package offers a function of the same name.
study_module = import_module("percussion_model.verification.accuracy.study")
SCENARIOS = Path(__file__).parents[2] / "scenarios"
POINT_KEYS = {
    "ladder", "label", "size", "setup", "second", "blow", "repeats", "values", "errors", "fit",
    "note",
}  # fmt: skip


@pytest.fixture(scope="module")
def found():
    """The reference scene by coarse waves and rigid bars."""
    patch = pytest.MonkeyPatch()

    def few(problem, full):
        rungs = ladders(problem, full)
        cells = ("5 cells", "20 cells", "40 cells", "60 cells")
        return [rung for rung in rungs if rung.label in cells or rung.ladder == "rigid"]

    patch.setattr(study_module, "ladders", few)
    said: list[tuple[float, str]] = []
    result = study(
        Scene.from_toml(SCENARIOS / "reference.toml"),
        progress=lambda share, text: said.append((share, text)),
    )
    patch.undo()
    assert [share for share, _ in said[:3]] == sorted(share for share, _ in said[:3])
    return result


def test_finer_waves_are_better_and_dearer(found):
    points = [point for point in found.ladder("wave") if point.fit < 1e-6]
    errors = [point.errors[RATE] for point in points]
    assert [point.label for point in points] == ["20 cells", "40 cells", "60 cells"]
    assert max(errors) < 2e-4
    # the rate passes thresholds and converges by leaps; the force of a blow does not
    shapes = [point.errors[HISTORY] for point in points]
    assert shapes[0] > 1.5 * shapes[1] > 2.0 * shapes[2] > 0
    order = found.order("wave", HISTORY)
    assert order is not None
    assert order.value > 1.0


def test_lengths_that_do_not_fit_are_not_in_the_order(found):
    assert found.ladder("wave")[0].label == "5 cells"
    assert "5 cells" not in [point.label for point in found.fitted("wave", RATE)]


def test_a_rigid_hammer_has_an_error_and_no_order(found):
    (point,) = found.ladder("rigid")
    assert point.errors[RATE] == pytest.approx(0.036, abs=0.003)
    assert found.order("rigid", RATE) is None


def test_advice_names_a_method_that_keeps_the_word(found):
    text = found.advice(1e-3)
    assert text.startswith("For 0.1 % take wave, 20 cells")
    assert "no method" in found.advice(1e-9)


def test_json_has_what_it_promises(found):
    tree = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert {"title", "machine", "compilation", "reference", "ladders", "points", "orders"} <= set(
        tree
    )
    assert {"processor", "cores", "python", "numba"} <= set(tree["machine"])
    for point in tree["points"]:
        assert set(point) == POINT_KEYS
        assert point["second"] > 0
        assert point["blow"] == pytest.approx(point["second"] * tree["period"], rel=0.05)


def test_table_and_figures(found, tmp_path, capsys):
    from percussion_model.interface.plotting.error_against_time import (
        draw_accuracy,
        draw_quantities,
    )

    show_study(found)
    shown = capsys.readouterr().out
    assert "Measured orders" in shown
    assert max(len(line.rstrip()) for line in shown.splitlines()) <= 100
    path = tmp_path / "accuracy.png"
    draw_accuracy(found).savefig(path)
    assert path.stat().st_size > 10_000
    titles = [ax.get_title() for ax in draw_quantities(found).axes]
    assert "Rate of penetration" in titles


def test_every_ladder_is_described_and_some_are_for_full_runs_only():
    problem = pose(Scene())
    usual, full = ({rung.ladder for rung in ladders(problem, wish)} for wish in (False, True))
    assert usual < full == set(LADDERS)


def test_short_strokes_are_told_by_statistics():
    problem = pose(Scene.from_toml(SCENARIOS / "aperiodic.toml").replace(**{"run.duration": 1.5}))
    assert problem.kind == APERIODIC
    answer = Run(problem, problem.scene.computed_by("rigid")).answer()
    assert answer.history is None
    assert answer.errors[RATE] > 0
    rungs = ladders(problem)
    assert {rung.ladder for rung in rungs} == {"wave", "fem", "rigid"}


def test_a_general_integrator_agrees_with_the_elements_on_the_same_mesh():
    """A drop: same equations, another integrator; both with small steps."""
    problem = pose(Scene.from_toml(SCENARIOS / "drop_test.toml").replace(**{"run.duration": 4e-3}))
    coarse = fem_scene(problem.scene, 3, 0.2, 1e12)
    own = Run(problem, coarse).answer()
    other = GeneralRun(problem, coarse, "DOP853", 1e-6, 60.0).answer()
    for key in ("resting_place", "rock_energy", "peak_bit_force"):
        assert other.values[key] == pytest.approx(own.values[key], rel=2e-4)
    assert np.sum(np.abs(other.history - own.history)) < 2e-3 * np.sum(np.abs(own.history))


def test_times_are_taken_turn_by_turn_and_the_dear_ones_less_often():
    turns: list[str] = []

    def cheap():
        turns.append("cheap")
        return 0.01

    def dear():
        turns.append("dear")
        return 100.0

    (median, many), (_, few) = interleaved([cheap, dear])
    assert turns[:3] == ["cheap", "dear", "cheap"]
    assert (median, few) == (0.01, 1)
    assert many > few


def refused(*arguments: str) -> str:
    from typer.testing import CliRunner

    done = CliRunner().invoke(app, ["accuracy", *arguments])
    assert done.exit_code != 0
    return str(done.exception)


def test_rigid_scenes_are_refused():
    with pytest.raises(SceneError, match="rigid bar has closed forms"):
        pose(Scene.from_toml(SCENARIOS / "rigid.toml"))


def test_too_few_blows_are_refused():
    with pytest.raises(SceneError, match=r"blows after run\.settle"):
        pose(Scene().replace(**{"run.duration": 0.2, "run.settle": 0.0}))


def test_unknown_methods_and_missing_files_are_refused():
    scene = str(SCENARIOS / "reference.toml")
    assert "'waves' is no method: wave, fem" in refused(scene, "--methods", "waves,fem")
    assert "none.toml" in refused("none.toml")
