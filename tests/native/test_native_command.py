"""The command `native`, and the library that it compiles once."""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path

import pytest

from fmu_src.commands import options
from fmu_src.hammer.build import about_hammer, refuse_other
from fmu_src.native import build as building
from fmu_src.native import library as native
from fmu_src.native.archive import write_native_fmu
from fmu_src.native.build import native_files
from fmu_src.native.library import libraries
from fmu_src.native.tables import model_tables
from percussion_model.engine import compiler
from percussion_model.engine.compiler import MOST_KEPT, NoCompilerError, compiler_for
from percussion_model.engine.platforms import this_platform
from percussion_model.scene.scene import Scene, SceneError
from tests.commands import percussion

HOST = "x86_64-linux"


@pytest.fixture
def without_compilers(monkeypatch):
    monkeypatch.setattr(compiler.shutil, "which", lambda name: None)
    monkeypatch.setattr(compiler.importlib.util, "find_spec", lambda name: None)


def bake(scene, path):
    """A native FMU with a library that is none."""
    write_native_fmu(
        path, "2.0", about_hammer(scene, Path("A.fmu")), scene, {HOST: b""},
        lambda guid: model_tables(scene, guid),
    )  # fmt: skip


def test_an_interruption_leaves_the_fmu_that_was_there(tmp_path, monkeypatch):
    """It is built beside it, and compared before it takes its place."""
    path = tmp_path / "Hammer-native.fmu"
    path.write_bytes(b"the one before")
    monkeypatch.setattr(building, "this_platform", lambda: HOST)

    def interrupt(scene, draft, named):
        assert draft.is_file()
        raise KeyboardInterrupt

    monkeypatch.setattr(building, "refuse_difference", interrupt)
    with pytest.raises(KeyboardInterrupt):
        building.build_native(Scene(), path, "2.0", {HOST: b""})
    assert path.read_bytes() == b"the one before"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(KeyboardInterrupt):  # a folder that is not there yet is made
        building.build_native(Scene(), tmp_path / "new" / "A-native.fmu", "2.0", {HOST: b""})


def test_the_fmu_of_another_scene_is_not_replaced(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(options, "DIST", tmp_path)
    rigid = Scene(piston={"model": "rigid"}, bit={"model": "rigid"})
    files = native_files(Path("reference.toml"), tmp_path)
    path = files["3.0"]
    bake(rigid, path)
    before = path.read_bytes()
    assert percussion("native", "reference", "-o", tmp_path) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"{path}: holds another FMU than that of this scene" in said
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    refuse_other(path, rigid)
    with pytest.raises(SceneError, match="holds another FMU"):
        refuse_other(path, Scene())
    refuse_other(path, Scene(), force=True)


def test_two_files_go_to_a_folder(tmp_path, capsys):
    assert percussion("native", "rigid", "-o", tmp_path / "Mine.fmu") == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "must be a folder" in said
    assert not list(tmp_path.iterdir())
    (tmp_path / "file").touch()
    assert percussion("native", "rigid", "-o", tmp_path / "file") == 2
    assert "is a file, not a folder" in capsys.readouterr().err


def test_a_missing_compiler_is_told_in_the_words_of_the_user(
    without_compilers, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(native, "kept_folder", lambda: tmp_path)
    assert percussion("native", "rigid", "--platforms", "win64", "-o", tmp_path) == 2
    said = capsys.readouterr().err
    wanted = 'no compiler for win64: install ziglang: pip install "percussion_model[native]"\n'
    assert said == f"percussion: {wanted}"
    with pytest.raises(NoCompilerError, match=r"a C compiler .*, or ziglang: pip install"):
        compiler_for(this_platform())
    assert not list(tmp_path.iterdir())


@pytest.fixture
def linked(monkeypatch):
    """Names of platforms, in the order of linking, which takes a while and compiles nothing."""
    names = []

    def link(name, compiler, sources, parts, out, flags):
        names.append(name)
        time.sleep(0.5)
        out.write_bytes(b"library")

    monkeypatch.setattr(native, "compiler_for", lambda name, word: ["cc"])
    monkeypatch.setattr(native, "objects", lambda _, names, report=None: {one: [] for one in names})
    monkeypatch.setattr(native, "link", link)
    return names


def test_a_part_of_a_system_comes_in_both_versions(built_library, tmp_path, capsys):
    assert percussion("native", "RigFeed", "-o", tmp_path) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [Path(one.split()[0]).name for one in lines] == ["RigFeed.fmu", "RigFeed-fmi3.fmu"]
    assert {path.name for path in tmp_path.iterdir()} == {"RigFeed.fmu", "RigFeed-fmi3.fmu"}
    assert percussion("native", "RigFeed", "--rock", "granite", "-o", tmp_path) == 2
    assert "RigFeed: is no hammer" in capsys.readouterr().err
    assert percussion("native", "RigFed", "-o", tmp_path) == 2
    assert "did you mean RigFeed?" in capsys.readouterr().err


def test_of_two_at_once_one_compiles_and_the_other_waits(linked, tmp_path, capsys):
    found = []
    both = [
        threading.Thread(target=lambda: found.append(libraries([HOST], tmp_path))) for _ in "ab"
    ]
    for one in both:
        one.start()
    for one in both:
        one.join()
    assert linked == [HOST]
    assert found == [{HOST: b"library"}] * 2
    assert capsys.readouterr().err.count("waiting for it") == 1


def test_the_newest_libraries_are_kept(linked, tmp_path, monkeypatch):
    stamps = [f"stamp{k}" for k in range(MOST_KEPT + 2)]
    for k, stamp in enumerate(stamps):
        monkeypatch.setattr(native, "stamp", lambda stamp=stamp: stamp)
        libraries([HOST], tmp_path)
        os.utime(tmp_path / stamp, (k, k))
    left = {path.name for path in tmp_path.glob("*/")}
    assert len(left) == MOST_KEPT
    assert stamps[-1] in left
    assert stamps[0] not in left
