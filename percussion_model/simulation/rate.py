"""Rate of penetration of some blows and its standard error.

The evidence for the estimate is in docs/data/stated_errors.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from percussion_model.physics import judgement
from percussion_model.physics.judgement import FEWEST_DEPENDENT as FEWEST_DEPENDENT
from percussion_model.physics.judgement import LEAST_ADVANCE
from percussion_model.physics.judgement import LEAST_BLOWS as LEAST_BLOWS
from percussion_model.physics.settling import STALLED_PERIODS

# A rate that is known no better than this, relative to it, deserves a warning.
LARGE_ERROR = 1e-2
# Stretches that tell how scatter grows have this share of all blows. Longer ones are too few,
# shorter ones do not show what blows take back from each other.
STRETCH = 0.25


def rate_of_blows(
    blows: np.ndarray, stretches: Sequence[float] = (STRETCH,)
) -> tuple[float, float]:
    """Advance of the hole by time over successive blows, and its standard error [m/s].

    Parameters
    ----------
    blows : ndarray of BLOW
        One after the other.
    stretches : sequence of float
        As of `ratio_of_sums`.

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

    See `physics.judgement.ratio_of_sums`.
    """
    ratio, error = judgement.ratio_of_sums(values, weights, stretches)
    return float(ratio), float(error)
