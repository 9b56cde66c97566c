"""A part of a drilling system: its table of variables, and what computes it.

A part that is compiled has a `Law`: kernels that get records of numbers. In the record of its
parameters, and in that of its inputs, each variable is a field whose name has underscores for
dots; rows of numbers such as `layers[2].top` are one field, a matrix.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from fmu_src.flat_names import flat_name

Entries = dict[str, tuple[Any, ...]]

COUNT = "count"  # in place of a unit, makes a whole number

# Numbers of a saved state in SI stay below this, so that no product of a few of them overflows.
LARGEST = 1e60
NUMBER = (-LARGEST, LARGEST)
# Whole numbers of a state that counts or tells yes from no.
FLAG = (0, 1)
# First field of what moves; as the shell has it (fmu_src/native/state.c).
IS_READ = "is_read"

_LISTED = re.compile(r"(\w+)\[(\d+)\]\.\w+")


class Room(NamedTuple):
    """Numbers of a motion whose count follows from parameters.

    Attributes
    ----------
    made, moving : ndarray
        Those that follow from parameters alone, and those that belong to the state.
    facts : ndarray, shape (4,)
        Of what a kernel refuses.
    """

    made: np.ndarray
    moving: np.ndarray
    facts: np.ndarray


@dataclass(frozen=True)
class Law:
    """What a part computes, as kernels.

    They get `p`, the parameters; `u`, the inputs; `s`, the state; `y`, the outputs, to be filled;
    and `w`, the `Room` for what has a length that follows from parameters. Where one refuses it
    returns the number of a template, counted from 1, and puts its facts into `w.facts`.

    Attributes
    ----------
    state : dict of tuple
        Lowest and highest value of each field, two whole numbers where it is one; and how many
        numbers there are in it, if it is a row of them.
    begin : kernel
        (p, u, s, w): the state at time zero, which is zeros so far.
    step : kernel
        (p, u, s, w, h) -> fault: advance by h [s] with the inputs held.
    outputs : kernel
        (p, s, w, y).
    made, moving : kernel
        (p) -> count of numbers that follow from parameters alone, and that belong to the state.
    check : kernel, optional
        (p, facts) -> fault, of parameters that do not go together.
    make : kernel, optional
        (p, made): numbers that follow from parameters.
    state_fault : kernel, optional
        (p, s, w) -> fault of a state from outside, whose fields are within their limits.
    faults : tuple of str
        Templates, as of `percussion_model.engine.fault_texts`.
    """

    state: Mapping[str, tuple[Any, ...]]
    begin: Any
    step: Any
    outputs: Any
    made: Any = None
    moving: Any = None
    check: Any = None
    make: Any = None
    state_fault: Any = None
    faults: tuple[str, ...] = ()

    @property
    def fields(self) -> dict[str, tuple[Any, ...]]:
        """Fields of the record of what moves."""
        return {IS_READ: FLAG, **self.state}

    @property
    def record(self) -> np.dtype:
        """Type of that record."""
        return np.dtype(
            [(name, np.int64 if isinstance(low, int) else np.float64, *count)
             for name, (low, _, *count) in self.fields.items()]
        )  # fmt: skip

    @property
    def words(self) -> list[tuple[str, float, float, bool]]:
        """Name and limits of each word of that record, and whether it is a whole number."""
        return [
            (name, low, high, isinstance(low, int))
            for name, (low, high, *count) in self.fields.items()
            for _ in range(*count or (1,))
        ]


@dataclass(frozen=True)
class PartTable:
    """Description and variables of a part; SI, forces and positions down positive.

    An entry of inputs and parameters is (unit, lower, upper, start, description), one of
    outputs (unit, description). A start that is a flag makes a Boolean, as does False for the
    unit of an output; the unit COUNT makes a whole number, and a tuple in place of the start an
    enumeration, whose first word is the start.

    Attributes
    ----------
    name : str
        Of the FMU.
    at_start : dict of tuple
        Inputs that an output depends on at the start, beside parameters; outputs that are
        left out are the same at every start.
    law : Law, optional
        Of a part that is compiled.
    slave : type, optional
        What runs in the FMU of another one, by Python.
    """

    name: str
    description: str
    inputs: Entries
    outputs: Entries
    parameters: Entries
    at_start: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    law: Law | None = None
    slave: Any = None


def record_of(entries: Entries) -> np.dtype:
    """Type of the record that kernels see of parameters or inputs, in their order."""
    fields: dict[str, list[Any]] = {}
    for name, (unit, _, _, start, _) in entries.items():
        whole = isinstance(start, (bool, tuple)) or unit == COUNT
        listed = _LISTED.fullmatch(name)
        row = fields.setdefault(listed[1] if listed else flat_name(name), [np.float64, {}])
        row[0] = np.int64 if whole else np.float64
        number = listed[2] if listed else ""
        row[1][number] = row[1].get(number, 0) + 1
    return np.dtype(
        [(name, kind, (len(counts), counts["1"])) if "1" in counts else (name, kind)
         for name, (kind, counts) in fields.items()]
    )  # fmt: skip


def record_of_outputs(entries: Entries) -> np.dtype:
    """Type of the record of outputs, all numbers to the shell."""
    return np.dtype([(flat_name(name), np.float64) for name in entries])
