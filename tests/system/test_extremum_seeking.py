"""The seeker ends within 3 % of the best rate of an open-loop sweep."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from scenarios import extremum_seeking as extremum_seeking_script
from scenarios import two_way_seeking
from scenarios.extremum_seeking import BOUND, LAST, STARTS, draw, rate_over, seek, sweep, top_of
from scenarios.results import DIST

LONG = os.environ.get("PERCUSSION_LONG") == "1"
long = pytest.mark.skipif(not LONG, reason="takes minutes; set PERCUSSION_LONG=1")
LUMPED = {"string.model": 2}  # a cheaper string
SHORT, LATE = 16.0, 4.0  # the seeker is there after six periods [s]


@pytest.fixture(scope="module")
def best(extremum_seeking):
    """Greatest rate of a short sweep [m/s], whose top is known from the long one."""
    hill = sweep(extremum_seeking, (2700.0, 2820.0, 2950.0), 3.2, LUMPED)
    assert np.argmax(hill[:, 1]) == 1
    return hill[1, 1]


@pytest.mark.parametrize("start", STARTS)
def test_the_seeker_finds_the_best_feed(extremum_seeking, best, start):
    run = seek(extremum_seeking, start, SHORT, LUMPED)
    centre = run["controller.seek.centre"]
    assert centre[0] == start
    assert rate_over(run, SHORT - LATE) > (1.0 - BOUND) * best
    assert centre[-1] == pytest.approx(2820.0, rel=0.05)
    # it began on the hill, not at its top: the first window that counts saw the slope
    slope = run["controller.seek.gradient"][run["time"] >= 4.1][0]
    assert np.sign(slope) == np.sign(2820.0 - start)
    assert abs(slope) > 0.3


def hill_of(best_feed):
    feeds = np.linspace(1700.0, 4200.0, 26)
    return np.stack([feeds, 0.016 * np.exp(-3.0 * np.log(feeds / best_feed) ** 2)], axis=1)


def test_the_top_of_a_sweep_is_found_between_its_feeds():
    (feed, rate), (feed_error, _) = top_of(hill_of(2870.0))
    assert feed == pytest.approx(2870.0, rel=1e-3)
    assert rate == pytest.approx(0.016, rel=1e-5)
    assert feed_error < 3.0
    rough = hill_of(2870.0)
    rough[:, 1] *= 1.0 + 0.01 * np.random.default_rng(1).standard_normal(len(rough))
    (feed, _), (feed_error, _) = top_of(rough)
    # the error says how far off it may be
    assert 3.0 < feed_error < 200.0
    assert abs(feed - 2870.0) < 4.0 * feed_error


def test_the_top_of_a_sweep_over_both_is_found():
    rows = [
        (f, p, 0.015 * np.exp(-3.0 * np.log(f / 2830.0) ** 2 - 2.0 * np.log(p / 1.88e6) ** 2))
        for f in two_way_seeking.FEEDS
        for p in two_way_seeking.PRESSURES
    ]
    top, errors = two_way_seeking.top_of(np.array(rows))
    np.testing.assert_allclose(top, [2830.0, 1.88e6, 0.015], rtol=5e-3)
    assert np.all(errors < 0.01 * top)


class Ended(dict):
    """Signals of a seeker that has ended at 2823.4 N and 19.037 bar, at a rate [m/s]."""

    error = ""

    def __init__(self, rate, duration):
        time = np.linspace(0.0, duration, 101)
        super().__init__(
            {
                "time": time,
                "hammer.blow_time": time,
                "hammer.blow_position": rate * time,
                "controller.seek.centre": np.full(101, 2823.4),
                "controller.seek.pressure_centre": np.full(101, 1.9037e6),
            }
        )


@pytest.mark.parametrize("module", [extremum_seeking_script, two_way_seeking])
def test_rows_of_a_seeker_say_that_its_errors_are_not_known(module, monkeypatch, capsys):
    one_way = module is extremum_seeking_script
    hill = hill_of(2830.0)
    if not one_way:
        hill = np.array(
            [
                (f, p, 0.016 * np.exp(-3.0 * np.log(f / 2830.0) ** 2 - np.log(p / 1.9e6) ** 2))
                for f in two_way_seeking.FEEDS
                for p in two_way_seeking.PRESSURES
            ]
        )
    monkeypatch.setattr(module, "sweep", lambda *words: hill)
    monkeypatch.setattr(module, "seek", lambda *words: Ended(0.0155432, module.DURATION))
    monkeypatch.setattr(module, "write_search", lambda *words: [])
    module.main([Path("x.ssp")], Path("x"))
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("from ")]
    assert len(rows) == 3
    for row in rows:
        found = row.split(": ")[1]
        assert found.startswith("≈2820 N, " if one_way else "≈2820 N, ≈19.0 bar, ")
        assert "≈15.5 mm/s, ≈-2.9 %" in found


def test_a_seeker_within_the_error_of_the_best_rate_is_not_said_to_be_worse():
    assert extremum_seeking_script.reached(0.0162, 0.0164, 0.0005).startswith("≈16.2 mm/s, undecid")


@long
def test_three_starts_and_a_dense_sweep(extremum_seeking, tmp_path):
    hill = sweep(extremum_seeking)
    (_, rate), (_, rate_error) = top_of(hill)
    # the top is known much better than the bound, and is inside of the sweep
    assert rate_error < 0.002 * rate
    assert max(hill[0, 1], hill[-1, 1]) < 0.75 * rate
    runs = [seek(extremum_seeking, start) for start in STARTS]
    for run in runs:
        assert rate_over(run, run["time"][-1] - LAST) > (1.0 - BOUND) * rate
    assert draw(hill, runs, tmp_path / "seek.png").stat().st_size > 40_000


@long
def test_the_seeker_finds_feed_and_pressure(two_way, tmp_path):
    hill = two_way_seeking.sweep(two_way)
    top, errors = two_way_seeking.top_of(hill)
    assert errors[2] < 0.002 * top[2]
    runs = [two_way_seeking.seek(two_way, start) for start in two_way_seeking.STARTS]
    for run in runs:
        assert rate_over(run, run["time"][-1] - two_way_seeking.LAST) > (1.0 - BOUND) * top[2]
    path = two_way_seeking.draw(hill, runs, tmp_path / "two.png")
    assert path.stat().st_size > 40_000


@long
def test_the_seeker_finds_the_best_feed_with_waves():
    """The same with elastic piston and bit, where the archive has been built."""
    system = DIST / "ExtremumSeeking.ssp"
    if not system.is_file():
        pytest.skip("python3 build.py system ExtremumSeeking makes the archive")
    hill = sweep(system, (2500.0, 2700.0, 2800.0, 2900.0, 3000.0, 3200.0), 4.0)
    run = seek(system, STARTS[0], 24.0)
    assert rate_over(run, 24.0 - LAST) > (1.0 - BOUND) * hill[:, 1].max()
