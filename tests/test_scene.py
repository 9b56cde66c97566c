"""Scenes: reading, writing, changing, and every way to get one wrong."""

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from percussion_model.parameter_table import parameter_table
from percussion_model.parameters import BitBar, PistonBar, RockLaw, Section
from percussion_model.scene import Scene, SceneError, read_setting

SCENARIOS = Path(__file__).parents[1] / "scenarios"


@pytest.fixture
def read(tmp_path):
    """Read a scene from text."""

    def from_text(text):
        path = tmp_path / "scene.toml"
        path.write_text(text, encoding="utf-8")
        return Scene.from_toml(path)

    return from_text


# ---------------------------------------------------------------- stored scenes


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.toml")), ids=lambda path: path.stem)
def test_stored_scenes_are_sound(path):
    scene = Scene.from_toml(path)
    assert scene.title
    assert scene.unused == ()


def test_the_reference_file_is_the_default_scene():
    scene = Scene.from_toml(SCENARIOS / "reference.toml")
    assert scene == Scene(title=scene.title)
    assert (SCENARIOS / "reference.toml").read_text() == scene.to_toml(comments=True)


def test_the_reference_file_names_every_parameter():
    text = (SCENARIOS / "reference.toml").read_text()
    for row in parameter_table():
        assert f"{row.key.rpartition('.')[2]} =" in text or row.kind == "sections"


def test_solvers_and_effects_of_the_stored_scenes():
    reference, drop, rigid, undamped = (
        Scene.from_toml(SCENARIOS / f"{name}.toml")
        for name in ("reference", "drop_test", "rigid", "undamped")
    )
    every = ("gravity", "feed", "drive", "loss", "barrier", "rock")
    assert (reference.solver_name, reference.effects_on) == ("wave", every)
    assert (drop.solver_name, drop.effects_off) == ("wave", ("drive",))
    assert (rigid.solver_name, rigid.effects_off) == ("rigid", ("loss",))
    assert (undamped.solver_name, undamped.effects_off) == ("wave", ("loss",))


# ------------------------------------------------------------------- bad input

