"""Compared quantities, and the error of an answer against a reference."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

__all__ = ["HISTORY", "QUANTITIES", "RATE", "Answer", "Quantity", "batch_means", "relative_error"]

RATE = "rate_of_penetration"
HISTORY = "bit_force_history"
# Parts of an aperiodic run whose means are taken as independent.
BATCHES = 16


@dataclass(frozen=True)
class Quantity:
    """A number that methods are compared by: its name, and how it is shown."""

    key: str
    label: str
    factor: float
    unit: str


QUANTITIES = {
    one.key: one
    for one in (
        Quantity(RATE, "rate of penetration", 1e3, "mm/s"),
        Quantity("blow_period", "blow period", 1e3, "ms"),
        Quantity("impact_velocity", "impact velocity", 1.0, "m/s"),
        Quantity("rebound_velocity", "rebound velocity", 1.0, "m/s"),
        Quantity("peak_bit_force", "peak bit force", 1e-3, "kN"),
        Quantity("rock_energy", "energy into rock, a blow", 1.0, "J"),
        Quantity("resting_place", "resting place of the bit", 1e3, "mm"),
        Quantity(HISTORY, "bit force through a blow (L1)", 1.0, ""),
    )
}


@dataclass
class Answer:
    """Answer of a method.

    Attributes
    ----------
    values : dict of float
        By the names of `QUANTITIES`, SI units.
    errors : dict of float
        Standard errors, where the motion is aperiodic.
    history : ndarray or None
        Force on the rock [N] at the problem's offsets from the start of a blow.
    blows : float
        Blows that the timed run went through.
    """

    values: dict[str, float]
    errors: dict[str, float] = field(default_factory=dict)
    history: np.ndarray | None = None
    blows: float = 1.0


def relative_error(
    answer: Answer, values: dict[str, float], history: np.ndarray | None, key: str
) -> float:
    """Error of a quantity relative to a reference; of the history, the ratio of L1 norms.

    NaN where one of the two does not have it.
    """
    if key == HISTORY:
        if answer.history is None or history is None or len(answer.history) != len(history):
            return float("nan")
        return float(np.sum(np.abs(answer.history - history)) / np.sum(np.abs(history)))
    found, wanted = answer.values.get(key), values.get(key)
    if found is None or not wanted:
        return float("nan")
    return abs(found / wanted - 1.0)


def batch_means(values: np.ndarray, weights: np.ndarray | None = None) -> tuple[float, float]:
    """Mean of rows, or ratio of two sums, and its standard error from batches.

    Blows of an aperiodic motion are not independent: where the bit leaps far, the next
    blow takes back most of it. Means over whole stretches of the run are nearly so.

    Parameters
    ----------
    values, weights : ndarray, shape (n,)
        The mean is sum(values) / sum(weights), or / n.

    Returns
    -------
    mean, standard_error : float
    """
    below = np.ones(len(values)) if weights is None else weights
    mean = float(np.sum(values) / np.sum(below))
    parts = np.array_split(np.arange(len(values)), min(BATCHES, len(values)))
    means = np.array([np.sum(values[part]) / np.sum(below[part]) for part in parts])
    if len(means) < 2:
        return mean, float("nan")
    return mean, float(np.std(means, ddof=1) / np.sqrt(len(means)))
