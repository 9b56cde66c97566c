"""The default solver against the best of its peers: times for the same error, over scenes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import NamedTuple

from percussion_model.verification.accuracy.orders import Cost
from percussion_model.verification.accuracy.study import PEERS, Study

# How a contest ends: both meet the error; one of them does not; the reference cannot tell, or
# both meet it with their coarsest rungs.
MET, PEER_MISSES, MISSED, UNDECIDED = "met", "no peer meets it", "the solver misses it", "undecided"
THRESHOLD = "the motion is near a threshold"


@dataclass(frozen=True)
class Contest:
    """The default solver and the best peer, at one error of one scene."""

    title: str  # of the scene
    wanted: float  # relative error that both have to meet for good
    own: Cost  # of the default solver
    peer: Cost | None  # the cheapest of the peers, None where none meets the error
    outcome: str  # `MET`, `PEER_MISSES`, `MISSED` or `UNDECIDED`
    # time of the peer by that of the solver, and its range. Where one of the two misses the
    # error, or meets it with its coarsest rung, a bound, from the dearest rung or from that
    ratio: float
    low: float
    high: float
    why: str = ""  # why it is undecided, or the peer faster; empty where neither is so

    @property
    def least(self) -> float:
        """What the ratio is at least: 0 where it is bounded from above alone."""
        bounded_above = self.outcome == MISSED or (self.peer is not None and self.peer.is_bound)
        return 0.0 if bounded_above else self.ratio

    @property
    def most(self) -> float:
        """What the ratio is at most: infinite where it is bounded from below alone."""
        return math.inf if self.outcome == PEER_MISSES or self.own.is_bound else self.ratio


def contest(
    found: Study, wanted: float, key: str = "", ladder: str = "", duration: float = math.inf
) -> Contest:
    """Compare the default solver with the best of its peers.

    Parameters
    ----------
    found : Study
    wanted : float
        Relative error.
    key : str
        Quantity; the main one if left out.
    ladder : str
        The one to be compared; that of the default solver if left out.
    duration : float
        Of a run whose set-up counts as well [s]; without set-up if left out.
    """
    key = key or found.main
    own = found.cost(ladder or found.own, key, wanted, duration)
    peer = found.best(PEERS, key, wanted, duration)
    why = ""

    def ended(outcome: str, ratio: float, low: float, high: float) -> Contest:
        return Contest(found.title, wanted, own, peer, outcome, ratio, low, high, why)

    floor = found.reference.floor(key)
    if math.isnan(floor) or not own.decided or (peer is not None and not peer.decided):
        bar = found.reference.bars.get(key)
        why = THRESHOLD if bar is not None and bar.threshold else "by the bar of the reference"
        return ended(UNDECIDED, math.nan, math.nan, math.nan)
    is_met = math.isfinite(own.value)
    if peer is not None and is_met:
        if own.is_bound and peer.is_bound:
            why = "both meet it with their coarsest settings"
            return ended(UNDECIDED, math.nan, math.nan, math.nan)
        ratio = peer.value / own.value
        low = 0.0 if peer.is_bound else peer.low / own.high
        why = _why_slower(found, own, peer) if ratio < 1.0 else ""
        return ended(MET, ratio, low, math.inf if own.is_bound else peer.high / own.low)
    if is_met:
        tried = [found.cost(name, key, wanted, duration) for name in found.peers]
        if not tried or not all(cost.decided for cost in tried):
            return ended(UNDECIDED, math.nan, math.nan, math.nan)
        least = min(cost.dearest for cost in tried) / own.value
        return ended(PEER_MISSES, least, least, math.inf)
    if peer is not None:
        why = MISSED
        most = peer.value / own.dearest
        return ended(MISSED, most, 0.0, most)
    return ended(UNDECIDED, math.nan, math.nan, math.nan)


def _why_slower(found: Study, own: Cost, peer: Cost) -> str:
    """Why a peer is faster: by luck, by its coarse mesh, or by what the solver needs."""
    if peer.is_bound:
        return "the peer meets it with its coarsest setting"
    mine, other = (found.meets(one).label for one in (own, peer))
    return f"{other} meet the error for good, of the solver {mine}"


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
    """Ratios over scenes: those of the luckiest, the median and the worst."""

    wanted: float
    scenes: int
    undecided: int  # scenes of which there is no ratio, nor a bound
    luckiest: Bounds  # these three are NaN where nothing is decided
    median: Bounds
    worst: Bounds
    where: tuple[str, str]  # titles of the luckiest and the worst scene


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
