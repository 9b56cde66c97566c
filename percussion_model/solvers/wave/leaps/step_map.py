"""Linear map of one step in a given configuration, and what it dissipates.

The map is made by the solver's own step, from unit deviations. Its quadratic
forms follow from the same formulas as the ledger of a step
(docs/numerics.md, sections 3, 4 and 5).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from percussion_model.physics.elementary import expm1
from percussion_model.physics.kernel import kernel, preparing
from percussion_model.physics.records import BLOW, EVENT, Mode
from percussion_model.physics.reference import refer
from percussion_model.solvers.wave.cutting import Grid
from percussion_model.solvers.wave.leaps.products import of_pairs
from percussion_model.solvers.wave.records import WAVE_STATE, Bars, Coef, Row
from percussion_model.solvers.wave.step import step

# Unit in which the map counts the penetration while it is made [m].
SCALE = 1e-6
# A barrier that nothing passes, to hold a configuration in standstill [J].
NO_WAY_OUT = 1e300
ROWS, COEFS = len(Row), len(Coef)


class Configuration(NamedTuple):
    """A bar whose step map is wanted: free, or on a spring and dashpot.

    Attributes
    ----------
    par : WAVE_PAR array of length 1
        Of the bar as a bit.
    grid : Grid
    c : ndarray
        Rows of `Coef`.
    stiffness, damping : float
        Under the lower end; 0 where it is free [N/m], [N s/m].
    """

    par: np.ndarray
    grid: Grid
    c: np.ndarray
    stiffness: float = 0.0
    damping: float = 0.0


@kernel
def size_of(bar):
    """Numbers in the state of a `Configuration`."""
    size = 2 * len(bar.grid.mass)
    return size + 1 if bar.stiffness > 0.0 else size


@kernel
def _begin(bar, s):
    """Complete a state of zeros in which only the waves are still to be set."""
    s.mode = Mode.SS if bar.stiffness > 0.0 else Mode.FF
    s.leap_end = -1
    s.live = 1
    s.gamma = s.next_gamma = 1.0
    s.k_r = s.next_k_r = bar.stiffness
    s.c_r = bar.damping
    s.next_c_r = 1.0  # a barrier stands, so that standstill lasts
    s.w_r = s.next_w_r = NO_WAY_OUT


@kernel
def _disturb(s, w, n, k):
    """Set the k-th unit deviation."""
    w[:] = 0.0
    if k < n:
        w[Row.DOWN, k] = 1.0
    elif k < 2 * n:
        w[Row.UP, k - n] = 1.0
    else:
        s.p = SCALE


@kernel
def _make_step(par_, state, bars_, blows, events):
    """Make one step without leaps."""
    par, bars = par_[0], refer(bars_)
    step(par, state[0], bars, par.dt, blows, events)


@preparing
def step_map(bar):
    """What one step makes of each unit deviation.

    Parameters
    ----------
    bar : Configuration

    Returns
    -------
    by_column : ndarray, shape (size, size)
        Row k is the state after a step from the k-th unit deviation: down-going
        waves, up-going waves [m/s] and, on the rock, the penetration [m].
    faces : ndarray, shape (size, n + 1)
        Row k holds the interface velocities that the step had [m/s].
    """
    n, size = len(bar.grid.mass), size_of(bar)
    blows, events = np.zeros(1, BLOW), np.zeros(1, EVENT)
    by_column, faces = np.zeros((size, size)), np.zeros((size, n + 1))
    w = np.zeros((ROWS, n + 1))
    bars = Bars(np.zeros((ROWS, 1)), np.zeros((COEFS, 1)), w, bar.c)
    for k in range(size):
        state = np.zeros(1, WAVE_STATE)
        _begin(bar, state[0])
        _disturb(state[0], w, n, k)
        _make_step(bar.par, state, bars, blows, events)
        unit = 1.0 if k < 2 * n else SCALE
        for i in range(n):
            by_column[k, i] = w[Row.DOWN_OTHER, i] / unit
            by_column[k, n + i] = w[Row.UP_OTHER, i] / unit
        for i in range(n + 1):
            faces[k, i] = w[Row.FACE, i] / unit
        if size > 2 * n:
            by_column[k, size - 1] = state["p"][0] / unit  # a record does not keep its array
    return by_column, faces


@kernel
def _reach(bar):
    """Integrals over a step of the loaded end's velocity and of its square.

    For unit velocity at the start, which then fades with the rate K/(z + C).
    """
    par = bar.par[0]
    if bar.stiffness == 0.0:
        return par.dt, par.dt
    z = par.z_b * (1.0 + par.kappa_b)
    rate = bar.stiffness / (z + bar.damping)
    fade = -expm1(-rate * par.dt)
    return fade / rate, 0.5 * fade * (2.0 - fade) / rate


@kernel
def fill_end_row(bar, by_column, out):
    """Fill the velocity of the loaded end at the start of the step into the first column."""
    last, path = len(by_column) - 1, _reach(bar)[0]
    for k in range(last + 1):
        moved = by_column[k, last] - (1.0 if k == last else 0.0)
        out[k, 0] = moved / path


@kernel
def _fill_before(c, n, before):
    """Fill the inner interface velocities of each unit deviation before any loss [m/s]."""
    for i in range(1, n):
        before[i - 1, i - 1] = c[Coef.ALPHA, i]
        before[n + i, i - 1] = c[Coef.BETA, i]


@kernel
def _settle(c, n, faces, before, settled):
    """Fill the inner interface velocities as one sub-step of the loss leaves them."""
    for k in range(len(faces)):
        for i in range(1, n):
            below = c[Coef.VISCOUS, i] * (faces[k, i + 1] - faces[k, i])
            above = c[Coef.VISCOUS, i - 1] * (faces[k, i] - faces[k, i - 1])
            settled[k, i] = before[k, i - 1] + c[Coef.INV_Z, i] * (below - above)


@kernel
def _fill_pairs_of_faces(c, n, dt, before, settled, one, other):
    """Fill what the interfaces lost, and the velocities that it was lost at."""
    for k in range(len(settled)):
        for i in range(1, n):
            other[k, i - 1] = settled[k, i]
            one[k, i - 1] = -dt * (settled[k, i] - before[k, i - 1]) / c[Coef.INV_Z, i]


@kernel
def _fill_pairs_of_cells(n, mass, by_column, settled, one, other):
    """Fill pairs whose products are the kinetic energy that the loss between cells takes.

    What the interfaces sent, less what had come in from the other side, are the cells before.
    """
    for k in range(len(settled)):
        for i in range(n):
            before = settled[k, i] + settled[k, i + 1]
            if k == i or k == n + i:
                before -= 1.0
            after = by_column[k, i] + by_column[k, n + i]
            one[k, i], other[k, i] = 0.5 * mass[i] * before, before
            one[k, n + i], other[k, n + i] = -0.5 * mass[i] * after, after


@preparing
def _lost_inside(bar, by_column, faces):
    """Form of what a step loses between interfaces and between cells [J]."""
    par, c, n, size = bar.par[0], bar.c, len(bar.grid.mass), len(faces)
    before, settled = np.zeros((size, n - 1)), faces.copy()
    _fill_before(c, n, before)
    if par.loss == 1:  # the step kept them as they were before the loss
        _settle(c, n, faces, before, settled)
    # all pairs side by side: one product sums them
    one, other = np.zeros((size, 3 * n - 1)), np.zeros((size, 3 * n - 1))
    _fill_pairs_of_cells(n, bar.grid.mass, by_column, settled, one, other)
    _fill_pairs_of_faces(c, n, par.dt, before, settled, one[:, 2 * n :], other[:, 2 * n :])
    return of_pairs(one, other)


@kernel
def _add_ends(bar, faces, loss):
    """Add what the end cells lose: what they work against, times their viscous numbers."""
    par, n, last = bar.par[0], len(bar.grid.mass), len(faces) - 1
    dt = par.dt
    path, square = _reach(bar)
    z, viscous = par.z_b * (1.0 + par.kappa_b), par.z_b * par.kappa_b * square
    for i in range(last + 1):
        top, mean = faces[i, 0], faces[i, n]
        end = mean * (dt / path)
        against = (1.0 + par.kappa_t) * top - (2.0 if i == n else 0.0)
        at_top = par.z_t * dt * (par.kappa_t * top - against)
        free = mean
        if bar.stiffness > 0.0:
            free = (1.0 + bar.damping / z) * end
            free += bar.stiffness / z if i == last else 0.0
        against = (1.0 + par.kappa_b) * free - (2.0 if i == n - 1 else 0.0)
        at_bottom = par.z_b * dt * against
        for j in range(last + 1):
            other = faces[j, n]
            loss[i, j] += at_top * faces[j, 0]
            loss[i, j] += viscous * (end * (other * (dt / path))) - at_bottom * other


@preparing
def loss_of_step(bar, by_column, faces):
    """Quadratic form of a step's structural loss, by the formulas of its ledger.

    Parameters
    ----------
    bar : Configuration
    by_column, faces : ndarray
        From `step_map`.

    Returns
    -------
    ndarray, shape (size, size)
        [J]. It need not be symmetric.
    """
    if bar.par[0].loss == 0 or len(bar.grid.mass) < 2:
        return np.zeros((len(faces), len(faces)))
    loss = _lost_inside(bar, by_column, faces)
    _add_ends(bar, faces, loss)
    return loss


@preparing
def square_at_end(bar, faces):
    """Quadratic form of the square of the lower end's velocity at the start of the step.

    Parameters
    ----------
    bar : Configuration
    faces : ndarray
        From `step_map`.

    Returns
    -------
    ndarray, shape (size, size)
        [m2/s2]
    """
    size, n, growth = len(faces), len(bar.grid.mass), bar.par[0].dt / _reach(bar)[0]
    squares = np.zeros((size, size))
    for i in range(size):
        for j in range(size):
            squares[i, j] = (faces[i, n] * growth) * (faces[j, n] * growth)
    return squares
