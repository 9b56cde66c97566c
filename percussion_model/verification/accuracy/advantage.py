"""Waves against the best of their peers: times for the same error, over several scenes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import NamedTuple

from percussion_model.verification.accuracy.orders import Cost
from percussion_model.verification.accuracy.study import PEERS, Study

__all__ = [
    "MET",
    "MISSED",
    "PEER_MISSES",
    "UNDECIDED",
    "Bounds",
    "Contest",
    "Summary",
    "contest",
    "summary",
]

# How a contest ends: both meet the error; one of them does not; the reference cannot tell, or
# both meet it with their coarsest rungs.
MET, PEER_MISSES, MISSED, UNDECIDED = "met", "no peer meets it", "waves miss it", "undecided"


@dataclass(frozen=True)
class Contest:
    """Waves and the best peer, at one error of one scene.

    Attributes
    ----------
    title : str
        Of the scene.
    wanted : float
        Relative error that both have to meet for good.
    wave : Cost
    peer : Cost or None
        The cheapest of the peers, None where none meets the error.
    outcome : str
        `MET`, `PEER_MISSES`, `MISSED` or `UNDECIDED`.
    ratio, low, high : float
        Time of the peer by that of the waves, and its range. Where one of the two misses the
        error, or meets it with its coarsest rung, a bound, from the dearest rung or from that.
    """

    title: str
    wanted: float
    wave: Cost
    peer: Cost | None
    outcome: str
    ratio: float
    low: float
    high: float

    @property
    def least(self) -> float:
        """What the ratio is at least: 0 where it is bounded from above alone."""
        bounded_above = self.outcome == MISSED or (self.peer is not None and self.peer.is_bound)
        return 0.0 if bounded_above else self.ratio

    @property
    def most(self) -> float:
        """What the ratio is at most: infinite where it is bounded from below alone."""
        return math.inf if self.outcome == PEER_MISSES or self.wave.is_bound else self.ratio


def contest(found: Study, wanted: float, key: str = "", waves: str = "wave") -> Contest:
    """Compare the waves with the best of their peers.

    Parameters
    ----------
    found : Study
    wanted : float
        Relative error.
    key : str
        Quantity; the main one if left out.
    waves : str
        Ladder of the waves.
    """
    key = key or found.main
    wave, peer = found.cost(waves, key, wanted), found.best(PEERS, key, wanted)

    def ended(outcome: str, ratio: float, low: float, high: float) -> Contest:
        return Contest(found.title, wanted, wave, peer, outcome, ratio, low, high)

    floor = found.reference.floor(key)
    if math.isnan(floor) or not wave.decided or (peer is not None and not peer.decided):
        return ended(UNDECIDED, math.nan, math.nan, math.nan)
    wave_met = math.isfinite(wave.value)
    if peer is not None and wave_met:
        if wave.is_bound and peer.is_bound:
            return ended(UNDECIDED, math.nan, math.nan, math.nan)
        ratio = peer.value / wave.value
        low = 0.0 if peer.is_bound else peer.low / wave.high
        return ended(MET, ratio, low, math.inf if wave.is_bound else peer.high / wave.low)
    if wave_met:
        tried = [found.cost(name, key, wanted) for name in found.peers]
        if not tried or not all(cost.decided for cost in tried):
            return ended(UNDECIDED, math.nan, math.nan, math.nan)
        least = min(cost.dearest for cost in tried) / wave.value
        return ended(PEER_MISSES, least, least, math.inf)
    if peer is not None:
        most = peer.value / wave.dearest
        return ended(MISSED, most, 0.0, most)
    return ended(UNDECIDED, math.nan, math.nan, math.nan)


class Bounds(NamedTuple):
    """What a ratio is at least and at most; both are the same where it is known."""

    least: float
    most: float

    @property
    def decided(self) -> bool:
        """Whether anything is known of it."""
        return self.least > 0.0 or self.most < math.inf


UNKNOWN = Bounds(math.nan, math.nan)


class Summary(NamedTuple):
    """Ratios over scenes: those of the luckiest, the median and the worst.

    Attributes
    ----------
    wanted : float
    scenes, undecided : int
        How many there are, and of how many there is no ratio, nor a bound.
    luckiest, median, worst : Bounds
        NaN where nothing is decided.
    where : tuple of str
        Titles of the luckiest and the worst scene.
    """

    wanted: float
    scenes: int
    undecided: int
    luckiest: Bounds
    median: Bounds
    worst: Bounds
    where: tuple[str, str]


def summary(contests: Sequence[Contest]) -> Summary:
    """Sum up contests of one error."""
    known = [one for one in contests if one.outcome != UNDECIDED]
    wanted, undecided = contests[0].wanted, len(contests) - len(known)
    if not known:
        return Summary(wanted, len(contests), undecided, UNKNOWN, UNKNOWN, UNKNOWN, ("", ""))
    # what is in a place of the order lies between those that are there if all ratios are as
    # small, or as great, as their bounds allow
    least, most = sorted(one.least for one in known), sorted(one.most for one in known)
    ranked = sorted(known, key=lambda one: one.ratio)
    return Summary(
        wanted,
        len(contests),
        undecided,
        Bounds(least[-1], most[-1]),
        Bounds(median(least), median(most)),
        Bounds(least[0], most[0]),
        (ranked[-1].title, ranked[0].title),
    )
