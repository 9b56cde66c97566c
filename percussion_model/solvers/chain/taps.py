"""Weights by which a wave arrives at the far end of a section.

A wave takes the time T = (n + f) dt from end to end, and structural loss spreads it as a normal
distribution of the variance eta T does (docs/model.md, eq. 2, for waves far longer than eta c).
So it arrives as a sum of what was sent at some steps before, by weights whose sum is one: a
lasting force passes as it is. The part f dt of a step is Lagrange's cubic between four steps, in
its middle interval, where it lets no frequency grow (T. Laakso et al., IEEE Signal Processing
Magazine 13 (1996) 30); the spread is by samples of the normal distribution, or where it is narrow
by weights (a, 1 - 2 a, a), some times, which let none grow either. So no weights make energy.
"""

from __future__ import annotations

import math

import numpy as np

# A part of a step below this is rounding [steps].
WHOLE = 1e-9
# Weights (a, 1 - 2 a, a) spread a wave without turning any of its frequencies over up to this a.
MOST_SPREAD = 0.25
# And where steps are few, up to this.
UTMOST_SPREAD = 0.5
# Above this variance samples of a normal distribution have it to rounding [steps^2].
LEAST_NORMAL = 2.0
# They end so many standard deviations from the mean, where they are 4e-5 of the greatest; where a
# section is too short for that no less than so many, which keeps 0.999 of the variance.
REACH, LEAST_REACH = 4.5, 4.0
# In so many rounds the variance of what ends comes right to rounding.
ROUNDS = 8
# Weights below this, at either end, are rounding.
NOTHING = 1e-18


def weights_of(transit: float, variance: float) -> tuple[int, np.ndarray, float]:
    """Weights of a section.

    Parameters
    ----------
    transit, variance : float
        Wanted mean, which is one step or at least two [steps], and variance [steps^2].

    Returns
    -------
    delay : int
        Steps from a wave that is sent to the first weight.
    weights : ndarray
        By how many steps later still.
    spread : float
        Their variance.
    """
    whole = max(1, math.floor(transit + WHOLE))
    part = max(transit - whole, 0.0)
    if part <= WHOLE:
        delay, weights, spread = whole, np.ones(1), 0.0
    else:
        delay, weights, spread = whole - 1, _cubic(part), 0.0
    rest, room = max(variance - spread, 0.0), delay - 1
    reach = min(room, math.ceil(REACH * math.sqrt(rest)))
    if rest >= LEAST_NORMAL and reach >= LEAST_REACH * math.sqrt(rest):
        weights = np.convolve(weights, _normal(rest, reach))
        return delay - reach, weights / weights.sum(), spread + rest
    rounds = min(math.ceil(0.5 * rest / MOST_SPREAD), room)
    if rounds == 0:
        return delay, weights, spread
    a = min(0.5 * rest / rounds, UTMOST_SPREAD)
    for _ in range(rounds):
        weights = np.convolve(weights, [a, 1.0 - 2.0 * a, a])
    kept = np.flatnonzero(np.abs(weights) > NOTHING)
    weights = weights[kept[0] : kept[-1] + 1]
    first = delay - rounds + int(kept[0])
    return first, weights / weights.sum(), spread + 2.0 * a * rounds


def _normal(variance: float, reach: int) -> np.ndarray:
    """Samples of a normal distribution so wide that they have the variance though they end."""
    places, wide = np.arange(-reach, reach + 1), variance
    for _ in range(ROUNDS):
        weights = np.exp(-0.5 * places**2 / wide)
        weights /= weights.sum()
        wide *= variance / float(weights @ places**2)
    return weights


def turning(transit: float) -> float:
    """Weight a of a section of one to two steps, which is too short for others.

    y = a x + sqrt(1 - a^2) q, where q becomes sqrt(1 - a^2) x - a q: it delays by one step and
    (1 - a)/(1 + a) of another, takes nothing and makes nothing.
    """
    part = transit - 1.0
    return (1.0 - part) / (1.0 + part)


def _cubic(part: float) -> np.ndarray:
    """Lagrange's weights of the steps -1, 0, 1 and 2 at a part of the step from 0 to 1."""
    f = part
    return np.array(
        [
            -f * (f - 1.0) * (f - 2.0) / 6.0,
            (f + 1.0) * (f - 1.0) * (f - 2.0) / 2.0,
            -(f + 1.0) * f * (f - 2.0) / 2.0,
            (f + 1.0) * f * (f - 1.0) / 6.0,
        ]
    )
