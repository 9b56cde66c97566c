"""Waves against the best of their peers: times for the same error, over several scenes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from percussion_model.verification.accuracy.orders import Cost
from percussion_model.verification.accuracy.study import PEERS, Study

__all__ = [
    "MET",
    "MISSED",
    "PEER_MISSES",
    "UNDECIDED",
    "Contest",
    "Summary",
    "contest",
    "summary",
]

# How a contest ends: both meet the error; one of them does not; the reference cannot tell.
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
        Time of the peer by that of the waves, and its range. Where one of the two misses
        the error a bound, from the dearest rung that it was given.
    """

    title: str
    wanted: float
    wave: Cost
    peer: Cost | None
    outcome: str
    ratio: float
    low: float
    high: float


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
        ratio = peer.value / wave.value
        return ended(MET, ratio, peer.low / wave.high, peer.high / wave.low)
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


class Summary(NamedTuple):
    """Ratios over scenes: those of the luckiest, the median and the worst.

    Attributes
    ----------
    wanted : float
    scenes, undecided : int
        How many there are, and of how many the reference cannot tell.
    luckiest, median, worst : float
        Bounds count as what they bound; NaN where nothing is decided.
    where : tuple of str
        Titles of the luckiest and the worst scene.
    """

    wanted: float
    scenes: int
    undecided: int
    luckiest: float
    median: float
    worst: float
    where: tuple[str, str]


def summary(contests: Sequence[Contest]) -> Summary:
    """Sum up contests of one error."""
    known = sorted(
        ((one.ratio, one.title) for one in contests if one.outcome != UNDECIDED), reverse=True
    )
    wanted, undecided = contests[0].wanted, len(contests) - len(known)
    if not known:
        return Summary(wanted, len(contests), undecided, math.nan, math.nan, math.nan, ("", ""))
    ratios = [ratio for ratio, _ in known]
    middle = 0.5 * (ratios[(len(ratios) - 1) // 2] + ratios[len(ratios) // 2])
    where = known[0][1], known[-1][1]
    return Summary(wanted, len(contests), undecided, ratios[0], middle, ratios[-1], where)
