"""The stationary response of a scene: run until the blows repeat, and no longer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from percussion_model.scene import Scene, SceneError
from percussion_model.stepping import Simulation

__all__ = ["Settled", "settled"]

# Longest cycle that is looked for [blows].
MOST_BLOWS_A_CYCLE = 8
# A cycle that only scatters, without converging any more, is believed after so many repetitions.
REPETITIONS = 5
# Numbers of a blow by which two blows are the same.
COMPARED = ("impact_velocity", "period", "penetration")
# A run in which no blow ends for so long has come to a stop [s].
STALLED_AFTER = 2.0
# When a run is first looked at [s].
_FIRST_LOOK = 0.02
# The means of an aperiodic motion are taken over this many batches of blows.
BATCHES = 16
# Share of the blows of an aperiodic motion that is left out as settling.
SETTLING_SHARE = 0.2


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
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in numbers.items()
        }


def settled(
    scene: Scene,
    tolerance: float = 1e-4,
    most_blows: int = 400,
    progress: Callable[[float], None] | None = None,
) -> Settled:
    """Run a scene until its blows repeat, or until it is clear that they do not.

    Blows are compared at the section that starts them. A cycle of n blows is
    believed when the change over one more cycle and all changes still to come,
    were they to shrink as the last two did, stay within the tolerance; or when
    the last cycles only scatter within it. The rate is then extrapolated to the
    limit (Aitken). A motion that does neither within `most_blows` is aperiodic.

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

    Returns
    -------
    Settled

    Raises
    ------
    SceneError
        If the scene has no piston, or an argument makes no sense.
    SimulationError
        If the run cannot go on.
    """
    _check(scene, tolerance, most_blows)
    simulation = Simulation(scene, record_events=False)
    blows = simulation.blows
    wait = _FIRST_LOOK
    while len(blows) < most_blows:
        last = blows[-1] if len(blows) else None
        wait = 1.05 * float(last["period"]) if last is not None else wait
        simulation.advance(simulation.time + wait)
        before, blows = len(blows), simulation.blows
        if len(blows) == before:
            ended = 0.0 if last is None else float(last["time"] + last["period"])
            if simulation.time - ended > STALLED_AFTER + 4 * wait:
                return _made("stalled", 0, math.nan, math.nan, math.nan, blows, simulation)
            continue
        if progress is not None:
            progress(len(blows))
        for order in range(1, MOST_BLOWS_A_CYCLE + 1):
            found = _cycle(blows, order, tolerance)
            if found is not None:
                return _made("periodic", order, *found, blows, simulation)
    return _made("aperiodic", 0, *_batch_means(blows), math.nan, blows, simulation)


def _check(scene: Scene, tolerance: float, most_blows: int) -> None:
    if scene.piston.model == "absent":
        raise SceneError('piston.model = "absent": a bit alone has no blows that could settle')
    if not 0 < tolerance < 1:
        raise SceneError(f"tolerance = {tolerance!r}: must be a number above 0 and below 1")
    least = 2 * BATCHES
    if most_blows < least:
        raise SceneError(f"most_blows = {most_blows!r}: must be a whole number from {least} on")


def _cycle(blows: np.ndarray, order: int, tolerance: float) -> tuple[float, float, float] | None:
    """Rate, its error and the multiplier of a cycle of `order` blows, None if it is none."""
    if len(blows) < 3 * order:
        return None
    deviation = _changes(blows[-3 * order :], order)
    older, newer = (float(np.max(np.abs(part))) for part in np.split(deviation, 2))
    if newer <= tolerance:
        shrinking = newer / older if older > 0 else 0.0
        if shrinking < 1.0 and newer * shrinking / (1.0 - shrinking) <= tolerance:
            return _limit(blows, order)
    if len(blows) < REPETITIONS * order:
        return None
    rows = blows[-REPETITIONS * order :]
    changes = _changes(rows, order)
    largest = np.max(np.abs(changes))
    # What still drifts one way, however slowly, has not arrived.
    drift = np.max(np.abs(changes.reshape(REPETITIONS - 1, -1).sum(axis=0)))
    return _scattering(rows, order) if drift <= largest <= tolerance else None


def _changes(blows: np.ndarray, order: int) -> np.ndarray:
    """Relative change of each number of `COMPARED` over a cycle, a row for each blow."""
    values = np.stack([blows[name] for name in COMPARED], axis=1)
    scale = np.mean(np.abs(values[-order:]), axis=0)
    return (values[order:] - values[:-order]) / np.where(scale > 0, scale, 1.0)


def _rates(blows: np.ndarray, order: int) -> np.ndarray:
    """Mean rate over each run of `order` blows, one after the other [m/s]."""
    whole = len(blows) // order * order
    advance = blows["penetration"][-whole:].reshape(-1, order).sum(axis=1)
    return np.asarray(advance / blows["period"][-whole:].reshape(-1, order).sum(axis=1))


def _limit(blows: np.ndarray, order: int) -> tuple[float, float, float]:
    """Limit of a converging cycle: rate, error and multiplier."""
    second, third = _rates(blows[-2 * order :], order)
    change = third - second
    ratio = _multiplier(blows, order)
    shift = change * ratio / (1.0 - ratio) if abs(ratio) < 1.0 else 0.0
    # Extrapolating by more than the last change would trust the ratio too far.
    shift = float(np.clip(shift, -abs(change), abs(change)))
    return float(third + shift), float(abs(change) + abs(shift)), ratio


def _multiplier(blows: np.ndarray, order: int) -> float:
    """Ratio of the last two changes of the impact velocity over a cycle."""
    velocity = blows["impact_velocity"]
    newer = velocity[-1] - velocity[-1 - order]
    older = velocity[-1 - order] - velocity[-1 - 2 * order]
    return float(newer / older) if older != 0.0 else 0.0


def _scattering(blows: np.ndarray, order: int) -> tuple[float, float, float]:
    """Mean of cycles that only scatter: rate, scatter; the multiplier cannot be told."""
    rates = _rates(blows, order)
    return float(np.mean(rates)), float(np.ptp(rates)), math.nan


def _batch_means(blows: np.ndarray) -> tuple[float, float]:
    """Mean rate of an aperiodic motion and its standard error [m/s].

    Blows follow from each other, so that their scatter alone would tell too
    small an error; means over long batches are nearly independent.
    """
    rows = blows[int(SETTLING_SHARE * len(blows)) :]
    rates = _rates(rows, len(rows) // BATCHES)
    rate = float(np.sum(rows["penetration"]) / np.sum(rows["period"]))
    return rate, float(np.std(rates, ddof=1) / math.sqrt(len(rates)))


def _made(
    kind: str,
    order: int,
    rate: float,
    error: float,
    multiplier: float,
    blows: np.ndarray,
    simulation: Simulation,
) -> Settled:
    cycle = blows[len(blows) - order :]
    return Settled(
        kind=kind,
        order=order,
        rate_of_penetration=rate,
        rate_of_penetration_error=error,
        multiplier=multiplier,
        cycle=cycle,
        blows=blows,
        duration=simulation.time,
        wall_time=simulation.wall_time,
    )
