"""Change on a finer grid: of trajectories where motion is periodic, else of statistics."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.stats import ks_2samp

from percussion_model.scene.rows import SceneError
from percussion_model.simulation.files import plain
from percussion_model.verification.hard_cases.cases import HardCase
from percussion_model.verification.hard_cases.measures import Measures, measure

# Cells or elements are multiplied by this; the finite elements' step goes with them.
FINER = 2
# A rate that changes by no more than this has converged for the purpose of this table.
RATE_WITHIN = 0.02
# Statistics agree within so many standard errors, and where the periods' distributions
# differ no more than chance lets one in a thousand pairs do.
SIGMAS, LEAST_CHANCE = 3.0, 1e-3


@dataclass(frozen=True)
class Refinement:
    """Change on a grid of twice as many cells; NaN where there is nothing to compare."""

    rate_change: float = math.nan  # of the rate of penetration, divided by the finer one
    rate_sigmas: float = math.nan  # the same, in standard errors of both
    # greatest change of the bit's path through the first contact, divided by its length
    path_change: float = math.nan
    # chance of two samples of periods that differ as much (Kolmogorov-Smirnov)
    periods_chance: float = math.nan
    # whether rate (periodic), or rate and periods (aperiodic), stay; None where there is no rate
    converged: bool | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; None where a figure is not defined."""
        found: dict[str, Any] = plain({f"refined_{key}": v for key, v in asdict(self).items()})
        return found


def refine(case: HardCase, found: Measures, share: float = 1.0) -> Refinement:
    """Compare with a run on a finer grid; rigid bodies have none and are exact."""
    if found.solver == "rigid" or found.error:
        return Refinement()
    grid = {"solver.cells": FINER * found.cells}
    if found.solver == "fem":
        grid = {"fem.elements": FINER * case.scene.fem.elements}
    try:
        fine = measure(case, found.solver, share, again=False, **grid)
    except SceneError:  # loss that finer waves cannot have: there is nothing to compare with
        return Refinement()
    return _compare(case, found, fine)


def _compare(case: HardCase, coarse: Measures, fine: Measures) -> Refinement:
    """Differences of a run and of a finer one."""
    change = coarse.rate - fine.rate
    error = math.hypot(coarse.rate_error, fine.rate_error)
    relative = abs(change / fine.rate) if fine.rate else math.nan
    sigmas = abs(change) / error if error > 0.0 else math.nan
    chance = math.nan
    if min(len(coarse.periods), len(fine.periods)) > 2:
        chance = float(ks_2samp(coarse.periods, fine.periods, method="asymp").pvalue)
    converged = None
    if not math.isnan(change):
        converged = relative <= RATE_WITHIN or sigmas <= SIGMAS or change == 0.0
        if case.aperiodic:
            converged = converged and not chance < LEAST_CHANCE
    return Refinement(relative, sigmas, _path_change(coarse, fine), chance, converged)


def _path_change(coarse: Measures, fine: Measures) -> float:
    one, other = np.array(coarse.path), np.array(fine.path)
    if len(one) != len(other) or not len(one):
        return math.nan
    length = float(np.abs(other).max())
    return float(np.abs(one - other).max()) / length if length > 0.0 else math.nan
