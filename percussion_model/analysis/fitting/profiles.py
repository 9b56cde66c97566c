"""Profile likelihood: how far a parameter may move while the others follow at their best."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from percussion_model.analysis.fitting.likelihood import Likelihood, Place
from percussion_model.analysis.fitting.search import (
    LEAST_STEP,
    MOST_STEP,
    STEP_SHARE,
    descend,
    distinct,
)

# An end of an interval is found when the square root of the deviance is as near to that of the
# threshold, or the place as near to the end, as a share of the way.
NEAR_ENOUGH, SHORT_ENOUGH = 0.1, 0.1
MOST_TRIALS = 16
# Steps outwards grow by a factor between these.
LEAST_GROWTH, MOST_GROWTH = 1.25, 4.0
# and after so many trials at least by this one.
PATIENT_TRIALS, LATE_GROWTH = 3, 2.5
# Places as far beyond an end, as a multiple of the way to it, are looked at where the deviance
# jumps: behind a change in the number of drilling cycles the fit may be good again.
BEYOND = (1.5, 2.5)
# A deviance at the end of a straight model may be this much off before that is done.
ODD = 1.6
# The first step is no longer than this, in the logarithm.
LONGEST = 1.5
# At each place of a profile, descents begin from the best of so many known places beside it;
# starts nearer to each other than this in all parameters are one, in the logarithm.
NEIGHBOURS, FOLLOWED, APART = 2, 2, 0.1
# So near to the edge of the range, in the logarithm, is at it.
AT_EDGE = 1e-3
# A place better than the best by this share of the threshold starts all over.
BETTER = 0.1


class BetterPlaceError(Exception):
    """A profile met a better place than the best so far."""

    def __init__(self, place: Place) -> None:
        super().__init__("a better place was met")
        self.place = place


@dataclass
class Profile:
    """Deviance of one parameter, the others at their best.

    Attributes
    ----------
    low, high : float
        Ends of the interval (logarithms); infinite where it is open within the range.
    places : list of Place
        All that were found on it.
    own : (float, float)
        Ends of what belongs to the first minimum, without rivals.
    split : bool
        Whether places between the ends are not in the interval: minima apart are as likely.
    """

    low: float = -math.inf
    high: float = math.inf
    places: list[Place] = field(default_factory=list)
    own: tuple[float, float] = (-math.inf, math.inf)
    split: bool = False

    def reach(self, at: float, low: float, high: float) -> None:
        """Span a place as well; at the edge of what is searched the interval is open."""
        self.low = min(self.low, at if at > low + AT_EDGE else -math.inf)
        self.high = max(self.high, at if at < high - AT_EDGE else math.inf)

    def include(self, other: Profile) -> None:
        """Span another profile of the same parameter as well."""
        self.split |= other.low > self.high or other.high < self.low
        self.low, self.high = min(self.low, other.low), max(self.high, other.high)
        self.places += other.places


@dataclass
class Follower:
    """Follows profiles from a minimum.

    Attributes
    ----------
    like : Likelihood
    base : float
        Deviance of the best of all places; falls where a better one is met.
    threshold : float
        Deviance above it at the ends of the intervals.
    pool : list of ndarray
        Places (logarithms) at which the fit is known to be good; those found are added.
    rough : set of int
        Parameters in which the deviance jumps.
    restarts : bool
        Whether a much better place raises an error.
    hurry : callable
        Whether so much was computed that ends are not narrowed down any more: the first
        place beyond one is it, and one descent leads to it.
    """

    like: Likelihood
    base: float
    threshold: float
    pool: list[np.ndarray]
    rough: set[int]
    restarts: bool
    hurry: Callable[[], bool] = lambda: False

    def profile(self, start: Place, spread: np.ndarray, which: int) -> Profile:
        """Follow the profile of one parameter to both sides of a minimum.

        Parameters
        ----------
        start : Place
            The minimum.
        spread : ndarray
            Covariance of all parameters there, in the logarithm.
        which : int

        Raises
        ------
        BetterPlaceError
        """
        found = Profile(places=[start])
        found.low = self._end(start, spread, which, -1.0, found.places)
        found.high = self._end(start, spread, which, 1.0, found.places)
        found.own = found.low, found.high
        return found

    def _end(
        self, start: Place, spread: np.ndarray, which: int, sign: float, places: list[Place]
    ) -> float:
        """End of the interval on one side."""
        edge = (self.like.high if sign > 0 else self.like.low)[which]
        room = abs(float(edge - start.at[which]))
        error, root = math.sqrt(spread[which, which]), math.sqrt(self.threshold)
        inner, inner_root = 0.0, math.sqrt(max(start.deviance - self.base, 0.0))
        outer, outer_root = math.inf, math.inf
        near, straight = start, spread[:, which] / error**2
        way, expected = min(root * error, LONGEST, room), root * min(1.0, LONGEST / (root * error))
        if way == 0.0:
            return math.copysign(math.inf, sign)
        odd, end = False, math.inf
        for trial in range(MOST_TRIALS):
            ahead = np.clip((way - inner) * sign * straight, -LONGEST, LONGEST)
            place = self._best_at(which, start.at[which] + sign * way, near.at + ahead, spread)
            places.append(place)
            height = math.sqrt(max(place.deviance - self.base, 0.0))
            odd |= trial == 0 and not expected / ODD < height < expected * ODD
            if height < root:
                inner, inner_root, near = way, height, place
            else:
                outer, outer_root = way, height
            end = outer
            if self.hurry() and math.isfinite(outer):
                break
            if abs(height - root) < NEAR_ENOUGH * root:
                end = min(way * root / max(height, 1e-3), room)
                break
            if outer - inner < SHORT_ENOUGH * outer:
                break
            if math.isinf(outer):
                if way >= room:
                    return math.copysign(math.inf, sign)
                growth = 1.05 * root / max(height, 1e-3)
                least = LEAST_GROWTH if trial < PATIENT_TRIALS else LATE_GROWTH
                way = min(way * min(max(growth, least), MOST_GROWTH), way + LONGEST, room)
            else:
                share = (root - inner_root) / (outer_root - inner_root)
                way = inner + min(max(share, 0.15), 0.85) * (outer - inner)
        if math.isinf(end):
            return math.copysign(math.inf, sign)
        for factor in BEYOND if odd and not self.hurry() else ():
            if factor * end < room:
                there = start.at[which] + sign * factor * end
                place = self._best_at(which, there, near.at, spread)
                places.append(place)
                if place.deviance - self.base < self.threshold:
                    return self._end(place, spread, which, sign, places)
        return float(start.at[which] + sign * end)

    def _best_at(self, which: int, value: float, guess: np.ndarray, spread: np.ndarray) -> Place:
        """Best place with one parameter at a value, from a guess and from the nearest known."""
        others = [k for k in range(len(guess)) if k != which]
        hurry = self.hurry()
        by_distance = sorted(self.pool, key=lambda at: abs(float(at[which]) - value))
        starts = []
        for at in [guess, *by_distance[: NEIGHBOURS if which in self.rough and not hurry else 0]]:
            moved = np.clip(at, self.like.low, self.like.high)
            moved[which] = value
            starts.append(self.like.at(moved))
        steps = np.clip(STEP_SHARE * np.sqrt(np.diag(spread)), LEAST_STEP, MOST_STEP)
        best = min(starts, key=lambda one: one.deviance)
        if others:
            firsts = distinct(starts, np.full(len(guess), APART), 1 if hurry else FOLLOWED)
            rounds = 1 if hurry else 2
            lower = [descend(self.like, one.at, others, steps, rounds)[0] for one in firsts]
            best = min(lower, key=lambda one: one.deviance)
        if best.deviance < self.base - BETTER * self.threshold and self.restarts:
            raise BetterPlaceError(best)
        self.base = min(self.base, best.deviance)
        self.pool.append(best.at)
        return best
