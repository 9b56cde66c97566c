"""What solvers derive from the numbers of a scene, against what the scene says of itself."""

import numpy as np
import pytest
from numba import njit

from percussion_model.components import DRIVES as COMPONENT_DRIVES
from percussion_model.physics.records import DriveKind, RockKind
from percussion_model.scene.numbers import SCENE_NUMBERS, Numbers, numbers_of, scene_numbers
from percussion_model.scene.parameters import find_row
from percussion_model.scene.rock_law import ROCKS, barrier_on, rock_numbers
from percussion_model.scene.scene import Scene
from percussion_model.scene.values import Values
from percussion_model.solvers.setup import (
    DIRECTIONS,
    DRIVES,
    PISTONS,
    Bit,
    StandstillTension,
    kelvin_voigt_time,
)

SCENES = [
    {},
    {"effects.barrier": False},
    {"effects.loss": False},
    {"loss.time": 0.0},
    {"rock.barrier_energy": 0.0},
    {"rock.barrier_damping": 0.0},
    {"effects.rock": "spring"},
    {"effects.rock": "wall", "effects.loss": False},
    {"effects.rock": "none"},
]


@pytest.mark.parametrize(
    ("key", "names"),
    [
        ("piston.model", PISTONS),
        ("bit.model", Bit),
        ("effects.drive", DRIVES),
        ("effects.rock", ROCKS[:4]),
        ("effects.standstill_tension", StandstillTension),
    ],
)
def test_choices_stand_in_the_order_of_the_table(key, names):
    choices = list(find_row(key).choices)
    if key == "effects.rock":  # the power law has the modes of the bilinear one
        assert choices.pop() == "power"
        assert ROCKS[4:] == (RockKind.BILINEAR,)
    if key == "effects.drive":  # components follow
        assert [one.name for one in COMPONENT_DRIVES] == choices[3:]
        choices[3:] = ["component"] * len(COMPONENT_DRIVES)
    assert [one.name.lower() for one in names] == choices


def test_enumerations_are_covered_by_the_choices():
    assert set(DRIVES) == set(DriveKind)
    assert set(ROCKS) == set(RockKind)
    assert find_row("start.drive_direction").choices == DIRECTIONS


@pytest.mark.parametrize("changes", SCENES)
def test_numbers_say_what_the_scene_says(changes):
    scene = Scene().replace(**changes)
    numbers = numbers_of(scene)
    assert barrier_on(numbers) == scene.barrier_on
    assert kelvin_voigt_time(numbers) == (scene.loss.time if scene.loss_on else 0.0)
    rock = rock_numbers(numbers)
    assert (rock.c_r, rock.w_r) == ((1e4, 0.05) if scene.barrier_on else (0.0, 0.0))
    assert rock.k_r == (0.0 if scene.effects.rock == "none" else 7.5e8)
    assert rock.gamma == (5.0 if scene.effects.rock == "bilinear" else 1.0)


def test_values_are_the_fields_of_the_record():
    scene = Scene()
    assert Values._fields == SCENE_NUMBERS.names
    record = np.array([numbers_of(scene).values], SCENE_NUMBERS)
    assert record.tobytes() == scene_numbers(scene).tobytes()


@pytest.mark.parametrize("changes", [{}, {"effects.barrier": False, "effects.loss": False}])
def test_compiled_functions_take_the_record_in_place_of_the_values(changes):
    scene = Scene().replace(**changes)
    numbers = numbers_of(scene)
    as_record = Numbers(scene_numbers(scene)[0], numbers.piston, numbers.bit)
    for function in (barrier_on, kelvin_voigt_time):
        assert njit(function)(as_record) == function(numbers)
