"""Views of the image of a scene (`percussion_model.engine.scene_image`)."""

from __future__ import annotations

import numpy as np

from percussion_model.engine.memory import (
    floats_at,
    matrix_at,
    merging,
    new_record,
    records_at,
    viewing,
    words_at,
)
from percussion_model.engine.records import GaugeBar
from percussion_model.engine.scene_image import COUNTS, JOINT, OWN, PRESSED, SECTION, VALUES, Own
from percussion_model.physics.kernel import preparing
from percussion_model.scene.numbers import JOINT_KINDS, Numbers
from percussion_model.scene.values import SCENE_NUMBERS

PERFECT = float(JOINT_KINDS.index("perfect"))
_values_at = records_at(SCENE_NUMBERS)
# Room for the parameters of an image.
new_values = new_record(SCENE_NUMBERS)


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
    """Fill in the parameters; what the drive does follows from what only an FMU has.

    Parameters
    ----------
    image : int
        Address.
    values : SCENE_NUMBERS array of length 1
    """
    values[0] = _values_at(image + 8 * first_value(image), 1)[0]
    own = own_numbers(image)
    pressure, is_law = own[Own.PRESSURE], True
    if own[Own.ON] == 0.0:
        pressure = values[0].drive_external_force = 0.0
    for drive, word in PRESSED:
        if values[0].effects_drive == drive:
            values.view(np.float64)[word], is_law = pressure, False
    if is_law:
        values[0].drive_force = pressure * own[Own.AREA]


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


@merging
def numbers_in(image, values):
    """Numbers of an image; `values` is filled in, and must be held as long as they are used."""
    fill_values(image, values)
    return numbers_at(image, values)
