"""Waves against peers, on studies whose answer is known."""

from __future__ import annotations

import math

import pytest

from percussion_model.verification.accuracy import Point, Reference, Study
from percussion_model.verification.accuracy.advantage import (
    MET,
    MISSED,
    PEER_MISSES,
    UNDECIDED,
    contest,
    summary,
)
from percussion_model.verification.accuracy.problems import PERIODIC, RATE
from percussion_model.verification.accuracy.references import Bar


def made(ladders, bar=1e-6, agreed=True, title=""):
    """A study of ladders: pairs of time and error, by name."""
    points = [
        Point(name, str(k), 1.0 / time, 0.0, time, time, 3, 0.0, {}, {RATE: error})
        for name, rungs in ladders.items()
        for k, (time, error) in enumerate(rungs)
    ]
    bars = {RATE: Bar(1.0, bar, {"wave": (1.0, bar), "explicit": (1.0, bar)}, agreed)}
    return Study(title, PERIODIC, 1.0, 1.0, Reference(title, PERIODIC, bars, {}), points, {}, {})


WAVE = [(2.0, 5e-4)]


def test_the_cheapest_peer_counts():
    found = made({"wave": WAVE, "explicit": [(10.0, 5e-4)], "fem": [(50.0, 5e-4)], "rigid": WAVE})
    one = contest(found, 1e-3)
    assert one.outcome == MET
    assert one.peer is not None
    assert one.peer.ladder == "explicit"
    assert one.ratio == pytest.approx(5.0)
    assert one.low <= one.ratio <= one.high


def test_what_one_side_misses_gives_a_bound():
    lost = contest(made({"wave": WAVE, "explicit": [(10.0, 5e-2)], "fem": [(8.0, 5e-2)]}), 1e-3)
    assert lost.outcome == PEER_MISSES
    assert lost.ratio == pytest.approx(4.0)  # from the peer that was given least
    bad = contest(made({"wave": [(2.0, 5e-2)], "explicit": [(10.0, 5e-4)]}), 1e-3)
    assert bad.outcome == MISSED
    assert bad.ratio == pytest.approx(5.0)


def test_what_the_reference_does_not_resolve_is_undecided():
    ladders = {"wave": WAVE, "explicit": [(10.0, 1e-4)]}
    assert contest(made(ladders, bar=6e-4), 1e-3).outcome == UNDECIDED
    assert contest(made(ladders, agreed=False), 1e-3).outcome == UNDECIDED
    assert contest(made(ladders), 1e-3).outcome == MET


def test_the_summary_has_the_worst_scene_and_not_the_luckiest_alone():
    studies = [
        made({"wave": WAVE, "explicit": [(2.0 * ratio, 5e-4)]}, title=str(ratio))
        for ratio in (3.0, 0.5, 7.0, 11.0)
    ]
    told = summary([contest(one, 1e-3) for one in [*studies, made({"wave": WAVE}, bar=1.0)]])
    assert (told.luckiest, told.median, told.worst) == pytest.approx((11.0, 5.0, 0.5))
    assert told.where == ("11.0", "0.5")
    assert (told.scenes, told.undecided) == (5, 1)
    assert math.isnan(summary([contest(studies[0], 1e-9)]).median)
