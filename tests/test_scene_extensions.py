"""What may be added to the table of parameters: solvers by name, components with parameters."""

import subprocess
import sys

import pytest

from percussion_model import Simulation
from percussion_model.physics.kernel import inlined
from percussion_model.scene import solver_names
from percussion_model.scene.group import table_of
from percussion_model.scene.parameters import (
    COMPONENTS,
    GROUPS,
    Component,
    find_row,
    groups_with,
)
from percussion_model.scene.rows import SceneError
from percussion_model.scene.scene import Scene

FRICTION = Component(
    "friction", "friction", {"force": (50.0, "N", "friction force", 0.0, 1e6)}, max
)


@pytest.fixture
def names():
    before, bodies = list(solver_names.SOLVER_NAMES), dict(solver_names.BODIES)
    yield solver_names
    solver_names.SOLVER_NAMES[:] = before
    solver_names.BODIES.clear()
    solver_names.BODIES.update(bodies)


def test_a_registered_solver_can_be_asked_for(names):
    with pytest.raises(SceneError, match=r'"wave", "fem", "rigid", "modal"$'):
        Scene(solver={"name": "spectral"})
    names.register_name("spectral", "elastic")
    scene = Scene(solver={"name": "spectral"})
    assert scene.solver_name == "spectral"
    assert scene.loss_on
    assert list(find_row("solver.name").choices)[-1] == "spectral"
    with pytest.raises(SceneError, match=r'solver\.name = "spectral" needs bit\.model = "elastic"'):
        scene.replace(**{"piston.model": "rigid", "bit.model": "rigid"})


def test_a_registered_solver_of_rigid_bodies_makes_them_so(names):
    names.register_name("impulses", "rigid")
    scene = Scene().computed_by("impulses")
    assert scene.solver_name == "impulses"
    assert scene.piston.model == scene.bit.model == "rigid"
    assert not scene.loss_on
    with pytest.raises(SceneError, match=r'solver\.name = "impulses" computes no elastic bars'):
        Scene(solver={"name": "impulses"})


def test_a_name_is_registered_once(names):
    for name in ("wave", "auto"):
        with pytest.raises(ValueError, match="there is a solver of this name"):
            names.register_name(name)


def test_an_effect_brings_a_switch_and_a_group():
    groups = groups_with([*COMPONENTS, FRICTION])
    assert list(groups) == [*GROUPS, "friction"]
    rows = {row.key: row for row in table_of(groups)}
    assert rows["effects.friction"].default is False
    force = rows["friction.force"]
    assert (force.default, force.lower, force.upper, force.unit) == (50.0, 0.0, 1e6, "N")
    assert force.effect == "effects.friction = true"
    effects = groups["effects"](friction=True)
    assert isinstance(effects, GROUPS["effects"].__base__)
    # one more switch than the effects of all scenes
    assert list(groups["effects"].rows) == [*GROUPS["effects"].rows, "friction"]
    assert effects.friction
    assert effects.gravity
    with pytest.raises(SceneError, match=r"friction\.force = -1 N: must be a number from 0"):
        groups["friction"](force=-1)


def test_the_table_is_as_it_was_without_additions():
    groups = groups_with(COMPONENTS)
    assert [group.rows for group in groups.values()] == [one.rows for one in GROUPS.values()]
    assert list(groups) == list(GROUPS)


@pytest.mark.parametrize("name", ["gravity", "rock", "friction"])
def test_the_name_of_a_component_must_be_new(name):
    with pytest.raises(ValueError, match="there is a group or a switch of this name"):
        groups_with([FRICTION, Component(name, "again", {}, max)])


def test_a_field_of_a_component_is_no_parameter_of_it():
    twice = Component("seal", "seal", FRICTION.parameters, max, state={"force": ("N", "F", 0.0)})
    with pytest.raises(ValueError, match="component seal: force is a parameter and a field"):
        groups_with([twice])


@inlined
def push(par, s, h):
    return 0.0


