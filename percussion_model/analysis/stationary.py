"""Stationary response of a scene: a run until the blows repeat, and no longer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from percussion_model.scene.scene import Scene, SceneError
from percussion_model.simulation.cycles import (
    BATCHES,
    FEWEST_BLOWS,
    SETTLING_SHARE,
    batch_means,
    cycles_in,
)
from percussion_model.simulation.files import plain
from percussion_model.simulation.simulate import Simulation

__all__ = ["Settled", "settled"]

# A run in which no blow ends for so long [s], and so many periods of the last, has stopped.
STALLED_AFTER, STALLED_PERIODS = 2.0, 4.0
# The standard error is first believed after so many blows, and checked again
# when there are so many times more.
FEWEST_SCATTERED, NEXT_CHECK = 100, 1.25


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
    rate_of_penetration_error : float
        Periodic: bound of what convergence would still change, or the scatter
        of the cycles. Aperiodic: the standard error, from batches [m/s].
    multiplier : float
        What is left of a deviation after one cycle, from the ratio of the last
        two changes; negative where it alternates. The cycle is stable below 1
        in size.
    cycle : ndarray of BLOW
        The last cycle; no rows where the motion is not periodic.
    blows : ndarray of BLOW
        All blows of the run.
    duration, wall_time : float
        Simulated time and time to compute [s].
    """

    kind: str
    order: int
    rate_of_penetration: float
    rate_of_penetration_error: float
    multiplier: float
    cycle: np.ndarray = field(repr=False)
    blows: np.ndarray = field(repr=False)
    duration: float
    wall_time: float

    @property
    def counted(self) -> np.ndarray:
        """Blows that means are taken of: the last cycle, or all after settling."""
        return self.cycle if self.order else self.blows[int(SETTLING_SHARE * len(self.blows)) :]

    @property
    def blow_period(self) -> float:
        """Mean time from blow to blow [s]."""
        return float(np.mean(self.counted["period"])) if len(self.counted) else math.nan

    def summary(self) -> dict[str, Any]:
        """Return the numbers as plain values for JSON; None is what is not defined."""
        numbers = {
            "kind": self.kind,
            "order": self.order or None,
            "rate_of_penetration": self.rate_of_penetration,
            "rate_of_penetration_error": self.rate_of_penetration_error,
            "blow_period": self.blow_period,
            "multiplier": self.multiplier,
            "blows": len(self.blows),
            "duration": self.duration,
            "wall_time": self.wall_time,
        }
        values: dict[str, Any] = plain(numbers)
        return values


def settled(
    scene: Scene,
    tolerance: float = 1e-4,
    most_blows: int = 400,
    progress: Callable[[float], None] | None = None,
    scatter: float = 0.0,
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

    Returns
    -------
    Settled

    Raises
    ------
    SceneError
        If the scene has no piston, or an argument makes no sense.
    SimulationError
        If the run cannot continue.
    """
    check_request(scene, tolerance, most_blows, scatter)
    simulation = Simulation(scene, record_events=False)
    blows, next_check = simulation.blows, float(FEWEST_SCATTERED)

    def made(kind: str, order: int, rate: float, error: float, multiplier: float) -> Settled:
        cycle, times = blows[len(blows) - order :], (simulation.time, simulation.wall_time)
        return Settled(kind, order, rate, error, multiplier, cycle, blows, *times)

    while len(blows) < most_blows:
        ended, patience = 0.0, STALLED_AFTER
        if len(blows):
            last = blows[-1]
            ended = float(last["time"] + last["period"])
            patience += STALLED_PERIODS * float(last["period"])
        before = len(blows)
        until = max(simulation.time, ended + patience)
        simulation.advance_blows(max(1, FEWEST_BLOWS - before), until)
        blows = simulation.blows
        if len(blows) == before:
            return made("stalled", 0, math.nan, math.nan, math.nan)
        if progress is not None:
            progress(len(blows))
        for order, found in cycles_in(blows, tolerance).items():
            return made("periodic", order, *found)
        if scatter and len(blows) >= next_check:
            next_check = NEXT_CHECK * len(blows)
            rate, error = batch_means(blows)
            if error <= scatter * abs(rate):
                break
    return made("aperiodic", 0, *batch_means(blows), math.nan)


def check_request(scene: Scene, tolerance: float, most_blows: int, scatter: float) -> None:
    """Raise `SceneError` for arguments of `settled` that make no sense."""
    if scene.piston.model == "absent":
        raise SceneError('piston.model = "absent": a bit alone has no blows that could settle')
    if not 0 < tolerance < 1:
        raise SceneError(f"tolerance = {tolerance!r}: must be a number above 0 and below 1")
    if not 0 <= scatter < 1:
        raise SceneError(f"scatter = {scatter!r}: must be a number from 0 on and below 1")
    least = 2 * BATCHES
    if most_blows < least:
        raise SceneError(f"most_blows = {most_blows!r}: must be a whole number from {least} on")
