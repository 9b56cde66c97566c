"""A scene as plain numbers: one record of its parameters, and an array for each bar.

What follows from the arrays is in `percussion_model.scene.bars`.
"""

from __future__ import annotations

import math
from collections import namedtuple
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from percussion_model.scene.bar_groups import Bar
from percussion_model.scene.parameters import parameter_table
from percussion_model.scene.rows import Row
from percussion_model.scene.scene import Scene


def _is_whole(row: Row) -> bool:
    """Whether a parameter is a whole number in the record; one left out is NaN, no such."""
    return row.kind != "number" and (row.required or row.default is not None)


_ROWS = [
    row for row in parameter_table() if row.kind not in ("sections", "rods") and "*" not in row.key
]

# A field for each row of the parameter table in its order, sections left out; a point of
# its key is an underline here.
_FIELDS = [(row.key.replace(".", "_"), "i8" if _is_whole(row) else "f8") for row in _ROWS]
SCENE_NUMBERS = np.dtype(_FIELDS)

# The same fields as a named tuple: Python reads one of them in a tenth of the time.
Values = namedtuple("Values", [name for name, _ in _FIELDS])  # type: ignore[misc]

_values_of = attrgetter(*(row.key for row in _ROWS))
_CHOICES = [(k, row.choices) for k, row in enumerate(_ROWS) if row.kind == "choice"]
_OPTIONAL = [k for k, row in enumerate(_ROWS) if row.default is None and not row.required]


class Numbers(NamedTuple):
    """All that a solver takes from a scene.

    Attributes
    ----------
    values : Values, or SCENE_NUMBERS record
        Parameters in SI units; of choices the place in the choices of the row, 0 or 1 for
        flags, NaN for what is left out.
    piston, bit : float array, shape (sections, 4)
        Sections as `section_numbers` has them, whatever the model of the bar.
    rods : tuple of such arrays
        Bars between them; none without effects.string.
    joints : float array, shape (rods, 6)
        Of each rod to the bar below, as `joint_numbers` has them.
    """

    values: Any
    piston: np.ndarray
    bit: np.ndarray
    rods: tuple[np.ndarray, ...] = ()
    joints: np.ndarray = np.zeros((0, 6))


def numbers_of(scene: Scene) -> Numbers:
    """Numbers of a scene and of its bars."""
    ends = section_numbers(scene.piston), section_numbers(scene.bit)
    if not scene.effects.string:
        return Numbers(_values(scene), *ends)
    rods = tuple(section_numbers(rod) for rod in scene.string.rods)
    return Numbers(_values(scene), *ends, rods, joint_numbers(scene))


# Kinds of joint, in the order of the choices.
JOINT_KINDS = next(row.choices for row in parameter_table() if row.key == "string.rods.*.joint")


def joint_numbers(scene: Scene) -> np.ndarray:
    """Joints of rods to the bars below.

    Returns
    -------
    float array, shape (rods, 6)
        Kind, by its place in `JOINT_KINDS`, transmission, relaxation [s], gap [m], preload [N]
        and thread stiffness [N/m]. With effects.joints off all are perfect.
    """
    rows = np.zeros((len(scene.string.rods), 6))
    for row, rod in zip(rows, scene.string.rods, strict=True):
        kind = JOINT_KINDS.index(rod.joint if scene.effects.joints else "perfect")
        row[:] = (
            kind, rod.transmission, rod.relaxation, rod.gap, rod.preload, rod.thread_stiffness
        )  # fmt: skip
    return rows


def _values(scene: Scene) -> Values:
    found = list(_values_of(scene))
    for k, choices in _CHOICES:
        found[k] = choices.index(found[k])
    for k in _OPTIONAL:
        if found[k] is None:
            found[k] = math.nan
    return Values._make(found)


def scene_numbers(scene: Scene) -> np.ndarray:
    """Parameters of a scene as one record, by the fields of `Values`.

    Returns
    -------
    SCENE_NUMBERS array of length 1
    """
    return np.array([_values(scene)], SCENE_NUMBERS)


def section_numbers(bar: Bar) -> np.ndarray:
    """Sections of a bar from top to bottom.

    Returns
    -------
    float array, shape (sections, 4)
        Length [m], area [m^2], Young's modulus [Pa] and density [kg/m^3].
    """
    return np.array(bar.numbers)
