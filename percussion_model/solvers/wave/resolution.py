"""Cells that meet a wanted accuracy, by a rule that was calibrated (docs/requested_accuracy.md).

The rule only knows the scene. What it cannot know, such as chatter, shows in the run.
"""

from __future__ import annotations

import math
from itertools import pairwise

from percussion_model.scene.scene import Scene
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


def asked_cells(scene: Scene) -> int | None:
    """Cells in the first elastic bar for the accuracy that a scene asks for, if it asks."""
    if scene.solver.accuracy is None:
        return None
    return cells_for(scene, scene.solver.accuracy)[0]


def cells_for(
    scene: Scene, accuracy: float, fewest: int = 1, most: int | None = None
) -> tuple[int, float]:
    """Cells in the first elastic bar for a wanted accuracy.

    Parameters
    ----------
    scene : Scene
        With an elastic bit.
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
    bars = elastic_bars(scene)
    shortest = min(bar.transit_time for bar in bars)
    first = bars[0].transit_time
    least = max(fewest, math.ceil(cells_by_rule(accuracy) * first / shortest - 1e-9))
    end = math.floor(MOST_REFINED * least)
    end = end if most is None else max(least, min(end, most))
    return fitting_cells(bars, least, end, FIT_SHARE * accuracy)


def coarser_cells(scene: Scene, cells: int) -> int:
    """Cells of a coarser run that fit the lengths best."""
    low, high = COARSER
    fewest = max(1, math.ceil(low * cells))
    most = max(fewest, math.floor(high * cells))
    return fitting_cells(elastic_bars(scene), fewest, most, 0.0)[0]


def cells_by_rule(accuracy: float) -> float:
    """Cells of the bar with the shortest transit, a power law between calibrated points."""
    points = list(pairwise(CALIBRATED))
    (loose, few), (tight, many) = next(
        (pair for pair in points if accuracy >= pair[1][0]), points[-1]
    )
    slope = math.log(many / few) / math.log(loose / tight)
    return few * (loose / accuracy) ** slope
