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


@pytest.mark.parametrize("k", JUDGED)
def test_rate_of_few_modes(k):
    assert abs(off_by(k)) <= OFF, (by_modes(k), RUNS[k][-1])


@pytest.mark.parametrize("k", OTHERS)
def test_rate_of_few_modes_where_meshes_are_apart(k):
    """Their scatter tells no more; it is no judgement."""
    fine, here = RUNS[k][-1], by_modes(k)
    room = OFF * fine["rate"] + SIGMAS * scatter_of(fine, here)
    assert abs(here["rate"] - fine["rate"]) <= room


# Where no blow differs from the one before.
STEADY = [k for k in JUDGED if RUNS[k][-1]["standard_error"] < 1e-5 * RUNS[k][-1]["rate"]]


@pytest.mark.parametrize("k", STEADY)
def test_drilling_cycles_of_a_blow_are_those_of_the_elements(k):
    assert by_modes(k)["cycles"] == pytest.approx(RUNS[k][-1]["cycles"], abs=0.01)


@pytest.mark.skipif(not LONG, reason="half an hour; set PERCUSSION_LONG=1")
@pytest.mark.parametrize("k", range(COUNT))
def test_truths_computed_anew(k):
    for before, again in zip(RUNS[k], refined(k, drawn()[k]), strict=True):
        room = AGAIN * before["rate"] + SIGMAS * scatter_of(before, again)
        assert abs(again["rate"] - before["rate"]) <= room
