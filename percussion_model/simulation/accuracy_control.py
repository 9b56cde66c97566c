"""Accuracy control: finer runs until they agree, longer ones where motion is aperiodic.

The evidence for the constants is in docs/data/stated_errors.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene
from percussion_model.scene.solver_names import counted
from percussion_model.simulation.error_estimate import (
    Estimate,
    GridRun,
    error_by_decisions,
    errors_of_numbers,
    estimate_error,
    grid_run,
    otherwise_decided,
    warnings_of_decisions,
)
from percussion_model.simulation.rate import FEWEST_DEPENDENT, LEAST_BLOWS
from percussion_model.simulation.result import Result
from percussion_model.solvers.modal.resolution import (
    REQUESTED,
    coarser_modes,
    modes_for,
    most_modes,
)
from percussion_model.solvers.wave.resolution import coarser_steps, steps_for

# Aperiodic motion runs on for at most this multiple of the duration.
LONGEST = 100.0
# A run grows at most by this factor before it is judged again, and a little
# further than the scatter seen so far asks for.
GROWTH, MARGIN = 4.0, 1.1
# The scatter of few blows says little, unless it is far below what is wanted.
FAR_BELOW = 0.1

# With more drilling cycles a blow than this the rate jumps from grid to grid, and
# grids agree by chance: they must do so within this share of what is wanted.
MOST_CYCLES, CHATTER_SHARE = 8.0, 0.5
# More steps or modes in the first bar are not tried: runs with them take minutes for a second.
FINEST = 256
# Twice as many: what is left of an error of first order is the distance to the run before.
FINER = 2

# Runs a scene; the second argument: whether for as long as aperiodic motion needs.
RunOnce = Callable[[Scene, bool], Result]


@dataclass(frozen=True)
class Step:
    """A run that may answer a request, and what is thought of it.

    Attributes
    ----------
    cells : int
        Steps or modes, in the first elastic bar.
    run : GridRun
    estimate : Estimate
    doubt : float
        Relative error that the run before was thought to have by its cells: there was
        reason not to trust that one, and two runs that agree by chance are not rare then.
    decided : tuple of GridRun
        On the same grid, with close decisions taken otherwise.
    interrupted : bool
        Whether the run after this one was.
    """

    cells: int
    run: GridRun
    estimate: Estimate
    doubt: float = 0.0
    decided: tuple[GridRun, ...] = ()
    interrupted: bool = False

    @property
    def error(self) -> float:
        """Estimated error of the rate, relative to it."""
        return max(self.estimate.total, self.doubt, self.by_decisions)

    @property
    def by_decisions(self) -> float:
        """What close decisions make of it."""
        return error_by_decisions(self.run, self.decided)


def time_needed(result: Result, accuracy: float) -> float:
    """Time until which a run must last for the wanted standard error [s].

    Standard errors fall with the square root of time. The present time where
    the result is good enough or tells no rate.
    """
    rate, scatter = abs(result.rate_of_penetration), result.rate_of_penetration_standard_error
    if len(result.counted) < LEAST_BLOWS or rate == 0.0:
        return result.duration
    excess = scatter / (accuracy * rate)
    few = len(result.counted) < FEWEST_DEPENDENT and excess > FAR_BELOW
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
        it could be estimated. Its times are those of all runs.
    """
    wanted = scene.solver.accuracy
    assert wanted is not None
    if not has_grid(scene):  # rigid bodies move in closed form
        return _finished(scene, [GridRun(run_once(scene, True))], None)
    runs: list[GridRun] = []
    *coarser, cells = _first_grids(scene)
    for count in coarser:
        runs.append(_run(scene, count, run_once, extend=False))
        if runs[-1].result.cut_short:
            return _finished(scene, runs, None)
    runs.append(_run(scene, cells, run_once))
    if not runs[-1].useful:
        return _finished(scene, runs, None)
    step = Step(cells, runs[-1], estimate_error(runs[-1], runs[:-1]))
    step = _decided(step, runs[:-1], wanted, run_once)
    if not scene.run.check and _trusted(step, wanted):
        return _finished(scene, runs, step)
    while (finer := _finer(scene, step, wanted)) is not None:
        close = step.by_decisions > wanted
        runs.append(_run(scene, finer, run_once))
        if runs[-1].result.cut_short:
            step = replace(step, interrupted=True)
            break
        if not runs[-1].useful:
            return _finished(scene, runs, None)
        step = Step(finer, runs[-1], estimate_error(runs[-1], runs[:-1]), doubt=step.estimate.grid)
        step = _decided(step, runs[:-1], wanted, run_once)
        # a decision that is close on two grids is so on many
        if step.error <= wanted or (close and step.by_decisions > wanted):
            break
    return _finished(scene, runs, step)


def has_grid(scene: Scene) -> bool:
    """Whether steps or modes decide how accurate a scene is."""
    return scene.solver_name in ("wave", "modal")


