"""C_R and W_R of the energy barrier from drop tests, and K_R and gamma where wanted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from percussion_model.analysis.fitting.least_squares import (
    LEAST_STEPS,
    CountedModel,
    Fit,
    FitError,
    check_confidence,
    checked_columns,
    descend,
    make_fit,
    profile_intervals,
    search,
    student_width,
)
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import Simulation

__all__ = ["BARRIER", "ROCK", "DropTest", "drop_test_signal", "fit_drop_tests"]

BARRIER = ("rock.barrier_damping", "rock.barrier_energy")
ROCK = (*BARRIER, "rock.loading_stiffness", "rock.unloading_ratio")
LEAST_DATA = 10
# Signals that can be measured on a bit.
SIGNALS = ("bit_position", "bit_velocity", "bit_end_position", "bit_end_velocity", "bit_force")
# Nothing is tried farther than this from the guess [logarithm of the factor], nor nearer than
# this to a bound of the parameter.
FARTHEST, SHORT_OF_BOUND = 7.0, 1e-3
# So often the fit starts again from a better place that it met while checking its intervals.
MOST_STARTS = 5


@dataclass(frozen=True)
class DropTest:
    """One measured fall of the bit, SI units.

    Attributes
    ----------
    time : array_like
        Since the bit was `start.rock_gap` above the rock; rising [s].
    values : array_like
        What was measured.
    speed : float
        At time zero, downward [m/s].
    """

    time: Any
    values: Any
    speed: float


def drop_test_signal(scene: Scene, times: np.ndarray, speed: float, signal: str) -> np.ndarray:
    """Compute what would be measured in a drop test.

    Parameters
    ----------
    scene : Scene
        Of a bit alone.
    times : ndarray
        [s].
    speed : float
        Of the bit at the start [m/s].
    signal : str
        One of `SIGNALS`.

    Returns
    -------
    ndarray
        SI units.
    """
    simulation = Simulation(scene.replace(**{"start.bit_velocity": speed}), record_events=False)
    return simulation.sample(times)[signal]


def fit_drop_tests(
    scene: Scene,
    tests: Sequence[DropTest],
    parameters: Sequence[str] = BARRIER,
    signal: str = "bit_position",
    span: float = 10.0,
    steps: int = 7,
    confidence: float = 0.95,
) -> Fit:
    """Fit C_R and W_R, or all of the bilinear law, to drop tests of the bit.

    The signal is a smooth function of the parameters only as long as the bit
    makes the same drilling cycles; where their number changes it jumps. So
    grids, coarse to fine, are searched first; least squares go on from the best
    point; and a search without derivatives ends it. The slopes that the
    intervals rest on are taken over one standard error, not over a vanishing
    step, and the misfit itself is looked at on both sides of each interval.

    Parameters
    ----------
    scene : Scene
        Of the drop test, a bit alone. Its rock is the first guess.
    tests : sequence of DropTest
        Noise is taken to be alike and independent in all.
    parameters : sequence of str
        What is fitted, of `ROCK`. The rest is taken as exact: K_R and gamma
        from a slow test should be fitted along (`ROCK`), for a small error of
        K_R passes for a large one of C_R.
    signal : str
        What was measured, one of `SIGNALS`.
    span : float
        Searched are C_R and W_R from the guess by this factor to it times this
        factor; 1 searches nothing.
    steps : int
        Values of each on a grid.
    confidence : float
        Of the intervals.

    Returns
    -------
    Fit
        With estimates by the keys of `parameters`, SI units.

    Raises
    ------
    FitError
        If data or arguments make no sense, or the data tell nothing of them.
    """
    check_confidence(confidence)
    names = tuple(parameters)
    _check_arguments(scene, names, signal, span, steps)
    rows = [_checked(k, test) for k, test in enumerate(tests)]
    if not rows:
        raise FitError("tests: at least one drop test is needed")
    data = np.concatenate([values for _, values, _ in rows])

    def signals(at: np.ndarray) -> np.ndarray:
        here = scene.replace(**dict(zip(names, np.exp(at).tolist(), strict=True)))
        return np.concatenate([drop_test_signal(here, t, v, signal) for t, _, v in rows])

    guess = np.log([scene[name] for name in names])
    bounds = _bounds(scene, names, guess)
    model = CountedModel(signals, *bounds)
    reach = np.where(np.isin(names, BARRIER), np.log(span), 0.0)
    width = student_width(confidence, len(data) - len(names))
    at = search(model, data, guess, reach, steps)
    for left in reversed(range(MOST_STARTS)):
        at, jacobian, spread = descend(model, data, at, names)
        ends, best = profile_intervals(model, data, at, spread, width)
        # the last intervals stay with the point that they were found at
        if best is at or left == 0:
            break
        at = best
    return make_fit(model, data, at, jacobian, ends, names, (True,) * len(names), confidence)


def _bounds(scene: Scene, names: Sequence[str], guess: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms between which the fit stays."""
    low, high = guess - FARTHEST, guess + FARTHEST
    for k, name in enumerate(names):
        row = scene.row_of(name)
        if row.lower:
            low[k] = max(low[k], np.log(row.lower) + SHORT_OF_BOUND)
        if row.upper:
            high[k] = min(high[k], np.log(row.upper) - SHORT_OF_BOUND)
    return low, high


def _check_arguments(
    scene: Scene, names: tuple[str, ...], signal: str, span: float, steps: int
) -> None:
    if scene.piston.model != "absent":
        raise FitError(f'piston.model = "{scene.piston.model}": a drop test is of a bit alone')
    if not scene.barrier_on:
        raise FitError("the scene has no energy barrier: its C_R and W_R are the first guess")
    for name in names:
        if name not in ROCK or names.count(name) > 1:
            raise FitError(f"parameters: {name} must be one of {', '.join(ROCK)}, once")
    if not names:
        raise FitError(f"parameters: at least one of {', '.join(ROCK)} is needed")
    if signal not in SIGNALS:
        raise FitError(f"signal = {signal!r}: must be one of {', '.join(SIGNALS)}")
    if not 1.0 <= span <= np.exp(FARTHEST):
        raise FitError(f"span = {span!r}: must be a factor from 1 to {np.exp(FARTHEST):.0f}")
    if steps < LEAST_STEPS:
        raise FitError(f"steps = {steps!r}: must be a whole number from {LEAST_STEPS} on")


def _checked(k: int, test: DropTest) -> tuple[np.ndarray, np.ndarray, float]:
    columns = {f"time of test {k}": test.time, f"values of test {k}": test.values}
    time, values = checked_columns(columns, LEAST_DATA)
    if time[0] < 0 or np.any(np.diff(time) <= 0):
        raise FitError(f"time of test {k}: must rise, and start at 0 s or later")
    if not (np.isfinite(test.speed) and test.speed > 0):
        raise FitError(f"speed of test {k} = {test.speed!r} m/s: must be a number above 0")
    return time, values, float(test.speed)
