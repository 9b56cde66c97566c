"""Bars of any sections cut into cells of equal transit time, and what follows from steel alone."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from percussion_model.physics.elementary import exp
from percussion_model.physics.kernel import kernel, preparing
from percussion_model.scene.bars import section_mass
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.wave.grid import misfit, section_count, substeps
from percussion_model.solvers.wave.records import Coef

# Share of the loss that acts between interfaces; the rest between cells.
HALF_LOSS = 0.5
# Terms of a series that halves each time: thirty make nine digits.
HALVINGS = 30
# Terms of the series of a front's variance; the largest is a tenth.
HARMONICS = 200
ROWS = len(Coef)


class Grid(NamedTuple):
    """Cells of one bar.

    Attributes
    ----------
    impedance, mass : ndarray, shape (n,)
        Of each cell [N s/m], [kg].
    time_step : float
        Transit time of every cell [s].
    fit : float
        Largest relative error of a section's wave speed.
    """

    impedance: np.ndarray
    mass: np.ndarray
    time_step: float
    fit: float

    @property
    def n(self) -> int:
        """Number of cells."""
        return len(self.mass)


class CutBar(NamedTuple):
    """A bar in cells, none where it is not elastic; arrays are shared and must not be changed.

    Attributes
    ----------
    grid : Grid
    coefficients : ndarray, shape (len(Coef), n + 1)
    kappa : tuple of float
        Viscous numbers of the top and the bottom end cell.
    bound : tuple of float
        Largest strain offset of the top and the bottom end, over sqrt(2 E) [m/J^0.5].
    """

    grid: Grid
    coefficients: np.ndarray
    kappa: tuple[float, float]
    bound: tuple[float, float]


class CutBars(NamedTuple):
    """The bars of a scene in cells of one transit time.

    Attributes
    ----------
    time_step : float
        Transit time of a cell [s].
    substeps : int
        Of the loss operator in a step, 0 without loss.
    front : float
        Share of a step before its closure (`place_of_closure`).
    piston : CutBar
        Without cells where it is rigid or absent.
    bit : CutBar
    """

    time_step: float
    substeps: int
    front: float
    piston: CutBar
    bit: CutBar

    @property
    def both(self) -> tuple[CutBar, ...]:
        """The elastic bars, top to bottom."""
        return (self.piston, self.bit) if self.piston.grid.n else (self.bit,)


@preparing
def cut(sections, time_step):
    """Cut a bar into cells of one transit time.

    Length and mass of each section stay as they are; where its transit time
    is no whole number of steps, the wave speed takes the error.

    Parameters
    ----------
    sections : float array, shape (n, 4)
        As from `section_numbers`.
    time_step : float
        Transit time of a cell [s].

    Returns
    -------
    Grid
    """
    n = 0
    for section in sections:
        n += section_count(section, time_step)
    impedance, mass = np.zeros(n), np.zeros(n)
    end = 0
    for section in sections:
        count, whole = section_count(section, time_step), section_mass(section)
        for i in range(end, end + count):
            impedance[i] = whole / (count * time_step)
            mass[i] = whole / count
        end += count
    return Grid(impedance, mass, time_step, misfit(sections, time_step))


@kernel
def _fill_loss(c, z, part):
    """Fill the viscous numbers of one sub-step, times impedances."""
    n = len(z)
    for i in range(n):
        c[Coef.VISCOUS, i] = part * z[i]
    for i in range(n - 1):
        c[Coef.BETWEEN, i] = part * 2.0 * z[i] * z[i + 1] / (z[i] + z[i + 1])


@preparing
def coefficients(grid, loss_time):
    """Rows of `Coef` for a bar.

    Parameters
    ----------
    grid : Grid
    loss_time : float
        Kelvin-Voigt time [s].

    Returns
    -------
    ndarray, shape (len(Coef), n + 1)
    """
    z, m, dt = grid.impedance, grid.mass, grid.time_step
    n, total = len(m), 0.0
    c = np.zeros((ROWS, n + 1))
    for i in range(1, n):
        both = z[i - 1] + z[i]
        c[Coef.ALPHA, i], c[Coef.BETA, i] = 2.0 * z[i - 1] / both, 2.0 * z[i] / both
        c[Coef.INV_Z, i] = 1.0 / both
    parts = substeps(loss_time, dt)
    if parts > 0 and n > 1:
        _fill_loss(c, z, HALF_LOSS * loss_time / dt / parts)
    for i in range(n):
        total += m[i]
    end = 0.0
    for i in range(n):
        above = end + 0.5 * m[i]
        end += m[i]
        c[Coef.INV_CELL_Z, i], c[Coef.MASS, i] = 1.0 / z[i], m[i]
        c[Coef.BOTTOM, i] = above / total * dt
        c[Coef.TOP, i] = (total - above) / total * dt
        c[Coef.STATIC, i] = 0.5 * above / z[i]
    if parts > 1 and n > 1:
        _fill_response(c, n, parts, 1, c[Coef.FROM_TOP])
        _fill_response(c, n, parts, n - 1, c[Coef.FROM_BOTTOM])
    return c


@preparing
def end_viscosity(c, grid, loss_time):
    """Viscous numbers of the top and the bottom end cell.

    With sub-steps the interface next to the end gives way while the end cell
    pushes; its mean response lowers the number (docs/numerics.md, eq. 9). Where
    one end's force reaches the other end within the step, of which that knows
    nothing, it is lowered further, so that the two never give energy.
    """
    z, n, parts = grid.impedance, len(grid.mass), substeps(loss_time, grid.time_step)
    if parts == 0 or n < 2:
        return 0.0, 0.0
    kappa = HALF_LOSS * loss_time / grid.time_step
    if parts == 1:
        return kappa, kappa
    top, bottom = np.zeros(n + 1), np.zeros(n + 1)
    mean_top = _fill_response(c, n, parts, 1, top)
    mean_bottom = _fill_response(c, n, parts, n - 1, bottom)
    if top[n - 1] > 0.0:
        # reached: the form of the step's loss in both forces must not be negative
        later = _half_step_later(c, n, parts, bottom)
        cross = abs(_pairing(c, n, top, later))
        spare = 1.0 / (kappa * z[n - 1]) + mean_bottom - _pairing(c, n, bottom, later)
        mean_bottom += max(cross - spare, 0.0)
        later = _half_step_later(c, n, parts, top)
        spare = 1.0 / (kappa * z[0]) + mean_top - _pairing(c, n, top, later)
        mean_top += max(cross - spare, 0.0)
    return kappa / (1.0 + kappa * z[0] * mean_top), kappa / (1.0 + kappa * z[n - 1] * mean_bottom)


@kernel
def _pairing(c, n, one, other):
    """Product of two rows of interface velocities, weighted by mass."""
    total = 0.0
    for i in range(1, n):
        total += one[i] * other[i] / (2.0 * c[Coef.INV_Z, i])
    return total


@preparing
def _half_step_later(c, n, parts, v):
    """Solve x + S x = v, where S is a step's sub-steps of diffusion.

    By the series in (1 - S)/2, whose terms fall by half at least.
    """
    total, term, after = np.zeros(n + 1), np.zeros(n + 1), np.zeros(n + 1)
    for i in range(n + 1):
        term[i] = 0.5 * v[i]
    for _ in range(HALVINGS):
        for i in range(n + 1):
            total[i] += term[i]
            after[i] = term[i]
        for _ in range(parts):
            _diffuse(c, n, after)
        for i in range(n + 1):
            term[i] = 0.5 * (term[i] - after[i])
    return total


@kernel
def _diffuse(c, n, v):
    """One explicit sub-step of the loss between interfaces, end cells left out."""
    above = 0.0
    for i in range(1, n):
        below = 0.0
        if i < n - 1:
            below = c[Coef.VISCOUS, i] * (v[i + 1] - v[i])
        v[i] += 2.0 * c[Coef.INV_Z, i] * (below - above)
        above = below


@kernel
def _fill_response(c, n, parts, where, v):
    """Fill the interface velocities after a unit force on one interface over a step.

    Parameters
    ----------
    v : ndarray, shape (n + 1,)
        Zeros, which become the velocities after the last sub-step [m/(N s)].

    Returns
    -------
    float
        Mean of the loaded interface's velocity before each sub-step.
    """
    mean = 0.0
    for _ in range(parts):
        mean += v[where] / parts
        _diffuse(c, n, v)
        v[where] += 2.0 * c[Coef.INV_Z, where] / parts
    return mean


@kernel
def place_of_closure(variance):
    """Where in a step a closure has to come for its front to get the right width.

    Loss spreads a sharp front to a Gaussian; the means over cells then have a larger
    variance than the Gaussian, by the mean of f (1 - f) of what its places leave over
    whole cells. Smoothing from cell to cell, exact for smooth waves, misses that while
    the front is narrower than a cell. A front that begins at the share f of a step
    is averaged over a cell and has f (1 - f) (docs/numerics.md, eqs 14a and 14b).

    Parameters
    ----------
    variance : float
        Of the Gaussian after one transit of the bar [cells squared].

    Returns
    -------
    float
        Share of the step, from 0 without loss to 0.211.
    """
    if variance == 0.0:
        return 0.0
    missing = 0.0
    for order in range(1, HARMONICS + 1):
        turn = math.pi * order
        missing += exp(-2.0 * (turn * turn) * variance) / (turn * turn)
    width = max(1.0 / 6.0 - missing, 0.0)
    return 0.5 * (1.0 - math.sqrt(1.0 - 4.0 * width))


@kernel
def _offset_bound(c, n, row):
    """Factor b in |offset| <= b sqrt(2 E) (docs/numerics.md, eq. 14)."""
    total = 0.0
    for i in range(n):
        total += c[row, i] * c[row, i] / c[Coef.MASS, i]
    return math.sqrt(total)


@preparing
def _cut_bar(sections, time_step, loss_time):
    grid = cut(sections, time_step)
    c, n = coefficients(grid, loss_time), len(grid.mass)
    kappa = end_viscosity(c, grid, loss_time)
    bound = _offset_bound(c, n, Coef.TOP), _offset_bound(c, n, Coef.BOTTOM)
    return CutBar(grid, c, kappa, bound)


@preparing
def cut_both(piston, bit, time_step, loss_time):
    """Cut the bars of a scene.

    Parameters
    ----------
    piston, bit : float array, shape (n, 4)
        Sections; none of a piston that is not elastic.
    time_step : float
        Transit time of a cell [s].
    loss_time : float
        Kelvin-Voigt time [s].

    Returns
    -------
    CutBars
    """
    first, last = _cut_bar(piston, time_step, loss_time), _cut_bar(bit, time_step, loss_time)
    shortest = len(last.grid.mass)
    if len(piston) > 0:
        shortest = min(shortest, len(first.grid.mass))
    front = place_of_closure(loss_time / time_step * shortest)
    return CutBars(time_step, substeps(loss_time, time_step), front, first, last)
