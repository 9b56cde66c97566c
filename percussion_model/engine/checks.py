"""What moves, where it comes from outside: whether its numbers are within their limits."""

from __future__ import annotations

import numpy as np

from percussion_model.engine.faults import Fault
from percussion_model.engine.layout import directory
from percussion_model.engine.memory import floats_at, words_at
from percussion_model.engine.records import RECORD
from percussion_model.physics.kernel import preparing
from percussion_model.solvers.state import first_beyond, is_bounded

# A state is no more than a step, and rounding, behind the present [steps].
MOST_BEHIND = 2.0


@preparing
def record_fault(moving, low, high, may_be_nan, whole, number, facts):
    """Look at each word of a solver's record.

    Parameters
    ----------
    moving : int
        Address of what moves.
    low, high, may_be_nan, whole : ndarray
        As in `LimitRows`.
    number : int
        Of the fault.
    facts : float array, shape (4,)
        Filled where there is one: word and value, and its limits.

    Returns
    -------
    int
        0 where all are good.
    """
    words = words_at(moving + RECORD, len(low))
    numbers = words.view(np.float64)
    k = first_beyond(words, numbers, low, high, may_be_nan, whole)
    if k < 0:
        return 0
    facts[0] = k + 1.0
    facts[1] = float(words[k]) if whole[k] else numbers[k]
    facts[2], facts[3] = low[k], high[k]
    return number


@preparing
def time_fault(state_time, t, step, facts):
    """Number of the fault of a state far behind the present, 0 for none; fills the facts."""
    facts[0], facts[1] = state_time, t
    return 0 if state_time >= t - MOST_BEHIND * step else Fault.BEHIND.value


@preparing
def arrays_are_bounded(base, moving, first, count):
    """Whether all numbers of arrays of what moves are such; their rows of the directory."""
    d = directory(base)
    for k in range(first, first + count):
        if not is_bounded(floats_at(moving + d[k, 0], d[k, 1] * d[k, 2])):
            return False
    return True
