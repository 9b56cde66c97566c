"""Estimated errors of the rate and of other means, from runs on grids whose errors differ.

Modes leave a series short, steps of waves average fronts: runs with fewer tell how much is left
(docs/accuracy.md).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from percussion_model.physics import judgement
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.decisions import (
    other_barriers,
    unsure_counts,
)
from percussion_model.simulation.means import COUNTS, numbers_over, scatter_over
from percussion_model.simulation.rate import LARGE_ERROR, LEAST_BLOWS, rate_of_blows
from percussion_model.simulation.result import Result
from percussion_model.simulation.uncertain import in_digits
from percussion_model.simulation.warnings import least_loss_time
from percussion_model.solvers.modal.resolution import promised_error
from percussion_model.solvers.wave.resolution import (
    coarser_steps,
    error_by_pulse,
    error_by_steps,
)

# The error is not below this share of what the rule of steps promises.
FLOOR_SHARE = 0.1
# Runs to compare with may take this share of the work of the run they judge; the time that
# they take to set up comes on top.
COMPARISON_WORK = 0.12
# They last for so many blows at least: to settle and to count.
FEWEST_BLOWS = 10
# What brings the rate of a solver closer.
REMEDIES = {
    "modal": "solver.accuracy (--accuracy) takes as many modes as an error needs",
    "wave": "solver.accuracy (--accuracy) takes as many steps as an error needs",
    "fem": "more fem.elements and a greater fem.contact_stiffness bring it closer",
}
# Words of the warning of a large error.
LARGE = "may be off by"
# What the vibration that is left of the blow before decides, and grids decide otherwise.
OF_VIBRATION = ("standstill_bit_force", "rebound_velocity")
# What the grids of solvers are.
_GRIDS = {"modal": judgement.Grid.MODES, "wave": judgement.Grid.STEPS}


@dataclass(frozen=True)
class GridRun:
    """A run on one grid.

    Attributes
    ----------
    result : Result
    promised : float
        Relative error of the rate that the rule of steps or modes expects; 0 where none does.
    number : tuple of float or None
        What is judged in place of the rate, and its standard error [SI].
    floor_share : float
        Share of what is promised that no error by waves goes below.
    """

    result: Result
    promised: float = 0.0
    number: tuple[float, float] | None = None
    floor_share: float = FLOOR_SHARE

    @cached_property
    def _number(self) -> tuple[float, float]:
        """What is judged, and its standard error."""
        if self.number is not None:
            return self.number
        return rate_of_blows(self.result.counted)

    @property
    def value(self) -> float:
        """Rate of penetration [m/s], or the other number."""
        return self._number[0]

    @property
    def scatter(self) -> float:
        """Its standard error."""
        return self._number[1]

    @cached_property
    def cycles(self) -> float:
        """Drilling cycles a blow; 0 where there are no blows."""
        counted = self.result.counted["drilling_cycles"]
        return float(np.mean(counted)) if len(counted) else 0.0

    @cached_property
    def row(self) -> np.ndarray:
        """What is judged, as the columns of `judgement.Row`."""
        return np.array([*self._number, self.cycles, self.resolution])

    @property
    def resolution(self) -> int:
        """Cells or modes of the first elastic bar; 1 of rigid bodies."""
        return next(iter(self.result.cells.values()), 1)

    @property
    def grid(self) -> int:
        """`judgement.Grid` of the solver."""
        return int(_GRIDS.get(self.result.solver, judgement.Grid.ELEMENTS))

    @cached_property
    def apart(self) -> float:
        """Relative distance to the number over blows of one kind, where one of two is rare."""
        kinds = _two_kinds(self.result.counted)
        return judgement.apart(self.value, *(rate_of_blows(one)[0] for one in kinds))

    @property
    def useful(self) -> bool:
        """Whether there is a number to judge."""
        return not self.result.cut_short and math.isfinite(self.value) and self.value != 0.0

    def numbers(self) -> dict[str, GridRun]:
        """The run with each of its numbers in place of the rate, by name.

        They are those over blows, or those of the fall of a bit that nothing has struck.
        """
        if not len(self.result.blows):
            fall = self.result.fall.items()
            return {name: replace(self, number=(value, 0.0)) for name, value in fall}
        blows = self.result.counted
        scatter, found = scatter_over(blows), {}
        # what is the same for all numbers is found once
        shared = {"cycles": self.cycles}
        of_kinds = [numbers_over(kind) for kind in _two_kinds(blows)]
        for name, value in numbers_over(blows).items():
            number = value, scatter.get(name, math.nan)
            found[name] = one = GridRun(self.result, self.promised, number, self.floor_share)
            apart = judgement.apart(value, *(numbers[name] for numbers in of_kinds))
            vars(one).update(shared, _number=number, apart=apart)
        return found


def _two_kinds(blows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Blows by their drilling cycles, where these are two numbers and one is rare; else all."""
    first = judgement.first_kind(blows["drilling_cycles"])
    return (blows[first], blows[~first]) if first.any() else (blows, blows)


