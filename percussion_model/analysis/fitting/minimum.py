"""The minimum of a misfit that is smooth only piece by piece."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from percussion_model.analysis.fitting.estimates import Counted, Model, covariance

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


def search(
    model: Counted, data: np.ndarray, guess: np.ndarray, reach: np.ndarray, steps: int
) -> np.ndarray:
    """Best point of a grid around the guess, of a finer one around that, and so on.

    Parameters
    ----------
    model : Counted
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
    model: Counted, data: np.ndarray, start: np.ndarray, names: Sequence[str]
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
