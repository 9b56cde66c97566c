"""Cells of equal transit time for bars of any sections: how many, and where they lie."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from percussion_model.physics.records import Piston
from percussion_model.scene.bars import (
    bar_transit_time,
    section_transit_time,
)
from percussion_model.scene.numbers import Numbers
from percussion_model.scene.rows import SceneError
from percussion_model.solvers.setup import (
    MOST_CELLS,
    PISTONS,
    Bit,
    elastic_piston,
    elastic_times,
    kelvin_voigt_time,
    refuse_many,
)

# Cells in the piston (or the only elastic bar) where the scene names none.
DEFAULT_CELLS = 20
# A section's transit time may be off by this much before finer grids are tried.
WANTED_FIT = 2e-3
# Finer grids are tried up to this multiple of the wanted number of cells.
MOST_REFINED = 2.0
# Cells times sub-steps: a step takes some ten milliseconds then, the set-up a second.
MOST_WORK = 5e6
WORK = (
    "{cells} cells, each with {parts} sub-steps of the loss: the product must be at most "
    f"{MOST_WORK:.3g}: lower solver.cells or loss.time"
)
# Explicit loss stays free of overshoot up to this viscous number a sub-step.
MOST_VISCOUS = 0.5


class Refused(IntEnum):
    """Why bars cannot be cut into cells."""

    NOT = 0
    CELLS = 1  # too many
    WORK = 2  # too many, each with so many sub-steps of the loss


class Wish(NamedTuple):
    """Size of a grid that a scene asks for, and whether it is refused.

    Attributes
    ----------
    refused : int
        A `Refused`.
    cells : float
        Of all bars, about.
    parts : float
        Sub-steps of the loss in each, about.
    """

    refused: int
    cells: float
    parts: float


def section_count(section: np.ndarray, time_step: float) -> int:
    """Cells that a section gets."""
    return max(1, round(section_transit_time(section) / time_step))


def section_misfit(section: np.ndarray, time_step: float) -> float:
    """Relative error of a section's wave speed in cells of one transit time, signed."""
    cells = section_count(section, time_step) * time_step
    return section_transit_time(section) / cells - 1.0


def section_misfits(sections: np.ndarray, time_step: float) -> list[float]:
    """Relative error of each section's wave speed, signed."""
    return [section_misfit(section, time_step) for section in sections]


def misfit(sections: np.ndarray, time_step: float) -> float:
    """Largest relative error of a section's wave speed; 0 for no sections."""
    worst = 0.0
    for section in sections:
        worst = max(worst, abs(section_misfit(section, time_step)))
    return worst


def elastic_bars(numbers: Numbers) -> list[np.ndarray]:
    """Sections of the bars that get cells, the one first whose cells are counted."""
    if numbers.values.bit_model != Bit.ELASTIC:
        return []
    if PISTONS[numbers.values.piston_model] == Piston.ELASTIC:
        return [numbers.piston, numbers.bit]
    return [numbers.bit]


def choose_time_step(numbers: Numbers, cells: int) -> float:
    """Transit time of a cell that suits all bars.

    Parameters
    ----------
    numbers : Numbers
        Of a scene with an elastic bit.
    cells : int
        Wanted number in the first elastic bar. 0 means `DEFAULT_CELLS` or, where the
        lengths do not fit it, the smallest number above that does better.
    """
    if cells == 0:
        most = int(MOST_REFINED * DEFAULT_CELLS)
        cells = fitting_cells(numbers, DEFAULT_CELLS, most, WANTED_FIT)[0]
    return elastic_times(numbers)[0] / cells


def fitting_cells(numbers: Numbers, fewest: int, most: int, wanted: float) -> tuple[int, float]:
    """Cells in the first elastic bar that suit the lengths of all.

    Parameters
    ----------
    numbers : Numbers
        Of a scene with an elastic bit.
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
    first, piston = elastic_times(numbers)[0], elastic_piston(numbers)
    best, best_fit = fewest, math.inf
    for count in range(fewest, most + 1):
        time_step = first / count
        fit = max(misfit(piston, time_step), misfit(numbers.bit, time_step))
        if fit < best_fit - 1e-12:
            best, best_fit = count, fit
        if best_fit < wanted:
            break
    return best, best_fit


def wish_for(numbers: Numbers, time_step: float) -> Wish:
    """Size of the grid with cells of a transit time, refused where it cannot be set up."""
    count = 0.0
    for bar in (elastic_piston(numbers), numbers.bit):
        count += max(bar_transit_time(bar) / time_step, float(len(bar)))
    parts = max(1.0, kelvin_voigt_time(numbers) / time_step / MOST_VISCOUS)
    if not count <= MOST_CELLS:
        return Wish(Refused.CELLS.value, count, parts)
    if count * parts > MOST_WORK:
        return Wish(Refused.WORK.value, count, parts)
    return Wish(Refused.NOT.value, count, parts)


def refuse(wish: Wish) -> None:
    """Raise `SceneError` for more cells than can be set up, or more work in a step."""
    if wish.refused == Refused.CELLS:
        refuse_many("cells", wish.cells)
    if wish.refused == Refused.WORK:
        raise SceneError(WORK.format(cells=f"{wish.cells:.3g}", parts=f"{wish.parts:.3g}"))


def substeps(loss_time: float, time_step: float) -> int:
    """Sub-steps of the explicit loss operator; 0 without loss."""
    if loss_time == 0.0:
        return 0
    return max(1, math.ceil(loss_time / time_step / MOST_VISCOUS - 1e-12))
