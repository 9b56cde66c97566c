"""Accuracy control: finer runs until they agree, longer ones where motion is aperiodic.

The evidence for the constants is in docs/requested_accuracy.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene
from percussion_model.simulation.result import LEAST_BLOWS, Result
from percussion_model.solvers.wave.resolution import cells_for, coarser_cells

# Aperiodic motion runs on for at most this multiple of the duration.
LONGEST = 100.0
# A run grows at most by this factor before it is judged again, and a little
# further than the scatter seen so far asks for.
GROWTH, MARGIN = 4.0, 1.1
# The scatter of fewer blows says little, unless it is far below what is wanted.
FEWEST_BLOWS, FAR_BELOW = 10, 0.1

# With more drilling cycles a blow than this the rate jumps from grid to grid, and
# two grids agree by chance: they must do so within this share of what is wanted.
MOST_CYCLES, CHATTER_SHARE = 8.0, 0.5
# What an error of the wave speed does to the rate, by that error.
FIT_EFFECT = 5.0
# Two aperiodic runs differ if they do by more than so many standard errors.
CONFIDENCE = 2.0
# More cells in the first bar are not tried: leaps end there, and a run without
# them takes minutes for a second.
FINEST = 256

# Runs a scene; the second argument: whether for as long as aperiodic motion needs.
RunOnce = Callable[[Scene, bool], Result]


@dataclass(frozen=True)
class Grid:
    """A run at one resolution.

    Attributes
    ----------
    result : Result
    fit_error : float
        What the error of the wave speed may do to the rate, relative to it.
    """

    result: Result
    fit_error: float

    @property
    def rate(self) -> float:
        """Rate of penetration [m/s]."""
        return self.result.rate_of_penetration

    @property
    def scatter(self) -> float:
        """Standard error of the rate [m/s]."""
        return self.result.rate_of_penetration_standard_error


def time_needed(result: Result, accuracy: float) -> float:
    """Time until which a run must last for the wanted standard error [s].

    Standard errors fall with the square root of time. The present time where
    the result is good enough or tells no rate.
    """
    rate, scatter = abs(result.rate_of_penetration), result.rate_of_penetration_standard_error
    if len(result.counted) < LEAST_BLOWS or rate == 0.0:
        return result.duration
    excess = scatter / (accuracy * rate)
    few = len(result.counted) < FEWEST_BLOWS and excess > FAR_BELOW
    if excess <= 1.0 and not few:
        return result.duration
    factor = GROWTH if few else min(MARGIN * excess * excess, GROWTH)
    return result.settle + factor * (result.duration - result.settle)


def run_to_accuracy(scene: Scene, run_once: RunOnce) -> Result:
    """Run a scene so that its rate of penetration has the accuracy that it asks for.

    Parameters
    ----------
    scene : Scene
        With `solver.accuracy`.
    run_once : callable
        Runs a scene; the second argument says whether as long as aperiodic
        motion needs.

    Returns
    -------
    Result
        The finest of the runs, with `rate_of_penetration_relative_error` where
        two of them could be compared. Its times are those of all runs.
    """
    wanted = scene.solver.accuracy
    assert wanted is not None
    if scene.solver_name != "wave":  # rigid bodies move in closed form
        return _finished(scene, [Grid(run_once(scene, True), 0.0)], wanted)
    coarse, cells = planned_cells(scene)[:2]
    grids = [_run(scene, coarse, run_once, extend=False)]
    if grids[0].result.cut_short:
        return _finished(scene, grids, wanted)
    grids.append(_run(scene, cells, run_once))
    if not scene.run.check and _trusted(grids, wanted):
        return _finished(scene, grids, wanted)
    while _useful(grids) and 2 * cells <= FINEST:
        cells = _halved(scene, wanted, cells)
        finer = _run(scene, cells, run_once)
        if finer.result.cut_short:
            note = "interrupted while it was verified: this is the run before"
            grids[-1].result.warnings.append(note)
            break
        grids.append(finer)
        if _verified(grids, wanted):
            break
    return _finished(scene, grids, wanted)


def planned_cells(scene: Scene) -> list[int]:
    """Cells of the runs that a wanted accuracy takes: to compare with, by rule, to verify."""
    wanted = scene.solver.accuracy
    assert wanted is not None
    numbers = numbers_of(scene)
    cells, _ = cells_for(numbers, wanted)
    plan = [coarser_cells(numbers, cells), cells]
    if scene.run.check and 2 * cells <= FINEST:
        plan.append(_halved(scene, wanted, cells))
    return plan


def with_cells(scene: Scene, cells: int) -> Scene:
    """Return the scene with cells in place of a wanted accuracy."""
    return scene.replace(**{"solver.accuracy": None, "run.check": False, "solver.cells": cells})


def _halved(scene: Scene, wanted: float, cells: int) -> int:
    """Cells of a run at half the step that fit the lengths."""
    return cells_for(numbers_of(scene), wanted, fewest=2 * cells, most=FINEST)[0]


def _run(scene: Scene, cells: int, run_once: RunOnce, extend: bool = True) -> Grid:
    result = run_once(with_cells(scene, cells), extend)
    return Grid(result, FIT_EFFECT * result.wave_speed_error)


def _useful(grids: list[Grid]) -> bool:
    """Whether a finer run could tell more."""
    last = grids[-1]
    return not last.result.cut_short and math.isfinite(last.rate) and last.rate != 0.0


def _difference(coarse: Grid, fine: Grid) -> float:
    """Relative difference of two runs; 0 where scatter alone explains it."""
    off = abs(fine.rate - coarse.rate)
    if off <= CONFIDENCE * math.hypot(fine.scatter, coarse.scatter):
        return 0.0
    return off / abs(fine.rate)


def _trusted(grids: list[Grid], wanted: float) -> bool:
    """Whether a coarser run gives no reason to doubt the one that the rule chose."""
    coarse, fine = grids
    if not _useful(grids):
        return True  # nothing to verify
    cycles = fine.result.summary()["drilling_cycles_per_blow"]
    share = CHATTER_SHARE if cycles > MOST_CYCLES else 1.0
    close = _difference(coarse, fine) <= share * wanted
    return close and estimated_error(grids) <= wanted


def _verified(grids: list[Grid], wanted: float) -> bool:
    """Whether three runs agree: two that do so by chance are not rare once there is doubt."""
    return not _useful(grids) or _error_of_three(grids) <= wanted


def _error_of_three(grids: list[Grid]) -> float:
    """Estimated error that heeds what the last run but one was off by, misfit apart."""
    before, coarse, _ = grids[-3:]
    earlier = max(_difference(before, coarse) - before.fit_error, 0.0)
    return max(earlier, estimated_error(grids))


def estimated_error(grids: list[Grid]) -> float:
    """Estimated relative error of the rate of the last run, from the one before.

    Their difference bounds the error of the finer one if errors at least halve
    with the step; scatter and a misfit of lengths, which both may share, add to it.
    """
    coarse, fine = grids[-2:]
    return max(_difference(coarse, fine), fine.scatter / abs(fine.rate)) + fine.fit_error


def _finished(scene: Scene, grids: list[Grid], wanted: float) -> Result:
    """The last result as that of the scene, with its estimated error and what to warn of."""
    last = grids[-1].result
    error = math.nan
    if _useful(grids):
        scatter = grids[-1].scatter / abs(grids[-1].rate)
        error = estimated_error(grids) if len(grids) > 1 else scatter
        if len(grids) > 2 and not _verified(grids, wanted):
            error = _error_of_three(grids)
    result = replace(
        last,
        scene=scene,
        rate_of_penetration_relative_error=error,
        wall_time=sum(grid.result.wall_time for grid in grids),
        setup_time=sum(grid.result.setup_time for grid in grids),
    )
    if not error <= wanted and not last.cut_short:
        result.warnings.append(_missed(grids, wanted, error))
    return result


def _missed(grids: list[Grid], wanted: float, error: float) -> str:
    """Say that the wanted accuracy was not reached, and why."""
    last = grids[-1]
    if not math.isfinite(error):
        return f"solver.accuracy = {wanted!r} cannot be judged without a rate of penetration"
    head = f"solver.accuracy = {wanted!r} was not reached: estimated error {error:.2g}"
    if last.scatter > wanted * abs(last.rate):
        return (
            f"{head}, since the motion is aperiodic and {last.result.duration:.4g} s average "
            "out no more; a longer run.duration allows a longer run"
        )
    if last.fit_error > wanted:
        return f"{head}, since the lengths fit no common cell"
    return (
        f"{head} with {next(iter(last.result.cells.values()))} cells: the rate jumps from grid "
        "to grid, since the motion passes close by a threshold"
    )
