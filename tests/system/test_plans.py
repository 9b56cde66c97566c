"""Files of systems that come from strangers: one error, and no file outside of the folder."""

from contextlib import contextmanager
from pathlib import Path

import pytest

from fmu_src.native import library
from fmu_src.system import archive
from fmu_src.system.archive import SYSTEMS, find_plan, plans, read_plan
from percussion_model.interface import progress
from percussion_model.scene.presets import scene_presets
from tests.commands import percussion

PLAIN = (SYSTEMS / "feed_control.toml").read_text()
NAME = 'name = "FeedControl"'
NASTY = {
    "name above": (PLAIN.replace(NAME, 'name = "../evil"'), "must begin with a letter"),
    "absolute name": (PLAIN.replace(NAME, 'name = "/tmp/evil"'), "must begin with a letter"),
    "no name": (PLAIN.replace(NAME, ""), "name missing"),
    "number for a name": (PLAIN.replace(NAME, "name = 5"), "name = 5: must be text"),
    "control character": (PLAIN.replace("Feed-controlled", "a\\u0000"), "control character"),
    "component above": (PLAIN.replace("[components]", '[components]\n"../x" = "a"'), "letter"),
    "unknown FMU": (PLAIN.replace("[components]", '[components]\nx = "Evil"'), "must be one of"),
    "list of FMUs": (PLAIN.replace("[components]", "[components]\nx = []"), "a table of texts"),
    "base of itself": ('base = "system.toml"', "base = "),
    "base that is a number": ("base = 5", "base = 5"),
    "table over value": ('base = "plain.toml"\nparameters = 5', "parameters = 5: must be a table"),
    "value over table": ('base = "plain.toml"\n[parameters]\nrig = 5', "stands where its base"),
    "no TOML": ("[", "not valid TOML"),
}  # fmt: skip


@pytest.mark.parametrize("name", NASTY)
def test_a_nasty_plan_is_one_line(name, tmp_path, capsys):
    text, said = NASTY[name]
    (tmp_path / "plain.toml").write_text(PLAIN)
    path = tmp_path / "system.toml"
    path.write_text(text)
    assert percussion("system", path, "-o", tmp_path / "out") == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert said in lines[0]
    assert not list(tmp_path.rglob("*.ssp"))


def test_plans_that_ship_are_read():
    for path in SYSTEMS.glob("*.toml"):
        assert read_plan(path).components


def test_a_plan_names_files_beside_it_or_presets(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "own.toml").write_text("[feed]\nforce = 2000.0\n")
    path = folder / "system.toml"
    path.write_text('base = "feed_control"\nname = "Mine"\nhammer = "own.toml"')
    plan = read_plan(path)
    assert (plan.name, plan.hammer) == ("Mine", folder / "own.toml")
    assert plan.components == read_plan(SYSTEMS / "feed_control.toml").components
    path.write_text('base = "feed_control"\nhammer = "rigid"')
    assert read_plan(path).hammer == scene_presets()["rigid"]


def test_systems_that_ship_go_by_name(capsys):
    plan = find_plan(Path("FeedControlRigid"))
    assert (plan.name, plan.hammer) == ("FeedControlRigid", scene_presets()["rigid"])
    assert percussion("system", "Nosuch") == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    for one in plans():
        assert one.name in said


def test_without_a_name_it_lists_what_there_is(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert percussion("system", "-o", "dist") == 0
    said = capsys.readouterr()
    assert [line.split()[0] for line in said.out.splitlines()] == [one.name for one in plans()]
    assert max(map(len, said.out.splitlines())) <= 80
    assert said.err == ""
    assert list(tmp_path.iterdir()) == []


def test_it_builds_what_is_named_or_all_and_tells_the_share(tmp_path, monkeypatch, capsys):
    told = []

    @contextmanager
    def noted(text, done=0.0):
        yield lambda text, share: told.append((text, share))

    monkeypatch.setattr(archive, "build_fmus", lambda *_: {})
    monkeypatch.setattr(archive, "write_system", lambda plan, fmus, path: path)
    monkeypatch.setattr(library, "libraries", lambda *_, **__: {})
    monkeypatch.setattr(progress, "progress", noted)
    names = [plan.name for plan in plans()]
    for words, wanted in (
        (["all"], names),
        (["FeedControl"], ["FeedControl"]),
        (names[:2], names[:2]),
    ):
        told.clear()
        assert percussion("system", *words, "-o", tmp_path) == 0
        lines = capsys.readouterr().out.splitlines()
        assert [Path(line.partition(":")[0]).stem for line in lines] == wanted
        assert [share for _, share in told] == (
            [k / len(wanted) for k in range(len(wanted))] if len(wanted) > 1 else []
        )
    assert told[1][0] == f"building {names[1]} (2 of 2)"
