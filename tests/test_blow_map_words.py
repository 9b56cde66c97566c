"""A table of blows as a row of numbers, and what is refused of one from outside."""

import math

import numpy as np
import pytest

from percussion_model.physics.records import Status
from percussion_model.scene.numbers import kernel_numbers
from percussion_model.scene.parameters import parameter_table
from percussion_model.solvers.blow_map.prepare import (
    first_value,
    made_for,
    scene_fault,
    shape_of,
    words_fault,
)
from percussion_model.solvers.blow_map.solver import BlowMapSolver
from percussion_model.solvers.blow_map.words import FIXED, SECTIONS, Word, WordFault
from tests.blow_map_scenes import by_hand, mapped

SCENE = mapped()
WEIGHT = SCENE.bit.mass * SCENE.gravity.acceleration


@pytest.fixture
def words():
    return by_hand(SCENE, penetration=2e-4, rest=0.01).to_words()


def test_a_table_comes_back_from_its_numbers(words):
    table = by_hand(SCENE, penetration=2e-4, rest=0.01)
    assert words_fault(words, WEIGHT) == WordFault.NONE
    assert scene_fault(words, kernel_numbers(SCENE)) == (WordFault.NONE, 0)
    np.testing.assert_array_equal(
        words[first_value(words) :].reshape(shape_of(words)), table.values
    )
    par = BlowMapSolver(SCENE, table)._par[0]
    for part in ("lowest", "highest", "origin", "step"):
        assert tuple(par[part]) == getattr(table, part)


def test_what_a_table_is_made_for_stands_in_the_order_of_its_keys():
    values = kernel_numbers(SCENE).values
    wanted = [float(values[key.replace(".", "_")]) for key in FIXED]
    np.testing.assert_array_equal(made_for(values), wanted)


def test_a_table_cut_short_or_of_another_format_is_refused(words):
    for end in (0, 1, SECTIONS - 1):
        assert words_fault(words[:end], WEIGHT) == WordFault.FORMAT
    assert words_fault(words[:-1], WEIGHT) == WordFault.LENGTH
    assert words_fault(np.append(words, 0.0), WEIGHT) == WordFault.LENGTH
    for place in (Word.FORMAT, Word.PISTON, Word.BIT):
        for value in (0.0, -1.0, 1.5, math.nan, math.inf, 1e300):
            damaged = words.copy()
            damaged[place] = value
            assert words_fault(damaged, WEIGHT) == WordFault.FORMAT


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_axes_that_no_table_has_are_refused(words, value):
    for place in range(Word.COUNTS, Word.FIXED):
        damaged = words.copy()
        damaged[place] = value
        assert words_fault(damaged, WEIGHT) == WordFault.NODES
    damaged = words.copy()
    damaged[Word.STEP + 2] = 0.0
    assert words_fault(damaged, WEIGHT) == WordFault.NODES
    damaged = words.copy()
    damaged[Word.LOWEST + 2] = -WEIGHT  # the logarithm of nothing
    assert words_fault(damaged, WEIGHT) == WordFault.NODES


def test_all_numbers_of_the_rock_are_on_an_axis_or_fixed():
    """A new one that changes blows must not be read past."""
    rock = {
        row.key
        for row in parameter_table()
        if row.key.startswith("rock.")
        and "bilinear" in row.needs.get("effects.rock", ())
        and "effects.cuttings" not in row.needs
    }
    assert rock - set(FIXED) == {"rock.loading_stiffness"}


@pytest.mark.parametrize("k", range(len(FIXED)))
def test_another_value_of_what_it_was_made_for_is_told(words, k):
    damaged = words.copy()
    damaged[Word.FIXED + k] += 1.0
    if math.isnan(words[Word.FIXED + k]):
        damaged[Word.FIXED + k] = 20.0
    assert scene_fault(damaged, kernel_numbers(SCENE)) == (WordFault.FIXED, k)


def test_other_sections_are_told(words):
    numbers = kernel_numbers(SCENE)
    piston, bit = len(numbers.piston), len(numbers.bit)
    for k in range(4 * (piston + bit)):
        damaged = words.copy()
        damaged[SECTIONS + k] *= 1.0 + 1e-15
        assert scene_fault(damaged, numbers) == (WordFault.SECTION, k)
    longer = numbers._replace(bit=np.concatenate([numbers.bit, numbers.bit]))
    assert scene_fault(words, longer) == (WordFault.SECTIONS, 1)


def test_a_coordinate_far_outside_the_axes_takes_the_last_cell():
    """No whole number is as large: the run goes on, or refuses."""
    table = by_hand(SCENE, penetration=2e-4, rebound=-0.4, offset=-1e-4, opened=1e-3)
    solver = BlowMapSolver(SCENE, table)
    solver._par["step"] = 1e-300
    state = solver.new_state()
    status, *_ = solver.advance(state, 0.05, np.zeros(9, solver._no_blows.dtype),
                                np.zeros(99, solver._no_events.dtype), False)  # fmt: skip
    assert status in (Status.DONE, Status.REFUSED)
    assert np.isfinite(state.record["y"][0])
