"""Eight numbers side by side, which stay in registers through the loops over modes.

The instructions are plain arithmetic in a fixed order: no platform rounds it otherwise than
another, whatever vectors its processor has.
"""

from __future__ import annotations

import numpy as np

from percussion_model.physics.kernel import when_compiling

WIDTH = 8


def load(array, row, start):
    """Eight numbers of a row from a place on."""
    return array[row, start : start + WIDTH].copy()


def store(array, row, start, lanes):
    """Write eight numbers into a row from a place on."""
    array[row, start : start + WIDTH] = lanes


def spread(number):
    """One number eight times."""
    return np.full(WIDTH, number)


def total(lanes):
    """Sum of eight numbers: of both halves, of both halves of that, and so on."""
    sums = lanes
    while len(sums) > 1:
        half = len(sums) // 2
        sums = sums[:half] + sums[half:]
    return float(sums[0])


def totals(one, other):
    """`total` of eight numbers and of eight others."""
    return total(one), total(other)


def lower_of(one, other):
    """The lower one of each two numbers."""
    return np.minimum(one, other)


def higher_of(one, other):
    """The higher one of each two numbers."""
    return np.maximum(one, other)


def root(lanes):
    """Square roots."""
    return np.sqrt(lanes)


def from_front(index):
    """An index that is never below zero: compiled, nothing looks whether it counts from the end."""
    return index


def _teach():
    from percussion_model.physics.compiling import instruct
    from percussion_model.solvers.modal import lane_types

    for function in (load, store, spread, total, totals, lower_of, higher_of, root, from_front):
        instruct(function, getattr(lane_types, function.__name__))


when_compiling(_teach)