def planned_cells(scene: Scene) -> list[int]:
    """Steps, or modes, of the runs of a request: to compare with, by rule, to verify."""
    plan = _first_grids(scene)
    if scene.run.check:
        finer = _finer_grid(scene, plan[-1])
        plan += [] if finer is None else [finer]
    return plan


def with_cells(scene: Scene, cells: int) -> Scene:
    """Return the scene with steps, or modes, in place of a wanted accuracy."""
    changes = {"solver.accuracy": None, "run.check": False, "solver.cells": cells}
    return scene.replace(**changes)


def _first_grids(scene: Scene) -> list[int]:
    """Steps or modes to begin with: of the runs to compare with, and by the rule."""
    wanted = scene.solver.accuracy
    assert wanted is not None
    if scene.solver_name == "modal":
        modes = modes_for(numbers_of(scene), wanted)
        return [*coarser_modes(modes, REQUESTED), modes]
    steps = steps_for(wanted, scene.effects.string)
    return [coarser_steps(steps), steps]


def _finer_grid(scene: Scene, cells: int) -> int | None:
    """Steps or modes of the next run; None where there is none."""
    most, finer = FINEST, FINER * cells
    if scene.solver_name == "modal":
        most = min(most, most_modes(numbers_of(scene)))
    return finer if finer <= most else None


def _run(scene: Scene, cells: int, run_once: RunOnce, extend: bool = True) -> GridRun:
    return grid_run(run_once(with_cells(scene, cells), extend))


def _decided(step: Step, others: list[GridRun], wanted: float, run_once: RunOnce) -> Step:
    """A step that would do, with runs of the other motions where decisions are close."""
    if step.error > wanted:
        return step
    scenes = otherwise_decided(step.run, others)
    return replace(step, decided=tuple(grid_run(run_once(one, False)) for one in scenes))


def _trusted(step: Step, wanted: float) -> bool:
    """Whether coarser runs give no reason to doubt the one that the rule chose."""
    cycles = step.run.result.summary()["drilling_cycles_per_blow"]
    share = CHATTER_SHARE if cycles > MOST_CYCLES else 1.0
    return step.estimate.grid <= share * wanted and step.error <= wanted


def _finer(scene: Scene, step: Step, wanted: float) -> int | None:
    """Steps or modes of the next run; None where it is not tried or would not help."""
    estimate = step.estimate
    by_grid = max(estimate.grid, estimate.floor, step.doubt, step.by_decisions)
    if step.error > wanted and by_grid <= CHATTER_SHARE * wanted:
        return None  # scatter is all that is left
    return _finer_grid(scene, step.cells)


def _finished(scene: Scene, runs: list[GridRun], step: Step | None) -> Result:
    """The last result as that of the scene, with its estimated error and what to warn of."""
    wanted = scene.solver.accuracy
    assert wanted is not None
    judged = step.run if step else runs[-1]
    last = judged.result
    error = math.nan
    if step is not None:
        error = step.error
    elif len(runs) == 1 and runs[0].useful:
        error = runs[0].scatter / abs(runs[0].value)
    # by place: runs compare by arrays
    before = runs[: next(k for k, run in enumerate(runs) if run is judged)]
    known, decided = math.isfinite(error), step.decided if step else ()
    result = replace(
        last,
        scene=scene,
        errors=errors_of_numbers(judged, judged, before, decided) if known else {},
        rate_of_penetration_relative_error=error,
        wall_time=sum(run.result.wall_time for run in runs),
        setup_time=sum(run.result.setup_time for run in runs),
    )
    if known and error > wanted:
        result.warnings.extend(warnings_of_decisions(judged, before, decided, error))
    if not error <= wanted and not last.cut_short:
        result.warnings.append(_missed(result, step, wanted, error))
    elif step is not None and step.interrupted:
        result.warnings.append("interrupted while it was verified: this is the run before")
    return result


def _missed(result: Result, step: Step | None, wanted: float, error: float) -> str:
    """Say that the wanted accuracy was not reached, and why."""
    if step is not None and not math.isfinite(error):
        return f"solver.accuracy = {wanted!r} cannot be judged: no other run has a rate to compare"
    if not math.isfinite(error):
        return f"solver.accuracy = {wanted!r} cannot be judged without a rate of penetration"
    head = f"solver.accuracy = {wanted!r} was not reached: estimated error {error:.2g}"
    if step is not None and step.interrupted:
        return f"{head}, interrupted in a finer run; this is the run before"
    if step is None or step.estimate.scatter > wanted:
        return (
            f"{head}, since the motion is aperiodic and {result.duration:.4g} s average "
            "out no more; a longer run.duration allows a longer run"
        )
    if step.by_decisions > wanted:
        return f"{head}, since a bounce comes close to the barrier"
    return (
        f"{head} with {next(iter(result.cells.values()))} "
        f"{counted(result.solver)}: the rate jumps between discretisations, since the motion "
        "passes close to a threshold"
    )
