"""Cells that meet a wanted accuracy, by a rule that was calibrated (docs/requested_accuracy.md).

The rule only knows the scene. What it cannot know, such as chatter, shows in the run.
"""

from __future__ import annotations

import math

from percussion_model.scene.bars import bar_transit_time
from percussion_model.scene.numbers import Numbers
from percussion_model.solvers.wave.grid import elastic_bars, fitting_cells

# Relative error of the rate of penetration, and the cells of the bar with the shortest
# transit for which it held with a margin of two or more.
CALIBRATED = ((1e-1, 14), (1e-2, 28), (1e-3, 56), (1e-4, 128))
# Errors of the wave speed act some fivefold on the rate: the share of the wanted
# error that they may be.
FIT_SHARE = 0.1
# How far above the rule's number cells are looked for that fit the lengths.
MOST_REFINED = 2.0
# A run to compare with has between these shares of the cells.
COARSER = (0.5, 0.75)


def asked_cells(numbers: Numbers) -> int:
    """Cells in the first elastic bar that a scene asks for, itself or by an accuracy; or 0."""
    values = numbers.values
    if not math.isnan(values.solver_cells):
        return int(values.solver_cells)
    if not math.isnan(values.solver_accuracy):
        return cells_for(numbers, values.solver_accuracy)[0]
    return 0


def cells_for(
    numbers: Numbers, accuracy: float, fewest: int = 1, most: int | None = None
) -> tuple[int, float]:
    """Cells in the first elastic bar for a wanted accuracy.

    Parameters
    ----------
    numbers : Numbers
        Of a scene with an elastic bit.
    accuracy : float
        Wanted relative error of the rate of penetration.
    fewest, most : int, optional
        Not to be gone below and beyond.

    Returns
    -------
    cells : int
    fit : float
        Relative error of the wave speed.
    """
    bars = elastic_bars(numbers)
    first, bit = bar_transit_time(bars[0]), bar_transit_time(bars[-1])
    least = max(fewest, math.ceil(cells_by_rule(accuracy) * first / min(first, bit) - 1e-9))
    end = math.floor(MOST_REFINED * least)
    if most is not None:
        end = max(least, min(end, most))
    return fitting_cells(bars, least, end, FIT_SHARE * accuracy)


def coarser_cells(numbers: Numbers, cells: int) -> int:
    """Cells of a coarser run that fit the lengths best."""
    low, high = COARSER
    fewest = max(1, math.ceil(low * cells))
    most = max(fewest, math.floor(high * cells))
    return fitting_cells(elastic_bars(numbers), fewest, most, 0.0)[0]


def cells_by_rule(accuracy: float) -> float:
    """Cells of the bar with the shortest transit, a power law between calibrated points."""
    k = 1
    while k < len(CALIBRATED) - 1 and accuracy < CALIBRATED[k][0]:
        k += 1
    (loose, few), (tight, many) = CALIBRATED[k - 1], CALIBRATED[k]
    slope = math.log(many / few) / math.log(loose / tight)
    return few * (loose / accuracy) ** slope
