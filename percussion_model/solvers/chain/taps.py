"""Weights by which a wave arrives at the far end of a section.

A wave takes the time T = (n + f) dt from end to end, of which f dt is a part of a step, and
structural loss spreads it as a normal distribution of the variance eta T does (docs/model.md,
eq. 2, for waves far longer than eta c). So it arrives as a sum of what was sent at some steps
before, by weights of the mean T/dt and the variance eta T/dt^2. None is negative and their sum is
one: no wave ever grows, and a lasting force passes as it is.
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
# Weights below this, at either end, are rounding.
NOTHING = 1e-18


def weights_of(transit: float, variance: float) -> tuple[int, np.ndarray, float]:
    """Weights of a section.

    Parameters
    ----------
    transit, variance : float
        Wanted mean [steps] and variance [steps^2].

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
    part = min(max(transit - whole, 0.0), 1.0)
    part = part if part > WHOLE else 0.0
    weights = np.array([1.0 - part, part]) if part else np.ones(1)
    rest = variance - part * (1.0 - part)
    if rest <= 0.0:
        return whole, weights, part * (1.0 - part)
    rounds = math.ceil(0.5 * rest / MOST_SPREAD)
    rounds = min(rounds, whole - 1)
    if rounds == 0:
        return whole, weights, part * (1.0 - part)
    a = min(0.5 * rest / rounds, UTMOST_SPREAD)
    for _ in range(rounds):
        weights = np.convolve(weights, [a, 1.0 - 2.0 * a, a])
    delay = whole - rounds
    kept = np.flatnonzero(weights > NOTHING)
    weights = weights[kept[0] : kept[-1] + 1]
    return delay + int(kept[0]), weights / weights.sum(), part * (1.0 - part) + 2.0 * a * rounds
