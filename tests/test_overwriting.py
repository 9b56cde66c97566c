"""Results never replace those of another scene or run without saying so."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import percussion_model
from percussion_model.interface.cli import main
from percussion_model.simulation.files import ResultError
from percussion_model.simulation.one_writer import hold
from percussion_model.simulation.origin import ORIGIN, Claim

SCENE = str(Path(__file__).parents[1] / "scenarios" / "rigid.toml")
SHORT = ["--duration", "0.3", "--settle", "0"]
RUN = ["run", SCENE, *SHORT]


@pytest.fixture
def percussion(monkeypatch, tmp_path, capsys):
    """The command, in a folder of its own: gives its code and what it said on stderr.

    Figures are files with a number, another one each time, which tells of one drawn anew.
    """
    monkeypatch.chdir(tmp_path)
    drawn = itertools.count()

    def savefig(figure, path, **options):
        Path(path).write_text(f"<svg>{next(drawn)}</svg>")

    monkeypatch.setattr(Figure, "savefig", savefig)
    monkeypatch.setattr(Figure, "draw_without_rendering", lambda figure: None)

    def call(*words):
        monkeypatch.setattr("sys.argv", ["percussion", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, " ".join(capsys.readouterr().err.split())

    return call


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in Path(folder).rglob("*")
        if path.is_file()
    }


def test_another_setting_does_not_replace_what_a_named_folder_holds(percussion):
    assert percussion(*RUN, "--no-figures", "--out", "x")[0] == 0
    before = contents("x")
    code, said = percussion(*RUN, "--no-figures", "--out", "x", "--set", "feed.force=1500")
    assert code == 2
    assert said == (
        "percussion: x holds another result (feed.force 2500.0 N, now 1500.0 N): "
        "--force replaces it, another --out keeps it"
    )
    assert contents("x") == before
    forced = [*RUN, "--no-figures", "--out", "x", "--set", "feed.force=1500", "--force"]
    assert percussion(*forced)[0] == 0
    assert "force = 1500.0" in Path("x/scene.toml").read_text()
    # what made it is known from now on: no --force is needed again
    assert percussion(*forced[:-1])[0] == 0


def test_the_same_run_replaces_its_own_result(percussion):
    for _ in range(2):
        code, said = percussion(*RUN, "--no-figures", "--out", "x")
        assert code == 0
        assert "holds another" not in said
    assert sorted(path.name for path in Path().iterdir()) == ["x"]
    found = json.loads(Path("x", ORIGIN).read_text())
    assert found["made_by"]["command"] == "run"
    assert found["made_by"]["scene.feed.force"] == 2500.0
    assert found["version"] == percussion_model.__version__
    assert found["files"] == ["blows.csv", "events.csv", "scene.toml", "summary.json"]


def test_plot_does_not_draw_over_another_run(percussion):
    """The folder that it chooses itself is numbered; the same run's own is taken."""
    assert percussion(*RUN, "--out", "out/rigid")[0] == 0
    before = contents("out/rigid")
    code, said = percussion("plot", SCENE, "--duration", "0.5")
    assert code == 0
    assert "out/rigid holds another result (duration 0.3, now 0.5" in said
    assert "goes to out/rigid-2" in said
    assert contents("out/rigid") == before
    assert Path("out/rigid-2/overview.png").is_file()
    assert percussion("plot", SCENE, *SHORT)[0] == 0
    assert contents("out/rigid").keys() == before.keys()
    # again: no third folder
    assert percussion("plot", SCENE, "--duration", "0.5")[0] == 0
    assert sorted(path.name for path in Path("out").iterdir()) == ["rigid", "rigid-2"]


def test_figures_of_a_result_go_beside_it(percussion):
    assert percussion(*RUN, "--no-figures", "--out", "x")[0] == 0
    assert percussion("plot", "x") == (0, "")
    assert Path("x/overview.png").is_file()
    assert percussion(*RUN, "--out", "y", "--set", "feed.force=500")[0] == 0
    code, said = percussion("plot", "x", "--out", "y")
    assert code == 2
    assert "y holds the result of `percussion run`" in said


def test_forcing_leaves_nothing_of_the_other_run(percussion):
    assert percussion(*RUN, "--out", "x", "--trace", "1e-3")[0] == 0
    assert percussion("effects", SCENE, *SHORT, "--out", "x", "--force")[0] == 0
    assert sorted(contents("x")) == ["effects.png", "effects.svg", ORIGIN]


def test_files_of_unknown_origin_are_left_alone(percussion):
    Path("mine").mkdir()
    Path("mine/scene.toml").write_text(Path(SCENE).read_text())
    before = contents("mine")
    code, said = percussion("run", "mine/scene.toml", *SHORT, "--out", "mine")
    assert code == 2
    assert "mine holds files of unknown origin (scene.toml)" in said
    assert contents("mine") == before


@pytest.mark.parametrize("command", ["compare", "effects"])
def test_other_commands_keep_to_the_rule(percussion, command):
    words = [command, SCENE, *SHORT] + (["--solvers", "rigid"] if command == "compare" else [])
    for setting, folders in (("600", 1), ("700", 2), ("600", 2)):
        assert percussion(*words, "--set", f"feed.force={setting}")[0] == 0
        assert len(list(Path("out").iterdir())) == folders
    assert percussion(*words, "--out", next(Path("out").iterdir()))[0] == 2