def _rows(runs: Sequence[GridRun]) -> np.ndarray:
    """Rows of runs, those that were cut short left out."""
    return np.array([run.row for run in runs if not run.result.cut_short]).reshape(-1, 4)


@dataclass(frozen=True)
class Estimate:
    """Parts of an estimated error, relative to the rate.

    Attributes
    ----------
    grid, scatter, floor : float
        What is left of the number of steps or modes, of the scatter of aperiodic motion, and
        what is never gone below.
    """

    grid: float
    scatter: float
    floor: float

    @property
    def total(self) -> float:
        """The whole error."""
        return max(self.scatter, self.grid, self.floor)


def grid_run(result: Result) -> GridRun:
    """A result with what its steps or modes promise."""
    run = GridRun(result)
    if result.solver == "wave":
        promised = error_by_steps(run.resolution, result.scene.effects.string)
        return replace(run, promised=promised)
    if result.solver != "modal":
        return run
    return replace(run, promised=promised_error(numbers_of(result.scene), run.resolution))


def error_by_decisions(part: GridRun, decided: Sequence[GridRun]) -> float:
    """Relative error that covers runs whose close decisions were taken otherwise.

    Parameters
    ----------
    part : GridRun
        The run over their time: chance has the same part in both.
    decided : sequence of GridRun
        On the same grid, with another barrier.
    """
    return judgement.error_by_decisions(part.row, _rows(decided))


def estimate_error(run: GridRun, others: Sequence[GridRun]) -> Estimate:
    """Estimate the error of a run from others.

    Parameters
    ----------
    run : GridRun
        With a rate.
    others : sequence of GridRun
        On coarser grids, the best last.

    Returns
    -------
    Estimate
    """
    known = [other for other in others if other.useful]
    if run.grid != judgement.Grid.MODES:
        known = known[-1:]
    rows, share = _rows(known), run.floor_share
    floor = judgement.floor_of_error(run.grid, run.row, rows, run.promised, share, 0.0)
    by_grid = judgement.error_by_grid(run.grid, run.row, rows, run.promised)
    return Estimate(by_grid, run.scatter / abs(run.value), floor)


def with_error_estimate(
    result: Result,
    coarser: Sequence[Scene] | None,
    run: Callable[[Scene], Result],
    whole_time: bool = False,
) -> Result:
    """Tell how far the numbers of a run may be off, by short runs on coarser grids.

    They start as the run did, and numbers are compared over the same stretch of time.

    Parameters
    ----------
    result : Result
    coarser : sequence of Scene, or None
        The scene on coarser grids: none where there is no grid and only scatter is left,
        None where nothing is known of the solver.
    run : callable
        Runs a scene.
    whole_time : bool
        Whether to compare over all of the run, not a part that takes a share of its work.

    Returns
    -------
    Result
        With `rate_of_penetration_relative_error` and `errors`, of what could be told: nothing
        where waves run without loss.
    """
    if coarser is None or result.cut_short or result.scene.is_undamped or result.has_stalled:
        return result  # what rings on without loss is another on every grid; no rate, no error
    if len(result.counted) < LEAST_BLOWS and not any(result.fall.values()):
        return result
    whole = grid_run(result)
    if not coarser:
        return _judged(whole, whole, [], [])
    end = result.duration if whole_time else _comparison_time(result, coarser)
    settle = min(result.settle, 0.5 * end)
    short = {"run.duration": end, "run.settle": settle}
    early = result.blows["time"] + result.blows["period"] <= end
    part = grid_run(replace(result, settle=settle, blows=result.blows[early]))
    if _has_makeshift(result, coarser):
        part = replace(part, floor_share=1.0)
    try:
        others = [grid_run(run(scene.replace(**short))) for scene in coarser]
        decided = [
            grid_run(run(scene.replace(**short))) for scene in otherwise_decided(part, others)
        ]
    except (SceneError, SimulationError) as error:
        result.warnings.append(f"the errors of the means could not be estimated: {error}")
        return result
    if any(other.result.cut_short for other in (*others, *decided)):
        result.warnings.append("interrupted while the errors of the means were estimated")
        return result
    return _judged(whole, part, others, decided)


