"""Files of systems that come from strangers: one error, and no file outside of the folder."""

from pathlib import Path

import pytest

from fmu_src.native import library
from fmu_src.system import archive
from fmu_src.system.archive import SYSTEMS, find_plan, plans, read_plan
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


def test_without_a_name_all_are_built_and_named_first(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(archive, "build_fmus", lambda plan, folder, force: {})
    monkeypatch.setattr(archive, "write_system", lambda plan, fmus, path: path)
    monkeypatch.setattr(library, "library_here", dict)
    assert percussion("system", "-o", tmp_path) == 0
    said = capsys.readouterr()
    names = [plan.name for plan in plans()]
    assert f"all {len(names)} are built: {', '.join(names)}" in " ".join(said.err.split())
    assert [Path(line.partition(":")[0]).stem for line in said.out.splitlines()] == names
    assert percussion("system", "FeedControl", "-o", tmp_path) == 0
    assert "no system is named" not in capsys.readouterr().err
