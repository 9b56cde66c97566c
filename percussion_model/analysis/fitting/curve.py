"""A measured curve of force over penetration: its model, and K_R and gamma at first sight."""

from __future__ import annotations

from typing import Any

import numpy as np

from percussion_model.analysis.fitting.measurements import Curve, FitError

# Data that each branch must have with force on the rock.
LEAST_BRANCH = 3
# Force below this share of the greatest does not count for the first guess of a slope.
CLEAR_FORCE = 0.1
# Which data carry load is settled after so many rounds, or goes to and fro by one of them.
MOST_ROUNDS = 20


def bilinear_force(
    penetration: Any,
    stiffness: float,
    ratio: float,
    datum: float = 0.0,
    peak: float | None = None,
) -> np.ndarray:
    """Force of one slow loading and unloading (docs/model.md, table 1: FC, then BC).

    Parameters
    ----------
    penetration : array_like
        In the order of time: rising, then falling [m].
    stiffness : float
        K_R [N/m].
    ratio : float
        gamma.
    datum : float
        Penetration at which the rock is touched [m].
    peak : float, optional
        Penetration at which unloading begins [m]; default the greatest.

    Returns
    -------
    ndarray
        [N].
    """
    p = np.asarray(penetration, dtype=float)
    turn = int(np.argmax(p))
    peak = float(p[turn]) if peak is None else peak
    loading = stiffness * (p - datum)
    unloading = stiffness * (peak - datum) - ratio * stiffness * (peak - p)
    return np.maximum(np.where(np.arange(len(p)) <= turn, loading, unloading), 0.0)


def best_datum_and_peak(
    curve: Curve, stiffness: float, ratio: float, guess: tuple[float, float]
) -> tuple[float, float]:
    """Find where the rock is touched and where unloading begins, for a given K_R and gamma.

    The zero of the gauge is rarely that of the rock, and the greatest reading rarely the
    peak. Force is linear in both as long as the same data carry load.

    Parameters
    ----------
    curve : Curve
        Checked.
    stiffness, ratio : float
    guess : (float, float)
        Datum and peak [m].

    Returns
    -------
    datum, peak : float
        [m]
    """
    p, force = curve.penetration, curve.force
    loading = np.arange(len(p)) <= int(np.argmax(p))
    slopes = stiffness * np.column_stack([-np.ones(len(p)), np.where(loading, 0.0, 1.0 - ratio)])
    offset = stiffness * np.where(loading, 1.0, ratio) * p
    datum, peak = guess
    carries = np.zeros(len(p), bool)
    for _ in range(MOST_ROUNDS):
        now = slopes @ (datum, peak) + offset > 0.0
        if np.array_equal(now, carries):
            break
        carries = now
        if min(np.sum(carries & loading), np.sum(carries & ~loading)) < LEAST_BRANCH:
            return guess
        matrix = slopes[carries]
        datum, peak = np.linalg.solve(matrix.T @ matrix, matrix.T @ (force - offset)[carries])
    return float(datum), float(peak)


def first_sight(curve: Curve) -> tuple[float, float, float, float]:
    """Find K_R, gamma, datum and peak by straight lines through both branches.

    Raises
    ------
    FitError
        If the data are no loading and unloading.
    """
    p, measured = curve.penetration, curve.force
    turn = int(np.argmax(p))
    clear = measured > CLEAR_FORCE * measured.max()
    lines = []
    for name, part in (("loading", slice(0, turn + 1)), ("unloading", slice(turn, None))):
        x, y = p[part][clear[part]], measured[part][clear[part]]
        if len(np.unique(x)) < LEAST_BRANCH:
            raise FitError(
                f"penetration: {len(np.unique(x))} data of {name} under force, at least "
                f"{LEAST_BRANCH} are needed; the rows must be in the order of time, one "
                "loading and one unloading"
            )
        slope, intercept = np.polyfit(x, y, 1)
        if not slope > 0:
            raise FitError(f"force: does not rise with penetration while {name}")
        lines.append((float(slope), float(intercept)))
    (loading, intercept), (unloading, _) = lines
    if not unloading > loading:
        raise FitError(
            f"force: unloads less stiffly ({unloading:.3g} N/m) than it loads ({loading:.3g} N/m): "
            "the rows must be in the order of time"
        )
    return loading, unloading / loading, -intercept / loading, float(p[turn])
