"""Stationary response of a scene: a run until the blows repeat, and no longer."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from percussion_model.physics.judgement import FIRST_ORDER
from percussion_model.physics.settling import (
    REQUEST,
    STALLED_AFTER,
    Verdict,
    multiplier_of,
    request_for,
)
from percussion_model.scene.scene import Scene, SceneError, refuse_other
from percussion_model.simulation.driller_numbers import driller_numbers
from percussion_model.simulation.error_estimate import with_error_estimate
from percussion_model.simulation.files import plain
from percussion_model.simulation.means import by_volume, numbers_over, scatter_over
from percussion_model.simulation.rate import advances, rate_of_blows, ratio_of_sums
from percussion_model.simulation.result import Result
from percussion_model.simulation.simulate import Simulation, SimulationError
from percussion_model.simulation.uncertain import BY_CELLS, is_undecided, rate_field
from percussion_model.simulation.warnings import warnings_of_motion

# The standard error is first believed after so many blows, when each cycle of several could have
# been known (`settling`), and checked again when there are so many times more.
FEWEST_SCATTERED, NEXT_CHECK = 64, 1.1
# A run that ends once its error is small ends where chance has made it small: so of the errors
# by these stretches the greatest counts. It held for 67, 84 and 92 % of 200 aperiodic points of
# the map of docs/studies.md within one, two and three of it, from 100 blows on for 65, 86 and 92
# with a fifth more of them; that by a quarter for 56, 82 and 90 %.
STRETCHES = 1 / 8, 1 / 4, 1 / 2
# A motion is aperiodic that has not settled after so many blows.
MOST_BLOWS = 400
# Processor time after which a run that has not settled is given up [s].
MOST_TIME = 300.0
# Blows look alike long before a motor has its speed, to 1e-4: after so many of its responses.
MOTOR_SETTLES = 10.0
# With fewer blows allowed nothing is known of an aperiodic motion.
LEAST_LIMIT = 32
# Numbers whose errors by the grid are estimated: rate, period, and other means over blows.
_RATE, _PERIOD = "rate_of_penetration", "blow_period"
# Smaller ones, and smaller errors of them, are rounding.
ROUNDING = 1e-12
MEANS = (
    *("blow_frequency", "impact_velocity", "transfer_efficiency"),
    *("percussive_power", "energy_per_advance"),
)
JUDGED = (_RATE, _PERIOD, *MEANS)
# Least blows that grids are compared over, and the share that counts where motion is periodic.
FEWEST_JUDGED, JUDGED_SHARE = 12, 0.5
# Share of the blows of an aperiodic motion that is left out as settling.
SETTLING_SHARE = 0.2


class Motion(NamedTuple):
    """Kind, blows in a cycle and multiplier of a motion, as those of `Settled`."""

    kind: str
    order: int
    multiplier: float

    def __str__(self) -> str:
        words = {0: "", 1: ", every blow alike"}.get(self.order, f", {self.order} blows a cycle")
        return f"{self.kind}{words}"


@dataclass(frozen=True)
class Settled:
    """The stationary response of a scene, SI units; NaN is what is not defined.

    Attributes
    ----------
    kind : {"periodic", "aperiodic", "stalled"}
    order : int
        Blows in a cycle; 0 where the motion is not periodic.
    rate_of_penetration : float
        Mean over one cycle, or over the blows of an aperiodic motion [m/s].
    settling_error : float
        Part of the rate's error [m/s]. Periodic: bound of what convergence would still
        change, or the scatter of the cycles. Aperiodic: the standard error.
    multiplier : float
        Stability multiplier: what is left of a deviation after one cycle, from the
        ratio of the last two changes; negative where it alternates. The cycle is stable below 1
        in size. Its error is `multiplier_error`.
    cycle : ndarray of BLOW
        The last cycle; no rows where the motion is not periodic.
    blows : ndarray of BLOW
        All blows of the run.
    duration, wall_time : float
        Simulated time and time to compute [s].
    depends_on_cells : bool
        Whether the rate is one of the cells and of nothing else.
    grid_errors : dict of float
        The other part of the errors of `rate_of_penetration` [m/s], `blow_period` [s] and
        `MEANS`, as `simulate` estimates it by coarser grids, with what scatter does to these
        runs; 0 without a grid. Of what was not estimated there is none.
    others : tuple of Motion
        The motions on coarser grids, where errors were estimated.
    warnings : list of str
        As of a run, but for those of its length, where errors were estimated.
    hole_diameter : float or None
        Of the scene [m].
    """

    kind: str
    order: int
    rate_of_penetration: float
    settling_error: float
    multiplier: float
    cycle: np.ndarray = field(repr=False)
    blows: np.ndarray = field(repr=False)
    duration: float
    wall_time: float
    depends_on_cells: bool = False
    grid_errors: dict[str, float] = field(default_factory=dict)
    others: tuple[Motion, ...] = ()
    warnings: list[str] = field(default_factory=list, repr=False)
    hole_diameter: float | None = None

    def __repr__(self) -> str:
        rate = rate_field(self.summary())
        error_of = f"error_of={self.error_of!r}, " if rate else ""
        return (
            f"Settled({self.kind!r}, order={self.order}, {rate}{error_of}"
            f"blows={len(self.blows)}, duration={self.duration:.4g})"
        )

    @property
    def rate_of_penetration_error(self) -> float:
        """How far the rate may be off, by `error_of` [m/s]."""
        return self._with_grid(_RATE, self.settling_error)

    def _with_grid(self, name: str, settling: float) -> float:
        """Error of a number by its grid, as far as that is known, and by settling."""
        grid = self.grid_errors.get(name, 0.0)
        # the limit of a sequence, and that of its grid; scatter is in the other part as well
        return settling + grid if self.order else max(settling, grid)

    @property
    def error_of(self) -> str:
        """What `rate_of_penetration_error` is the error of; empty where there is no rate."""
        if math.isnan(self.settling_error):
            return ""
        settling = "scatter" if math.isnan(self.multiplier) else "convergence"
        return (
            f"discretisation and {settling}" if self.grid_errors.get(_RATE, 0.0) > 0.0 else settling
        )

    @property
    def rate_of_penetration_undecided(self) -> bool:
        """Whether the error is no smaller than the rate, or it is one of the cells."""
        if self.depends_on_cells and abs(self.rate_of_penetration) > 0.0:
            return True
        return is_undecided(self.rate_of_penetration, self.rate_of_penetration_error)

    @property
    def motion(self) -> Motion:
        """Kind, order and multiplier."""
        return Motion(self.kind, self.order, self.multiplier)

    @property
    def same_motion(self) -> bool | None:
        """Whether the motions on coarser grids are of this kind and order; None if not known."""
        if not self.others:
            return None
        return all(other[:2] == (self.kind, self.order) for other in self.others)

    @property
    def multiplier_error(self) -> float:
        """How far the multiplier may be off; NaN where that is not known.

        By the cycle before, and by coarser grids where errors were estimated.
        """
        earlier = len(self.blows) - self.order
        if math.isnan(self.multiplier) or self.same_motion is False or earlier <= 2 * self.order:
            return math.nan
        last = self.blows["impact_velocity"][earlier - 1 :: -self.order][:3]
        before = multiplier_of(*last)
        off = [abs(other.multiplier - self.multiplier) for other in self.others]
        return abs(self.multiplier - before) + FIRST_ORDER * float(np.max(off, initial=0.0))

    @property
    def counted(self) -> np.ndarray:
        """Blows that means are taken of: the last cycle, or all after settling."""
        return self.cycle if self.order else after_settling(self.blows)

    @property
    def blow_period(self) -> float:
        """Mean time from blow to blow [s]; NaN where they have died out."""
        if self.kind == "stalled":
            return math.nan
        return float(np.mean(self.counted["period"])) if len(self.counted) else math.nan

    @property
    def blow_period_error(self) -> float:
        """How far the blow period may be off, by the same as the rate [s]; else NaN."""
        counted = self.counted["period"]
        if len(counted) == 0 or self.kind == "stalled":
            return math.nan
        if self.order:
            means = self.blows["period"][-2 * self.order :].reshape(2, -1).mean(axis=1)
            settling = float(abs(means[1] - means[0]))
        else:
            settling = ratio_of_sums(counted, np.ones(len(counted)))[1]
        return self._with_grid(_PERIOD, settling)

    @property
    def means(self) -> dict[str, float]:
        """`MEANS` over the blows that count, SI units; NaN where blows have died out."""
        if self.kind == "stalled":
            return dict.fromkeys(MEANS, math.nan)
        found = numbers_over(self.counted)
        # of energies that cancel their rounding is left
        return {name: 0.0 if abs(found[name]) < ROUNDING else found[name] for name in MEANS}

    @property
    def mean_errors(self) -> dict[str, float]:
        """How far `means` may be off, by the same as the rate, SI units; else NaN."""
        counted = self.counted
        if len(counted) == 0 or self.kind == "stalled":
            return dict.fromkeys(MEANS, math.nan)
        if self.order:
            last = numbers_over(counted)
            before = numbers_over(self.blows[-2 * self.order : -self.order])
            settling = {name: abs(last[name] - before[name]) for name in MEANS}
        else:
            settling = scatter_over(counted)
        found = {name: self._with_grid(name, settling.get(name, math.nan)) for name in MEANS}
        return {name: 0.0 if error < ROUNDING else error for name, error in found.items()}

    def summary(self) -> dict[str, Any]:
        """Return the numbers as plain values for JSON; None is what is not defined.

        `driller_numbers` has some of them in the units of drillers, as that of a `Result`.
        """
        means, errors, diameter = self.means, self.mean_errors, self.hole_diameter
        numbers = {
            "kind": self.kind,
            "order": self.order or None,
            "rate_of_penetration": self.rate_of_penetration,
            "rate_of_penetration_error": self.rate_of_penetration_error,
            "rate_of_penetration_error_of": self.error_of or None,
            "rate_of_penetration_settling_error": self.settling_error,
            "grid_errors": self.grid_errors,
            "rate_of_penetration_undecided": self.rate_of_penetration_undecided,
            BY_CELLS: self.depends_on_cells,
            "blow_period": self.blow_period,
            "blow_period_error": self.blow_period_error,
            **means,
            "specific_energy": by_volume(means, diameter).get("specific_energy", math.nan),
            **{f"{name}_error": error for name, error in errors.items()},
            "specific_energy_error": by_volume(errors, diameter).get("specific_energy", math.nan),
            "multiplier": self.multiplier,
            "multiplier_error": self.multiplier_error,
            "same_motion_on_other_grids": self.same_motion,
            "motions_on_other_grids": [other._asdict() for other in self.others],
            "blows": len(self.blows),
            "duration": self.duration,
            "wall_time": self.wall_time,
            "warnings": self.warnings,
        }
        values: dict[str, Any] = plain(numbers)
        return values | {"driller_numbers": driller_numbers(values)}


def settled(
    scene: Scene,
    tolerance: float = 1e-4,
    most_blows: int = MOST_BLOWS,
    progress: Callable[[float], None] | None = None,
    scatter: float = 0.0,
    most_time: float = MOST_TIME,
    error_estimate: bool = False,
) -> Settled:
    """Run a scene until its blows repeat, or until it is clear that they do not.

    Blows are compared at the section that starts them. One blow is believed to
    repeat when changes fall evenly from afar, for half of the run at least, and
    all still to come stay within the tolerance; its rate is extrapolated to the
    limit (Aitken). A cycle of several, or one that only scatters within the
    tolerance, is believed after sixty blows.
    A motion that does neither within `most_blows` is aperiodic.

    Parameters
    ----------
    scene : Scene
    tolerance : float
        Relative, of impact velocity, period and penetration of the blows of a
        cycle.
    most_blows : int
        Blows after which a motion that has not settled is called aperiodic.
    progress : callable, optional
        Called with the blows done.
    scatter : float
        Relative standard error of the rate with which a motion that has not
        settled is known well enough, and called aperiodic before `most_blows`.
        0: it never is.
    most_time : float
        Processor time after which the run is given up with an error [s].
    error_estimate : bool
        Whether to estimate the error of the grid, and to see whether the motion is that of
        coarser ones, by runs on these. They are not in the times.

    Returns
    -------
    Settled

    Raises
    ------
    SceneError
        If the scene has no piston, or an argument makes no sense.
    SimulationError
        If the run cannot continue, or takes longer than `most_time`.
    """
    check_request(scene, tolerance, most_blows, scatter)
    if not most_time > 0:
        raise SceneError(f"most_time = {most_time!r} s: must be above 0 s")
    began = time.thread_time()
    simulation = Simulation(scene, record_events=False)
    found = settle(simulation, tolerance, most_blows, scatter, began + most_time, progress)
    if not error_estimate:
        return found
    # before other runs make this one longer; a study of thousands would pay for them
    start = float(found.counted["time"][0]) if len(found.counted) else 0.0
    found.warnings.extend(warnings_of_motion(simulation.result(start)))
    others = _other_motions(simulation, tolerance, most_blows, scatter, most_time)
    found = replace(found, others=others)
    if math.isfinite(found.rate_of_penetration) and not scene.is_undamped:
        settling = JUDGED_SHARE if found.order else SETTLING_SHARE
        found = replace(found, grid_errors=_grid_errors(simulation, settling))
    return found


def settle(
    simulation: Simulation,
    tolerance: float,
    most_blows: int,
    scatter: float,
    deadline: float,
    progress: Callable[[float], None] | None = None,
) -> Settled:
    """Let a simulation that has not begun run until its blows repeat, as `settled` does.

    Parameters
    ----------
    simulation : Simulation
    tolerance, most_blows, scatter, progress
        See `settled`.
    deadline : float
        As `time.thread_time` tells it [s].

    Returns
    -------
    Settled
        Without errors of the grid.
    """
    scene = simulation.scene
    slowest = MOTOR_SETTLES * scene["rotation.response"] if scene.motor_stalls else 0.0

    def made(kind: str, order: int, rate: float, error: float, multiplier: float) -> Settled:
        cycle, times = blows[len(blows) - order :], (simulation.time, simulation.wall_time)
        if order and not advances(cycle).any():
            rate = error = 0.0
        values = kind, order, rate, error, multiplier, cycle, blows, *times
        return Settled(*values, scene.is_undamped, hole_diameter=scene.hole_diameter)

    asked = request_for(tolerance, most_blows, slowest)
    found = asked.view(REQUEST)[0]
    if scatter:
        found["enough"] = FEWEST_SCATTERED
    while True:
        simulation.settle(asked, progress, deadline)
        blows = simulation.blows
        if found["verdict"] == Verdict.STALLED:
            return made("stalled", 0, math.nan, math.nan, math.nan)
        if found["verdict"] == Verdict.PERIODIC:
            rate, error = float(found["rate"]), float(found["error"])
            return made("periodic", int(found["order"]), rate, error, float(found["multiplier"]))
        rate, error = rate_so_far(blows)
        if len(blows) >= most_blows or error <= scatter * abs(rate):
            return made("aperiodic", 0, rate, error, math.nan)
        found["verdict"], found["enough"] = Verdict.OPEN, NEXT_CHECK * len(blows)


def _other_motions(
    simulation: Simulation, tolerance: float, most_blows: int, scatter: float, most_time: float
) -> tuple[Motion, ...]:
    """Motions on coarser grids; none where there are no grids, or one cannot be run."""
    try:
        found = [
            settled(scene, tolerance, most_blows, scatter=scatter, most_time=most_time)
            for scene in simulation.solver.coarser_scenes() or ()
        ]
    except (SceneError, SimulationError):
        return ()
    return tuple(one.motion for one in found)


def _grid_errors(simulation: Simulation, settling: float) -> dict[str, float]:
    """Estimated errors of `JUDGED` by the grid, SI units; of what could be told.

    A run of few blows is made longer; `settling` is the share of it that does not count.
    """
    coarser = simulation.solver.coarser_scenes()
    if coarser == []:
        return dict.fromkeys(JUDGED, 0.0)
    while simulation.blow_rows < FEWEST_JUDGED:
        before = simulation.blow_rows
        simulation.advance_blows(1, simulation.time + STALLED_AFTER)
        if simulation.blow_rows == before:
            return {}
    end, settle = simulation.time, settling * simulation.time
    whole = simulation.scene.replace(**{"run.duration": end, "run.settle": settle})
    result = replace(simulation.result(settle), scene=whole)
    judged = with_error_estimate(result, coarser, _run, whole_time=True)
    errors = {_RATE: judged.rate_of_penetration_error, **judged.errors}
    return {name: errors[name] for name in JUDGED if errors.get(name, math.nan) >= 0.0}


def _run(scene: Scene) -> Result:
    """A whole run, of which blows alone are kept."""
    simulation = Simulation(scene, record_events=False)
    simulation.advance(scene.run.duration)
    return simulation.result()


def check_request(scene: Scene, tolerance: float, most_blows: int, scatter: float) -> None:
    """Raise `SceneError` for arguments of `settled` that make no sense."""
    refuse_other(scene)
    if scene.piston.model == "absent":
        raise SceneError('piston.model = "absent": a bit alone has no blows that could settle')
    if not 0 < tolerance < 1:
        raise SceneError(f"tolerance = {tolerance!r}: must be a number above 0 and below 1")
    if not 0 <= scatter < 1:
        raise SceneError(f"scatter = {scatter!r}: must be a number from 0 on and below 1")
    if most_blows < LEAST_LIMIT:
        least = f"must be a whole number from {LEAST_LIMIT} on"
        raise SceneError(f"most_blows = {most_blows!r}: {least}")


def rate_so_far(blows: np.ndarray) -> tuple[float, float]:
    """Rate of an aperiodic motion and its standard error [m/s]."""
    return rate_of_blows(after_settling(blows), STRETCHES)


def after_settling(blows: np.ndarray) -> np.ndarray:
    """Blows of an aperiodic motion that count."""
    return blows[int(SETTLING_SHARE * len(blows)) :]
