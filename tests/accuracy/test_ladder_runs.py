"""A study from end to end, with few and cheap rungs."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from percussion_model import Scene, SceneError
from percussion_model.interface.cli import app, main
from percussion_model.interface.commands import common
from percussion_model.interface.commands.accuracy_tables import (
    show_contests,
    show_study,
    within_bar,
)
from percussion_model.scene.hammers import hammer
from percussion_model.verification.accuracy import Study, study
from percussion_model.verification.accuracy.explicit import ExplicitSolver
from percussion_model.verification.accuracy.ladders import (
    LADDERS,
    affordable_modes,
    even_mesh,
    fem_scene,
    ladders,
    refuse_asked,
)
from percussion_model.verification.accuracy.orders import Order
from percussion_model.verification.accuracy.problems import (
    APERIODIC,
    HISTORIES,
    HISTORY,
    PERIODIC,
    RATE,
    STRESS_HISTORY,
    Answer,
    Problem,
    Run,
    pose,
    relative_error,
)
from percussion_model.verification.accuracy.references import Bar
from percussion_model.verification.accuracy.study import solvers_of
from percussion_model.verification.accuracy.timing import interleaved
from tests.accuracy.general_drop import Drop

# The package offers a function of the same name.
study_module = import_module("percussion_model.verification.accuracy.study")
SCENARIOS = Path(__file__).parents[2] / "scenarios"
POINT_KEYS = {
    "ladder", "label", "size", "setup", "second", "blow", "repeats", "spread", "values", "errors",
    "note",
}  # fmt: skip


@pytest.fixture(scope="module")
def found():
    """The reference scene by modes, coarse waves and rigid bars."""
    patch = pytest.MonkeyPatch()

    def few(problem, full):
        rungs = ladders(problem, full)
        chosen = {
            "modal": ("8 modes",),
            "wave": ("6 steps", "24 steps", "40 steps", "60 steps"),
            "explicit": ("11 elements", "20 elements", "40 elements"),
            "rigid": ("",),
        }
        return [rung for rung in rungs if rung.label in chosen.get(rung.ladder, ())]

    patch.setattr(study_module, "ladders", few)
    said: list[tuple[str, float | None]] = []
    result = study(
        Scene.from_toml(SCENARIOS / "reference.toml"),
        progress=lambda text, share: said.append((text, share)),
    )
    patch.undo()
    shares = [share for _, share in said if share is not None]
    assert shares == sorted(shares)
    # what compiles has no share, so that no time that is left is told by it
    before = [text for text, share in said if share is None]
    assert before == [text for text, _ in said[: len(before)]]
    assert [text for text in before if text.startswith("compiling or loading ")] == [
        "compiling or loading modal", "compiling or loading wave",
        "compiling or loading explicit elements", "compiling or loading rigid",
    ]  # fmt: skip
    after = [text for text, _ in said[len(before) :]]
    assert after[0] == "wave, 24 steps"
    assert "explicit elements, 20 elements" in after
    return result


def test_finer_waves_are_better_and_dearer(found):
    points = found.ladder("wave")
    assert [point.label for point in points] == ["6 steps", "24 steps", "40 steps", "60 steps"]
    assert max(point.errors[RATE] for point in points[1:]) < 2e-4
    # the rate passes thresholds and converges by jumps; the force of a blow does not
    shapes = [point.errors[HISTORY] for point in points]
    assert shapes[0] > 2.0 * shapes[1] > 2.5 * shapes[2] > 3.0 * shapes[3] > 0
    order = found.order("wave", HISTORY)
    assert order is not None
    assert order.value > 1.0


def test_modes_are_the_default_solver(found):
    """Eight modes meet a thousandth; what no ledger of explicit elements tells is left out."""
    assert found.own == found.solver == "modal"
    (modes,) = found.ladder("modal")
    assert modes.errors[RATE] < 1e-3
    assert modes.setup > 0.0
    waves = found.ladder("wave")[-1]
    for share in ("rock_share", "loss_share"):
        assert modes.values[share] == pytest.approx(waves.values[share], rel=2e-3)
        assert modes.errors[share] < 2e-3
    mass, speed = Scene().piston.mass, waves.values["impact_velocity"]
    into_rock = waves.values["rock_share"] * 0.5 * mass * speed**2
    assert into_rock == pytest.approx(waves.values["rock_energy"], rel=1e-3)
    assert "loss_share" not in found.ladder("explicit")[0].values


def test_modes_and_strings_take_the_ladders_of_their_scenes():
    """Modes in eights from eight on; in a string waves and explicit elements."""
    problem = pose(Scene())
    counts = [r.label for r in ladders(problem) if r.ladder == "modal"]
    # the bit has 1.15 times as many: with eight sixteen are computed, with fewer eight
    assert counts[:3] == ["6 modes", "8 modes", "14 modes"]
    long = Scene.from_toml(SCENARIOS / "top_hammer.toml")
    assert affordable_modes(long, (2, 4, 8, 20, 56, 80)) == [2, 4, 8, 20, 56]
    plain = hammer("t38").replace(**{"effects.breaking": False, "effects.rotation": False})
    string = Problem(plain, PERIODIC, 0.1, 0.05)
    assert {rung.ladder for rung in ladders(string)} == {"wave", "explicit"}
    for rung in ladders(replace(string, kind=APERIODIC)):
        assert rung.ladder in ("wave", "explicit")
    refuse_asked(plain, ["wave", "explicit"])
    for name in ("modal", "fem-gauss"):
        with pytest.raises(SceneError, match="piston and bit alone, but the scene has rods"):
            refuse_asked(plain, [name])


def test_explicit_elements_are_as_even_as_the_lengths_allow():
    scene = Scene.from_toml("dth5_st_anne")

    def step_by_mean(count):
        made = ExplicitSolver(scene, count)
        return made.time_step * sum(made.cells.values())

    tuned = [even_mesh(scene, about) for about in (10, 20, 40)]
    assert all(
        abs(count - about) <= 0.15 * about for count, about in zip(tuned, (10, 20, 40), strict=True)
    )
    for count, about in zip(tuned, (10, 20, 40), strict=True):
        assert step_by_mean(count) >= 0.999 * step_by_mean(about)


def test_forces_and_stress_are_compared(found):
    for point in found.ladder("wave"):
        assert {"peak_stress", *HISTORIES} <= set(point.errors)
    fine = found.ladder("wave")[-1]
    assert max(fine.errors[key] for key in HISTORIES) < 1e-2
    (rigid,) = found.ladder("rigid")
    assert np.isnan(rigid.errors[STRESS_HISTORY])
    # the first front: the contact force of two equal bars that meet, docs/model.md, section 12
    section = Scene().bit.sections[0]
    impedance = section.area * np.sqrt(section.youngs_modulus * section.density)
    peak = 0.5 * impedance * fine.values["impact_velocity"]
    assert fine.values["peak_contact_force"] == pytest.approx(peak, rel=0.02)
    assert fine.values["peak_stress"] == pytest.approx(peak / section.area, rel=0.02)


def test_a_study_survives_its_file(found):
    tree = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    again = Study.from_dict(tree)
    assert again.to_dict() == tree
    assert again.cost("wave", RATE, 1e-3) == found.cost("wave", RATE, 1e-3)


def test_a_rigid_hammer_has_an_error_and_no_order(found):
    (point,) = found.ladder("rigid")
    assert point.errors[RATE] == pytest.approx(0.036, abs=0.003)
    assert found.order("rigid", RATE) is None


def test_advice_names_a_method_that_keeps_the_word(found):
    text = replace(found, points=[p for p in found.points if p.ladder != "modal"]).advice(1e-3)
    (named,) = (
        p for p in found.points if f"take {LADDERS[p.ladder].title}, {p.label}, the" in text
    )
    finer = [p for p in found.ladder(named.ladder) if p.size <= named.size]
    assert all(p.errors[RATE] <= 1e-3 for p in finer)
    assert "no method" in replace(found, points=found.ladder("rigid")).advice(1e-9)


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


def test_an_error_below_the_bar_of_the_reference_is_said_to_be_below_it(found, capsys):
    point = found.ladder("wave")[-1]
    floor = found.reference.floor(RATE)
    good = replace(point, errors=point.errors | {RATE: 0.1 * floor})
    better = replace(found, points=[good])
    show_study(better)
    shown = capsys.readouterr().out
    assert f"<{floor:.1e}".replace("e-0", "e-") in shown
    assert f"off by less than {100 * floor:.2g} %" in better.advice(1e-2)


def test_times_have_their_spread(found, capsys):
    point = replace(found.ladder("wave")[1], spread=0.13)
    once = replace(found, points=[replace(point, spread=np.nan)])
    found = replace(found, points=[point])
    assert "ms (± 13 %)" in found.advice(1e-2)
    assert "±" not in once.advice(1e-2)
    for one, spread in ((found, "13"), (once, "-")):
        show_study(one)
        row = next(line for line in capsys.readouterr().out.splitlines() if "24 steps" in line)
        assert row.split()[3] == spread


def test_titles_of_narrow_tables_stay_whole(found, capsys):
    show_study(replace(found, points=found.ladder("rigid")))
    shown = capsys.readouterr().out
    assert "Relative error; ms to compute a simulated second; ms of set-up" in shown
    assert "Measured orders: none" in shown
    assert "at an error in rate" not in shown  # no method here has a cost to tell


def test_every_ladder_is_described_and_full_runs_have_more_rungs():
    problem = pose(Scene())
    usual, full = (ladders(problem, wish) for wish in (False, True))
    for rungs in (usual, full):
        assert {rung.ladder for rung in rungs} == {*LADDERS}
    labels = [{(rung.ladder, rung.label) for rung in rungs} for rungs in (usual, full)]
    assert labels[0] < labels[1]


def test_short_strokes_are_told_by_statistics():
    problem = pose(Scene.from_toml(SCENARIOS / "aperiodic.toml").replace(**{"run.duration": 1.5}))
    assert problem.kind == APERIODIC
    answer = Run(problem, problem.scene.computed_by("rigid")).answer()
    assert not answer.histories
    assert answer.errors[RATE] > 0
    rungs = ladders(problem)
    assert {rung.ladder for rung in rungs} == {"modal", "wave", "explicit", "fem", "rigid"}


def test_a_general_integrator_agrees_with_the_elements_on_the_same_mesh():
    """A drop: same equations, another integrator; both with small steps."""
    problem = pose(Scene.from_toml(SCENARIOS / "drop_test.toml").replace(**{"run.duration": 4e-3}))
    coarse = fem_scene(problem.scene, 3, 0.2, 1e12)
    own = Run(problem, coarse).answer()
    other = Drop(coarse)
    force = other.run(problem.duration, problem.offsets, 1e-6)
    found = {
        "resting_place": other.y[other.n - 1],
        "rock_energy": other.y[-1],
        "peak_bit_force": force.max(),
    }
    for key, value in found.items():
        assert value == pytest.approx(own.values[key], rel=2e-4)
    assert relative_error(Answer({}, histories={HISTORY: force}), {}, own.histories, HISTORY) < 2e-3


def test_times_are_taken_turn_by_turn_and_the_dear_ones_less_often():
    turns: list[str] = []

    def cheap():
        turns.append("cheap")
        return 0.01

    def dear():
        turns.append("dear")
        return 100.0

    shares: list[float] = []
    often, once = interleaved([cheap, dear], shares.append)
    assert shares == sorted(set(shares))
    assert 0.0 <= min(shares) < 0.5 < max(shares) < 1.0
    assert turns[:3] == ["cheap", "dear", "cheap"]
    assert (often.median, often.spread, once.repeats) == (0.01, 0.0, 1)
    assert often.repeats > once.repeats
    assert np.isnan(once.spread)


def test_several_scenes_come_in_one_table(found, capsys):
    show_contests({"one": found, "other": found})
    shown = capsys.readouterr().out
    assert "explicit" in shown
    assert "at the worst of 2 scenes" in " ".join(shown.split())


def refused(*arguments: str) -> str:
    done = CliRunner().invoke(app, ["accuracy", *arguments])
    assert done.exit_code != 0
    return str(done.exception)


def test_rigid_scenes_are_refused():
    with pytest.raises(SceneError, match="rigid bar has closed forms"):
        pose(Scene.from_toml(SCENARIOS / "rigid.toml"))


@pytest.mark.parametrize("bar", ["bit", "piston"])
def test_rigid_scenes_are_refused_before_anything_is_compiled(bar, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(common, "tell_of_compiling", lambda *names: pytest.fail("compiles"))
    scene = str(SCENARIOS / ("rigid.toml" if bar == "bit" else "reference.toml"))
    done = CliRunner().invoke(app, ["accuracy", scene, "--set", "piston.model=rigid"])
    assert isinstance(done.exception, SceneError)
    assert "the scene has rigid bodies (" in str(done.exception)
    assert f'{bar}.model = "rigid"' in str(done.exception)
    assert "solver.name" not in str(done.exception)
    assert done.output == ""
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("method", ["explicit", "exact-flow"])
@pytest.mark.parametrize("change", ["effects.rock=power", "effects.cuttings=true"])
def test_a_method_that_has_no_such_law_is_refused_before_anything_is_compiled(
    method, change, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(common, "tell_of_compiling", lambda *names: pytest.fail("compiles"))
    given = "--methods", f"wave,{method}", "--set", change
    assert change.partition("=")[0] in refused(str(SCENARIOS / "reference.toml"), *given)
    assert not list(tmp_path.iterdir())


def test_a_method_that_has_no_such_law_leaves_a_note_where_none_was_named():
    scene = Scene().replace(**{"effects.rock": "power"})
    rungs = [r for r in ladders(Problem(scene, PERIODIC, 0.1, 0.05)) if r.peer]
    assert [rung.ladder for rung in rungs] == ["explicit", "exact-flow"]
    for rung in rungs:
        with pytest.raises(SceneError, match=r"effects\.rock must not be 'power'"):
            rung.peer(rung.scene)


def test_a_loss_of_elements_alone_is_refused():
    with pytest.raises(SceneError, match=r"fem\.damping_ratio = 0\.3 .* set loss\.time"):
        pose(Scene().replace(**{"fem.damping_ratio": 0.3}))


def test_what_is_compiled_is_told_by_name(monkeypatch):
    """Held up where the pilot run would begin."""

    def held_up(scene):
        raise InterruptedError

    said = []
    monkeypatch.setattr(
        study_module, "place_to_compile", lambda name: "a place" if name == "wave" else None
    )
    made = SimpleNamespace(setup_time=0.0)
    monkeypatch.setattr(study_module, "Simulation", lambda scene: made)
    monkeypatch.setattr(study_module, "pose", held_up)
    with pytest.raises(InterruptedError):
        study(Scene(), methods=["wave", "fem"], progress=lambda text, share: said.append(text))
    assert said == [
        *("loading the solver modal", "compiling the solver wave", "loading the solver fem"),
        "pilot run",
    ]


def test_too_few_blows_are_refused():
    with pytest.raises(SceneError, match=r"blows after run\.settle"):
        pose(Scene().replace(**{"run.duration": 0.2, "run.settle": 0.0}))


def test_unknown_methods_and_missing_files_are_refused():
    scene = str(SCENARIOS / "reference.toml")
    assert "'waves' is no method: modal, wave" in refused(scene, "--methods", "waves,fem")
    assert "none.toml" in refused("none.toml")


def test_an_order_has_the_digits_of_its_error(found, capsys):
    assert str(Order(1.1739, 0.0197, 1.0, 4)) == "1.174 ± 0.020"
    assert str(Order(0.2, 0.46, 1.0, 4)) == "0.2 ± 0.5"
    assert str(Order(2.0, 0.0, 1.0, 3)) == "2.000 ± 0.010"
    show_study(found)
    shown = capsys.readouterr().out
    assert str(found.order("wave", HISTORY)).replace(" ", "") in shown
    assert "±0.0 " not in shown


def test_a_value_of_the_reference_has_the_digits_of_its_bar():
    bar = Bar(8.631622e-3, 2.0e-7, {}, True)
    assert within_bar(1e3, bar) == "8.63162"


def test_only_methods_that_were_asked_are_set_up():
    assert solvers_of(("wave", "rigid"), Scene()) == ["modal", "wave", "rigid"]
    assert solvers_of(("fem-time", "explicit"), Scene()) == ["modal", "fem"]
    assert solvers_of(LADDERS, Scene()) == ["modal", "wave", "fem", "rigid"]
    power = Scene().replace(**{"effects.rock": "power"})
    assert solvers_of(LADDERS, power) == ["modal", "wave", "fem", "rigid"]
    assert solvers_of(LADDERS, hammer("t38")) == ["wave"]


def test_methods_of_a_reference_are_refused(monkeypatch, capsys):
    scene = str(SCENARIOS / "reference.toml")
    monkeypatch.setattr(
        "percussion_model.interface.commands.accuracy._make_reference",
        lambda scene: pytest.fail("it was made"),
    )
    words = ["percussion", "accuracy", scene, "--make-references", "--methods", "wave"]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "--make-references and --methods do not go together" in line
