"""Cycles in a sequence of blows, and means where there are none."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from percussion_model.physics.records import BLOW

# Longest cycle that is looked for [blows].
MOST_BLOWS_A_CYCLE = 8
# Two changes that fall alike take so many blows: looking earlier is in vain.
FEWEST_BLOWS = 4
# Blows converge if their changes fall from so many tolerances on, each by this factor at
# least, and the factors are alike within that one.
FAR, FALLING, ALIKE = 10.0, 0.9, 3.0
# They must have done so for this share of all blows run: a motion that wanders, too, comes
# by chance upon a few blows that fall evenly, and leaves them again.
DIRECT = 0.5
# Where changes are below this share of the tolerance, no scatter is left to hide anything.
STILL = 1e-4
# A cycle of several blows, or one that only scatters without converging any more, is believed
# after so many repetitions and blows: near a threshold one blow in twenty may be quite another.
REPETITIONS, LASTING = 5, 60
# Numbers of a blow by which two blows are the same.
COMPARED = ("impact_velocity", "period", "penetration")
# Their places in a row, whose fields are words of eight bytes.
_COLUMNS = [(BLOW.names or ()).index(name) for name in COMPARED]
# Differences within a cycle that fall by less than this from one cycle to the next will stay.
STEADY = 0.9
# The means of an aperiodic motion are taken over this many batches of blows.
BATCHES = 16
# Share of the blows of an aperiodic motion that is left out as settling.
SETTLING_SHARE = 0.2


def cycles_in(blows: np.ndarray, tolerance: float) -> dict[int, tuple[float, float, float]]:
    """Cycles that the last blows could be, by order; values as from `cycle`."""
    velocity = blows["impact_velocity"][: -MOST_BLOWS_A_CYCLE - 2 : -1].tolist()
    last, largest = velocity[0], max(abs(value) for value in velocity)
    found = {
        order: cycle(blows, order, tolerance)
        for order in range(1, len(velocity))
        # else `cycle` would refuse, at a greater cost
        if abs(velocity[order] - last) <= tolerance * largest and not _still_shrinking(blows, order)
    }
    return {order: values for order, values in found.items() if values is not None}


def cycle(blows: np.ndarray, order: int, tolerance: float) -> tuple[float, float, float] | None:
    """Rate, its error and the multiplier of a cycle of `order` blows, None if it is none."""
    if len(blows) < 3 * order:
        return None
    changes = _by_cycle(blows, order)
    newer, older = changes[0], changes[1]
    if max(newer, older) <= STILL * tolerance:
        return _limit(blows, order)
    if newer > tolerance:
        return None
    ratio = newer / older if older > 0 else 1.0
    to_come = newer * ratio / (1.0 - ratio) if ratio < 1.0 else math.inf
    if order == 1 and to_come <= tolerance and _converges(changes, tolerance):
        return _limit(blows, order)
    repetitions = max(REPETITIONS, math.ceil(LASTING / order))
    if len(blows) < repetitions * order:
        return None
    rows = blows[-repetitions * order :]
    steps = _changes(rows, order)
    largest = np.max(np.abs(steps))
    # What still drifts one way, however slowly, has not arrived.
    drift = np.max(np.abs(steps.reshape(repetitions - 1, -1).sum(axis=0)))
    return _scattering(rows, order) if drift <= largest <= tolerance else None


def _by_cycle(blows: np.ndarray, order: int) -> list[float]:
    """Largest relative change from cycle to cycle, the newest first."""
    count = len(blows) // order
    changes = np.abs(_changes(blows[-count * order :], order))
    found: list[float] = changes.reshape(count - 1, -1).max(axis=1)[::-1].tolist()
    return found


def _converges(changes: list[float], tolerance: float) -> bool:
    """Whether changes from cycle to cycle, the newest first, fall evenly from afar."""
    factors: list[float] = []
    for newer, older in pairwise(changes):
        if older == 0.0:
            break
        factor = newer / older
        alike = not factors or factor / ALIKE <= factors[-1] <= factor * ALIKE
        if factor > FALLING or not alike:
            break
        factors.append(factor)
    enough = max(2.0, DIRECT * len(changes))
    return len(factors) >= enough and changes[len(factors)] >= FAR * tolerance


def _still_shrinking(blows: np.ndarray, order: int) -> bool:
    """Whether blows that alternate will yet agree, so that the cycle is a part of this one."""
    for part in range(1, order):
        if order % part == 0 and len(blows) >= 3 * order:
            deviation = np.abs(_changes(blows[-2 * order - part :], part))
            if np.max(deviation[order:]) < STEADY * np.max(deviation[:order]):
                return True
    return False


def _changes(blows: np.ndarray, order: int) -> np.ndarray:
    """Relative change of each number of `COMPARED` over a cycle, a row for each blow."""
    values = blows.view(np.float64).reshape(len(blows), -1)[:, _COLUMNS]
    scale = np.abs(values[-order:]).sum(axis=0) / order
    scale[scale == 0.0] = 1.0
    return (values[order:] - values[:-order]) / scale


def _rates(blows: np.ndarray, order: int) -> np.ndarray:
    """Mean rate over each run of `order` blows, one after the other [m/s]."""
    whole = len(blows) // order * order
    advance = blows["penetration"][-whole:].reshape(-1, order).sum(axis=1)
    return np.asarray(advance / blows["period"][-whole:].reshape(-1, order).sum(axis=1))


def _limit(blows: np.ndarray, order: int) -> tuple[float, float, float]:
    """Limit of a converging cycle: rate, error and multiplier."""
    second, third = _rates(blows[-2 * order :], order).tolist()
    change = third - second
    ratio = _multiplier(blows, order)
    shift = change * ratio / (1.0 - ratio) if abs(ratio) < 1.0 else 0.0
    # Extrapolating by more than the last change would trust the ratio too far.
    shift = max(-abs(change), min(shift, abs(change)))
    # Between cycles that agree to rounding the ratio of changes says nothing.
    return (
        float(third + shift),
        float(abs(change) + abs(shift)),
        ratio if abs(ratio) < 1 else math.nan,
    )


def _multiplier(blows: np.ndarray, order: int) -> float:
    """Ratio of the last two changes of the impact velocity over a cycle."""
    velocity = blows["impact_velocity"]
    newer = velocity[-1] - velocity[-1 - order]
    older = velocity[-1 - order] - velocity[-1 - 2 * order]
    return float(newer / older) if older != 0.0 else 0.0


def _scattering(blows: np.ndarray, order: int) -> tuple[float, float, float]:
    """Mean of cycles that only scatter: rate, scatter; the multiplier cannot be told."""
    rates = _rates(blows, order)
    return float(np.mean(rates)), float(np.ptp(rates)), math.nan


def batch_means(blows: np.ndarray) -> tuple[float, float]:
    """Mean rate of an aperiodic motion and its standard error [m/s].

    Blows follow from each other, so that their scatter alone would tell too
    small an error; means over long batches are nearly independent.
    """
    rows = blows[int(SETTLING_SHARE * len(blows)) :]
    rates = _rates(rows, len(rows) // BATCHES)
    rate = float(np.sum(rows["penetration"]) / np.sum(rows["period"]))
    return rate, float(np.std(rates, ddof=1) / math.sqrt(len(rates)))
