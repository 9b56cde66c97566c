"""The parameters of a scene as plain numbers: one record, by the one table."""

from __future__ import annotations

import math
from collections import namedtuple
from operator import attrgetter
from typing import Any

import numpy as np

from percussion_model.scene.parameters import parameter_table
from percussion_model.scene.rows import ParameterRow


def _is_whole(row: ParameterRow) -> bool:
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


def values_of(scene: Any) -> Values:
    """Parameters of a scene, by the groups that it has.

    Returns
    -------
    Values
        SI units; of choices the place in the choices of the row, NaN for what is left out.
    """
    found = list(_values_of(scene))
    for k, choices in _CHOICES:
        found[k] = choices.index(found[k])
    for k in _OPTIONAL:
        if found[k] is None:
            found[k] = math.nan
    return Values._make(found)
