"""Cells of equal transit time for bars of any sections, and their coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from percussion_model.scene.parameters import Bar, Section
from percussion_model.solvers.wave.records import Coef

# Cells in the piston (or the only elastic bar) where the scene names none.
DEFAULT_CELLS = 20
# A section's transit time may be off by this much before finer grids are tried.
WANTED_FIT = 2e-3
# Finer grids are tried up to this multiple of the wanted number of cells.
MOST_REFINED = 2.0
# Share of the loss that acts between interfaces; the rest between cells.
HALF_LOSS = 0.5
# Terms of a series that halves each time: thirty make nine digits.
HALVINGS = 30
# Explicit loss stays free of overshoot up to this viscous number a sub-step.
MOST_VISCOUS = 0.5


class Cells(Protocol):
    """Cells or elements of one bar."""

    @property
    def mass(self) -> np.ndarray:
        """Mass of each, top to bottom [kg]."""

    @property
    def n(self) -> int:
        """How many there are."""


@dataclass(frozen=True)
class Grid:
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


def section_count(section: Section, time_step: float) -> int:
    """Cells that a section gets."""
    return max(1, round(section.transit_time / time_step))


def cut(bar: Bar, time_step: float) -> Grid:
    """Cut a bar into cells of one transit time.

    Length and mass of each section stay as they are; where its transit time
    is no whole number of steps, the wave speed takes the error.
    """
    impedance: list[float] = []
    mass: list[float] = []
    fit = 0.0
    for section in bar.sections:
        count = section_count(section, time_step)
        fit = max(fit, abs(section.transit_time / (count * time_step) - 1.0))
        impedance += [section.mass / (count * time_step)] * count
        mass += [section.mass / count] * count
    return Grid(np.array(impedance), np.array(mass), time_step, fit)


def cell_at(bar: Bar, grid: Cells, place: float) -> tuple[int, float]:
    """Cell at a place along a bar.

    Parameters
    ----------
    place : float
        From the top of the bar [m].

    Returns
    -------
    cell : int
    area : float
        Cross-section there [m2].
    """
    above = 0.0
    for section in bar.sections:
        if place <= section.length:
            break
        above += section.mass
        place -= section.length
    mass = above + section.mass * min(place / section.length, 1.0)
    cell = int(np.searchsorted(np.cumsum(grid.mass), mass, side="right"))
    return min(cell, grid.n - 1), section.area


def choose_time_step(bars: list[Bar], cells: int | None) -> float:
    """Transit time of a cell that suits all bars.

    Parameters
    ----------
    bars : list of Bar
        The elastic bars; `cells` counts those of the first.
    cells : int or None
        Wanted number. None means `DEFAULT_CELLS` or, where the lengths do not
        fit it, the smallest number above that does better.
    """
    first = bars[0].transit_time
    if cells is not None:
        return first / cells
    most = int(MOST_REFINED * DEFAULT_CELLS)
    return first / fitting_cells(bars, DEFAULT_CELLS, most, WANTED_FIT)[0]


def fitting_cells(bars: Sequence[Bar], fewest: int, most: int, wanted: float) -> tuple[int, float]:
    """Cells in the first bar that suit the lengths of all.

    Parameters
    ----------
    bars : sequence of Bar
        The elastic bars.
    fewest, most : int
        Numbers to choose from.
    wanted : float
        Relative error of the wave speed that is small enough.

    Returns
    -------
    cells : int
        The smallest number that is below `wanted`; failing that, the best.
    fit : float
        Its error.
    """
    first = bars[0].transit_time
    best, best_fit = fewest, np.inf
    for count in range(fewest, most + 1):
        fit = max(cut(bar, first / count).fit for bar in bars)
        if fit < best_fit - 1e-12:
            best, best_fit = count, fit
        if best_fit < wanted:
            break
    return best, best_fit


def substeps(loss_time: float, time_step: float) -> int:
    """Sub-steps of the explicit loss operator; 0 without loss."""
    if loss_time == 0.0:
        return 0
    return max(1, int(np.ceil(loss_time / time_step / MOST_VISCOUS - 1e-12)))


def coefficients(grid: Grid, loss_time: float) -> np.ndarray:
    """Rows of `Coef` for a bar.

    Returns
    -------
    ndarray, shape (len(Coef), n + 1)
    """
    n = grid.n
    z, m, dt = grid.impedance, grid.mass, grid.time_step
    c = np.zeros((len(Coef), n + 1))
    c[Coef.ALPHA, 1:n] = 2.0 * z[:-1] / (z[:-1] + z[1:])
    c[Coef.BETA, 1:n] = 2.0 * z[1:] / (z[:-1] + z[1:])
    c[Coef.INV_Z, 1:n] = 1.0 / (z[:-1] + z[1:])
    parts = substeps(loss_time, dt)
    if parts and n > 1:
        part = HALF_LOSS * loss_time / dt / parts
        c[Coef.VISCOUS, :n] = part * z
        c[Coef.BETWEEN, : n - 1] = part * 2.0 * z[:-1] * z[1:] / (z[:-1] + z[1:])
    c[Coef.INV_CELL_Z, :n] = 1.0 / z
    c[Coef.MASS, :n] = m
    above = np.concatenate([[0.0], np.cumsum(m)[:-1]]) + 0.5 * m
    total = m.sum()
    c[Coef.BOTTOM, :n] = above / total * dt
    c[Coef.TOP, :n] = (total - above) / total * dt
    c[Coef.STATIC, :n] = 0.5 * above / z
    if parts > 1 and n > 1:
        c[Coef.FROM_TOP], _ = _response(c, n, parts, 1)
        c[Coef.FROM_BOTTOM], _ = _response(c, n, parts, n - 1)
    return c


def end_viscosity(c: np.ndarray, grid: Grid, loss_time: float) -> tuple[float, float]:
    """Viscous numbers of the top and the bottom end cell.

    With sub-steps the interface next to the end gives way while the end cell
    pushes; its mean response lowers the number (docs/numerics.md, eq. 9). Where
    one end's force reaches the other end within the step, of which that knows
    nothing, it is lowered further, so that the two never give energy.
    """
    parts = substeps(loss_time, grid.time_step)
    if parts == 0 or grid.n < 2:
        return 0.0, 0.0
    kappa = HALF_LOSS * loss_time / grid.time_step
    if parts == 1:
        return kappa, kappa
    top, mean_top = _response(c, grid.n, parts, 1)
    bottom, mean_bottom = _response(c, grid.n, parts, grid.n - 1)
    z = grid.impedance
    if top[-2] > 0.0:
        # reached: the form of the step's loss in both forces must not be negative
        later = _half_later(c, grid.n, parts, bottom)
        cross = abs(_pairing(c, grid.n, top, later))
        spare = 1.0 / (kappa * z[-1]) + mean_bottom - _pairing(c, grid.n, bottom, later)
        mean_bottom += max(cross - spare, 0.0)
        later = _half_later(c, grid.n, parts, top)
        spare = 1.0 / (kappa * z[0]) + mean_top - _pairing(c, grid.n, top, later)
        mean_top += max(cross - spare, 0.0)
    return kappa / (1.0 + kappa * z[0] * mean_top), kappa / (1.0 + kappa * z[-1] * mean_bottom)


def _pairing(c: np.ndarray, n: int, one: np.ndarray, other: np.ndarray) -> float:
    """Product of two rows of interface velocities, weighted by mass."""
    return float(np.sum(one[1:n] * other[1:n] / (2.0 * c[Coef.INV_Z, 1:n])))


def _half_later(c: np.ndarray, n: int, parts: int, v: np.ndarray) -> np.ndarray:
    """Solve x + S x = v, where S is a step's sub-steps of diffusion.

    By the series in (1 - S)/2, whose terms fall by half at least.
    """
    total = np.zeros_like(v)
    term = 0.5 * v
    for _ in range(HALVINGS):
        total += term
        after = term.copy()
        for _ in range(parts):
            _diffuse(c, n, after)
        term = 0.5 * (term - after)
    return total


def _diffuse(c: np.ndarray, n: int, v: np.ndarray) -> None:
    """One explicit sub-step of the loss between interfaces, end cells left out."""
    flow = c[Coef.VISCOUS, 1 : n - 1] * np.diff(v[1:n])
    force = np.zeros(n + 1)
    force[1 : n - 1] += flow
    force[2:n] -= flow
    v[1:n] += 2.0 * c[Coef.INV_Z, 1:n] * force[1:n]


def _response(c: np.ndarray, n: int, parts: int, where: int) -> tuple[np.ndarray, float]:
    """Interface velocities after a unit force on one interface over a step.

    Returns
    -------
    end : ndarray, shape (n + 1,)
        Velocities after the last sub-step [m/(N s)].
    mean : float
        Mean of the loaded interface's velocity before each sub-step.
    """
    v = np.zeros(n + 1)
    mean = 0.0
    for _ in range(parts):
        mean += v[where] / parts
        _diffuse(c, n, v)
        v[where] += 2.0 * c[Coef.INV_Z, where] / parts
    return v, mean
