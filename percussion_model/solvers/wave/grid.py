"""Bars of any sections cut into cells of equal transit time, and what follows from steel alone."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from percussion_model.physics.records import Piston
from percussion_model.scene.bars import (
    AREA,
    LENGTH,
    bar_transit_time,
    section_mass,
    section_transit_time,
)
from percussion_model.scene.numbers import Numbers
from percussion_model.scene.rows import SceneError
from percussion_model.solvers.base import Cells
from percussion_model.solvers.setup import PISTONS, Bit, kelvin_voigt_time, refuse_many
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
# Terms of the series of a front's variance; the largest is a tenth.
HARMONICS = 200
# Bars of so many scenes are kept [some ten kB each on the default grid].
MOST_KEPT = 16
# Cells times sub-steps: a step takes some ten milliseconds then, the set-up a second.
MOST_WORK = 5e6
# Explicit loss stays free of overshoot up to this viscous number a sub-step.
MOST_VISCOUS = 0.5


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


def section_count(section: np.ndarray, time_step: float) -> int:
    """Cells that a section gets."""
    return max(1, round(section_transit_time(section) / time_step))


def cut(sections: np.ndarray, time_step: float) -> Grid:
    """Cut a bar into cells of one transit time.

    Length and mass of each section stay as they are; where its transit time
    is no whole number of steps, the wave speed takes the error.

    Parameters
    ----------
    sections : float array, shape (n, 4)
        As from `section_numbers`.
    time_step : float
        Transit time of a cell [s].
    """
    counts = np.zeros(len(sections), np.int64)
    impedance, mass = np.zeros(len(sections)), np.zeros(len(sections))
    for k, section in enumerate(sections):
        count = section_count(section, time_step)
        counts[k] = count
        impedance[k] = section_mass(section) / (count * time_step)
        mass[k] = section_mass(section) / count
    return Grid(
        np.repeat(impedance, counts),
        np.repeat(mass, counts),
        time_step,
        misfit(sections, time_step),
    )


def section_misfits(sections: np.ndarray, time_step: float) -> list[float]:
    """Relative error of each section's wave speed in cells of one transit time, signed."""
    found = []
    for section in sections:
        cells = section_count(section, time_step) * time_step
        found.append(section_transit_time(section) / cells - 1.0)
    return found


def misfit(sections: np.ndarray, time_step: float) -> float:
    """Largest relative error of a section's wave speed in cells of one transit time."""
    return max(map(abs, section_misfits(sections, time_step)))


def cell_at(sections: np.ndarray, grid: Cells, place: float) -> tuple[int, float]:
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
    for section in sections:
        if place <= section[LENGTH]:
            break
        above += section_mass(section)
        place -= section[LENGTH]
    mass = above + section_mass(section) * min(place / section[LENGTH], 1.0)
    cell = int(np.searchsorted(np.cumsum(grid.mass), mass, side="right"))
    return min(cell, grid.n - 1), float(section[AREA])


def elastic_bars(numbers: Numbers) -> list[np.ndarray]:
    """Sections of the bars that get cells, the one first whose cells are counted."""
    if numbers.values.bit_model != Bit.ELASTIC:
        return []
    if PISTONS[numbers.values.piston_model] == Piston.ELASTIC:
        return [numbers.piston, numbers.bit]
    return [numbers.bit]


def choose_time_step(bars: Sequence[np.ndarray], cells: int) -> float:
    """Transit time of a cell that suits all bars.

    Parameters
    ----------
    bars : sequence of float array
        Sections of the elastic bars; `cells` counts those of the first.
    cells : int
        Wanted number. 0 means `DEFAULT_CELLS` or, where the lengths do not
        fit it, the smallest number above that does better.
    """
    if not cells:
        most = int(MOST_REFINED * DEFAULT_CELLS)
        cells = fitting_cells(bars, DEFAULT_CELLS, most, WANTED_FIT)[0]
    return bar_transit_time(bars[0]) / cells


