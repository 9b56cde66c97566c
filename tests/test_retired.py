"""Retired names answer in one line with what took their place; rigid bodies by fidelity."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from percussion_model import Scene, SceneError, simulate
from percussion_model.analysis.comparison import read_solvers
from percussion_model.interface.cli import BAD_INPUT
from percussion_model.scene.retired import BLOW_MAP
from tests.commands import percussion

KEYS = [
    *("velocity_from", "velocity_to", "feed_from", "feed_to", "force_from", "force_to"),
    *("stiffness_from", "stiffness_to", "density"),
]


@pytest.mark.parametrize(
    "words",
    [
        ["run", "reference", "--solver", "blow-map"],
        ["study", "reference", "--solver=blow-map", "--over", "feed.force=1,2", "--out", "a"],
        ["run", "reference", "--set", "solver.fidelity=blow-map"],
        ["run", "reference", "--set", "blow_map.density=2"],
        ["compare", "reference", "--solvers", "wave,blow-map"],
        ["blow-map", "reference"],
        ["blow-map", "reference", "show", "--set", "blow_map.density=2"],
        ["fmu", "reference", "--blow-map"],
        ["native", "--blow-map"],
        ["system", "FeedControlMap"],
    ],
    ids=" ".join,
)
def test_words_of_the_blow_map_are_refused(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert percussion(*words) == BAD_INPUT
    told = capsys.readouterr()
    assert told.out == ""
    assert BLOW_MAP in " ".join(told.err.split())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("key", KEYS)
def test_a_key_of_its_table_is_refused_in_one_line(key, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(f"[blow_map]\n{key} = 2.0\n")
    with pytest.raises(SceneError) as refused:
        Scene.from_toml(path)
    assert str(refused.value) == f"{path}: blow_map: {BLOW_MAP}"
    with pytest.raises(SceneError, match="the blow map is retired"):
        Scene().replace(**{f"blow_map.{key}": 2.0})


def test_its_fidelity_is_refused_with_those_there_are(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text('[solver]\nfidelity = "blow-map"\n')
    with pytest.raises(SceneError) as refused:
        Scene.from_toml(path)
    assert str(refused.value).startswith(
        f'{path}: solver.fidelity = "blow-map": must be one of "wave", "rigid"; the blow map'
    )
    assert "\n" not in str(refused.value)
    for work in (lambda: Scene().computed_by("blow-map"), lambda: read_solvers("blow-map")):
        with pytest.raises(SceneError, match="the blow map is retired"):
            work()


def test_pickles_of_scenes_that_had_its_table_are_refused():
    """As pickle makes the group again."""
    with pytest.raises(SceneError, match="pickled by an earlier version"):
        pickle.loads(b"cpercussion_model.scene.parameters\nBlowMapOptions\n)\x81.")


def test_files_of_percussion_new_are_read_still(tmp_path):
    """They have its table, with nothing in it."""
    path = tmp_path / "scene.toml"
    path.write_text("[blow_map]\n# density = 1.0\n\n[feed]\nforce = 3000.0\n")
    assert Scene.from_toml(path) == Scene(feed={"force": 3000.0})


def test_rigid_bodies_by_fidelity_are_those_of_the_rigid_scene():
    """An elastic scene gives the bits of one whose bodies are rigid."""
    by_fidelity = simulate(Scene().replace(**{"solver.fidelity": "rigid"}), 1.0, settle=0.2)
    rigid = simulate(Scene().computed_by("rigid"), 1.0, settle=0.2)
    assert by_fidelity.solver == rigid.solver == "rigid"
    assert by_fidelity.blows.tobytes() == rigid.blows.tobytes()
    assert not by_fidelity.warnings


def test_a_name_says_how_waves_are_computed_and_nothing_else():
    with pytest.raises(SceneError, match=r"solver\.fidelity = \"rigid\" and solver\.name"):
        Scene().replace(**{"solver.fidelity": "rigid", "solver.name": "fem"})
    rigid = Scene().replace(**{"solver.fidelity": "rigid"})
    assert rigid.computed_by("fem").solver_name == "fem"


OLD = """\
title = "Old"  # kept

[feed]
force = "3 kN"  # measured
[blow_map]   # no more
density = 2
# of the map
[solver]
name = "chain"  # as it was called
cells = 20
"""
UP_TO_DATE = """\
title = "Old"  # kept

[feed]
force = "3 kN"  # measured
[solver]
name = "wave"  # as it was called
cells = 20
"""


def test_an_older_scene_is_brought_up_to_date_with_its_comments(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("old.toml").write_text(OLD)
    with pytest.raises(SceneError):
        Scene.from_toml("old.toml")
    assert percussion("upgrade", "old.toml", "-o", "new.toml") == 0
    told = capsys.readouterr().out.splitlines()
    assert [line.partition(":")[0] for line in told] == ["[blow_map]", 'solver.name = "chain"']
    assert Path("new.toml").read_text() == UP_TO_DATE
    assert Path("old.toml").read_text() == OLD
    assert Scene.from_toml("new.toml").solver_name == "wave"
    assert percussion("upgrade", "new.toml") == 0
    assert "nothing to change" in capsys.readouterr().out
    assert percussion("upgrade", "old.toml", "-o", "new.toml") == BAD_INPUT  # which is there


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('solver = {name = "chain"}', "solver.name is not written on a line of its own"),
        ('[solver]\nname = "chain"\ncels = 3', "unknown key solver.cels"),
        ("[solver", "not valid TOML"),
    ],
)
def test_what_cannot_be_brought_up_to_date_is_said(text, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("old.toml").write_text(text)
    assert percussion("upgrade", "old.toml", "-o", "new.toml") == BAD_INPUT
    assert said in capsys.readouterr().err
    assert not Path("new.toml").exists()
