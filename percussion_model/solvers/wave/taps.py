"""Weights by which a wave arrives at the far end of a section.

A wave takes the time T = (n + f) dt from end to end, and structural loss spreads it as exp(-s T /
sqrt(1 + eta s)) does (docs/model.md, eq. 2): its cumulants are T, eta T, 9/4 eta^2 T, 15/2 eta^3 T.
So it arrives as a sum of what was sent at some steps before, by weights whose sum is one: a
lasting force passes as it is. They are samples of a gamma distribution with the first three
cumulants, whose fourth is 243/32 eta^3 T. None is below zero: nothing turns before a front.
Where the spread is narrow, the part f dt of a step is Lagrange's cubic between four steps, in its
middle interval, where it lets no frequency grow (T. Laakso et al., IEEE Signal Processing
Magazine 13 (1996) 30), and the spread is by weights (a, 1 - 2 a, a), some times, which let none
grow either. So no weights make energy.
"""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.elementary import exp, log
from percussion_model.physics.kernel import inlined, preparing
from percussion_model.scene.bars import add
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.modal.lanes import WIDTH

# A part of a step below this is rounding [steps].
WHOLE = 1e-9
# Weights (a, 1 - 2 a, a) spread a wave without turning any of its frequencies over up to this a.
MOST_SPREAD = 0.25
# And where steps are few, up to this.
UTMOST_SPREAD = 0.5
# Above this variance samples of a distribution do: 4e-5 is the part of what changes from step to
# step that they take for slower [steps^2].
LEAST_SAMPLED = 0.5
# Below this skewness a gamma distribution is a normal one to rounding.
LEAST_SKEWNESS = 1e-3
# Third moment eta^2 T of loss: so many times the square of its variance by T.
THIRD = 2.25
# They end so many standard deviations from the mean, where they are 4e-5 of the greatest; where a
# section is too short for that no less than so many, which keeps 0.999 of the variance.
REACH, LEAST_REACH = 4.5, 4.0
# In so many rounds the variance of what ends comes right to rounding.
ROUNDS = 8
# Waves on their way are spread over so many standard deviations, and are no more skewed than this,
# nor than by so much times that deviation: few samples in the first cells would not carry it.
REACH_ON_THE_WAY, MOST_SKEWED, SKEWED_BY_WIDTH = 3.5, 1.0, 0.25
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
    reach = min(whole - 1, math.ceil(REACH * math.sqrt(rest)))
    if rest >= LEAST_SAMPLED and reach >= LEAST_REACH * math.sqrt(rest):
        third = THIRD * rest * rest / transit
        return whole - reach, samples(part, rest, third, reach, True), rest
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
def samples(middle, variance, third, reach, all_three):
    """Samples of a gamma distribution so wide that they have its moments though they end.

    Parameters
    ----------
    middle : float
        Mean, from the sample `reach` on [steps].
    variance, third : float
        Second and third cumulant [steps^2, steps^3].
    reach : int
        Samples on either side.
    all_three : bool
        Whether they have the third as well, else about that.

    Returns
    -------
    ndarray, shape (2 reach + 2,)
    """
    weights, wide, place, skewed = np.zeros(2 * reach + 2), math.sqrt(variance), middle, third
    for _ in range(ROUNDS):
        skewness = skewed / (wide * wide * wide)
        for k in range(2 * reach + 2):
            z = (k - reach - place) / wide
            weights[k] = 0.0
            if skewness < LEAST_SKEWNESS:
                weights[k] = exp(-0.5 * z * z)
            elif 1.0 + 0.5 * skewness * z > 0.0:
                inner = log(1.0 + 0.5 * skewness * z)
                weights[k] = exp((4.0 / (skewness * skewness) - 1.0) * inner - 2.0 * z / skewness)
        _scaled(weights)
        mean = lost = 0.0
        for k in range(2 * reach + 2):
            mean, lost = add(mean, lost, weights[k] * (k - reach))
        mean += lost
        moment = cube = lost = rest = 0.0
        for k in range(2 * reach + 2):
            off = k - reach - mean
            moment, lost = add(moment, lost, weights[k] * (off * off))
            cube, rest = add(cube, rest, weights[k] * (off * off * off))
        place += middle - mean
        wide *= math.sqrt(variance / (moment + lost))
        if all_three:
            skewed += third - (cube + rest)
    return weights


@inlined
def width_of(reach):
    """Weights of a cell: of its reach, in whole lanes."""
    return (2 * reach + 1 + WIDTH) // WIDTH * WIDTH


@preparing
def on_the_way(cells, transit, spread, eta):
    """Weights by which waves are read in each cell: first for velocities, then for stress.

    On its way to a cell a wave has been spread. Stress is that of waves by 1 / sqrt(1 + eta s)
    (docs/numerics.md, eq. 4a), whose cumulants are eta / 2, eta^2 / 2, eta^3.

    Parameters
    ----------
    cells : int
        Of one length, in each of which a wave is read in the middle.
    transit : float
        Time in which a wave crosses them all [steps].
    spread : float
        Variance that a step adds [steps^2].
    eta : float
        Kelvin-Voigt time [steps].

    Returns
    -------
    weights : ndarray
        Of a cell, the newest last, in whole lanes; then of the next; then all anew for stress.
    reach : int
        They are of so many steps after a cell's own, and one more before it. 0: nothing is spread
        nor late, and there are no weights.
    """
    if spread == 0.0 and eta == 0.0:
        return np.zeros(0), 0
    square = 0.5 * eta * eta
    wide = REACH_ON_THE_WAY * math.sqrt(transit * spread + square)
    reach = math.ceil(wide + 0.5 * eta + abs(transit - cells))
    row = width_of(reach)
    weights = np.zeros(2 * cells * row)
    for cell in range(cells):
        steps = (cell + 0.5) * transit / cells
        late, variance = steps - (cell + 0.5), steps * spread
        third = THIRD * variance * spread
        _fill_row(weights, cell * row, reach, late, variance, third)
        late, variance, third = late + 0.5 * eta, variance + square, third + 2.0 * eta * square
        _fill_row(weights, (cells + cell) * row, reach, late, variance, third)
    return weights, reach


@preparing
def _fill_row(weights, at, reach, mean, variance, third):
    """Weights with the first cumulants of how late a wave is [steps, steps^2, steps^3]."""
    here = at + reach + 1
    if variance < LEAST_SAMPLED:
        second = variance + mean * mean
        weights[here - 1], weights[here + 1] = 0.5 * (second + mean), 0.5 * (second - mean)
        weights[here] = 1.0 - second
        return
    skewness = min(MOST_SKEWED, SKEWED_BY_WIDTH * math.sqrt(variance))
    third = min(third, skewness * variance * math.sqrt(variance))
    found = samples(mean, variance, third, reach, False)
    for late in range(-reach, reach + 2):
        weights[here - late] = found[reach + late]


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
