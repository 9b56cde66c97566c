"""Weights by which a wave arrives at the far end of a section.

A wave takes the time T = (n + f) dt from end to end, and structural loss spreads it as a normal
distribution of the variance eta T does, with the third moment 9/4 eta^2 T: exp(-s T /
sqrt(1 + eta s)) of docs/model.md, eq. 2, to the third order in s.
So it arrives as a sum of what was sent at some steps before, by weights whose sum is one: a
lasting force passes as it is. The part f dt of a step is Lagrange's cubic between four steps, in
its middle interval, where it lets no frequency grow (T. Laakso et al., IEEE Signal Processing
Magazine 13 (1996) 30); the spread is by samples of the normal distribution, or where it is narrow
by weights (a, 1 - 2 a, a), some times, which let none grow either. So no weights make energy.
"""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.elementary import exp
from percussion_model.physics.kernel import preparing
from percussion_model.scene.bars import add
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes

# A part of a step below this is rounding [steps].
WHOLE = 1e-9
# Weights (a, 1 - 2 a, a) spread a wave without turning any of its frequencies over up to this a.
MOST_SPREAD = 0.25
# And where steps are few, up to this.
UTMOST_SPREAD = 0.5
# Above this variance samples of a normal distribution have it to rounding [steps^2].
LEAST_NORMAL = 2.0
# Third moment eta^2 T of loss: so many times the square of its variance by T.
THIRD = 2.25
# They end so many standard deviations from the mean, where they are 4e-5 of the greatest; where a
# section is too short for that no less than so many, which keeps 0.999 of the variance.
REACH, LEAST_REACH = 4.5, 4.0
# In so many rounds the variance of what ends comes right to rounding.
ROUNDS = 8
# Waves on their way are spread over so many standard deviations.
REACH_ON_THE_WAY = 3.0
# Weights below this, at either end, are rounding.
NOTHING = 1e-18


@preparing
def weights_of(transit, variance):
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
        delay, weights = whole, np.ones(1)
    else:
        delay, weights = whole - 1, _cubic(part)
    rest, room = max(variance, 0.0), delay - 1
    reach = min(room, math.ceil(REACH * math.sqrt(rest)))
    if rest >= LEAST_NORMAL and reach >= LEAST_REACH * math.sqrt(rest):
        weights = _scaled(_convolved(weights, _normal(rest, reach)))
        if room - reach < 2:
            return delay - reach, weights, rest
        return delay - reach - 2, _convolved(weights, _skew(transit, rest)), rest
    rounds = min(math.ceil(0.5 * rest / MOST_SPREAD), room)
    if rounds == 0:
        return delay, weights, 0.0
    a = min(0.5 * rest / rounds, UTMOST_SPREAD)
    once = np.array([a, 1.0 - 2.0 * a, a])
    for _ in range(rounds):
        weights = _convolved(weights, once)
    if room - rounds >= 2:
        weights, delay = _convolved(weights, _skew(transit, variance)), delay - 2
    first, end = 0, len(weights)
    while abs(weights[first]) <= NOTHING:
        first += 1
    while abs(weights[end - 1]) <= NOTHING:
        end -= 1
    left = np.zeros(end - first)
    for k in range(end - first):
        left[k] = weights[first + k]
    return delay - rounds + first, _scaled(left), 2.0 * a * rounds


@preparing
def _skew(transit, variance):
    """Weights that give a distribution its third moment, and leave all before as they are."""
    c = THIRD * variance * variance / transit / 6.0
    return np.array([-0.5 * c, c, 1.0, -c, 0.5 * c])


@preparing
def _convolved(one, other):
    """Weights of both, one after the other; BLAS would sum otherwise on other processors."""
    out = np.zeros(len(one) + len(other) - 1)
    for k in range(len(one)):
        for j in range(len(other)):
            out[k + j] += one[k] * other[j]
    return out


@preparing
def _scaled(weights):
    """The same by their sum, in place."""
    total = rest = 0.0
    for k in range(len(weights)):
        total, rest = add(total, rest, weights[k])
    for k in range(len(weights)):
        weights[k] /= total + rest
    return weights


@preparing
def _normal(variance, reach):
    """Samples of a normal distribution so wide that they have the variance though they end."""
    weights, wide = np.zeros(2 * reach + 1), variance
    for _ in range(ROUNDS):
        for k in range(2 * reach + 1):
            place = float(k - reach)
            weights[k] = exp(-0.5 * (place * place) / wide)
        _scaled(weights)
        moment = lost = 0.0
        for k in range(2 * reach + 1):
            place = float(k - reach)
            moment, lost = add(moment, lost, weights[k] * (place * place))
        wide *= variance / (moment + lost)
    return weights


@preparing
def on_the_way(cells, spread):
    """Weights by which a wave has been spread in each cell on its way, row by row.

    Parameters
    ----------
    cells : int
    spread : float
        Variance that a step adds [steps^2].

    Returns
    -------
    weights : ndarray
        Of a cell from the newest wave to the oldest, 2 reach + 1 of them; then of the next.
    reach : int
        0: nothing is spread, and there are no weights.
    """
    if spread == 0.0:
        return np.zeros(0), 0
    reach = math.ceil(REACH_ON_THE_WAY * math.sqrt(cells * spread))
    weights = np.zeros(cells * (2 * reach + 1))
    for cell in range(cells):
        variance, middle = (cell + 0.5) * spread, cell * (2 * reach + 1) + reach
        if 0.5 * variance <= UTMOST_SPREAD:
            weights[middle - 1] = weights[middle + 1] = 0.5 * variance
            weights[middle] = 1.0 - variance
        else:
            row = _normal(variance, reach)
            for j in range(2 * reach + 1):
                weights[middle - reach + j] = row[j]
    return weights, reach


@preparing
def turning(transit):
    """Weight a of a section of one to two steps, which is too short for others.

    y = a x + sqrt(1 - a^2) q, where q becomes sqrt(1 - a^2) x - a q: it delays by one step and
    (1 - a)/(1 + a) of another, takes nothing and makes nothing.
    """
    part = transit - 1.0
    return (1.0 - part) / (1.0 + part)


@preparing
def _cubic(part):
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