def _has_makeshift(result: Result, coarser: Sequence[Scene]) -> bool:
    """Whether loss refuses the steps to compare with: near there others agree by chance."""
    if result.solver != "wave":
        return False
    usual = coarser_steps(next(iter(result.cells.values()), 1))
    return any(scene.solver.cells != usual for scene in coarser)


def otherwise_decided(run: GridRun, others: Sequence[GridRun]) -> list[Scene]:
    """Return the scene of a run with the barrier moved past the energies of close decisions."""
    scene, margins = run.result.scene, run.result.counted["barrier_margin"]
    return [
        scene.replace(**{"rock.barrier_threshold": factor * scene.rock.barrier_threshold})
        for factor in other_barriers(margins, _unsure_margin(run, others))
    ]


def _unsure_margin(run: GridRun, others: Sequence[GridRun]) -> float:
    """By how much the margin of the barrier may be off."""
    own, *middles = (
        judgement.middle(one.result.counted["barrier_margin"]) for one in (run, *others)
    )
    cycles = [other.cycles for other in others]
    return judgement.unsure_of_barrier(own, run.cycles, middles, cycles)


def errors_of_numbers(
    whole: GridRun,
    part: GridRun,
    others: Sequence[GridRun],
    decided: Sequence[GridRun] = (),
) -> dict[str, float]:
    """Estimate the errors of the numbers over blows of a run, or of its fall.

    Parameters
    ----------
    whole, part : GridRun
        The run, and the stretch of it that others are compared with.
    others : sequence of GridRun
        On coarser grids, the best last; none where there is no grid.
    decided : sequence of GridRun
        See `error_by_decisions`.

    Returns
    -------
    dict of float
        Of grid and scatter, by name, SI units; only what could be told. Where the bit still
        vibrates when the next blow comes, grids that agree do so by chance on `OF_VIBRATION`.
    """
    vibrates = others and whole.result.scene.loss.time < least_loss_time(whole.result)
    compared, otherwise = ([other.numbers() for other in runs] for runs in (others, decided))
    counts = unsure_counts(part.result.counted, [other.result.counted for other in others])
    of_part, found = part.numbers(), {}
    for name, number in whole.numbers().items():
        if vibrates and name in OF_VIBRATION:
            continue
        if number.useful and of_part[name].useful:
            known, moved = (
                [numbers[name] for numbers in runs if name in numbers]
                for runs in (compared, otherwise)
            )
            if others and not known:
                continue
            estimate = _of_whole(_estimate(of_part[name], known), of_part[name], number, moved)
            if name in COUNTS:  # grids that agree do so exactly
                estimate = replace(estimate, floor=0.0)
            error = max(abs(number.value) * estimate.total, counts.get(name, 0.0))
            if math.isfinite(error):
                found[name] = error
    return found


def _estimate(part: GridRun, others: Sequence[GridRun]) -> Estimate:
    """Estimate the error of a number by what is known of the solver's grids."""
    scatter = part.scatter / abs(part.value)
    if not others:
        return Estimate(0.0, scatter, 0.0)
    rows, numerical = _rows(others), part.result.energy["numerical_relative"]
    floor = judgement.floor_of_error(
        part.grid, part.row, rows, part.promised, part.floor_share, numerical
    )
    by_grid = judgement.error_by_grid(part.grid, part.row, rows, part.promised)
    # the ledger has no share where only a wave from outside gave energy
    return Estimate(by_grid, scatter, max(floor, _by_pulse(part)))


