"""Scenes as plain numbers, and what follows from the numbers of a bar."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from percussion_model.scene import bars
from percussion_model.scene.bar_groups import BitBar, Section
from percussion_model.scene.hammers import hammer
from percussion_model.scene.numbers import (
    SCENE_NUMBERS,
    numbers_of,
    scene_numbers,
    section_numbers,
)
from percussion_model.scene.parameters import find_row, parameter_table
from percussion_model.scene.scene import Scene


def test_the_record_has_a_field_for_each_row_but_lists():
    lists = ("sections", "rods")
    keys = [row.key for row in parameter_table() if "*" not in row.key and row.kind not in lists]
    assert list(SCENE_NUMBERS.names) == [key.replace(".", "_") for key in keys]
    assert {SCENE_NUMBERS[name].str[1:] for name in SCENE_NUMBERS.names} == {"f8", "i8"}


@pytest.mark.parametrize("changes", [{}, {"rock.unloading_ratio": 1.1, "solver.cells": 40}])
def test_the_record_holds_the_values_of_the_scene(changes):
    scene = Scene().replace(**changes)
    record = scene_numbers(scene)[0]
    for name in SCENE_NUMBERS.names:
        row = next(one for one in parameter_table() if one.key.replace(".", "_") == name)
        value = scene[row.key]
        if row.kind == "choice":
            assert row.choices[record[name]] == value
        elif value is None:
            assert math.isnan(record[name])
        else:
            assert record[name] == value


def test_flags_choices_and_what_is_left_out():
    scene = Scene(effects={"rock": "wall", "barrier": False, "loss": False})
    record = scene_numbers(scene)[0]
    assert record["effects_rock"] == find_row("effects.rock").choices.index("wall") == 2
    assert (record["effects_loss"], record["effects_gravity"]) == (0, 1)
    assert math.isnan(record["solver_cells"])
    assert record["start_drive_direction"] == 0  # of 1 and -1 the first


number = st.floats(1e-12, 1.0)
section = st.builds(
    Section,
    length=number,
    area=number,
    youngs_modulus=st.floats(1e6, 1e13),
    density=st.floats(1.0, 1e5),
)


@given(st.lists(section, min_size=1, max_size=20))
def test_numbers_of_a_bar_have_the_bits_of_its_properties(sections):
    bar = BitBar(sections=sections)
    array = section_numbers(bar)
    assert array.shape == (len(sections), 4)
    for row, one in zip(array, bar.sections, strict=True):
        assert row.tolist() == [one.length, one.area, one.youngs_modulus, one.density]
        assert bars.section_wave_speed(row) == one.wave_speed
        assert bars.section_impedance(row) == one.impedance
        assert bars.section_mass(row) == one.mass == one.density * one.area * one.length
        assert bars.section_transit_time(row) == one.transit_time
    assert bars.bar_mass(array) == bar.mass
    assert bars.bar_length(array) == bar.length
    assert bars.bar_transit_time(array) == bar.transit_time


@given(st.lists(section, min_size=1, max_size=20))
def test_sums_over_a_bar_are_rounded_once(sections):
    bar = BitBar(sections=sections)
    assert bar.mass == math.fsum(one.mass for one in sections)
    assert bar.length == math.fsum(one.length for one in sections)
    assert bar.transit_time == math.fsum(one.transit_time for one in sections)


def test_the_functions_of_bars_can_be_compiled():
    """So that what cuts bars into cells can be a kernel."""
    from numba import njit

    array = np.array([[0.1, 1e-3, 2e11, 7850.0], [0.3, 2e-3, 1e11, 4500.0]])
    for name in ("section_wave_speed", "section_impedance", "section_mass"):
        function = getattr(bars, name)
        assert njit(function)(array[1]) == function(array[1])


def test_rods_of_any_number_lie_in_one_array():
    scene = hammer("t38", 3)
    numbers = numbers_of(scene)
    assert len(numbers.rods) == len(scene.string.rods) == len(numbers.rod_counts)
    for found, rod in zip(numbers.rods, scene.string.rods, strict=True):
        np.testing.assert_array_equal(found, section_numbers(rod))
    assert numbers_of(Scene()).rods == []