SEAL = Component("seal", "seal", FRICTION.parameters, push)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"on_piston": None}, "it has no kernel"),
        ({"lasts": push}, "lasts takes 3 arguments: must be 2"),
        ({"is_drive": True, "on_piston": None, "on_bit": push}, "a drive has a kernel on_piston"),
        ({"parameters": {"a": (3.0, "N", "F", 0.0, 1.0)}}, "a is 3.0 by default: must be from 0.0"),
        ({"parameters": {"a": (3.0, "N", "F")}}, "a has 3 values: must be default, unit"),
        ({"inputs": ("force", "load")}, "inputs: load must be one of force"),
        ({"state": {"a": ("N", "F", "b")}}, "state: b must be one of force"),
        ({"of_blow": ("force",)}, "of_blow: force must be one of none"),
        ({"parameters": {"a": (0.5, "mm", "F", 0.0, 1.0)}}, "a has the unit 'mm': must be -, or"),
        ({"state": {"a": ("N*m", "F", 0.0)}}, "a has the unit 'N*m': must be -, or of m, s, kg,"),
    ],
)
def test_what_is_wrong_with_a_component_is_told(changes, told):
    assert not SEAL.fault
    assert SEAL._replace(stores=True).ledger == {
        "seal": ("stored", "taken from the piston by seal")
    }
    assert SEAL._replace(**changes).fault.startswith(told)


SPRING = """
from percussion_model.components import Component
from percussion_model.physics.kernel import inlined

@inlined
def push(par, s, h):
    return par.spring_stiffness * s.spring_length

stiffness = {"stiffness": (1.0, "N/m", "k", 0.0, 1e9)}
state = {"length": ("m", "x", 0.0)}
COMPONENT = Component("spring", "spring", stiffness, on_piston=push, state=state)
"""
FIND_SPRING = """
import sys
from percussion_model import components
components.__path__.append(sys.argv[1])
components.COMPONENTS += (components._component("spring"),)
from percussion_model.physics import state
"""


@pytest.mark.parametrize(
    ("slip", "told"),
    [
        (("s.spring_length", "s.spring_lenght"), "spring_lenght must be one of spring_length, "),
        (("par.spring_stiff", "par.spring_stif"), "spring_stifness must be one of spring_length, "),
        (("on_piston=", "on_pistn="), "Component() got an unexpected keyword argument 'on_pistn'"),
        (("", ""), ""),
    ],
)
def test_a_slip_in_the_file_of_a_component_is_told(tmp_path, slip, told):
    (tmp_path / "spring.py").write_text(SPRING.replace(*slip))
    command = [sys.executable, "-c", FIND_SPRING, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    last = done.stderr.splitlines()[-1] if told else done.stderr
    assert told in last
    assert last.startswith("ValueError: ") == ("spring.py" in last) == bool(told)


@pytest.mark.parametrize("needs", [{"effects.rokc": ("none",)}, {"effects.rock": ("nothing",)}])
def test_a_component_needs_what_there_is(needs):
    with pytest.raises(ValueError, match=r"component seal: needs effects\.ro.* = \('no"):
        groups_with([SEAL._replace(needs=needs)])


def test_without_what_it_needs_a_component_is_off():
    turning = {"effects.rotation": True, "rotation.mean_radius": 0.03}
    for rock, is_on in (("power", True), ("spring", False)):
        scene = Scene().computed_by("rigid", **turning, **{"effects.rock": rock})
        simulation = Simulation(scene)
        simulation.advance(0.05)
        assert (simulation.observe()["rotation_angle"] > 0.0) == is_on
        assert ("effects.rotation" in scene.unused) != is_on


def test_a_scene_has_the_groups_that_components_bring(tmp_path):
    code = """
import pickle
import sys
from percussion_model import components
from percussion_model.scene import parameters
friction = {"force": (50.0, "N", "F", 0.0, 1e6)}
one = components.Component("friction", "rub", friction, max)
components.COMPONENTS = (*components.COMPONENTS, one)
parameters.GROUPS.update(parameters.groups_with(components.COMPONENTS))
from percussion_model.scene.scene import Scene
scene = Scene().replace(**{"friction.force": 60.0})
assert scene.unused == ("friction.force",) and "friction" in scene.effects_off
scene = scene.replace(**{"effects.friction": True})
assert scene["friction.force"] == 60.0 and "friction" in scene.effects_on and not scene.unused
vars(parameters).update({group.__name__: group for group in parameters.GROUPS.values()})
assert pickle.loads(pickle.dumps(scene)) == scene
assert scene != Scene() and hash(scene) != hash(Scene())
for comments in (False, True):
    scene.to_toml(sys.argv[1], comments=comments)
    assert Scene.from_toml(sys.argv[1]) == scene
"""
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "scene.toml")], check=True)