def fitting_cells(
    bars: Sequence[np.ndarray], fewest: int, most: int, wanted: float
) -> tuple[int, float]:
    """Cells in the first bar that suit the lengths of all.

    Parameters
    ----------
    bars : sequence of float array
        Sections of the elastic bars.
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
    first = bar_transit_time(bars[0])
    best, best_fit = fewest, np.inf
    for count in range(fewest, most + 1):
        fit = max([misfit(bar, first / count) for bar in bars])
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
        later = _half_step_later(c, grid.n, parts, bottom)
        cross = abs(_pairing(c, grid.n, top, later))
        spare = 1.0 / (kappa * z[-1]) + mean_bottom - _pairing(c, grid.n, bottom, later)
        mean_bottom += max(cross - spare, 0.0)
        later = _half_step_later(c, grid.n, parts, top)
        spare = 1.0 / (kappa * z[0]) + mean_top - _pairing(c, grid.n, top, later)
        mean_top += max(cross - spare, 0.0)
    return kappa / (1.0 + kappa * z[0] * mean_top), kappa / (1.0 + kappa * z[-1] * mean_bottom)


def _pairing(c: np.ndarray, n: int, one: np.ndarray, other: np.ndarray) -> float:
    """Product of two rows of interface velocities, weighted by mass."""
    return float(np.sum(one[1:n] * other[1:n] / (2.0 * c[Coef.INV_Z, 1:n])))


def _half_step_later(c: np.ndarray, n: int, parts: int, v: np.ndarray) -> np.ndarray:
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


def place_of_closure(variance: float) -> float:
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
    order = np.arange(1, HARMONICS + 1)
    missing = np.exp(-2.0 * np.pi**2 * order**2 * variance) / (np.pi * order) ** 2
    width = max(1.0 / 6.0 - missing.sum(), 0.0)
    return 0.0 if variance == 0.0 else float(0.5 * (1.0 - np.sqrt(1.0 - 4.0 * width)))


def refuse_cells(bars: Sequence[np.ndarray], time_step: float, loss_time: float) -> None:
    """Raise `SceneError` for more cells than can be set up, or more work in a step."""
    count = sum(max(bar_transit_time(bar) / time_step, len(bar)) for bar in bars)
    refuse_many("cells", count)
    work = count * max(1.0, loss_time / time_step / MOST_VISCOUS)
    if work > MOST_WORK:
        raise SceneError(
            f"{count:.3g} cells, each with {work / count:.3g} sub-steps of the loss: the product "
            f"must be at most {MOST_WORK:.3g}: lower solver.cells or loss.time"
        )


class CutBar(NamedTuple):
    """An elastic bar in cells; arrays are shared and must not be changed.

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
    piston : CutBar or None
        None where it is rigid or absent.
    bit : CutBar
    """

    time_step: float
    substeps: int
    front: float
    piston: CutBar | None
    bit: CutBar

    @property
    def both(self) -> tuple[CutBar, ...]:
        """The elastic bars, top to bottom."""
        return (self.bit,) if self.piston is None else (self.piston, self.bit)


def cut_bars(numbers: Numbers, cells: int) -> CutBars:
    """Cut the elastic bars of a scene, or find them cut.

    Parameters
    ----------
    cells : int
        As for `choose_time_step`.
    """
    sections = [bar.tobytes() for bar in elastic_bars(numbers)]
    return _cut_bars(cells, kelvin_voigt_time(numbers), *sections)


@lru_cache(MOST_KEPT)
def _cut_bars(cells: int, loss_time: float, *sections: bytes) -> CutBars:
    bars = [np.frombuffer(one).reshape(-1, 4) for one in sections]
    time_step = choose_time_step(bars, cells)
    refuse_cells(bars, time_step, loss_time)
    found = [_cut_bar(bar, time_step, loss_time) for bar in bars]
    shortest = min([bar.grid.n for bar in found])
    return CutBars(
        time_step,
        substeps(loss_time, time_step),
        place_of_closure(loss_time / time_step * shortest),
        found[0] if len(found) > 1 else None,
        found[-1],
    )


def _cut_bar(sections: np.ndarray, time_step: float, loss_time: float) -> CutBar:
    grid = cut(sections, time_step)
    c = coefficients(grid, loss_time)
    kappa = end_viscosity(c, grid, loss_time)
    bound = _offset_bound(c, grid, Coef.TOP), _offset_bound(c, grid, Coef.BOTTOM)
    return CutBar(grid, c, kappa, bound)


def _offset_bound(c: np.ndarray, grid: Grid, row: Coef) -> float:
    """Factor b in |offset| <= b sqrt(2 E) (docs/numerics.md, eq. 14)."""
    n = grid.n
    return float(np.sqrt(np.sum(c[row, :n] * c[row, :n] / c[Coef.MASS, :n])))
