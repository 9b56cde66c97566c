"""Least squares of a model that is smooth piece by piece: minimum, and honest intervals."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

Model = Callable[[np.ndarray], np.ndarray]

# The misfit at an end of an interval may stay this far below what a straight model has there.
STRAIGHT_ENOUGH = 0.9
# Points of the profile on both sides, in half-widths of the interval.
PROFILE_POINTS = (0.4, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0)
# Residuals that follow from each other by so many standard errors are no independent noise.
MOST_CORRELATION = 4.0
# Step of the first slopes, in the logarithm: far above the noise of events that move from cell
# to cell, far below the steps at which the number of drilling cycles changes.
FIRST_STEP = 0.01
# Steps of the last slopes, which are taken over one standard error.
LEAST_STEP, MOST_STEP = 1e-4, 0.1
# Grids are refined down to steps of this size, in the logarithm.
SEARCHED = 0.1
LEAST_STEPS = 4  # with fewer a finer grid is no finer
# Least squares have arrived when a step is as small, relative.
ARRIVED = 1e-4
# The search without derivatives ends at this share of a standard error.
POLISHED = 0.05
MOST_POLISH = 40  # runs a parameter


class FitError(ValueError):
    """Data that nothing can be fitted to, or a fit that went wrong; the message says why."""


class Estimate(NamedTuple):
    """A fitted number, SI units."""

    value: float
    standard_error: float  # from the Jacobian
    low: float  # ends of the confidence interval
    high: float


@dataclass(frozen=True)
class Fit:
    """What a least-squares fit found, SI units.

    Attributes
    ----------
    estimates : dict of Estimate
        By name; those of the rock by the dotted key of the parameter.
    confidence : float
        Of the intervals, each for itself.
    noise : float
        Standard deviation of the residuals, in units of the data.
    fitted : ndarray
        The model at the data.
    half_width : ndarray
        Half the width of the confidence band of the fitted curve at the data.
    residuals : ndarray
        Data less model.
    runs : int
        How often the model was computed.
    warnings : list of str
        Why the intervals should not be trusted, if so.
    """

    estimates: dict[str, Estimate]
    confidence: float
    noise: float
    fitted: np.ndarray = field(repr=False)
    half_width: np.ndarray = field(repr=False)
    residuals: np.ndarray = field(repr=False)
    runs: int
    warnings: list[str]

    def changes(self) -> dict[str, float]:
        """Fitted parameters of a scene, for `Scene.replace`."""
        return {key: found.value for key, found in self.estimates.items() if "." in key}

    def summary(self) -> dict[str, Any]:
        """Return the numbers as plain values for JSON."""
        return {
            "estimates": {name: found._asdict() for name, found in self.estimates.items()},
            "confidence": self.confidence,
            "noise": self.noise,
            "data": len(self.residuals),
            "runs": self.runs,
            "warnings": self.warnings,
        }


class CountedModel:
    """A model that counts its calls, within bounds of its parameters.

    Parameters
    ----------
    model : callable
        Parameters to data.
    low, high : ndarray, optional
        Bounds of the parameters.
    """

    def __init__(
        self, model: Model, low: np.ndarray | None = None, high: np.ndarray | None = None
    ) -> None:
        self.model, self.runs = model, 0
        self.low: Any = -math.inf if low is None else low
        self.high: Any = math.inf if high is None else high

    def __call__(self, at: np.ndarray) -> np.ndarray:
        """Compute the model, at the nearest place within the bounds."""
        self.runs += 1
        return self.model(np.clip(at, self.low, self.high))

    def misfit(self, data: np.ndarray, at: np.ndarray) -> float:
        """Sum of squares of the residuals; infinite out of bounds."""
        if np.any(at < self.low) or np.any(at > self.high):
            return math.inf
        off = data - self(at)
        return float(off @ off)


def covariance(jacobian: np.ndarray, variance: float, names: Sequence[str]) -> np.ndarray:
    """Covariance s^2 (J^T J)^-1 of the parameters.

    Raises
    ------
    FitError
        If the data do not depend on a parameter, or on two in the same way.
    """
    scale = np.linalg.norm(jacobian, axis=0)
    for name, length in zip(names, scale, strict=True):
        if not length > 0:
            raise FitError(f"{name} cannot be told from these data: they do not depend on it")
    alike = (jacobian / scale).T @ (jacobian / scale)
    if np.linalg.cond(alike) > 1.0 / math.sqrt(np.finfo(float).eps):
        raise FitError(f"{' and '.join(names)} cannot be told apart from these data")
    return np.asarray(variance * np.linalg.inv(alike) / np.outer(scale, scale))


def profile_intervals(
    model: CountedModel, data: np.ndarray, at: np.ndarray, spread: np.ndarray, width: float
) -> tuple[np.ndarray, np.ndarray]:
    """Check intervals by the misfit itself, and look for a better place on the way.

    Along the line on which one parameter moves and the others follow at their
    best, a straight model has the misfit S (1 + h^2/f) at h standard errors,
    with f degrees of freedom. An interval reaches to the farthest place looked
    at that does no worse than its end should, and beyond by one step.

    Parameters
    ----------
    model : CountedModel
        Parameters to data.
    data : ndarray
    at : ndarray
        The best parameters so far.
    spread : ndarray
        Their covariance.
    width : float
        Half-width of the wanted interval, in standard errors.

    Returns
    -------
    ends : ndarray, shape (parameters, 2)
        Infinite where the search met no end.
    best : ndarray
        The best place met.
    """
    misfit, best = model.misfit(data, at), at
    least = misfit
    enough = 1.0 + STRAIGHT_ENOUGH * width**2 / (len(data) - len(at))
    errors = np.sqrt(np.diag(spread))
    ends = np.empty((len(at), 2))
    for k, error in enumerate(errors):
        if error == 0.0:  # data without noise
            ends[k] = at[k]
            continue
        for side, sign in enumerate((-1.0, 1.0)):
            reach = width
            for factor, beyond in zip(PROFILE_POINTS, (*PROFILE_POINTS[1:], math.inf), strict=True):
                place = at + sign * factor * width / error * spread[:, k]
                there = model.misfit(data, place)
                if there < least:
                    least, best = there, place
                if there < enough * misfit and factor >= 1.0:
                    reach = beyond * width
            ends[k, side] = at[k] + sign * reach * error
    return ends, best


def make_fit(
    model: CountedModel,
    data: np.ndarray,
    at: np.ndarray,
    jacobian: np.ndarray,
    ends: np.ndarray,
    names: Sequence[str],
    logarithmic: Sequence[bool],
    confidence: float,
) -> Fit:
    """Put a fit together.

    Parameters
    ----------
    model : CountedModel
        Parameters to data.
    data : ndarray
    at : ndarray
        The best parameters; logarithms where `logarithmic`.
    jacobian : ndarray, shape (data, parameters)
    ends : ndarray, shape (parameters, 2)
        Of the intervals.
    names : sequence of str
    logarithmic : sequence of bool
    confidence : float

    Returns
    -------
    Fit
    """
    fitted = model(at)
    residuals = data - fitted
    variance = float(residuals @ residuals) / (len(data) - len(at))
    spread = covariance(jacobian, variance, names)
    errors = np.sqrt(np.diag(spread))
    notes = _correlation_note(residuals)
    estimates = {}
    for k, name in enumerate(names):
        if not np.isfinite(ends[k]).all():
            notes.append(f"{name}: the interval has no end within what was searched")
        row = np.array([at[k], errors[k], *ends[k]])
        if logarithmic[k]:
            with np.errstate(over="ignore"):
                row[[0, 2, 3]] = np.exp(row[[0, 2, 3]])
            row[1] *= row[0]
        estimates[name] = Estimate(*row.tolist())
    width = student_width(confidence, len(data) - len(at))
    band = width * np.sqrt(np.einsum("ij,jk,ik->i", jacobian, spread, jacobian))
    noise = math.sqrt(variance)
    return Fit(estimates, confidence, noise, fitted, band, residuals, model.runs, notes)


def student_width(confidence: float, freedom: int) -> float:
    """Half-width of an interval in standard errors."""
    from scipy.stats import t as student

    return float(student.ppf(0.5 + 0.5 * confidence, freedom))


def _correlation_note(residuals: np.ndarray) -> list[str]:
    """Say that neighbouring residuals are alike, where they are."""
    total = float(residuals @ residuals)
    if not total > 0:
        return []
    correlation = float(residuals[1:] @ residuals[:-1]) / total
    if correlation * math.sqrt(len(residuals)) <= MOST_CORRELATION:
        return []
    return [
        f"neighbouring residuals are alike (correlation {correlation:.2f}): the model misses "
        "something, or the noise is no white noise; the intervals are too narrow"
    ]


def checked_columns(columns: dict[str, Any], least: int) -> list[np.ndarray]:
    """Return columns of data as arrays.

    Raises
    ------
    FitError
        If one is no row of finite numbers, or they differ in length, or are short.
    """
    found = []
    for name, values in columns.items():
        try:
            column = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            raise FitError(f"{name}: must be numbers") from None
        if column.ndim != 1:
            raise FitError(f"{name}: must be one row of numbers, not of shape {column.shape}")
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            raise FitError(f"{name}: number {bad[0]} of the row (from 0) is {column[bad[0]]}")
        found.append(column)
    lengths = [len(column) for column in found]
    if len(set(lengths)) > 1:
        words = ", ".join(f"{name} {n}" for name, n in zip(columns, lengths, strict=True))
        raise FitError(f"columns must be of one length: {words}")
    if lengths[0] < least:
        raise FitError(f"{' and '.join(columns)}: {lengths[0]} data, at least {least} are needed")
    return found


def check_confidence(confidence: float) -> None:
    """Raise `FitError` unless a confidence makes sense."""
    if not 0 < confidence < 1:
        raise FitError(f"confidence = {confidence!r}: must be a number above 0 and below 1")


def search(
    model: CountedModel, data: np.ndarray, guess: np.ndarray, reach: np.ndarray, steps: int
) -> np.ndarray:
    """Best point of a grid around the guess, of a finer one around that, and so on.

    Parameters
    ----------
    model : CountedModel
        Parameters to data.
    data : ndarray
    guess : ndarray
        Logarithms.
    reach : ndarray
        How far to search on either side; parameters with 0 stay.
    steps : int
        Values of each parameter on a grid.

    Returns
    -------
    ndarray
    """
    centre = np.clip(guess, model.low, model.high)
    while np.max(reach) > SEARCHED:
        axes = [np.linspace(-r, r, steps) if r > 0 else np.zeros(1) for r in reach]
        # The last varies fastest; among C_R and W_R it is the one that is cheap to change.
        points = [
            np.clip(centre + np.array(shift), model.low, model.high)
            for shift in itertools.product(*axes)
        ]
        centre = min(points, key=lambda at: model.misfit(data, at))
        reach = 2.0 * reach / (steps - 1)
    return centre


def descend(
    model: CountedModel, data: np.ndarray, start: np.ndarray, names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Go down to the minimum next to a point.

    Returns
    -------
    at : ndarray
        The minimum.
    jacobian : ndarray, shape (data, parameters)
        Taken over one standard error.
    spread : ndarray
        Covariance.
    """
    from scipy.optimize import least_squares, minimize

    def covariance_at(at: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
        variance = model.misfit(data, at) / (len(data) - len(at))
        return covariance(jacobian, variance, names)

    found = least_squares(
        lambda at: model(at) - data,
        start,
        lambda at: slopes(model, at, np.full(len(at), FIRST_STEP)),
        (model.low, model.high),
        xtol=ARRIVED,
        ftol=ARRIVED**2,
        x_scale="jac",
    )
    spread = covariance_at(found.x, found.jac)
    size = _steps(spread)
    corners = np.vstack([np.zeros(len(start)), np.eye(len(start))])
    polished = minimize(
        lambda shift: model.misfit(data, found.x + shift * size),
        corners[0],
        method="Nelder-Mead",
        options={
            "initial_simplex": corners,
            "xatol": POLISHED,
            "fatol": math.inf,
            "maxfev": MOST_POLISH * len(start),
        },
    )
    at = found.x + polished.x * size
    for _ in range(2):  # the step is the error, which follows from the step
        jacobian = slopes(model, at, _steps(spread))
        spread = covariance_at(at, jacobian)
    return at, jacobian, spread


def slopes(model: Model, at: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Jacobian by central differences over given steps, shape (data, parameters)."""
    columns = []
    for k, step in enumerate(steps):
        shift = np.zeros(len(at))
        shift[k] = step
        columns.append((model(at + shift) - model(at - shift)) / (2.0 * step))
    return np.stack(columns, axis=1)


def _steps(spread: np.ndarray) -> np.ndarray:
    """Steps of one standard error, within limits."""
    return np.clip(np.sqrt(np.diag(spread)), LEAST_STEP, MOST_STEP)
