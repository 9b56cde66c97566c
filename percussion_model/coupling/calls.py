"""Calls of FMUs as compiled code has them, and where those of a run are."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

STEP, SET_REAL, SET_INTEGER, GET_REAL, GET_INTEGER, GET_BOOLEAN = range(6)
DONE, NOT_FINITE, TOO_LARGE = -1, -2, -3  # statuses of FMI are from 0 on
# The highest status of a call that did what it should; integers of FMI are below this, by size.
WARNING, LARGEST = 1, 2.0**31

CALL = np.dtype(
    [
        ("kind", np.int64),
        ("port", np.int64),  # whose call it is
        ("function", np.int64),  # address
        ("component", np.int64),  # address
        ("references", np.int64),  # address
        ("values", np.int64),  # address of the first one in `reals` or `integers`
        ("count", np.int64),
        ("room", np.int64),  # place of the first one there
        ("place", np.int64),  # of the first one in `places`
        ("every", np.int64),  # steps of the loop that are done as one
    ]
)
INTEGER = np.dtype([("value", np.int32)])


class At(IntEnum):
    """Where the calls of a run are."""

    STEP = 0  # number of the present step
    STEPS = 1  # in all
    FAILED_CALL = 2  # the call that did not succeed, `DONE` where all did
    STATUS = 3  # of that call
    CALLS = 4  # how many there are
    PLACES = 5
    VALUES = 6
    ROOM = 7


WORDS_OF_AT = len(At)
