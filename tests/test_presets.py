"""Scenes that ship, by name, wherever a command takes a scene."""

from __future__ import annotations

import pytest

from percussion_model import Scene, SceneError
from percussion_model.interface.cli import BAD_INPUT
from percussion_model.scene.presets import scene_file, scene_presets, system_file, system_presets
from tests.commands import percussion


@pytest.fixture(autouse=True)
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_preset_is_a_scene():
    found = scene_presets()
    assert {"reference", "rigid", "drop_test", "undamped"} <= set(found)
    for path in found.values():
        Scene.from_toml(path)


def test_a_preset_is_run_from_an_empty_folder(empty_folder, capsys):
    assert percussion("run", "rigid", "--duration", "0.3", "--settle", "0") == 0
    assert "Rate of penetration" in capsys.readouterr().out
    assert not list(empty_folder.iterdir())


def test_a_file_wins_over_a_preset_and_a_folder_does_not(empty_folder):
    (empty_folder / "rigid").mkdir()
    assert scene_file(empty_folder / "rigid") == empty_folder / "rigid"  # a path is no name
    name = (empty_folder / "rigid").relative_to(empty_folder)
    assert scene_file(name) == scene_presets()["rigid"]
    name.rmdir()
    Scene(title="mine").to_toml(name)
    assert scene_file(name) == name
    assert Scene.from_toml(name).title == "mine"


def test_python_takes_the_names_of_the_command_line():
    for name, path in scene_presets().items():
        assert Scene.from_toml(name) == Scene.from_toml(path)
    with pytest.raises(SceneError, match="nosuch: there is no such scene file, and no preset"):
        Scene.from_toml("nosuch")
    with pytest.raises(SceneError, match=r"percussion new dth5\.toml --hammer dth5"):
        Scene.from_toml("dth5")


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["run", "refernce"], "reference"),
        (["explain", "Top_Hammer"], "top_hammer"),
        (["system", "FeedControlrigid"], "FeedControlRigid"),
        (["scenario", "laered_rock"], "layered_rock"),
    ],
)
def test_a_misspelt_name_is_told_the_one_that_was_meant(words, meant, capsys):
    assert percussion(*words) == BAD_INPUT
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f": did you mean {meant}? Known are " in said


def test_a_name_that_no_file_can_have_is_refused():
    for name in ("x" * 5000, "a\0b", "x" * 5000 + ".toml"):
        with pytest.raises(SceneError):
            Scene.from_toml(name)


@pytest.mark.parametrize(
    "words",
    [
        *(["run", "nosuch"], ["explain", "nosuch"], ["settled", "nosuch"], ["effects", "nosuch"]),
        *(["compare", "nosuch"], ["accuracy", "nosuch"], ["fmu", "nosuch"]),
        *(["plot", "nosuch"], ["native", "nosuch"], ["fmu", "--scene", "nosuch"]),
        ["study", "nosuch", "--over", "feed.force=1,2", "--out", "a"],
        ["calibrate", "nosuch", "--measured", "penetration=1+-0.1 mm @5"],
    ],
    ids=" ".join,
)
def test_an_unknown_name_is_one_line_with_those_that_there_are(words, empty_folder, capsys):
    assert percussion(*words) == BAD_INPUT
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert said.startswith("percussion: nosuch: there is no such scene file")
    for name in scene_presets():
        assert name in said
    assert not list(empty_folder.iterdir())


def test_a_file_that_is_not_there_is_no_preset(capsys):
    assert percussion("run", "reference.toml") == BAD_INPUT
    assert capsys.readouterr().err == "percussion: reference.toml: there is no such scene file\n"


def test_systems_have_names_too():
    assert set(system_presets()) == {
        "air_drilling",
        "extremum_seeking",
        "feed_control",
        "rock_following",
        "two_way_seeking",
        "wave_drilling",
    }
    assert all(system_file(path.relative_to(path.parent).with_suffix("")) == path
               for path in system_presets().values())  # fmt: skip
