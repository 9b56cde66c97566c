"""Random walk over all rocks that the data allow, across the many dips of their deviance."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from percussion_model.analysis.fitting.likelihood import Likelihood, Place

# Steps of a walk, for one parameter and as often again for each further one.
STEPS_OF_ONE = 250
# Lengths of steps by the spread of the places so far, evenly in the logarithm: long ones lead
# over ridges, short ones along them.
SHORTEST, LONGEST = 0.05, 3.0
# From so many steps on, and again after so many, the spread is that of the later part.
FIRST_LOOK, NEXT_LOOK = 200, 100
EARLY = 0.25
# So near to the edge of the range, in the logarithm, an interval is open. Where the law itself
# ends it is closed, and reaches to that end from this share of its width.
AT_EDGE, AT_END = 0.1, 0.05
# Of the width of an interval: a gap this wide without any place parts two minima.
PARTED = 0.33
# Ends of intervals wider than this, in the logarithm, are pushed out by this share of the width
# and twice as far each time, until nothing there explains the data.
WORTH_A_PUSH, PUSH = math.log(2.0), 0.1
# One round of least squares tells most places; those that end above the limit by less than
# this share of the threshold get more.
NEAR, MORE_ROUNDS = 2.0, 3
# Profiles reach to this multiple of the threshold.
SHOWN = 2.0
# Values of a parameter at which its profile is given.
POINTS = 40


@dataclass
class Walk:
    """Places that were looked at."""

    at: np.ndarray  # shape (places, parameters), logarithms
    deviance: np.ndarray  # shape (places,)

    def joined(self, other: Walk) -> Walk:
        """Both together."""
        return Walk(np.vstack([self.at, other.at]), np.append(self.deviance, other.deviance))

    @classmethod
    def of(cls, places: Sequence[Place]) -> Walk:
        """Places that are known already."""
        return cls(np.array([one.at for one in places]), np.array([one.deviance for one in places]))

    def lifted(self, dip: float, floor: float) -> Walk:
        """What lies above the bottom of a dip, as if that were as low as a floor."""
        return Walk(
            self.at, np.where(self.deviance < dip, self.deviance, self.deviance - dip + floor)
        )

    @property
    def best(self) -> np.ndarray:
        """The likeliest place."""
        best: np.ndarray = self.at[self.deviance.argmin()]
        return best

    def spread(self, threshold: float) -> np.ndarray | None:
        """Covariance of the places less than a threshold above the best; None of too few."""
        inside = self.at[self.deviance < self.deviance.min() + threshold]
        return None if len(inside) <= inside.shape[1] else np.atleast_2d(np.cov(inside.T))


@dataclass(frozen=True)
class Profile:
    """What the walk says of one parameter, in the logarithm."""

    low: float  # ends of the interval; infinite where it is open within the range
    high: float
    gap: tuple[float, float] | None  # ends of a wide gap within: minima apart are as likely
    values: np.ndarray = field(repr=False)
    deviance: np.ndarray = field(repr=False)  # the lowest that was found at these values


class Explored(NamedTuple):
    """The best place, its covariance, what was found around, whether no better place was, what to
    know of it, and why nothing explains the data if that is so."""

    best: Place
    spread: np.ndarray
    profiles: list[Profile]
    minima: list[Place]
    threshold: float
    settled: bool
    notes: Sequence[str] = ()
    unreached: Sequence[str] = ()


def steps_wanted(free: int) -> int:
    """Steps of a walk with so many parameters."""
    return int(STEPS_OF_ONE * 2**free)


def walk(
    like: Likelihood,
    start: Place,
    spread: np.ndarray,
    threshold: float,
    steps: int,
    rng: np.random.Generator,
) -> Walk:
    """Walk about so that places lie about as far above the best as a threshold.

    An adaptive Metropolis walk [1]_ with the deviance divided by a temperature. Dips that
    are less deep than the threshold do not hold it.

    Parameters
    ----------
    like : Likelihood
    start : Place
    spread : ndarray
        Covariance of the first steps, in the logarithm.
    threshold : float
        In the deviance.
    steps : int
    rng : Generator

    Returns
    -------
    Walk
        All places that may matter, whether the walk went there or not.

    References
    ----------
    .. [1] H. Haario, E. Saksman, J. Tamminen, "An adaptive Metropolis algorithm",
       Bernoulli 7 (2001) 223-242.
    """
    free = len(start.at)
    # where the deviance is a parabola, its mean above the best is a temperature a parameter
    temperature = threshold / free
    here, factor = start, _root(spread)
    passed, seen, deviance = [start.at], [start.at], [start.deviance]
    least = start.deviance
    for step in range(1, steps + 1):
        if step >= FIRST_LOOK and step % NEXT_LOOK == 0:
            factor = _root(np.cov(np.array(passed[int(EARLY * step) :]).T))
        length = math.exp(rng.uniform(math.log(SHORTEST), math.log(LONGEST)))
        at = here.at + length * factor @ rng.standard_normal(free)
        limit = here.deviance + 2.0 * temperature * rng.exponential()
        # above both it is neither where the walk goes nor of use for a profile
        shown = least + SHOWN * threshold
        there = like.below(_reflected(at, like.low, like.high), max(limit, shown), threshold)
        if there is not None:
            if there.deviance < limit:
                here = there
            seen.append(there.at)
            deviance.append(there.deviance)
            least = min(least, there.deviance)
        passed.append(here.at)
    return Walk(np.array(seen), np.array(deviance))


def _root(covariance: np.ndarray) -> np.ndarray:
    """A square root of a covariance that may be singular."""
    variances, directions = np.linalg.eigh(np.atleast_2d(covariance))
    root: np.ndarray = directions * np.sqrt(np.maximum(variances, 0.0))
    return root


def _reflected(at: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Place as far within the range as it was beyond."""
    at = np.where(at > high, 2.0 * high - at, at)
    return np.where(at < low, 2.0 * low - at, at)


