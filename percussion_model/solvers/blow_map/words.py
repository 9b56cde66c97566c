"""A table of blows as one row of numbers, which kernels read without Python.

`Word` says where its parts begin. Sections of piston and bit, and then the values in the order
of `BlowTable.values`, follow what it lists; all counts are whole numbers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import IntEnum
from typing import Any

import numpy as np

from percussion_model.scene.parameters import parameter_table

# What a table is made for by other parameters than sections, as `prepare.made_for` has them.
FIXED = (
    "effects.gravity",
    "effects.feed",
    "effects.loss",
    "effects.barrier",
    "effects.rock",
    "effects.standstill_tension",
    "piston.model",
    "bit.model",
    "gravity.acceleration",
    "loss.time",
    "rock.unloading_ratio",
    "rock.barrier_damping",
    "rock.barrier_energy",
    "rock.barrier_threshold",
    "solver.cells",
)
_ROWS = {row.key: row for row in parameter_table() if row.key in FIXED}
SECTION = ("length", "area", "youngs_modulus", "density")
# Inputs that the flight follows; others count at the next blow, and these not at all.
FLIGHT_INPUTS = frozenset({"drive_force", "reversal_distance"})
FIXED_INPUTS = {
    "unloading_ratio": "rock.unloading_ratio",
    "barrier_damping": "rock.barrier_damping",
    "barrier_energy": "rock.barrier_energy",
}
# Of these rows of numbers.
FORMAT = 2


class Word(IntEnum):
    """Where the parts of a table begin."""

    FORMAT = 0
    PISTON = 1  # sections of the piston
    BIT = 2  # and of the bit
    COUNTS = 3  # nodes of each `records.Axis`
    LOWEST = 7  # of K_R, v, F_S and F_0: what is answered
    HIGHEST = 11
    ORIGIN = 15  # of the axes, as logarithms
    STEP = 19
    FIXED = 23  # parameters by the order of FIXED, as in SCENE_NUMBERS


SECTIONS = int(Word.FIXED) + len(FIXED)


class WordFault(IntEnum):
    """What is wrong with a row of numbers, or with a scene that is to run on it."""

    NONE = 0
    FORMAT = 1  # no table, or one of another format
    LENGTH = 2  # cut short, or too long
    NODES = 3  # axes that no table has
    SECTIONS = 4  # made for another number of sections; place 0: of the piston, 1: of the bit
    FIXED = 5  # made for another value of the parameter with that place in FIXED
    SECTION = 6  # of a section; place 4 k + j: number j of SECTION, sections counted through


def head_of(table: Any) -> np.ndarray:
    """All of a `BlowTable` but its values.

    Raises
    ------
    LookupError, TypeError, ValueError
        If it was made for something that no scene has.
    """
    nodes, fixed = table.nodes, table.fixed
    bars = [_sections(fixed, "piston"), _sections(fixed, "bit")]
    head: list[float] = [FORMAT, *map(len, bars)]
    for part in (nodes.counts, nodes.lowest, nodes.highest, nodes.origin, nodes.step):
        head += part
    head += [_number(key, fixed[key]) for key in FIXED]
    return np.array(head + [number for bar in bars for one in bar for number in one], float)


def _sections(fixed: Mapping[str, Any], bar: str) -> list[list[float]]:
    found: list[list[float]] = []
    while f"{bar}.sections.{len(found)}.length" in fixed:
        found.append([float(fixed[f"{bar}.sections.{len(found)}.{name}"]) for name in SECTION])
    return found


def _number(key: str, value: Any) -> float:
    """A parameter as SCENE_NUMBERS has it."""
    row = _ROWS[key]
    if row.kind == "choice":
        return float(list(row.choices).index(value))
    return math.nan if value is None else float(value)