BAD = {
    "syntax": ("[rock\nunloading_ratio = 5", ("not valid TOML", "line 1")),
    "syntax on a later line": ('title = "x"\n[rock]\na = = 5', ("not valid TOML", "line 3")),
    "unknown key": (
        "[rock]\nunloading_rato = 5",
        ("rock.unloading_rato", "did you mean rock.unloading_ratio?"),
    ),
    "key of another table": (
        "[drive]\nunloading_ratio = 5",
        ("drive.unloading_ratio", "did you mean rock.unloading_ratio?"),
    ),
    "shortened key": ("[rock]\nloading = 5", ("did you mean rock.loading_stiffness?",)),
    "unknown key like no other": ("[rock]\nxyzzy = 5", ("rock.xyzzy", "loading_stiffness")),
    "unknown table": ("[rok]\na = 1", ("rok", "did you mean rock?")),
    "unknown key in a section": (
        "[[bit.sections]]\nlenth = 1.0\nlength = 1.0\narea = 1e-3",
        ("bit.sections.0.lenth", "did you mean bit.sections.0.length?"),
    ),
    "text for a number": ('[feed]\nforce = "10 kN"', ('feed.force = "10 kN"', "a number", " N")),
    "flag for a number": ("[feed]\nforce = true", ("feed.force = true", "a number")),
    "number for a flag": ("[effects]\nfeed = 1", ("effects.feed = 1", "true or false")),
    "number for a table": ("rock = 5", ("rock = 5", "[rock]")),
    "number for a title": ("title = 5", ("title = 5", "text")),
    "fraction for a whole number": ("[solver]\ncells = 2.5", ("cells = 2.5", "a whole number")),
    "unknown word": ('[effects]\nrock = "soft"', ('effects.rock = "soft"', '"bilinear", "spring"')),
    "negative length": (
        "[[bit.sections]]\nlength = -0.2\narea = 1e-3",
        ("bit.sections.0.length = -0.2 m:", "above 0", " m"),
    ),
    "zero area": (
        "[[piston.sections]]\nlength = 0.2\narea = 0",
        ("piston.sections.0.area = 0 m^2:", "above 0"),
    ),
    "missing area": ("[[bit.sections]]\nlength = 0.2", ("bit.sections.0.area is missing", "m^2")),
    "no sections": ("[bit]\nsections = []", ("bit.sections = []", "at least one section")),
    "sections of the wrong type": ("[bit]\nsections = [5]", ("bit.sections.0 = 5", "a table")),
    "gamma of one": (
        "[rock]\nunloading_ratio = 1.0",
        ("rock.unloading_ratio = 1.0:", "above 1"),
    ),
    "not a number": ("[rock]\nunloading_ratio = nan", ("rock.unloading_ratio = nan", "a number")),
    "infinite": ("[feed]\nforce = inf", ("feed.force = inf", "a number from")),
    "negative gap": ("[start]\ngap = -1e-5", ("start.gap = -1e-05 m:", "from 0")),
    "duration zero": ("[run]\nduration = 0", ("run.duration = 0 s:", "above 0")),
    "settling for ever": (
        "[run]\nduration = 2.0\nsettle = 2.0",
        ("run.settle = 2.0 s", "run.duration = 2.0 s"),
    ),
    "drive without piston": (
        '[piston]\nmodel = "absent"',
        ("effects.drive", "piston.model", 'set effects.drive = "none"'),
    ),
    "rigid bit under an elastic piston": (
        '[bit]\nmodel = "rigid"',
        ("piston.model", "bit.model", "set "),
    ),
    "absent bit": ('[bit]\nmodel = "absent"', ('bit.model = "absent"', '"elastic", "rigid"')),
    "waves in rigid bars": (
        '[piston]\nmodel = "rigid"\n[bit]\nmodel = "rigid"\n[solver]\nname = "wave"',
        ('solver.name = "wave"', "bit.model"),
    ),
    "rigid solver for elastic bars": (
        '[solver]\nname = "rigid"',
        ('solver.name = "rigid"', "elastic"),
    ),
    "barrier without the bilinear law": (
        '[effects]\nrock = "spring"\nbarrier = true',
        ("effects.barrier", 'not "spring"', "set effects.barrier = false"),
    ),
}


@pytest.mark.parametrize(("text", "words"), BAD.values(), ids=BAD)
def test_bad_scenes_get_one_clear_error(read, text, words):
    with pytest.raises(SceneError) as caught:
        read(text)
    message = str(caught.value)
    assert "scene.toml: " in message
    assert len(message.splitlines()) == 1
    for word in words:
        assert word in message


def test_every_fault_has_its_line(read):
    with pytest.raises(SceneError) as caught:
        read("[[bit.sections]]\nlength = -1.0\narea = 0.0\n[feed]\nforce = nan")
    assert len(str(caught.value).splitlines()) == 3


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(SceneError, match="there is no such scene file"):
        Scene.from_toml(tmp_path / "missing.toml")
    with pytest.raises(SceneError, match="is a folder"):
        Scene.from_toml(tmp_path)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="UTF-8"):
        Scene.from_toml(tmp_path / "binary.toml")


def test_a_file_that_cannot_be_written_leaves_nothing(tmp_path):
    target = tmp_path / "scene.toml"
    target.mkdir()
    with pytest.raises(SceneError, match="cannot be written"):
        Scene().to_toml(target)
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]
    (tmp_path / "file").write_text("")
    with pytest.raises(SceneError, match="cannot be written"):
        Scene().to_toml(tmp_path / "file" / "scene.toml")


def test_a_key_with_an_underline_for_its_point_is_understood():
    with pytest.raises(SceneError, match=r"feed_force: did you mean feed\.force\?"):
        Scene().replace(feed_force=3.0)


def test_a_folder_that_is_missing_is_made(tmp_path):
    Scene().to_toml(tmp_path / "missing" / "scene.toml")
    assert Scene.from_toml(tmp_path / "missing" / "scene.toml") == Scene()


