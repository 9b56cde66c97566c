"""Measured orders of convergence, and the cost of a wanted accuracy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from percussion_model.simulation.uncertain import with_short_error

# Fewer points make no order.
LEAST_POINTS = 3
# So many may lie on a line by chance, whatever the order between them.
FEW_POINTS = 5
# What is left of an error that the bar of the reference may make up whole.
NOTHING = 1e-3
# What stands before a bound.
AT_LEAST, AT_MOST = "≥ ", "≤ "
# A smaller error of an order is not shown.
LEAST_SHOWN = 0.01


@dataclass(frozen=True)
class Order:
    """A power law through errors."""

    value: float  # exponent
    # standard error; of few points at least half the spread of the orders between neighbours
    error: float
    scale: float  # error at size one
    points: int

    def __str__(self) -> str:
        return with_short_error(self.value, max(self.error, LEAST_SHOWN))


@dataclass(frozen=True)
class Cost:
    """What a wanted error costs, with its range.

    In the range errors are as sure as the reference's bar, times as the usual spread of the
    ladder's repeats.
    """

    ladder: str
    value: float  # least time, NaN where no rung meets the error [s]
    low: float  # NaN where the error is surely missed [s]
    high: float  # NaN where it is not surely met [s]
    dearest: float  # time of the dearest rung that was tried [s]
    # whether every rung meets the error: a coarser one might cost less, so that value and range
    # are those of an upper bound
    is_bound: bool = False

    @property
    def sign(self) -> str:
        """What stands before the value: "≤ " where it is a bound."""
        return AT_MOST if self.is_bound else ""

    @property
    def decided(self) -> bool:
        """Whether the reference tells that the error is met, or that it is missed."""
        return math.isnan(self.low) or (math.isfinite(self.value) and math.isfinite(self.high))


def fitted_order(sizes: Sequence[float], errors: Sequence[float]) -> Order | None:
    """Fit error = scale * size**value by least squares of logarithms.

    Parameters
    ----------
    sizes, errors : sequence of float
        Those not positive or not finite are left out.

    Returns
    -------
    Order or None
        None with fewer than three points.
    """
    pairs = [
        (size, error)
        for size, error in zip(sizes, errors, strict=True)
        if size > 0 and error > 0 and math.isfinite(size) and math.isfinite(error)
    ]
    if len({size for size, _ in pairs}) < LEAST_POINTS:
        return None
    x, y = np.log(np.array(pairs)).T
    slope, offset = np.polyfit(x, y, 1)
    rest = y - (slope * x + offset)
    spread = float(np.sum((x - x.mean()) ** 2))
    error = math.sqrt(float(rest @ rest) / (len(x) - 2) / spread)
    if len(x) <= FEW_POINTS:
        error = max(error, 0.5 * _spread_of_neighbours(x, y))
    return Order(float(slope), error, math.exp(float(offset)), len(x))


def _spread_of_neighbours(x: np.ndarray, y: np.ndarray) -> float:
    """Range of the slopes between neighbours; of one size the mean counts."""
    sizes = np.unique(x)
    means = np.array([y[x == size].mean() for size in sizes])
    return float(np.ptp(np.diff(means) / np.diff(sizes)))


def cost_at(costs: Sequence[float], errors: Sequence[float], wanted: float) -> float:
    """Cost at which a ladder meets an error for good.

    The dearest point that misses it and the next dearer one bracket the cost; between them
    both logarithms are taken as straight. A cheap point that happens to be good does not
    count while a dearer one is bad.

    Returns
    -------
    float
        NaN where no point meets it, or the dearest does not; where all meet it that of the
        cheapest, which is an upper bound.
    """
    pairs = sorted(
        (cost, error)
        for cost, error in zip(costs, errors, strict=True)
        if math.isfinite(error) and cost > 0
    )
    if not pairs or pairs[-1][1] > wanted:
        return math.nan
    missed = [k for k, (_, error) in enumerate(pairs) if error > wanted]
    if not missed:
        return pairs[0][0]
    (low, bad), (high, good) = pairs[missed[-1]], pairs[missed[-1] + 1]
    if good <= 0:
        return high
    share = math.log(bad / wanted) / math.log(bad / good)
    return low * (high / low) ** share


def cost_range(
    ladder: str, rungs: Sequence[tuple[float, float, float]], wanted: float, bar: float
) -> Cost:
    """Cost at which a ladder meets an error for good, and how sure it is.

    Parameters
    ----------
    ladder : str
        Its name.
    rungs : sequence of (float, float, float)
        Time [s], its relative spread (NaN: not known), and error of each rung.
    wanted : float
        Error.
    bar : float
        Of the reference: each error may be off by it.
    """
    costs = [cost for cost, _, _ in rungs]
    spreads = [spread for _, spread, _ in rungs if math.isfinite(spread)]
    spread = float(np.median(spreads)) if spreads else 0.0
    value, low, high = (
        cost_at(costs, [max(error + shift, NOTHING * error) for _, _, error in rungs], wanted)
        for shift in (0.0, -bar, bar)
    )
    dearest = max(costs, default=math.nan)
    is_bound = math.isfinite(value) and not any(error > wanted for _, _, error in rungs)
    return Cost(ladder, value, low * (1.0 - spread), high * (1.0 + spread), dearest, is_bound)
