"""Kinds of motion by their blows, and mean rates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from examples.shared import BLACK, GREEN, GREY
from percussion_model.simulation.rate import rate_of_blows

# Impact velocities that differ by less, relative, are the same.
SAME = 1e-3
# Blows go round n values where they repeat after n blows so much better than after one.
BETTER = 8.0
LONGEST_CYCLE = 8
# Blows without order that differ by less are nearly alike.
NEARLY = 0.05
KINDS = {
    "every blow alike": "#E6E6E6",
    "round 2 to 8 values": GREEN,
    "nearly alike": GREY,
    "no order": BLACK,
}
# What the errors of a branch are those of.
ABOUT_ERRORS = (
    "standard errors are by the scatter of the blows; those by the cells are not estimated"
)


@dataclass(frozen=True)
class Branch:
    """Blows along one way through the values of a parameter."""

    values: np.ndarray
    impact_velocity: np.ndarray  # (values, blows) [m/s]
    rate: np.ndarray  # mean over the blows of each value [m/s]
    error: np.ndarray  # its standard error [m/s]


def order_of(velocity: np.ndarray) -> int:
    """Values that impact velocities go round, one after the other; 0 if they do not."""
    lags = range(1, min(LONGEST_CYCLE, len(velocity) // 2) + 1)
    changes = [float(np.max(np.abs(velocity[n:] - velocity[:-n]))) for n in lags]
    same = max(SAME * float(np.mean(velocity)), changes[0] / BETTER)
    return next((n for n, change in zip(lags, changes, strict=True) if change <= same), 0)


def kind_of(velocity: np.ndarray) -> int:
    """Place among `KINDS`."""
    order = order_of(velocity)
    return min(order, 2) - 1 if order else 2 + int(np.ptp(velocity) > NEARLY * np.mean(velocity))


def branch_of(values: np.ndarray, rows: list[np.ndarray]) -> Branch:
    """Blows at each value, and their mean rate; the branch has the values rising."""
    up = np.argsort(values)
    velocity = np.array([blows["impact_velocity"] for blows in rows])
    rate, error = np.array([rate_of_blows(blows) for blows in rows]).T
    return Branch(values[up], velocity[up], rate[up], error[up])


def described(branch: Branch) -> dict[str, list[float]]:
    """Numbers of a branch as plain values, the rate with its standard error."""
    shown = {"values": branch.values, "rate": branch.rate, "rate_standard_error": branch.error}
    order = [order_of(velocity) for velocity in branch.impact_velocity]
    return {"order": order} | {name: numbers.tolist() for name, numbers in shown.items()}
