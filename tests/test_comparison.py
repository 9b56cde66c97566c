"""One scene by several solvers: numbers, table, figure and refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from percussion_model import Scene, SceneError, compare
from percussion_model.analysis.comparison import COMPARED, Comparison, read_solvers, usual_solvers
from percussion_model.interface.cli import app
from percussion_model.interface.commands import common
from percussion_model.simulation.warnings import find_warnings

RIGID = Path(__file__).parents[1] / "scenarios" / "rigid.toml"
SHORT = {"run.duration": 0.3, "run.settle": 0.05, "fem.elements": 20}


@pytest.fixture(scope="module")
def found():
    return compare(Scene().replace(**SHORT), ("wave", "fem", "rigid"))


def test_each_solver_computes_the_scene_its_way(found):
    assert list(found.results) == ["wave", "fem", "rigid"]
    for name, result in found.results.items():
        assert result.solver == name
        assert result.duration == 0.3
    assert found.results["rigid"].scene.bit.model == "rigid"
    assert found.results["fem"].scene.bit.model == "elastic"
    assert found.results["fem"].cells == {"piston": 20, "bit": 23}


def test_differences_are_relative_to_the_first(found):
    summaries, off = found.summaries(), found.differences()
    assert set(off) == {"fem", "rigid"}
    for key in COMPARED:
        base, value = summaries["wave"][key], summaries["rigid"][key]
        if value is None:
            assert off["rigid"][key] is None
        else:
            assert off["rigid"][key] == pytest.approx((value - base) / base)
    assert off["rigid"]["peak_contact_force"] is None
    assert abs(off["fem"]["rate_of_penetration"]) < 0.02


def test_what_another_solver_needs_was_not_given_in_vain(found):
    given = {"loss.time": 2e-7, "fem.courant": 1.0, "contact.restitution": 0.5}
    scenes = {name: found.results[name].scene.replace(**given) for name in ("wave", "fem", "rigid")}
    assert "loss.time" in scenes["rigid"].unused
    results = {
        name: replace(found.results[name], scene=scene, warnings=[])
        for name, scene in scenes.items()
    }
    for result in results.values():
        result.warnings.extend(find_warnings(result))
    told = Comparison(results).warnings()
    told = [text for text in told if "without effect" in text]
    assert not any("loss.time" in text or "fem.courant" in text for text in told)

    first_two = Comparison({name: results[name] for name in ("wave", "fem")}).warnings()
    vain = [text for text in first_two if "without effect" in text]
    assert vain == ["given, but without effect in this scene: contact.restitution"]
    results["fem"].warnings.append("something else")
    assert Comparison(results).warnings()[-1] == "fem: something else"


def test_figure_has_a_line_for_each_solver(found):
    pytest.importorskip("matplotlib")
    from percussion_model.interface.plotting.compared_blows import draw_comparison

    axes = draw_comparison(found).axes
    assert len(axes) == 6
    for ax in axes:
        assert len(ax.lines) == 3
        for line in ax.lines:
            assert len(line.get_xdata()) > 50
            assert line.get_xdata()[0] >= 0.0
    peaks = [max(line.get_ydata()) for line in axes[0].lines]
    for peak, result in zip(peaks, found.results.values(), strict=True):
        assert 1e3 * peak == pytest.approx(result.blows["peak_bit_force"][-1], rel=0.02)


def test_command_prints_a_table_and_writes_the_figure(tmp_path):
    file = tmp_path / "scene.toml"
    Scene(title="Two ways").replace(**SHORT).to_toml(file)
    out = tmp_path / "out"
    words = ["compare", str(file), "--solvers", "fem,rigid", "--out", str(out)]
    shown = CliRunner().invoke(app, words)
    assert shown.exit_code == 0, shown.output
    assert "Two ways" in shown.output
    assert "Rate of penetration" in shown.output
    assert sorted(path.name for path in out.iterdir()) == [
        "comparison.png", "comparison.svg", "made_by.json",
    ]  # fmt: skip
    assert f"wrote {out / 'comparison.png'}" in shown.output


def test_command_gives_json_alone(tmp_path):
    file = tmp_path / "scene.toml"
    Scene().replace(**SHORT).to_toml(file)
    words = ["compare", str(file), "--solvers", "wave,rigid", "--no-figures", "--json", "-"]
    plain = json.loads(CliRunner().invoke(app, words).stdout)
    assert set(plain["solvers"]) == {"wave", "rigid"}
    assert plain["differences"]["rigid"]["rate_of_penetration"] > 0.0


@pytest.mark.parametrize(
    ("text", "reason"),
    [("wave,boxes", "'boxes' is no solver: wave, fem, rigid"), ("fem,fem", "twice"), ("", "''")],
)
def test_bad_lists_of_solvers_are_refused(text, reason):
    with pytest.raises(SceneError, match=reason):
        read_solvers(text)


def test_a_scene_is_compared_with_its_own_solver_first():
    assert usual_solvers(Scene()) == ("modal", "wave", "fem", "rigid")
    assert usual_solvers(Scene().computed_by("wave"))[0] == "wave"
    with pytest.raises(SceneError, match="only rigid computes this scene"):
        usual_solvers(Scene.from_toml(RIGID))


def test_a_solver_that_cannot_is_named_before_anything_runs():
    scene = Scene().replace(**{"piston.model": "rigid", "bit.model": "rigid"})
    with pytest.raises(SceneError, match=r"rigid bodies .*fem computes elastic bars alone"):
        compare(scene, ("rigid", "fem"))


def test_a_command_refuses_before_it_tells_of_compiling_or_of_folders(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(common, "tell_of_compiling", lambda *names: pytest.fail("compiles"))
    done = CliRunner().invoke(app, ["compare", str(RIGID), "--solvers", "rigid,wave"])
    assert isinstance(done.exception, SceneError)
    assert 'rigid bodies (bit.model = "rigid"), and wave computes' in str(done.exception)
    assert done.output == ""
    assert not list(tmp_path.iterdir())
