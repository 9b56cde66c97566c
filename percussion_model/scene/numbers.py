"""A scene as plain numbers: one record of its parameters, and an array for each bar.

What follows from the arrays is in `percussion_model.scene.bars`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from percussion_model.scene.parameters import Bar, parameter_table
from percussion_model.scene.rows import Row
from percussion_model.scene.scene import Scene


def _is_whole(row: Row) -> bool:
    """Whether a parameter is a whole number in the record; one left out is NaN, no such."""
    return row.kind != "number" and (row.required or row.default is not None)


_ROWS = {
    row.key.replace(".", "_"): row
    for row in parameter_table()
    if row.kind != "sections" and "*" not in row.key
}

# A field for each row of the parameter table in its order, sections left out; a point of
# its key is an underline here.
SCENE_NUMBERS = np.dtype([(name, "i8" if _is_whole(row) else "f8") for name, row in _ROWS.items()])


def scene_numbers(scene: Scene) -> np.ndarray:
    """Parameters of a scene as one record.

    Returns
    -------
    SCENE_NUMBERS array of length 1
        Numbers in SI units; of choices the place in the choices of the row, 0 or 1 for
        flags, NaN for what is left out.
    """
    return np.array([tuple(_number(row, scene[row.key]) for row in _ROWS.values())], SCENE_NUMBERS)


def _number(row: Row, value: Any) -> float:
    if row.kind == "choice":
        return row.choices.index(value)
    return math.nan if value is None else value


def section_numbers(bar: Bar) -> np.ndarray:
    """Sections of a bar from top to bottom.

    Returns
    -------
    float array, shape (sections, 4)
        Length [m], area [m^2], Young's modulus [Pa] and density [kg/m^3].
    """
    return np.array(bar.numbers)