def test_bad_arguments_get_the_same_errors():
    with pytest.raises(SceneError, match=r"rock\.unloading_ratio = 0\.5: must be a number above 1"):
        Scene(rock={"unloading_ratio": 0.5})
    with pytest.raises(SceneError, match=r"unknown key rocks: did you mean rock\?"):
        Scene(rocks={})


# ------------------------------------------------------------------ round trip


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.toml")), ids=lambda path: path.stem)
@pytest.mark.parametrize("comments", [False, True])
def test_round_trip_of_stored_scenes(path, comments, tmp_path):
    scene = Scene.from_toml(path)
    copy = tmp_path / "copy.toml"
    text = scene.to_toml(copy, comments=comments)
    assert copy.read_text(encoding="utf-8") == text
    assert Scene.from_toml(copy) == scene
    assert Scene.from_toml(copy).to_toml(comments=comments) == text


positive = st.floats(1e-12, 1.0, exclude_min=True)
sections = st.lists(st.builds(Section, length=positive, area=positive), min_size=1, max_size=3).map(
    tuple
)


@given(
    title=st.text(st.characters(exclude_categories=["Cs"])),
    bit=st.builds(BitBar, sections=sections),
    force=st.floats(-1e9, 1e9),
    ratio=st.floats(1, 1e4, exclude_min=True),
    restitution=st.none() | st.floats(0, 1),
    leaps=st.booleans(),
    comments=st.booleans(),
)
def test_round_trip_is_exact(
    tmp_path_factory, title, bit, force, ratio, restitution, leaps, comments
):
    scene = Scene(
        title=title,
        bit=bit,
        feed={"force": force},
        rock={"unloading_ratio": ratio},
        contact={"restitution": restitution},
        solver={"leaps": leaps},
    )
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    scene.to_toml(path, comments=comments)
    assert Scene.from_toml(path) == scene


def test_round_trip_keeps_what_is_unused(read):
    scene = read("[effects]\nfeed = false\n[feed]\nforce = 100.0")
    for comments in (False, True):
        copy = read(scene.to_toml(comments=comments))
        assert copy == scene
        assert copy.unused == scene.unused == ("feed.force",)


def test_scenes_can_be_hashed_and_sent_to_another_process():
    scene = Scene(rock={"unloading_ratio": 7.0})
    copy = pickle.loads(pickle.dumps(scene))
    assert copy == scene
    assert hash(copy) == hash(scene)
    assert copy.given == {"rock.unloading_ratio"}


# --------------------------------------------------------------------- replace


def test_replace_changes_only_what_it_names():
    scene = Scene().replace(**{"rock.unloading_ratio": 10, "title": "harder"})
    assert (scene.rock, scene.title) == (RockLaw(unloading_ratio=10.0), "harder")
    assert scene.given == {"rock.unloading_ratio"}
    assert scene.replace(**{"rock.unloading_ratio": None}) == Scene(title="harder")
    assert Scene().rock.unloading_ratio == 5.0


def test_replace_reaches_into_sections():
    scene = Scene().replace(**{"piston.sections.0.length": 0.2})
    assert scene.piston.sections == (Section(length=0.2, area=5.5e-3),)
    assert scene["piston.sections.0.length"] == 0.2
    again = scene.replace(**{"piston.sections.0.area": 4e-3})
    assert again.piston.sections == (Section(length=0.2, area=4e-3),)


def test_replace_takes_groups_lists_and_numpy_numbers():
    rigid = Scene().replace(piston=PistonBar(model="rigid"), bit={"model": "rigid"})
    assert rigid.solver_name == "rigid"
    assert Scene().replace(**{"solver.cells": np.int64(40)}).solver.cells == 40
    stepped = [{"length": 0.1, "area": 1e-3}, {"length": 0.2, "area": 2e-3}]
    assert len(Scene().replace(**{"bit.sections": stepped}).bit.sections) == 2


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("rock.unloading", 3, "did you mean rock.unloading_ratio"),
        ("nonsense.key", 3, "a scene has a title and the tables"),
        ("rock.unloading_ratio", "x", "rock.unloading_ratio = "),
        ("bit.sections.4.length", 1.0, "no such section"),
        ("piston.model.deep", 1.0, "unknown key piston.model.deep"),
        ("run.duration", 0.5, "run.settle = 1.0 s"),
    ],
)
def test_replace_refuses(key, value, message):
    with pytest.raises(SceneError, match=message):
        Scene().replace(**{key: value})


