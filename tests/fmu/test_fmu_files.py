"""An FMU does not replace that of another scene; who builds it again finds the same bytes."""

from __future__ import annotations

from pathlib import Path

import pytest

import fmu_src.compare as comparison
from fmu_src.commands import options
from fmu_src.hammer.build import hammer_name
from fmu_src.system.archive import SYSTEMS, build_fmus, read_plan
from percussion_model.scene.presets import scene_presets
from percussion_model.scene.scene import SceneError
from tests.commands import percussion

RIGID = scene_presets()["rigid"]


@pytest.fixture
def dist(tmp_path, monkeypatch):
    """The folder of FMUs, for all that build into it."""
    monkeypatch.setattr(options, "DIST", tmp_path)
    monkeypatch.setattr(comparison, "DEFAULT", tmp_path / "PercussiveHammer.fmu")
    return tmp_path


def build(*words):
    return percussion("fmu", "--no-reference", *words)


def test_all_commands_make_the_same_bytes(dist, monkeypatch, capsys):
    """`percussion fmu`, `percussion system` and `build.py run`."""
    assert build() == 0
    first = (dist / "PercussiveHammer.fmu").read_bytes()
    assert (
        capsys.readouterr()
        .out.strip()
        .endswith("}: written, from the scene reference, since none was named")
    )
    build_fmus(read_plan(SYSTEMS / "feed_control.toml"), dist)
    assert (dist / "PercussiveHammer.fmu").read_bytes() == first

    def only_built(scene, path):
        comparison.build_hammer(scene, path)
        return {}

    monkeypatch.setattr(comparison, "run_both", only_built)
    monkeypatch.setattr(comparison, "describe", lambda both, settle: "")
    assert comparison.main() == 0
    assert "PercussiveHammer.fmu: unchanged\n" in capsys.readouterr().out
    assert (dist / "PercussiveHammer.fmu").read_bytes() == first


def test_another_scene_has_a_file_of_its_own(dist, capsys):
    assert build() == 0
    assert build("--scene", RIGID) == 0
    assert sorted(path.name for path in dist.iterdir()) == [
        "PercussiveHammer.fmu", "RigidHammer.fmu",
    ]  # fmt: skip
    plan = read_plan(SYSTEMS / "feed_control.toml", hammer="rigid")
    before = (dist / "RigidHammer.fmu").read_bytes()
    build_fmus(plan, dist)
    assert (dist / "RigidHammer.fmu").read_bytes() == before


def test_the_fmu_of_another_scene_is_not_replaced(dist, tmp_path, capsys):
    path = tmp_path / "PercussiveHammer.fmu"
    assert build("--scene", RIGID, "-o", path) == 0
    before = path.read_bytes()
    assert build() == 2
    said = capsys.readouterr().err
    assert "PercussiveHammer.fmu: holds another FMU than that of this scene" in said
    assert "--force" in said
    assert comparison.main() == 1
    path.with_name("PercussiveHammer-native.fmu").write_bytes(before)
    with pytest.raises(SceneError, match="holds another FMU"):
        build_fmus(read_plan(SYSTEMS / "feed_control.toml"), dist)
    assert path.read_bytes() == before
    assert build("--force") == 0
    assert capsys.readouterr().out.split("}: ")[1].startswith("replaced, from the scene reference")
    assert path.read_bytes() != before


def test_a_file_that_is_no_fmu_is_not_replaced(dist, tmp_path):
    (tmp_path / "PercussiveHammer.fmu").write_text("mine")
    assert build() == 2
    assert (tmp_path / "PercussiveHammer.fmu").read_text() == "mine"


@pytest.mark.parametrize(
    ("scene", "name"),
    [
        ("reference.toml", "PercussiveHammer.fmu"),
        ("drop_test.toml", "DropTestHammer.fmu"),
        ("my scene-2.toml", "MyScene2Hammer.fmu"),
        ("2kN.toml", "Scene2KnHammer.fmu"),
    ],
)
def test_names_are_identifiers(scene, name):
    assert hammer_name(Path(scene)) == name
    assert name.removesuffix(".fmu").isidentifier()


def test_a_folder_is_no_fmu(tmp_path, capsys):
    path = tmp_path / "Empty.fmu"
    path.mkdir()
    for words in ([], ["--force"]):
        assert percussion("fmu", "rigid", "-o", path, *words) == 2
        said = capsys.readouterr().err
        assert said.startswith(f"percussion: {path}: is a folder")
        assert said.count("\n") == 1


def test_platforms_bring_their_libraries(tmp_path, built_library, capsys):
    from zipfile import ZipFile

    assert percussion("fmu", "rigid", "--platforms", "aarch64-linux") == 2
    said = capsys.readouterr().err
    assert "--platforms aarch64-linux: an FMU that runs Python is for linux64, win64" in said
    assert percussion("fmu", "rigid", "--platforms", "linux65") == 2
    assert "--platforms linux65: must be one or more of" in capsys.readouterr().err
    if "x86_64-linux" not in built_library:
        pytest.skip("no compiler for linux64")
    path = tmp_path / "Hammer.fmu"
    assert percussion("fmu", "rigid", "-o", path, "--no-reference", "--platforms", "linux64") == 0
    found = ZipFile(path).read("resources/native/x86_64-linux/hammer.so")
    assert found == built_library["x86_64-linux"]


def test_bad_names_are_refused_before_anything_is_compiled(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("fmu_src.native.library.library_here", lambda: pytest.fail("compiles"))
    (tmp_path / "file").touch()
    for name, told in (
        ("two-words.fmu", "an FMU is named by letters"),
        ("Hammer.zip", "ends with .fmu"),
        ("file/Hammer.fmu", "is a file, not a folder"),
    ):
        assert percussion("fmu", "rigid", "-o", tmp_path / name) == 2
        said = capsys.readouterr().err
        assert told in said
        assert said.count("\n") == 1


def test_a_scene_is_given_once(capsys):
    assert percussion("fmu", "rigid", "--scene", RIGID) == 2
    assert "a scene is given already" in capsys.readouterr().err
