"""Whether the blows of a run repeat: judgement after each of them (docs/studies.md).

Blows are the rows of a matrix, in the order of `BLOW`, the newest last.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from percussion_model.physics.kernel import inlined, inlined_scalar, kernel
from percussion_model.physics.records import BLOW, BLOW_COLUMNS

_NAMES = [column.name for column in BLOW_COLUMNS]
WIDTH = BLOW.itemsize // 8
# Numbers of a blow by which two blows are the same.
COMPARED = ("impact_velocity", "period", "penetration")
_FIRST, _SECOND, _THIRD = (_NAMES.index(name) for name in COMPARED)
_TIME, _PERIOD, _ADVANCE = (_NAMES.index(name) for name in ("time", "period", "hole_advance"))
# A run in which no blow ends for so long [s], and so many periods of the last, has stalled.
STALLED_AFTER, STALLED_PERIODS = 2.0, 4.0
# Longest cycle that is looked for [blows].
MOST_BLOWS_A_CYCLE = 8
# Two changes that fall alike take so many blows: looking earlier is in vain.
FEWEST_BLOWS = 4
# Many blows are looked at again when there is one more for so many.
LOOK_AGAIN = 16
# Blows converge if their changes fall from so many tolerances on, each by this factor at
# least, and the factors are alike within that one.
FAR, FALLING, ALIKE = 10.0, 0.9, 3.0
# They must have done so for this share of all blows run: a motion that wanders, too, comes
# by chance upon a few blows that fall evenly, and leaves them again.
DIRECT = 0.5
# So many at least: two fall evenly by chance where a motion comes near quickly and then wanders.
LEAST_FACTORS = 3.0
# Where changes are below this share of the tolerance, no scatter is left to hide anything.
STILL = 1e-4
# A cycle of several blows, or one that only scatters without converging any more, is believed
# after so many repetitions and blows: near a threshold one blow in twenty may be quite another.
REPETITIONS, LASTING = 5, 60
# Differences within a cycle that fall by less than this from one cycle to the next will stay.
STEADY = 0.9


class Verdict(IntEnum):
    """What is known of the blows so far."""

    OPEN = 0  # nothing yet: the run goes on
    PERIODIC = 1
    STALLED = 2
    ENOUGH = 3  # there are as many as were asked for


# What is asked, and what is found.
REQUEST = np.dtype(
    [
        ("tolerance", "f8"),  # relative, of the numbers that are compared
        ("most", "i8"),  # so many blows end the run
        ("enough", "f8"),  # and so many are told of, when they are next judged
        ("not_before", "f8"),  # nothing repeats before this time [s]
        ("until", "f8"),  # one call comes so far, and is told to go on [s]
        # found
        ("blows", "i8"),
        ("verdict", "i8"),  # `Verdict`
        ("order", "i8"),  # blows in a cycle
        ("rate", "f8"),  # of penetration [m/s]
        ("error", "f8"),
        ("multiplier", "f8"),  # of a deviation over one cycle
        ("judged", "i8"),  # blows that were judged last
        ("wanted", "i8"),  # blows when they are judged next
        ("time", "f8"),  # that the run has reached [s]
    ]
)
_REQUEST = np.dtype((np.record, REQUEST))


class Cycle(NamedTuple):
    """Rate, its error and multiplier of a cycle of `order` blows; order 0: it is none."""

    order: int
    rate: float
    error: float
    multiplier: float


@inlined
def no_cycle():
    """No cycle."""
    return Cycle(0, math.nan, math.nan, math.nan)


@kernel
def scale_over(rows, n, count):
    """Mean sizes of the numbers that are compared, over the last `count` of `n` blows."""
    one = other = third = 0.0
    for k in range(n - count, n):
        one += abs(rows[k, _FIRST])
        other += abs(rows[k, _SECOND])
        third += abs(rows[k, _THIRD])
    scale = one / count, other / count, third / count
    return (
        scale[0] if scale[0] != 0.0 else 1.0,
        scale[1] if scale[1] != 0.0 else 1.0,
        scale[2] if scale[2] != 0.0 else 1.0,
    )


@inlined
def largest(one, other, third):
    """The largest size of three numbers."""
    return max(abs(one), max(abs(other), abs(third)))


@inlined
def changes(rows, now, before, scale):
    """Relative changes from one blow to another."""
    return (
        (rows[now, _FIRST] - rows[before, _FIRST]) / scale[0],
        (rows[now, _SECOND] - rows[before, _SECOND]) / scale[1],
        (rows[now, _THIRD] - rows[before, _THIRD]) / scale[2],
    )


@kernel
def change_over(rows, last, count, apart, scale):
    """Largest relative change of `count` blows up to `last`, each from one so many before."""
    most = 0.0
    for k in range(last - count + 1, last + 1):
        one, other, third = changes(rows, k, k - apart, scale)
        most = max(most, largest(one, other, third))
    return most


@inlined
def repetitions(order):
    """How often a cycle must repeat that only scatters."""
    return max(REPETITIONS, -(-LASTING // order))


@kernel
def still_shrinking(rows, n, order):
    """Whether blows that alternate will yet agree, so that the cycle is a part of this one."""
    for part in range(1, order):
        if order % part == 0 and n >= 3 * order:
            scale = scale_over(rows, n, part)
            newer = change_over(rows, n - 1, order, part, scale)
            if newer < STEADY * change_over(rows, n - 1 - order, order, part, scale):
                return True
    return False


@kernel
def converges(rows, n, scale, tolerance):
    """Whether changes from blow to blow fall evenly from afar."""
    factors, before, count = 0, 0.0, n - 1
    newer = change_over(rows, n - 1, 1, 1, scale)
    while factors < count - 1:
        older = change_over(rows, n - 2 - factors, 1, 1, scale)
        if older == 0.0:
            break
        factor = newer / older
        if factor > FALLING:
            break
        if factors > 0 and not factor / ALIKE <= before <= factor * ALIKE:
            break
        before, newer = factor, older
        factors += 1
    return factors >= max(LEAST_FACTORS, DIRECT * count) and newer >= FAR * tolerance


@inlined
def rate_over(rows, last, order):
    """Mean rate over `order` blows up to `last` [m/s]."""
    advance = period = 0.0
    for k in range(last - order + 1, last + 1):
        advance += rows[k, _ADVANCE]
        period += rows[k, _PERIOD]
    return advance / period


@inlined_scalar
def multiplier_of(newest, older, oldest):
    """Ratio of two changes that follow each other; 0 where there was none."""
    before = older - oldest
    return (newest - older) / before if before != 0.0 else 0.0


@kernel
def limit(rows, n, order):
    """Limit of a converging cycle: its rate is extrapolated (Aitken)."""
    newer, older = rows[n - 1, _FIRST], rows[n - 1 - order, _FIRST]
    ratio = multiplier_of(newer, older, rows[n - 1 - 2 * order, _FIRST])
    third = rate_over(rows, n - 1, order)
    change = third - rate_over(rows, n - 1 - order, order)
    shift = change * ratio / (1.0 - ratio) if abs(ratio) < 1.0 else 0.0
    # extrapolating by more than the last change would trust the ratio too far
    shift = max(-abs(change), min(shift, abs(change)))
    # between cycles that agree to rounding the ratio of changes says nothing
    known = ratio if abs(ratio) < 1.0 else math.nan
    return Cycle(order, third + shift, abs(change) + abs(shift), known)


@kernel
def scattering(rows, n, order, tolerance):
    """Mean of cycles that only scatter; none where they drift, or scatter too far."""
    count, scale = repetitions(order), scale_over(rows, n, order)
    first, drift, most = n - count * order, 0.0, 0.0
    for i in range(order):
        one = other = third = 0.0
        for k in range(first + order + i, n, order):
            a, b, c = changes(rows, k, k - order, scale)
            one, other, third = one + a, other + b, third + c
            most = max(most, largest(a, b, c))
        drift = max(drift, largest(one, other, third))
    # what still drifts one way, however slowly, has not arrived
    if not drift <= most <= tolerance:
        return no_cycle()
    low, high, whole = math.inf, -math.inf, 0.0
    for k in range(count):
        rate = rate_over(rows, n - 1 - k * order, order)
        low, high, whole = min(low, rate), max(high, rate), whole + rate
    return Cycle(order, whole / count, high - low, math.nan)


@kernel
def cycle(rows, n, order, tolerance):
    """Make out whether the last of `n` blows are a cycle of `order`; `Cycle`."""
    if n < 3 * order:
        return no_cycle()
    scale = scale_over(rows, n, order)
    newer = change_over(rows, n - 1, order, order, scale)
    older = change_over(rows, n - 1 - order, order, order, scale)
    if max(newer, older) <= STILL * tolerance:
        return limit(rows, n, order)
    if not newer <= tolerance:
        return no_cycle()
    ratio = newer / older if older > 0.0 else 1.0
    to_come = newer * ratio / (1.0 - ratio) if ratio < 1.0 else math.inf
    if order == 1 and to_come <= tolerance and converges(rows, n, scale, tolerance):
        return limit(rows, n, order)
    if n < repetitions(order) * order:
        return no_cycle()
    return scattering(rows, n, order, tolerance)


@kernel
def cycle_in(rows, n, tolerance):
    """Shortest cycle that the last of `n` blows are; `Cycle`."""
    longest = min(MOST_BLOWS_A_CYCLE, n - 1)
    one = other = third = 0.0
    for k in range(n - 1 - longest, n):
        one = max(one, abs(rows[k, _FIRST]))
        other = max(other, abs(rows[k, _SECOND]))
        third = max(third, abs(rows[k, _THIRD]))
    scale = (
        one if one != 0.0 else 1.0,
        other if other != 0.0 else 1.0,
        third if third != 0.0 else 1.0,
    )
    for order in range(1, longest + 1):
        most = change_over(rows, n - 1, 1, order, scale)
        lasts = n >= repetitions(order) * order
        # else `cycle` would refuse, at a greater cost
        near = most <= tolerance and (order == 1 or most <= STILL * tolerance or lasts)
        if near and not still_shrinking(rows, n, order):
            found = cycle(rows, n, order, tolerance)
            if found.order > 0:
                return found
    return no_cycle()


@kernel
def blows_wanted(n, most):
    """How many blows there are to be when those are judged that come after `n`."""
    more = max(1, max(FEWEST_BLOWS - n, n // LOOK_AGAIN))
    return min(n + more, most)


@kernel
def stalls_at(rows, n):
    """Time at which a run has stalled in which no more blow ends than `n` [s]."""
    if n == 0:
        return STALLED_AFTER
    period = rows[n - 1, _PERIOD]
    return rows[n - 1, _TIME] + period + STALLED_AFTER + STALLED_PERIODS * period


@kernel
def judge(rows, request):
    """Judge the blows that are listed, into the record of what is asked."""
    asked = request[0]
    n = asked.blows
    if n >= min(asked.most, asked.enough):
        asked.verdict = Verdict.ENOUGH.value
    if n == asked.judged:
        asked.verdict = Verdict.STALLED.value
    elif asked.time >= asked.not_before:
        found = cycle_in(rows, n, asked.tolerance)
        if found.order > 0:
            asked.verdict = Verdict.PERIODIC.value
            asked.order, asked.multiplier = found.order, found.multiplier
            asked.rate, asked.error = found.rate, found.error
    asked.judged = n


def request_for(tolerance: float, most: int, not_before: float) -> np.ndarray:
    """A record of `REQUEST`, as an array.

    Parameters
    ----------
    tolerance, most, not_before
        See there.
    """
    asked = np.zeros(1, _REQUEST)
    one = asked.view(REQUEST)[0]
    one["tolerance"], one["most"], one["not_before"] = tolerance, most, not_before
    one["enough"] = one["until"] = math.inf
    return asked
