"""Scenes: reading, writing, changing, and what has no effect."""

import copy
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from percussion_model.scene.bar_groups import BitBar, PistonBar, Section
from percussion_model.scene.parameters import RockLaw, parameter_table
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.scene.text import read_setting

SCENARIOS = Path(__file__).parents[1] / "scenarios"


# ---------------------------------------------------------------- stored scenes


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.toml")), ids=lambda path: path.stem)
def test_stored_scenes_are_sound(path):
    scene = Scene.from_toml(path)
    assert scene.title
    assert scene.unused == ()


def test_the_reference_file_is_the_default_scene():
    scene = Scene.from_toml(SCENARIOS / "reference.toml")
    assert scene == Scene(title=scene.title, hole_diameter=0.08255)  # 3 1/4 inch
    assert (SCENARIOS / "reference.toml").read_text() == scene.to_toml(comments=True)


def test_the_reference_file_names_every_parameter():
    text = (SCENARIOS / "reference.toml").read_text()
    for row in parameter_table():
        assert (
            f"{row.key.rpartition('.')[2]} =" in text or row.kind == "sections" or "rods" in row.key
        )


def test_solvers_and_effects_of_the_stored_scenes():
    reference, drop, rigid, undamped = (
        Scene.from_toml(SCENARIOS / f"{name}.toml")
        for name in ("reference", "drop_test", "rigid", "undamped")
    )
    every = ("gravity", "feed", "drive", "loss", "barrier", "rock")
    turns = ("breaking", "rotation", "shoulder")
    assert (reference.solver_name, reference.effects_on) == ("modal", every)
    assert (drop.solver_name, drop.effects_off) == ("modal", ("drive", "cuttings", *turns))
    assert (rigid.solver_name, rigid.effects_off) == ("rigid", ("loss", "cuttings", *turns))
    assert (undamped.solver_name, undamped.effects_off) == ("wave", ("loss", "cuttings", *turns))


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
    title=st.text(
        st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="\ufffe\uffff")
    ),
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


def test_round_trip_keeps_what_is_unused(scene_from_text):
    scene = scene_from_text("[effects]\nfeed = false\n[feed]\nforce = 100.0")
    for comments in (False, True):
        copy = scene_from_text(scene.to_toml(comments=comments))
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
def test_unused_parameters_are_named(scene_from_text, text, unused):
    assert scene_from_text(text).unused == unused


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


def test_a_rigid_piston_on_an_elastic_bit_is_for_modes():
    assert Scene(piston={"model": "rigid"}).solver_name == "modal"


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"effects.loss": False}, "off"),
        ({"loss.time": 0.0}, "below 0.0005"),
        ({"effects.rock": "wall", "effects.barrier": False}, "wall"),
        ({"bit.sections.0.length": 4.0}, "more than 16 times as long"),
        # 5e-4 of the transit time of the piston, 33.8 us
        ({"loss.time": 1.6e-8}, "below 0.0005"),
    ],
)
def test_waves_are_taken_where_modes_ring_or_are_too_many(changes, why):
    scene = Scene().replace(**changes)
    assert scene.solver_name == "wave"
    assert why in scene.why_solver
    named = scene.replace(**{"solver.name": "modal"})
    assert (named.solver_name, named.why_solver) == ("modal", "")


@pytest.mark.parametrize("loss", [1.8e-8, 3.3e-5, 1e-3])
def test_modes_are_taken_above(loss):
    scene = Scene().replace(**{"loss.time": loss})
    assert (scene.solver_name, scene.why_solver) == ("modal", "elastic bars with loss")


def test_reading_a_scene_loads_nothing_that_draws_or_exports():
    code = (
        "import sys, percussion_model.scene.scene; "
        "print({'matplotlib', 'pandas', 'fmpy', 'pythonfmu'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy])
def test_a_copy_is_an_equal_scene(copied):
    scene = Scene(rock={"unloading_ratio": 7.0}, title="hard")
    assert copied(scene) == scene
    assert copied(scene).given == scene.given


def test_values_given_make_an_equal_scene():
    scene = Scene(title="x").replace(**{"bit.sections.0.length": 0.3, "effects.loss": False})
    again = Scene(**scene.given_values())
    assert (again, again.given) == (scene, scene.given)


def test_a_change_leaves_what_it_was_given_alone():
    group, sections = {"unloading_ratio": 7.0}, [{"length": 0.1, "area": 1e-3}]
    scene = Scene().replace(**{"rock": group, "rock.loading_stiffness": 1e8})
    assert (scene.rock.unloading_ratio, scene.rock.loading_stiffness) == (7.0, 1e8)
    scene = Scene().replace(**{"bit.sections": sections, "bit.sections.0.length": 0.2})
    assert scene.bit.length == 0.2
    assert (group, sections) == ({"unloading_ratio": 7.0}, [{"length": 0.1, "area": 1e-3}])


def test_groups_given_as_objects_can_be_changed_further():
    piston = PistonBar(model="rigid", sections=[Section(length=0.1, area=1e-3)])
    scene = Scene().replace(piston=piston, **{"piston.sections.0.length": 0.3})
    assert (scene.piston.model, scene.piston.length) == ("rigid", 0.3)
    with pytest.raises(SceneError, match=r"unknown key bit\.sections\.0\.length"):
        Scene().replace(**{"bit.sections": 5, "bit.sections.0.length": 0.3})
