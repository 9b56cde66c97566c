"""Cycles in a sequence of blows, and means where there are none."""

from __future__ import annotations

import math

import numpy as np

# Longest cycle that is looked for [blows].
MOST_BLOWS_A_CYCLE = 8
# A cycle that only scatters, without converging any more, is believed after so many repetitions.
REPETITIONS = 5
# Numbers of a blow by which two blows are the same.
COMPARED = ("impact_velocity", "period", "penetration")
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
    deviation = _changes(blows[-3 * order :], order)
    older, newer = (float(np.max(np.abs(part))) for part in np.split(deviation, 2))
    if newer <= tolerance:
        shrinking = newer / older if older > 0 else 0.0
        if shrinking < 1.0 and newer * shrinking / (1.0 - shrinking) <= tolerance:
            return _limit(blows, order)
    if len(blows) < REPETITIONS * order:
        return None
    rows = blows[-REPETITIONS * order :]
    changes = _changes(rows, order)
    largest = np.max(np.abs(changes))
    # What still drifts one way, however slowly, has not arrived.
    drift = np.max(np.abs(changes.reshape(REPETITIONS - 1, -1).sum(axis=0)))
    return _scattering(rows, order) if drift <= largest <= tolerance else None


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
    values = np.stack([blows[name] for name in COMPARED], axis=1)
    scale = np.mean(np.abs(values[-order:]), axis=0)
    return (values[order:] - values[:-order]) / np.where(scale > 0, scale, 1.0)


def _rates(blows: np.ndarray, order: int) -> np.ndarray:
    """Mean rate over each run of `order` blows, one after the other [m/s]."""
    whole = len(blows) // order * order
    advance = blows["penetration"][-whole:].reshape(-1, order).sum(axis=1)
    return np.asarray(advance / blows["period"][-whole:].reshape(-1, order).sum(axis=1))


def _limit(blows: np.ndarray, order: int) -> tuple[float, float, float]:
    """Limit of a converging cycle: rate, error and multiplier."""
    second, third = _rates(blows[-2 * order :], order)
    change = third - second
    ratio = _multiplier(blows, order)
    shift = change * ratio / (1.0 - ratio) if abs(ratio) < 1.0 else 0.0
    # Extrapolating by more than the last change would trust the ratio too far.
    shift = float(np.clip(shift, -abs(change), abs(change)))
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
