"""Cells that meet a wanted accuracy, by a rule that was calibrated (docs/data/stated_errors.md).

The rule only knows the scene. What it cannot know, such as chatter, shows in the run.
"""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.elementary import exp, log
from percussion_model.scene.bars import bar_transit_time
from percussion_model.scene.numbers import Numbers
from percussion_model.solvers.setup import MOST_CELLS, elastic_piston, elastic_times, refuse_many
from percussion_model.solvers.wave.grid import (
    Refused,
    Wish,
    elastic_bars,
    fitting_cells,
    section_misfits,
)

# Relative error of the rate of penetration, and the cells of the bar with the shortest
# transit for which it held with a margin of two or more.
CALIBRATED = ((1e-1, 14), (2e-2, 20), (1e-2, 28), (1e-3, 56), (1e-4, 128))
LOGARITHMS = tuple((-math.log(error), math.log(cells)) for error, cells in CALIBRATED)
# Errors of the wave speed act some fivefold on the rate, up to fortyfold in some scenes:
# the share of the wanted error that they may be at first.
FIT_SHARE = 0.1
# How far above the rule's number cells are looked for that fit the lengths.
MOST_REFINED = 2.0
# Runs to compare with have between these shares of the cells.
COARSER = (0.5, 0.75)
# A finer run has between these multiples of the cells.
FINER = (1.4, 2.8)
# Below this error of the wave speed lengths fit.
FITS = 1e-6


def asked_cells(numbers: Numbers) -> int:
    """Cells in the first elastic bar that a scene asks for, itself or by an accuracy; or 0."""
    values = numbers.values
    if not math.isnan(values.solver_cells):
        return int(values.solver_cells)
    if not math.isnan(values.solver_accuracy):
        return cells_that_fit(numbers, values.solver_accuracy)[0]
    return 0


def asked_wish(numbers: Numbers) -> Wish:
    """Size of the grid that an accuracy asks for, refused where none is to be looked for."""
    values, count = numbers.values, 0.0
    if math.isnan(values.solver_cells) and not math.isnan(values.solver_accuracy):
        count = cells_to_fit(numbers, values.solver_accuracy)
    many = not count <= MOST_CELLS
    return Wish(Refused.CELLS.value if many else Refused.NOT.value, count, 1.0)


def in_first_bar(numbers: Numbers, count: float) -> int:
    """Cells or modes in the first elastic bar where that of the shortest transit has so many."""
    first, shortest = elastic_times(numbers)
    return math.ceil(count * first / shortest - 1e-9)


def cells_to_fit(numbers: Numbers, accuracy: float) -> float:
    """Cells of all sections where each has as many as the first elastic bar is to have."""
    least = in_first_bar(numbers, cells_by_rule(accuracy))
    return float(least) * (len(elastic_piston(numbers)) + len(numbers.bit))


def cells_that_fit(numbers: Numbers, accuracy: float) -> tuple[int, float]:
    """As `cells_for`, where `cells_to_fit` are not too many."""
    least = in_first_bar(numbers, cells_by_rule(accuracy))
    return fitting_cells(numbers, least, math.floor(MOST_REFINED * least), FIT_SHARE * accuracy)


def cells_for(numbers: Numbers, accuracy: float) -> tuple[int, float]:
    """Cells in the first elastic bar for a wanted accuracy.

    Parameters
    ----------
    numbers : Numbers
        Of a scene with an elastic bit.
    accuracy : float
        Wanted relative error of the rate of penetration.

    Returns
    -------
    cells : int
    fit : float
        Relative error of the wave speed.
    """
    refuse_many("cells", cells_to_fit(numbers, accuracy))
    return cells_that_fit(numbers, accuracy)


def coarser_cells(numbers: Numbers, cells: int) -> list[int]:
    """Cells of the coarser runs that a run is compared with, the best last.

    One where the lengths fit; else two, if there are such, whose wave speeds are off to
    either side. None at all below a single cell.
    """
    low, high = math.ceil(COARSER[0] * cells), math.floor(COARSER[1] * cells)
    counts = range(low, min(max(low, high) + 1, cells))
    if not counts:
        return []
    found = {count: misfits(numbers, count) for count in counts}
    # of equals the finer, which costs more but is nearer
    ranked = sorted(counts, key=lambda count: (largest_misfit(found[count]), -count))
    best = ranked[0]
    if largest_misfit(found[best]) <= FITS:
        return [best]
    side = np.sum(found[best])
    across = [count for count in ranked if np.sum(found[count]) * side < 0.0]
    return [*across[:1], best]


def finer_cells(numbers: Numbers, cells: int, wanted_fit: float, most: int) -> int | None:
    """Cells of a finer run with another misfit, or None where `most` are too few.

    The fewest whose wave speed is off by less than `wanted_fit`; failing that, the best.
    """
    fewest, end = math.ceil(FINER[0] * cells), min(math.floor(FINER[1] * cells), most)
    if fewest > end:
        return None
    here = misfits(numbers, cells)
    sizes = {}
    for count in range(fewest, end + 1):
        there = misfits(numbers, count)
        if largest_misfit(here) <= FITS or largest_misfit(there - here) > 0.5 * largest_misfit(
            here
        ):
            sizes[count] = largest_misfit(there)
    if not sizes:
        return None
    return next(
        (count for count in sizes if sizes[count] <= max(wanted_fit, FITS)),
        min(sizes, key=lambda count: sizes[count]),
    )


def misfits(numbers: Numbers, cells: int) -> np.ndarray:
    """Relative error of the wave speed in each section, with its sign.

    Parameters
    ----------
    numbers : Numbers
        Of a scene with an elastic bit.
    cells : int
        In the first elastic bar.
    """
    bars = elastic_bars(numbers)
    step = bar_transit_time(bars[0]) / cells
    return np.array([error for bar in bars for error in section_misfits(bar, step)])


def largest_misfit(misfit: np.ndarray) -> float:
    """Largest misfit of a section."""
    return float(np.max(np.abs(misfit), initial=0.0))


def promised_error(numbers: Numbers, cells: int) -> float:
    """Relative error of the rate that the rule expects of cells in the first elastic bar."""
    first, shortest = elastic_times(numbers)
    errors, counts = np.array(LOGARITHMS).T
    return math.exp(-np.interp(math.log(cells * shortest / first), counts, errors))


def cells_by_rule(accuracy: float) -> float:
    """Cells of the bar with the shortest transit, a power law between calibrated points."""
    wanted = -log(accuracy)
    for k in range(len(LOGARITHMS) - 1):
        (error, count), (next_error, next_count) = LOGARITHMS[k], LOGARITHMS[k + 1]
        if wanted <= next_error:
            slope = (next_count - count) / (next_error - error)
            return exp(slope * max(0.0, wanted - error) + count)
    return exp(LOGARITHMS[-1][1])
