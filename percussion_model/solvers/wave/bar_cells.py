"""Bars cut into cells, with what the wave solver derives from steel alone.

Scenes on other rock, with another feed or drive, share it: a study makes it once.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np

from percussion_model.scene.parameters import Bar
from percussion_model.scene.scene import Scene
from percussion_model.solvers.wave.grid import (
    Grid,
    choose_time_step,
    coefficients,
    cut,
    end_viscosity,
)
from percussion_model.solvers.wave.records import Coef
from percussion_model.solvers.wave.resolution import asked_cells, elastic_bars

# Bars of so many scenes are kept [some ten kB each on the default grid].
MOST_KEPT = 16


@dataclass(frozen=True)
class CutBar:
    """An elastic bar in cells; arrays are shared and must not be changed.

    Attributes
    ----------
    grid : Grid
    coefficients : ndarray, shape (len(Coef), n + 1)
    transit_time : float
        Of the whole bar [s].
    kappa : tuple of float
        Viscous numbers of the top and the bottom end cell.
    bound : tuple of float
        Largest strain offset of the top and the bottom end, over sqrt(2 E) [m/J^0.5].
    """

    grid: Grid
    coefficients: np.ndarray
    transit_time: float
    kappa: tuple[float, float]
    bound: tuple[float, float]


@dataclass(frozen=True, eq=False)
class CutBars:
    """The bars of a scene in cells of one transit time; equal if the same object.

    Attributes
    ----------
    time_step : float
        Transit time of a cell [s].
    loss_time : float
        Kelvin-Voigt time [s], 0 without loss.
    piston : CutBar or None
        None where it is rigid or absent.
    bit : CutBar
    """

    time_step: float
    loss_time: float
    piston: CutBar | None
    bit: CutBar

    @property
    def both(self) -> tuple[CutBar, ...]:
        """The elastic bars, top to bottom."""
        return (self.bit,) if self.piston is None else (self.piston, self.bit)


_kept: dict[tuple, CutBars] = {}
_lock = threading.Lock()


def cut_bars(scene: Scene) -> CutBars:
    """Cut the elastic bars of a scene, or find them cut."""
    bars = elastic_bars(scene)
    cells = scene.solver.cells or asked_cells(scene)
    loss_time = scene.loss.time if scene.loss_on else 0.0
    sections = [tuple((part.transit_time, part.mass) for part in bar.sections) for bar in bars]
    key = (cells, loss_time, *sections)
    with _lock:  # hosts may make instances in threads
        found = _kept.get(key)
        if found is None:
            while len(_kept) >= MOST_KEPT:
                del _kept[next(iter(_kept))]
            time_step = choose_time_step(bars, cells)
            *above, bit = [_cut_bar(bar, time_step, loss_time) for bar in bars]
            found = CutBars(time_step, loss_time, above[0] if above else None, bit)
            _kept[key] = found
    return found


def _cut_bar(bar: Bar, time_step: float, loss_time: float) -> CutBar:
    grid = cut(bar, time_step)
    c = coefficients(grid, loss_time)
    kappa = end_viscosity(c, grid, loss_time)
    bound = _offset_bound(c, grid, Coef.TOP), _offset_bound(c, grid, Coef.BOTTOM)
    return CutBar(grid, c, bar.transit_time, kappa, bound)


def _offset_bound(c: np.ndarray, grid: Grid, row: Coef) -> float:
    """Factor b in |offset| <= b sqrt(2 E) (docs/numerics.md, eq. 14)."""
    n = grid.n
    return float(np.sqrt(np.sum(c[row, :n] * c[row, :n] / c[Coef.MASS, :n])))