def _by_pulse(run: GridRun) -> float:
    """Error of what a wave from outside does, whose front and end steps spread; 0 without one."""
    string, step = run.result.scene.string, run.result.time_step
    if run.result.solver != "wave" or len(run.result.blows) or not string.pulse_force or not step:
        return 0.0
    return error_by_pulse(string.pulse_duration / step)


def _of_whole(
    estimate: Estimate, part: GridRun, whole: GridRun, decided: Sequence[GridRun]
) -> Estimate:
    """An estimate by a part of a run, with the scatter and the kinds of blows of all of it."""
    scatter = whole.scatter / abs(whole.value)
    scatter = scatter if math.isfinite(scatter) else math.inf
    by_grid = 0.0
    if whole.result.cells:
        by_decisions = error_by_decisions(part, decided)
        by_grid = max(estimate.grid, judgement.SPREAD_MARGIN * whole.apart, by_decisions)
    return Estimate(by_grid, scatter, estimate.floor)


def _judged(
    whole: GridRun, part: GridRun, others: Sequence[GridRun], decided: Sequence[GridRun]
) -> Result:
    """The result with its errors and what to warn of."""
    result = replace(whole.result, errors=errors_of_numbers(whole, part, others, decided))
    if not whole.useful or not part.useful:
        return result
    estimate = _of_whole(_estimate(part, others), part, whole, decided)
    if not math.isfinite(estimate.total):
        return result
    if estimate.total > LARGE_ERROR:
        close = list(warnings_of_decisions(part, others, decided, estimate.total))
        result.warnings.extend(close or _large_error(estimate, result.solver))
    return replace(result, rate_of_penetration_relative_error=estimate.total)


def warnings_of_decisions(
    part: GridRun, others: Sequence[GridRun], decided: Sequence[GridRun], error: float
) -> Iterator[str]:
    """Name the close decision that makes most of an error, relative, and the other rates."""
    if error_by_decisions(part, decided) < error:
        return
    blows = part.result.counted
    near = judgement.near_barrier(blows["barrier_margin"], _unsure_margin(part, others))
    rates = " or ".join(in_digits(1e3 * other.value, 4) for other in decided if other.useful)
    off, within = (in_digits(100.0 * share, 2) for share in (error, float(np.max(np.abs(near)))))
    yield (
        f"the rate of penetration {LARGE} {off} %: at a bounce or in a standstill the bit's energy "
        f"is within {within} % of the barrier (rock.barrier_energy) in {len(near)} of {len(blows)} "
        f"blows, and another discretisation may decide otherwise; the rate is {rates} mm/s then"
    )


def _large_error(estimate: Estimate, solver: str) -> Iterator[str]:
    """Warn of a rate that is not known well, and of why."""
    by_grid = max(estimate.grid, estimate.floor)
    if by_grid > max(LARGE_ERROR, estimate.scatter):
        remedy = REMEDIES.get(solver, REMEDIES["fem"])
        yield (
            f"the rate of penetration {LARGE} {in_digits(100.0 * by_grid, 2)} %, as coarser "
            f"runs show; {remedy}"
        )


def _comparison_time(result: Result, coarser: Sequence[Scene]) -> float:
    """Until when runs to compare with last [s]; work rises between cells and their square."""
    work = 0.0
    for scene in coarser:
        share = _cells_asked(scene) / next(iter(result.cells.values()), 1)
        work += 0.5 * (share + share * share)
    blows = result.blows[:FEWEST_BLOWS]
    if not len(blows):
        return result.duration
    least = float(blows["time"][-1] + blows["period"][-1])
    return min(result.duration, max(COMPARISON_WORK / work * result.duration, least))


def _cells_asked(scene: Scene) -> int:
    """Cells or elements that a scene names; 1 of rigid bodies."""
    count = scene.fem.elements if scene.solver_name == "fem" else scene.solver.cells
    return count or 1
