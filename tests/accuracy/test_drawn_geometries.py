"""Few modes on twelve drawn geometries, against refined explicit elements with a hard contact.

A geometry is judged where the two finest meshes agree. What the elements gave is stored;
`PERCUSSION_LONG=1` computes it anew. `drawn_geometries.py` tells how.
"""

from __future__ import annotations

import json
import math
import os
from functools import cache
from typing import Any

import pytest

from tests.accuracy.drawn_geometries import (
    COUNT,
    MODES,
    SEED,
    STORE,
    drawn,
    modal,
    numbers,
    plan_of,
    refined,
    run,
)

LONG = os.environ.get("PERCUSSION_LONG") == "1"
# How far two meshes may be apart, and a rate by modes from the finer, relative to it.
AGREE, OFF = 1e-3, 2e-3
LEAST_JUDGED = 8
# Rates of aperiodic motions are compared within so many standard errors.
SIGMAS = 3.0
# What else a rate computed anew may be off by: machines round differently.
AGAIN = 1e-4

GEOMETRIES = json.loads(STORE.read_text(encoding="utf-8"))
RUNS: list[list[dict[str, Any]]] = [one["runs"] for one in GEOMETRIES["geometries"]]


def is_judged(runs):
    """Whether the two finest meshes agree, and not by the luck of few blows."""
    coarse, fine = runs[-2:]
    apart = abs(coarse["rate"] / fine["rate"] - 1.0)
    scatter = max(coarse["standard_error"], fine["standard_error"]) / fine["rate"]
    return max(apart, scatter) <= AGREE


@cache
def by_modes(k):
    """Run of the modal solver, as long as those of the elements."""
    return run(modal(drawn()[k]), plan_of(k).duration)


def off_by(k):
    """Relative error of the rate by modes."""
    return by_modes(k)["rate"] / RUNS[k][-1]["rate"] - 1.0


def scatter_of(*runs):
    """Standard error of the difference of rates [m/s]."""
    return math.hypot(*(one["standard_error"] for one in runs))


JUDGED = [k for k in range(COUNT) if is_judged(RUNS[k])]
OTHERS = [k for k in range(COUNT) if k not in JUDGED]
# Known failures: modes settle on a motion with another number of drilling cycles, while elements
# agree on one (from 100 in the piston in 1, from 200 in 11). In 1 the rock's force late in the
# first blow is 2e-3 to 5e-3 too large with 20 modes, and what is off falls as slowly as 1 / N;
# without the barrier's dashpot the same forces change by 1e-4 from 20 to 160 modes.
ANOTHER_MOTION = {
    1: "elements have 38 drilling cycles a blow, modes 40",
    11: "elements have 22 and 23 drilling cycles in turn, few modes 21",
}


def params(geometries):
    """Geometries to test, known failures marked."""
    return [
        pytest.param(k, marks=pytest.mark.xfail(reason=ANOTHER_MOTION[k], strict=True))
        if k in ANOTHER_MOTION
        else k
        for k in geometries
    ]


def test_truths_are_those_of_the_drawn_geometries():
    assert GEOMETRIES["seed"] == SEED
    found = json.loads(json.dumps([numbers(scene) for scene in drawn()]))
    assert found == [one["drawn"] for one in GEOMETRIES["geometries"]]


def test_draws_are_as_asked_for():
    for scene in drawn():
        bars = scene.piston, scene.bit
        sections = [section for bar in bars for section in bar.sections]
        assert max(len(bar.sections) for bar in bars) <= 3
        assert sum(section.density != 7850.0 for section in sections) == 1
        assert 0.15 <= scene.piston.length <= 0.35
        assert 0.7 <= scene.bit.length / scene.piston.length <= 2.5


def test_enough_geometries_are_judged():
    assert 20 <= MODES <= 30
    assert len(JUDGED) >= LEAST_JUDGED, OTHERS


@pytest.mark.parametrize("k", params(JUDGED))
def test_rate_of_few_modes(k):
    assert abs(off_by(k)) <= OFF, (by_modes(k), RUNS[k][-1])


@pytest.mark.parametrize("k", OTHERS)
def test_rate_of_few_modes_where_meshes_are_apart(k):
    """Their scatter tells no more; it is no judgement."""
    fine, here = RUNS[k][-1], by_modes(k)
    room = OFF * fine["rate"] + SIGMAS * scatter_of(fine, here)
    assert abs(here["rate"] - fine["rate"]) <= room


@pytest.mark.parametrize("k", sorted(ANOTHER_MOTION))
def test_cycles_differ_where_rates_do(k):
    assert abs(by_modes(k)["cycles"] - RUNS[k][-1]["cycles"]) > 0.5


@pytest.mark.skipif(not LONG, reason="half an hour; set PERCUSSION_LONG=1")
@pytest.mark.parametrize("k", range(COUNT))
def test_truths_computed_anew(k):
    for before, again in zip(RUNS[k], refined(k, drawn()[k]), strict=True):
        room = AGAIN * before["rate"] + SIGMAS * scatter_of(before, again)
        assert abs(again["rate"] - before["rate"]) <= room
