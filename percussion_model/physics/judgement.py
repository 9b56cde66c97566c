"""Errors of numbers over blows: by scatter, by runs on coarser grids, by close decisions.

Written once for Python, which runs it as it stands, and for pages, which have it compiled
(`engine.judgement`). The evidence is in docs/data/stated_errors.md, the method in
docs/accuracy.md, section 8.

A *row* is one number of one run: its value, its standard error, drilling cycles a blow, and modes
or steps in the first elastic bar (`Row`).
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from percussion_model.physics.kernel import plain

# Fewer whole blows than this tell no rate.
LEAST_BLOWS = 3
# Fewer than this do not tell how they depend on each other: they count as independent.
FEWEST_DEPENDENT = 20
# A hole that advances less in a blow does not: that is rounding of its depth [m].
LEAST_ADVANCE = 1e-13
# Where blows have two numbers of drilling cycles, and one is this rare, the motion is near the
# threshold between two: on another grid all blows may be of either kind.
RARE = 0.25
# Two aperiodic runs differ if they do by more than so many standard errors.
CONFIDENCE = 2.0
# Margin on the spread of rates where motions differ: the right one may lie outside of them.
SPREAD_MARGIN = 1.5
# What elements lose to discretisation costs about this share of it in the rate: at 1, 2 and
# 50 elements in the piston 0.78, 0.36 and 0.033 of the energy, and 0.36, 0.11 and 0.004.
NUMERICAL_SHARE = 0.4
# The same where coarser elements have another motion; 2.6 was seen (scenarios/chatter.toml).
NUMERICAL_SHARE_OF_MOTIONS = 3.0
# The error is not below this share of what the rule of modes promises: they are surer than steps.
FLOOR_SHARE_OF_MODES = 0.08
# Steps half as long again change half of an error of first order.
FIRST_ORDER = 2.0
# Steps that are not this many times as long change less of it.
NEARLY_AS_LONG = 4.0 / 3.0
# A run is compared with those that have at least this share of its modes.
LEAST_MODES = 0.3
# Runs whose drilling cycles a blow differ by more, or by more than this share of them, are
# of different motions; where there are dozens, one more or less is a smooth change.
SAME_MOTION, SAME_SHARE = 0.5, 0.05
# A motion repeats whose standard error is below this share of the rate, and does not where it is
# so many times as large.
STEADY, SCATTERING = 1e-4, 20.0
# A margin may be off by so many times what coarser runs are: energies that decide converge late,
# and not from one side (docs/data/stated_errors.md, section 6).
UNSURE = 6.0
# So it may where coarser runs have other decisions, which tell nothing of this one.
UNSURE_OTHERWISE = 0.02
# The other barrier lies beyond the energies of all blows that are near, and what is doubtful, by
# this factor: the other motion has other energies. Those so many times as far are not near.
BEYOND, NEAR = 1.2, 3.0
# A decision that is farther from the barrier is not near, however unsure [1].
FAR = 0.07
# Steps of components in runs to compare with, by those of this one: errors of second order double.
LONGER_STEPS = math.sqrt(2.0)


class Row(IntEnum):
    """Columns of a row."""

    VALUE = 0
    SCATTER = 1
    CYCLES = 2
    GRID = 3


_VALUE, _SCATTER, _CYCLES, _GRID = (one.value for one in Row)


class Grid(IntEnum):
    """What a run is divided by."""

    NONE = 0
    MODES = 1
    STEPS = 2
    ELEMENTS = 3


_NONE, _MODES, _STEPS = Grid.NONE.value, Grid.MODES.value, Grid.STEPS.value


def running_sums(values):
    """Sums of none of the values, of the first, of the first two, ..."""
    return np.concatenate((np.zeros(1), np.cumsum(values)))


def median(values):
    """Median of some values."""
    return np.median(values)


@plain
def _scattered(sums, length):
    """Mean square over stretches of so many rows."""
    off = sums[length:] - sums[: len(sums) - length]
    return np.mean(off * off)


@plain
def ratio_of_sums(values, weights, stretches):
    """Ratio of the sums of two series of a motion, and its standard error.

    The sum of (value - ratio * weight) over n rows scatters with the variance a n + b: a is
    that of a random walk, b is what later rows take back. Both follow from stretches of one
    row and of a share of all.

    Parameters
    ----------
    values, weights : ndarray, shape (n,)
        Successive rows, which may depend on each other.
    stretches : sequence of float
        Those shares. Of several the one that tells of the greatest error counts.

    Returns
    -------
    ratio, standard_error : float
        The error is NaN for fewer than `LEAST_BLOWS` rows.
    """
    count, total = len(values), np.sum(weights)
    ratio = np.sum(values) / total
    if count < LEAST_BLOWS:
        return ratio, math.nan
    sums = running_sums(values - ratio * weights)
    short, walk = _scattered(sums, 1), 1.0 - 1.0 / count
    if count < FEWEST_DEPENDENT:
        return ratio, math.sqrt(short / walk * count) / abs(total)
    variance = 0.0
    for share in stretches:
        length = max(int(share * count), 2)
        long, longer_walk = _scattered(sums, length), length * (1.0 - length / count)
        a = max((long - short) / (longer_walk - walk), 0.0)
        b = short - a * walk
        if b < 0.0:
            a, b = long / longer_walk, 0.0
        variance = max(variance, a * count + b)
        if math.isnan(long):
            variance = long
    return ratio, math.sqrt(variance) / abs(total)


@plain
def first_kind(cycles):
    """Which blows have the drilling cycles of the first, where two numbers are, and one is rare.

    Parameters
    ----------
    cycles : ndarray
        Of each blow.

    Returns
    -------
    ndarray of bool
        None of them where there are not two numbers, or neither is rare.
    """
    count = len(cycles)
    first = cycles == cycles[0] if count > 0 else np.zeros(0, np.bool_)
    rest = cycles[~first]
    is_rare = min(len(rest), count - len(rest)) < RARE * count
    if len(rest) > 0 and is_rare and not np.any(rest != rest[0]):
        return first
    return np.zeros(count, np.bool_)


@plain
def apart(value, one, other):
    """Greatest relative distance to the values over blows of two kinds; NaN is not defined."""
    most = 0.0
    if value != 0.0:
        for kind in (one, other):
            off = abs(kind / value - 1.0)
            if off > most:
                most = off
    return most


@plain
def _useful(row):
    return math.isfinite(row[_VALUE]) and row[_VALUE] != 0.0


@plain
def repeat_alike(run, other):
    """Whether it is not so that a run repeats from blow to blow, and another one scatters."""
    steady = abs(run[_SCATTER] / run[_VALUE])
    scatters = abs(other[_SCATTER] / other[_VALUE])
    return not (steady <= STEADY and SCATTERING * STEADY <= scatters)


@plain
def same_motion(run, other):
    """Whether two runs have the same number of drilling cycles a blow, and repeat alike."""
    off = abs(run[_CYCLES] - other[_CYCLES])
    return repeat_alike(run, other) and off <= max(SAME_MOTION, SAME_SHARE * run[_CYCLES])


@plain
def difference(other, run):
    """Relative difference of a number of two runs; 0 where scatter alone explains it."""
    off = abs(run[_VALUE] - other[_VALUE])
    chance = run[_SCATTER] * run[_SCATTER] + other[_SCATTER] * other[_SCATTER]
    if repeat_alike(run, other) and off <= CONFIDENCE * math.sqrt(chance):
        return 0.0
    return off / abs(run[_VALUE])


@plain
def error_by_modes(run, others, promised):
    """Error by the number of modes: the largest distance to runs with not much fewer.

    Parameters
    ----------
    run : row
    others : ndarray of rows
        Of runs with fewer modes, the fewest first; infinite where none has a number.
    promised : float
        Relative error that the rule of modes expects.
    """
    last = -1
    for k in range(len(others)):
        if _useful(others[k]):
            last = k
    if last < 0:
        return math.inf
    off, same, found = 0.0, True, False
    for k in range(last + 1):
        if _useful(others[k]) and others[k][_GRID] >= LEAST_MODES * run[_GRID]:
            off = max(off, difference(others[k], run))
            same, found = same and same_motion(run, others[k]), True
    if not found:
        off, same = difference(others[last], run), same_motion(run, others[last])
    return off if same else max(SPREAD_MARGIN * off, promised)


@plain
def error_by_steps(run, other):
    """Error by the steps: what is left of one of first order, by a run with longer ones."""
    longer = run[_GRID] / other[_GRID]
    left = 1.0 / (longer - 1.0) if 1.0 < longer < NEARLY_AS_LONG else FIRST_ORDER
    return left * difference(other, run)


@plain
def error_by_decisions(run, decided):
    """Relative error that covers runs whose close decisions were taken otherwise.

    Parameters
    ----------
    run : row
        Over their time: chance has the same part in both.
    decided : ndarray of rows
        On the same grid, with another barrier.
    """
    off = 0.0
    for k in range(len(decided)):
        if _useful(decided[k]):
            off = max(off, difference(decided[k], run))
    return SPREAD_MARGIN * off


@plain
def error_by_grid(grid, run, others, promised):
    """Relative error by what is known of the grids of a solver.

    Parameters
    ----------
    grid : int
        `Grid`.
    run : row
    others : ndarray of rows
        On coarser grids, the best last; infinite where none has a number.
    promised : float
        See `error_by_modes`.
    """
    if grid == _MODES:
        return error_by_modes(run, others, promised)
    total, found = 0.0, False
    for k in range(len(others)):  # each is coarser in another way
        if _useful(others[k]):
            found = True
            if grid == _STEPS:
                total += error_by_steps(run, others[k])
            else:
                total += difference(others[k], run)
    return total if found else math.inf


@plain
def floor_of_error(grid, run, others, promised, floor_share, numerical):
    """Relative error that grids which agree by chance do not go below.

    Parameters
    ----------
    grid, run, others, promised
        See `error_by_grid`.
    floor_share : float
        Of what is promised, where there are no modes.
    numerical : float
        Share of the energy put in that the ledger has as numerical.
    """
    if grid == _MODES:
        return FLOOR_SHARE_OF_MODES * promised
    same = True
    for k in range(len(others)):
        if _useful(others[k]):
            same = same and same_motion(run, others[k])
    share = NUMERICAL_SHARE if same else NUMERICAL_SHARE_OF_MOTIONS
    return max(floor_share * promised, share * abs(numerical))


@plain
def error_of_number(grid, rows, others, kinds, promised, floor_share, numerical):
    """Relative error of a number of a run that is compared over all of it.

    Parameters
    ----------
    grid : int
        `Grid`.
    rows : ndarray of rows
        Of the run, of so many `others` on coarser grids, the rest with another barrier.
    others : int
    kinds : float
        As `apart` gives it.
    promised, floor_share, numerical
        See `floor_of_error`.
    """
    run, coarser, decided = rows[0], rows[1 : 1 + others], rows[1 + others :]
    scatter = abs(run[_SCATTER] / run[_VALUE])
    floor, by_grid = 0.0, 0.0
    if others > 0:
        floor = floor_of_error(grid, run, coarser, promised, floor_share, numerical)
        by_grid = error_by_grid(grid, run, coarser, promised)
    if grid == _NONE:
        by_grid = 0.0
    else:
        by_grid = max(by_grid, SPREAD_MARGIN * kinds, error_by_decisions(run, decided))
    return max(scatter, by_grid, floor)


@plain
def middle(values):
    """Median of what is defined; NaN where nothing is."""
    known = values[np.isfinite(values)]
    return median(known) if len(known) > 0 else math.nan


@plain
def unsure_by(own, others):
    """By how much a margin may be off, by its medians in a run and in coarser ones."""
    most = 0.0
    for k in range(len(others)):
        off = abs(others[k] - own)
        if math.isfinite(off) and off > most:
            most = off
    return UNSURE * most


@plain
def unsure_of_barrier(own, cycles, middles, others):
    """By how much the margin of the barrier may be off, as runs tell that fit as well.

    Parameters
    ----------
    own, cycles : float
        Median of the margins of a run, and drilling cycles a blow.
    middles, others : ndarray
        The same of coarser runs.
    """
    for k in range(len(others)):
        if not abs(cycles - others[k]) <= SAME_MOTION:  # its closest decision is another one
            return UNSURE_OTHERWISE
    return unsure_by(own, middles)


@plain
def near_barrier(margins, unsure):
    """Those of the margins whose decision may fall the other way, and others nearly as close."""
    if not np.any(np.abs(margins) <= min(unsure, FAR)):
        return margins[:0]
    return margins[np.abs(margins) <= min(NEAR * unsure, FAR)]


@plain
def other_barrier(sign, margins, unsure):
    """Barrier, by the present one, beyond which close decisions fall the other way; NaN: none is.

    Parameters
    ----------
    sign : float
        1: of cycles that began by little energy, -1: of those to which little was missing.
    margins : ndarray, shape (n,)
        `barrier_margin` of each blow; NaN where nothing was decided.
    unsure : float
        By how much they may be off.
    """
    near = near_barrier(margins[sign * margins > 0.0], unsure)
    if len(near) == 0:
        return math.nan
    farthest = min(unsure, FAR)
    for margin in near:
        farthest = max(farthest, abs(margin))
    return 1.0 + sign * BEYOND * farthest


@plain
def longer_step(step, longest):
    """Step of a component in a run to compare with [s].

    Where a longer one may not be, half of it tells nearly as much.
    """
    return step * (LONGER_STEPS if LONGER_STEPS * step <= longest else 0.5)