@pytest.mark.parametrize(
    ("text", "setting"),
    [
        ("rock.unloading_ratio=10", ("rock.unloading_ratio", 10)),
        ("feed.force = -2.5e3", ("feed.force", -2500.0)),
        ("effects.loss=false", ("effects.loss", False)),
        ("effects.rock=spring", ("effects.rock", "spring")),
        ('title="a = b"', ("title", "a = b")),
        (
            "bit.sections=[{length=0.2,area=1e-3}]",
            ("bit.sections", [{"length": 0.2, "area": 1e-3}]),
        ),
    ],
)
def test_settings_of_the_command_line(text, setting):
    assert read_setting(text) == setting


@pytest.mark.parametrize("text", ["rock", "=5", "rock.unloading_ratio=", ""])
def test_bad_settings(text):
    with pytest.raises(SceneError, match="must be KEY=VALUE"):
        read_setting(text)


# ------------------------------------------------------------- effects and use

UNUSED = [
    ("[effects]\ngravity = false\n[gravity]\nacceleration = 9.81", ("gravity.acceleration",)),
    ("[effects]\nloss = false\n[loss]\ntime = 1e-7", ("loss.time",)),
    ("[effects]\nbarrier = false\n[rock]\nbarrier_energy = 0.1", ("rock.barrier_energy",)),
    ("[drive]\nexternal_force = 10.0", ("drive.external_force",)),
    ('[effects]\ndrive = "external"\n[drive]\nforce = 1.0', ("drive.force",)),
    ('[effects]\nrock = "spring"\n[rock]\nunloading_ratio = 3.0', ("rock.unloading_ratio",)),
    ('[effects]\nrock = "wall"\n[rock]\nloading_stiffness = 1e8', ("rock.loading_stiffness",)),
    ('[effects]\nrock = "none"\n[start]\nrock_gap = 0.1', ("start.rock_gap",)),
    (
        '[effects]\ndrive = "none"\n[piston]\nmodel = "absent"\n[start]\ngap = 0.1',
        ("start.gap",),
    ),
    ("[contact]\nrestitution = 0.5", ("contact.restitution",)),
    (
        '[piston]\nmodel = "rigid"\n[bit]\nmodel = "rigid"\n[solver]\ncells = 20\n'
        "[effects]\nloss = true",
        ("effects.loss", "solver.cells"),
    ),
    ('[effects]\nrock = "spring"\n[rock]\nloading_stiffness = 1e8', ()),
    ('[piston]\nmodel = "rigid"\n[bit]\nmodel = "rigid"\n[contact]\nrestitution = 0.5', ()),
]


@pytest.mark.parametrize(("text", "unused"), UNUSED)
def test_unused_parameters_are_named(read, text, unused):
    assert read(text).unused == unused


@pytest.mark.parametrize(
    "change",
    [{"rock.barrier_energy": 0}, {"rock.barrier_damping": 0}, {"effects.barrier": False}],
)
def test_without_energy_or_damping_there_is_no_barrier(change):
    assert Scene().barrier_on
    assert not Scene().replace(**change).barrier_on
    assert "barrier" in Scene().replace(**change).effects_off


def test_a_spring_has_no_barrier():
    scene = Scene(effects={"rock": "spring"})
    assert not scene.barrier_on
    assert "rock" in scene.effects_on


def test_a_rigid_piston_on_an_elastic_bit_is_for_waves():
    assert Scene(piston={"model": "rigid"}).solver_name == "wave"


def test_reading_a_scene_loads_nothing_that_draws_or_exports():
    code = (
        "import sys, percussion_model.scene; "
        "print({'matplotlib', 'pandas', 'fmpy', 'pythonfmu'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
