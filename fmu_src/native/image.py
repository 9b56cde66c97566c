"""The image of a scene: all its numbers as words, which hosts change by their variables.

Words: how many sections the piston has, the bit, how many rods there are, sections of each;
the fields of `SCENE_NUMBERS`; sections of piston, bit and rods, four numbers each; joints of
the rods, six numbers each; what only an FMU has (`Own`).
"""

from __future__ import annotations

from enum import IntEnum

from fmu_src.native.layout import GaugeBar
from fmu_src.native.memory import (
    floats_at,
    matrix_at,
    merging,
    records_at,
    viewing,
    words_at,
)
from percussion_model.physics.kernel import preparing
from percussion_model.scene.numbers import JOINT_KINDS, Numbers
from percussion_model.scene.parameters import find_row
from percussion_model.scene.rows import ParameterRow
from percussion_model.scene.values import SCENE_NUMBERS
from percussion_model.solvers.state import words_of

COUNTS = 3  # words before the sections of each rod
VALUES = SCENE_NUMBERS.itemsize // 8
SECTION, JOINT = 4, 6
PERFECT = float(JOINT_KINDS.index("perfect"))
AT = words_of(SCENE_NUMBERS)
_values_at = records_at(SCENE_NUMBERS)


def row_of(key: str) -> ParameterRow:
    """Row of the parameter table."""
    row = find_row(key)
    assert row is not None, key
    return row


class Own(IntEnum):
    """Numbers at the end of an image that no scene has."""

    PRESSURE = 0
    ON = 1
    AREA = 2
    GAUGE_BAR = 3
    GAUGE_PLACE = 4
    BARRIER_GIVEN = 5  # 1: it was asked for, not left to its default


OWN = len(Own)


@viewing
def first_value(image):
    """Word of an image at which the fields of `SCENE_NUMBERS` begin."""
    return COUNTS + words_at(image, COUNTS)[2]


@viewing
def own_numbers(image):
    """What only an FMU has, by `Own`."""
    counts = words_at(image, first_value(image))
    sections = counts[0] + counts[1] + counts[COUNTS:].sum()
    at = len(counts) + VALUES + SECTION * sections + JOINT * counts[2]
    return floats_at(image + 8 * at, OWN)


@viewing
def fill_values(image, values):
    """Fill in the parameters; the drive's forces follow from what only an FMU has.

    Parameters
    ----------
    image : int
        Address.
    values : SCENE_NUMBERS array of length 1
    """
    values[0] = _values_at(image + 8 * first_value(image), 1)[0]
    own = own_numbers(image)
    if own[Own.ON] == 0.0:
        values[0].drive_force = values[0].drive_external_force = 0.0
    else:
        values[0].drive_force = own[Own.PRESSURE] * own[Own.AREA]


@merging
def numbers_at(image, values):
    """Numbers of an image, with values that were filled in."""
    counts = words_at(image, first_value(image))
    rods = counts[2] if values[0].effects_string else 0
    piston_at = image + 8 * (len(counts) + VALUES)
    bit_at = piston_at + 8 * SECTION * counts[0]
    rods_at = bit_at + 8 * SECTION * counts[1]
    rod_counts = counts[COUNTS : COUNTS + rods].copy()
    joints_at = rods_at + 8 * SECTION * counts[COUNTS:].sum()
    joints = matrix_at(joints_at, rods, JOINT).copy()
    if not values[0].effects_joints:
        joints[:, 0] = PERFECT
    return Numbers(
        values[0],
        matrix_at(piston_at, counts[0], SECTION),
        matrix_at(bit_at, counts[1], SECTION),
        matrix_at(rods_at, rod_counts.sum(), SECTION),
        rod_counts,
        joints,
    )


@viewing
def has_rods(image):
    """Whether the scene has rods, with or without effects.string."""
    return words_at(image, COUNTS)[2] > 0


@preparing
def gauge_sections(numbers, bar):
    """Sections of the bar that carries the gauge, by `GaugeBar`; the piston's where it is none."""
    if bar == GaugeBar.BIT:
        return numbers.bit
    if bar >= GaugeBar.ROD and bar - GaugeBar.ROD < len(numbers.rod_counts):
        which = bar - GaugeBar.ROD
        first = numbers.rod_counts[:which].sum()
        return numbers.rod_sections[first : first + numbers.rod_counts[which]]
    return numbers.piston