def test_a_refusal_names_no_folder(percussion):
    figures = ("compare", SCENE, "--solvers", "rigid", "--settle", "0", "--duration")
    assert percussion(*figures, "0.3")[0] == 0
    code, said = percussion(*figures, "-1")
    assert code == 2
    assert "--force" not in said
    assert "goes to" in percussion(*figures, "0.2")[1]


def test_a_calibrated_scene_does_not_replace_a_file(percussion):
    Path("slow.csv").write_text("penetration,force\n" + "\n".join(
        f"{1e-5 * k},{7.5e8 * 1e-5 * k}" for k in range(20)
    ))  # fmt: skip
    Path("mine.toml").write_text("of mine")
    words = ("calibrate", SCENE, "--curve", "slow.csv", "--out", "mine.toml")
    code, said = percussion(*words)
    assert code == 2
    assert "mine.toml: exists already; --force overwrites it" in said
    assert Path("mine.toml").read_text() == "of mine"


def test_a_result_that_is_saved_from_python_is_of_unknown_origin(percussion):
    """Else the command that wrote the folder before would take it for its own."""
    from percussion_model.scene.scene import Scene
    from percussion_model.simulation.simulate import simulate

    assert percussion(*RUN, "--no-figures", "--out", "x")[0] == 0
    simulate(Scene.from_toml(SCENE), 0.2, 0.0).save("x")
    assert percussion(*RUN, "--no-figures", "--out", "x")[0] == 2


def test_numbers_go_on_till_a_folder_is_free(tmp_path):
    for k, name in enumerate(("x", "x-2", "x-3")):
        claimed = Claim(tmp_path / "x", {"command": "run", "k": k}, numbered=True)
        assert claimed.folder.name == name
        claimed.folder.mkdir()
        (claimed.folder / "file").touch()
        claimed.sign()
    assert Claim(tmp_path / "x", {"command": "run", "k": 1}, numbered=True).folder.name == "x-2"
    with pytest.raises(ResultError, match="k 0, now 7"):
        Claim(tmp_path / "x", {"command": "run", "k": 7})


def test_an_interrupted_run_does_not_replace_the_whole_one(percussion, monkeypatch):
    import percussion_model.simulation.simulate as module

    assert percussion(*RUN, "--no-figures", "--out", "x")[0] == 0
    before, whole = contents("x"), module.simulate

    def interrupted(scene, duration, settle, *words, **options):
        found = whole(scene, 0.2, settle, *words, **options)
        monkeypatch.setattr(type(found), "cut_short", True, raising=False)
        return found

    monkeypatch.setattr(module, "simulate", interrupted)
    _, said = percussion(*RUN, "--no-figures", "--out", "x")
    assert contents("x") == before
    assert "goes to x-2" in said
    assert json.loads(Path("x-2/summary.json").read_text())["duration"] == 0.2


def test_forcing_removes_nothing_outside_of_the_folder(tmp_path):
    """A list of files may come from elsewhere, as the whole folder may."""
    (tmp_path / "kept").touch()
    claimed = Claim(tmp_path / "x", {"command": "run"})
    claimed.folder.mkdir()
    (claimed.folder / "old").touch()
    files = ["old", "../kept", str(tmp_path / "kept"), 3]
    (claimed.folder / ORIGIN).write_text(json.dumps({"made_by": {"command": "a"}, "files": files}))
    Claim(tmp_path / "x", {"command": "run"}, force=True).sign()
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["kept", ORIGIN, "x"]


def test_what_another_command_left_is_named_as_it_is_typed(tmp_path):
    typed = {
        "run": "percussion run",
        "python -m scenarios.rod_addition": "python -m scenarios.rod_addition",
    }
    for command, words in typed.items():
        Claim(tmp_path, {"command": command}, force=True).sign()
        with pytest.raises(ResultError, match=f"holds the result of `{words}`"):
            Claim(tmp_path, {"command": "couple"})
    assert Claim(tmp_path, {"command": command}).folder == tmp_path


@pytest.mark.parametrize("text", ["[]", '{"made_by": 3, "files": []}', '{"made_by": {}}', "{"])
def test_a_damaged_origin_is_unknown(tmp_path, text):
    (tmp_path / ORIGIN).write_text(text)
    with pytest.raises(ResultError, match="holds"):
        Claim(tmp_path, {"command": "run"})


def test_a_summary_that_is_replaced_is_said_to_be(percussion):
    words = (*RUN, "--json", "numbers.json")
    assert "wrote numbers.json" in percussion(*words)[1]
    assert "replaced numbers.json" in percussion(*words)[1]


def test_force_removes_nothing_from_the_folder_beside_one_that_is_held(tmp_path, monkeypatch):
    """Another process writes to the wanted folder: the one beside it has this origin, and stays."""
    beside = tmp_path / "run-2"
    beside.mkdir()
    claimed = Claim(beside, {"command": "run"})
    (beside / "figure.png").touch()
    claimed.sign()
    monkeypatch.setattr(
        "percussion_model.simulation.origin.hold",
        lambda folder: None if folder.name == "run" else hold(folder),
    )
    again = Claim(tmp_path / "run", {"command": "run"}, force=True, numbered=True)
    assert again.folder == beside
    again.sign()
    assert (beside / "figure.png").exists()
