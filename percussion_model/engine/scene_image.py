"""The image of a scene: all its numbers as words, which hosts change by their variables.

Words: how many sections the piston has, the bit, how many rods there are, sections of each;
the fields of `SCENE_NUMBERS`; sections of piston, bit and rods, four numbers each; joints of
the rods, six numbers each; what only an FMU has (`Own`).
"""

from __future__ import annotations

from enum import IntEnum
from struct import Struct

import numpy as np

from percussion_model.scene.inputs import PRESSURES
from percussion_model.scene.numbers import Numbers
from percussion_model.scene.parameters import row_of
from percussion_model.scene.values import SCENE_NUMBERS
from percussion_model.solvers.state import words_of

COUNTS = 3  # words before the sections of each rod
VALUES = SCENE_NUMBERS.itemsize // 8
SECTION, JOINT = 4, 6
AT = words_of(SCENE_NUMBERS)
_WORDS = Struct("=" + "".join("q" if one[1].endswith("i8") else "d" for one in SCENE_NUMBERS.descr))
# Drives that take a pressure as it is: the choice of `effects.drive`, and the pressure's word.
PRESSED = tuple(
    (row_of("effects.drive").choices.index(drive), AT[field]) for drive, field in PRESSURES.items()
)


class Own(IntEnum):
    """Numbers at the end of an image that no scene has."""

    PRESSURE = 0
    ON = 1
    AREA = 2
    GAUGE_BAR = 3
    GAUGE_PLACE = 4
    BARRIER_GIVEN = 5  # 1: it was asked for, not left to its default


OWN = len(Own)


def image_of(numbers: Numbers) -> np.ndarray:
    """Image of a scene's numbers, whose drive pushes as they say.

    Returns
    -------
    int64 array
        Words, some of which are numbers.
    """
    counts = [len(numbers.piston), len(numbers.bit), len(numbers.rod_counts), *numbers.rod_counts]
    values = numbers.values
    own = np.zeros(OWN)
    word = dict(PRESSED).get(int(values.effects_drive), AT["drive_force"])
    own[Own.PRESSURE], own[Own.AREA] = values[word], 1.0
    own[Own.ON], own[Own.GAUGE_PLACE] = 1.0, -1.0
    rows = (numbers.piston, numbers.bit, numbers.rod_sections, numbers.joints, own)
    words = [np.array(counts, np.int64).tobytes(), _WORDS.pack(*values)]
    words += [np.ascontiguousarray(one, np.float64).tobytes() for one in rows]
    return np.frombuffer(bytearray(b"".join(words)), np.int64)


def words_in_image(numbers: Numbers, field: str) -> list[int]:
    """Words of an image of a scene's numbers that hold a field of `SCENE_NUMBERS`."""
    first = COUNTS + len(numbers.rod_counts)
    words = [first + AT[field]]
    if dict(PRESSED).get(int(numbers.values.effects_drive), AT["drive_force"]) == AT[field]:
        sections = len(numbers.piston) + len(numbers.bit) + len(numbers.rod_sections)
        rows = SECTION * sections + JOINT * len(numbers.joints)
        words.append(first + VALUES + rows + Own.PRESSURE)
    return words
