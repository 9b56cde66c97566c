"""K_R and gamma from a measured curve of force over penetration."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from percussion_model.analysis.fitting.least_squares import (
    CountedModel,
    Estimate,
    Fit,
    FitError,
    check_confidence,
    checked_columns,
    covariance,
    make_fit,
    student_width,
)

__all__ = ["bilinear_force", "fit_force_penetration"]

NAMES = ("rock.loading_stiffness", "rock.unloading_ratio", "datum", "peak")
LEAST_DATA = 10
# Data that each branch must have with force on the rock.
LEAST_BRANCH = 3
# Force below this share of the greatest does not count for the first guess of a slope.
CLEAR_FORCE = 0.1


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


def fit_force_penetration(penetration: Any, force: Any, confidence: float = 0.95) -> Fit:
    """Fit K_R and gamma to one slow loading and unloading of the rock.

    Where the rock is touched (`datum`) and where unloading begins (`peak`) are
    fitted as well: the zero of the gauge is rarely that of the rock, and the
    greatest reading rarely the peak. Noise is taken to be in the force, alike
    and independent; penetration should be known far better.

    Parameters
    ----------
    penetration : array_like
        In the order of time: rising, then falling [m].
    force : array_like
        On the rock, compression positive [N].
    confidence : float
        Of the intervals.

    Returns
    -------
    Fit
        With `rock.loading_stiffness` [N/m], `rock.unloading_ratio`, `datum`
        and `peak` [m].

    Raises
    ------
    FitError
        If the data are no loading and unloading.
    """
    from scipy.optimize import least_squares

    check_confidence(confidence)
    columns = {"penetration": penetration, "force": force}
    p, measured = checked_columns(columns, LEAST_DATA)
    first = _first_guess(p, measured)
    # Lengths are counted in spans of the data, so that all parameters are of one size.
    origin, span = float(p.min()), float(np.ptp(p))
    scaled = (p - origin) / span

    def model(at: np.ndarray) -> np.ndarray:
        stiffness, ratio = np.exp(at[:2])
        return bilinear_force(scaled, stiffness, ratio, at[2], at[3])

    start = np.array([np.log(first[0] * span), np.log(first[1]), (first[2] - origin) / span, 1.0])
    load = float(np.max(measured))
    found = least_squares(lambda at: (model(at) - measured) / load, start, "3-point", x_scale="jac")
    jacobian = found.jac * load
    freedom = len(p) - len(NAMES)
    variance = 2.0 * found.cost * load**2 / freedom
    errors = np.sqrt(np.diag(covariance(jacobian, variance, NAMES)))
    reach = student_width(confidence, freedom) * errors
    ends = np.stack([found.x - reach, found.x + reach], axis=1)
    curve = CountedModel(model)
    fit = make_fit(
        curve, measured, found.x, jacobian, ends, NAMES, (True, True, False, False), confidence
    )
    if not fit.estimates[NAMES[1]].value > 1.0:
        raise FitError(
            f"force: unloads less stiffly than it loads (ratio {np.exp(found.x[1]):.3g})"
        )
    return _unscaled(fit, origin, span)


def _first_guess(p: np.ndarray, measured: np.ndarray) -> tuple[float, float, float]:
    """Slopes of both branches and the datum, by straight lines."""
    turn = int(np.argmax(p))
    if not np.ptp(p) > 0:
        raise FitError("penetration: does not change")
    if not measured.max() > 0:
        raise FitError("force: never positive; compression counts positive")
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
    return loading, unloading / loading, -intercept / loading


def _unscaled(fit: Fit, origin: float, span: float) -> Fit:
    """Return the fit with lengths in metres again."""
    found = dict(fit.estimates)
    found[NAMES[0]] = Estimate(*(value / span for value in found[NAMES[0]]))
    for name in NAMES[2:]:
        value, error, low, high = found[name]
        ends = origin + span * low, origin + span * high
        found[name] = Estimate(origin + span * value, span * error, *ends)
    return replace(fit, estimates=found)