def pushed_out(
    like: Likelihood,
    walked: Walk,
    threshold: float,
    lowest: Callable[[np.ndarray, list[int], int], Place],
) -> list[Place]:
    """Places beyond the ends of wide intervals: a walk may have stopped short of the true ends.

    Parameters
    ----------
    like : Likelihood
    walked : Walk
    threshold : float
        Deviance above the best at which an interval ends.
    lowest : callable
        Goes down from a place, over some of its parameters, in so many rounds.

    Returns
    -------
    list of Place
        The last one of each end lies outside of the interval, or at the edge of the range.
    """
    inside = walked.at[walked.deviance < walked.deviance.min() + threshold]
    limit = walked.deviance.min() + threshold
    found: list[Place] = []
    for k in range(inside.shape[1]):
        width = float(np.ptp(inside[:, k]))
        if width < WORTH_A_PUSH:
            continue
        others = [j for j in range(inside.shape[1]) if j != k]
        low = like.low[k] + (0.0 if like.ends_low[k] else AT_EDGE)
        for row, sign in ((inside[:, k].argmin(), -1.0), (inside[:, k].argmax(), 1.0)):
            at, step = inside[row], PUSH * width
            while low < at[k] < like.high[k] - AT_EDGE:
                at = at.copy()
                at[k] = np.clip(at[k] + sign * step, like.low[k], like.high[k])
                place = lowest(at, others, 1) if others else like.at(at)
                if others and limit <= place.deviance < limit + NEAR * threshold:
                    place = lowest(place.at, others, MORE_ROUNDS)
                found.append(place)
                if place.deviance >= limit:
                    break
                at, step = place.at, 2.0 * step
    return found


def profiles_of(like: Likelihood, walked: Walk, threshold: float) -> list[Profile]:
    """Interval and profile of each parameter: ends of what lies below a threshold.

    Parameters
    ----------
    like : Likelihood
    walked : Walk
    threshold : float
        Deviance above the best.
    """
    above = walked.deviance - walked.deviance.min()
    inside = above < threshold
    found = []
    for k, values in enumerate(walked.at.T):
        allowed = np.sort(values[inside])
        low, high = allowed[[0, -1]]
        closed = like.ends_low[k]
        if closed and low - like.low[k] < AT_END * (high - low):
            low = like.low[k]
        shown = above < SHOWN * threshold
        open_above = not high < like.high[k] - AT_EDGE
        open_below = not (closed or low > like.low[k] + AT_EDGE)
        if open_above and low == like.low[k]:
            open_below = True  # the whole range
        found.append(
            Profile(
                -math.inf if open_below else low,
                math.inf if open_above else high,
                _gap(allowed),
                *_lowest(values[shown], above[shown]),
            )
        )
    return found


def _gap(allowed: np.ndarray) -> tuple[float, float] | None:
    """Ends of the widest gap between rising values, where there are many and it is wide."""
    if len(allowed) <= POINTS:
        return None
    last = int(np.diff(allowed).argmax())
    low, high = float(allowed[last]), float(allowed[last + 1])
    return (low, high) if high - low > PARTED * (allowed[-1] - allowed[0]) else None


def _lowest(values: np.ndarray, above: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest points in intervals of equal width."""
    bins = np.linspace(values.min(), values.max(), POINTS + 1)[1:-1]
    which = np.digitize(values, bins)
    order = np.lexsort((above, which))
    first = order[np.append(True, np.diff(which[order]) > 0)]
    return values[first], above[first]
