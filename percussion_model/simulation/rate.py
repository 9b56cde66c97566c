"""Rate of penetration of some blows and its standard error.

The evidence for the estimate is in docs/data/stated_errors.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from percussion_model.physics.settling import STALLED_PERIODS

# Fewer whole blows than this give no rate.
LEAST_BLOWS = 3
# A rate that is known no better than this, relative to it, deserves a warning.
LARGE_ERROR = 1e-2
# Fewer than this do not tell how they depend on each other: they count as independent.
FEWEST_DEPENDENT = 20
# Stretches that tell how scatter grows have this share of all blows. Longer ones are too few,
# shorter ones do not show what blows take back from each other.
STRETCH = 0.25
# A hole that advances less in a blow does not: that is rounding of its depth [m].
LEAST_ADVANCE = 1e-13


def rate_of_blows(
    blows: np.ndarray, stretches: Sequence[float] = (STRETCH,)
) -> tuple[float, float]:
    """Advance of the hole by time over successive blows, and its standard error [m/s].

    Parameters
    ----------
    blows : ndarray of BLOW
        One after the other.
    stretches : sequence of float
        As of `ratios_of_sums`.

    Returns
    -------
    rate, standard_error : float
        NaN for fewer than `LEAST_BLOWS`.
    """
    if len(blows) < LEAST_BLOWS:
        return math.nan, math.nan
    return ratio_of_sums(advances(blows), blows["period"], stretches)


def advances(blows: np.ndarray) -> np.ndarray:
    """Advance of the hole in each blow [m], less rounding."""
    found = blows["hole_advance"]
    return np.where(np.abs(found) < LEAST_ADVANCE, 0.0, found)


def has_stalled(periods: np.ndarray, ended: float, until: float) -> bool:
    """Whether blows ended long before a time: what went before is no steady drilling.

    Parameters
    ----------
    periods : ndarray
        Of the whole blows [s].
    ended : float
        When the last of them ended [s].
    until : float
        Up to which the hammer was followed [s].

    Returns
    -------
    bool
        False where there is no blow.
    """
    return len(periods) > 0 and until - ended > STALLED_PERIODS * float(np.max(periods))


def ratio_of_sums(
    values: np.ndarray, weights: np.ndarray, stretches: Sequence[float] = (STRETCH,)
) -> tuple[float, float]:
    """Ratio of the sums of two series of a motion, and its standard error.

    See `ratios_of_sums`.

    Parameters
    ----------
    values, weights : ndarray, shape (n,)
        Successive rows, which may depend on each other.

    Returns
    -------
    ratio, standard_error : float
        The error is NaN for fewer than `LEAST_BLOWS` rows.
    """
    ratios, errors = ratios_of_sums(values[np.newaxis], weights[np.newaxis], stretches)
    return float(ratios[0]), float(errors[0])


def ratios_of_sums(
    values: np.ndarray, weights: np.ndarray, stretches: Sequence[float] = (STRETCH,)
) -> tuple[np.ndarray, np.ndarray]:
    """Ratios of the sums of pairs of series of a motion, and their standard errors.

    The sum of (value - ratio * weight) over n rows scatters with the variance a n + b: a is
    that of a random walk, b is what later rows take back. Both follow from stretches of one
    row and of a share of all.

    Parameters
    ----------
    values, weights : ndarray, shape (m, n)
        m series of n successive rows, which may depend on each other.
    stretches : sequence of float
        Those shares. Of several the one that tells of the greatest error counts.

    Returns
    -------
    ratios, standard_errors : ndarray, shape (m,)
        Errors are NaN for fewer than `LEAST_BLOWS` rows.
    """
    count, totals = values.shape[1], np.sum(weights, axis=1)
    ratios = np.sum(values, axis=1) / totals
    if count < LEAST_BLOWS:
        return ratios, np.full(len(ratios), math.nan)
    off = np.cumsum(values - ratios[:, np.newaxis] * weights, axis=1)
    sums = np.concatenate([np.zeros((len(ratios), 1)), off], axis=1)

    def scattered(length: int) -> tuple[np.ndarray, float]:
        """Mean square over stretches, and what it would be of a random walk with a = 1."""
        off = sums[:, length:] - sums[:, :-length]
        return np.mean(off * off, axis=1), length * (1.0 - length / count)

    short, walk = scattered(1)
    if count < FEWEST_DEPENDENT:
        return ratios, np.sqrt(short / walk * count) / totals
    variance = np.zeros(len(ratios))
    for length in {max(int(share * count), 2) for share in stretches}:
        long, longer_walk = scattered(length)
        a = np.maximum((long - short) / (longer_walk - walk), 0.0)
        b = short - a * walk
        a, b = np.where(b < 0.0, long / longer_walk, a), np.maximum(b, 0.0)
        variance = np.maximum(variance, a * count + b)
    return ratios, np.sqrt(variance) / totals
