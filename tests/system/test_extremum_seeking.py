"""The seeker ends within 3 % of the best rate of an open-loop sweep."""

from __future__ import annotations

import os

import numpy as np
import pytest

from scenarios.extremum_seeking import LAST, STARTS, draw, rate_over, seek, sweep

LONG = os.environ.get("PERCUSSION_LONG") == "1"
# The lowest start is the farthest from the top, by the logarithm and by the slope.
CHOSEN = STARTS if LONG else (STARTS[-1],)


def test_the_seeker_finds_the_best_feed(extremum_seeking, tmp_path):
    hill = sweep(extremum_seeking) if LONG else sweep(extremum_seeking, (1700.0, 2800.0, 4200.0))
    feeds, rates = hill.T
    best = rates.max()
    # there is a hill to be climbed, with its top inside
    assert rates[0] < 0.9 * best
    assert rates[-1] < 0.9 * best
    runs = [seek(extremum_seeking, start, 40.0 if LONG else 24.0) for start in CHOSEN]
    for start, run in zip(CHOSEN, runs, strict=True):
        assert run["controller.seek.centre"][0] == start
        assert rate_over(run, run["time"][-1] - LAST) > 0.97 * best
        assert run["controller.seek.centre"][-1] == pytest.approx(feeds[np.argmax(rates)], rel=0.12)
    assert draw(hill, runs, tmp_path / "seek.png").stat().st_size > 20_000
