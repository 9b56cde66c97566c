"""The ledger of leaps is that of their steps, and its residual shows an error in them."""

from __future__ import annotations

import os

import numpy as np
import pytest

from percussion_model import Scene, Simulation
from percussion_model.physics.ledger import DISSIPATED, NUMERICAL, STORED, WORKS, unexplained
from percussion_model.solvers.wave.solver import WaveSolver
from tests.invariants.ledger_scenes import random_scene

WAVES = Scene().computed_by("wave")
ENTRIES = (*WORKS, *DISSIPATED, *NUMERICAL, *STORED)
# Of a run's energy. Over 300 random scenes residuals stay below 7e-12, `numerical` above
# -1e-14; over 4 ms, in which rounding hardly grows, leaps on and off differ by 2e-11.
MOST_RESIDUAL = 5e-11
LEAST_NUMERICAL = -1e-9
MOST_DIFFERENCE = 1e-9
SAME_MOTION = 0.004  # s
RANDOM = 300 if os.environ.get("PERCUSSION_LONG") else 12

SCENES = {
    "much loss under 10 MN": ({"loss.time": 3.7e-4, "feed.force": 1e7}, 0.07),
    "loss in a thousand parts": ({"loss.time": 1e-3}, 0.05),
    "loss in twelve parts": ({"loss.time": 1e-5}, 0.1),
    "reference": ({}, 0.1),
}


def ledger_at(scene, end):
    """Ledger at the first grid point from `end` on, what it is measured by, and counts."""
    simulation = Simulation(scene)
    simulation.advance(end)
    simulation.advance(simulation.solver.grid_point_after(simulation.save().state, end))
    ledger = simulation.energy()
    scale = unexplained(ledger | {"start": ledger["initial"]})[1]
    return ledger, scale, simulation.statistics()


def both_ways(scene, end):
    """Ledger with leaps and step by step, and the energy to measure them by."""
    leaping, scale, counts = ledger_at(scene, end)
    stepping, _, no_leaps = ledger_at(scene.replace(**{"solver.leaps": False}), end)
    assert no_leaps["leaps"] == 0
    return leaping, stepping, scale, counts["leaps"]


@pytest.mark.parametrize("name", SCENES)
def test_leaps_book_what_their_steps_would(name):
    changes, end = SCENES[name]
    leaping, stepping, scale, leaps = both_ways(WAVES.replace(**changes), end)
    assert leaps > 1
    for entry in ENTRIES:
        assert abs(leaping[entry] - stepping[entry]) < 1e-9 * scale, entry
    assert leaping["numerical"] > 0.0
    assert abs(leaping["residual"]) < MOST_RESIDUAL * scale


@pytest.mark.parametrize("part", ["piston_loss", "loss", "squares"])
def test_the_residual_shows_an_error_in_a_leap(part):
    """A thousandth more in one of the forms that leaps book by."""
    scene = WAVES
    solver = WaveSolver(scene)
    forms = getattr(solver._operators, part)
    solver._operators = solver._operators._replace(**{part: 1.001 * forms})
    simulation = Simulation(scene, solver=solver)
    simulation.advance(0.1)
    wrong = abs(simulation.energy()["residual_relative"])
    # long leaps of standstill, whose dashpot takes little, are all that uses the squares
    assert wrong > {"piston_loss": 1e-6, "loss": 1e-6, "squares": 1e-12}[part]
    assert wrong > 20 * abs(ledger_at(scene, 0.1)[0]["residual_relative"])


def test_the_residual_shows_a_leap_that_moves_otherwise():
    """Powers that lose a millionth of the bit's waves, as its forms do not know."""
    scene = WAVES
    solver = WaveSolver(scene)
    solver._operators = solver._operators._replace(bit=(1.0 - 1e-6) * solver._operators.bit)
    simulation = Simulation(scene, solver=solver)
    simulation.advance(0.1)
    assert abs(simulation.energy()["residual_relative"]) > 1e-9


@pytest.mark.parametrize("seed", range(RANDOM))
def test_the_ledger_of_random_scenes(seed):
    scene = random_scene(np.random.default_rng(seed))
    leaping, stepping, scale, _ = both_ways(scene, SAME_MOTION)
    for ledger in (leaping, stepping):
        assert abs(ledger["residual"]) <= MOST_RESIDUAL * scale
        assert ledger["numerical"] >= LEAST_NUMERICAL * scale
    for entry in ENTRIES:
        assert abs(leaping[entry] - stepping[entry]) <= MOST_DIFFERENCE * scale, entry
    later, scale, _ = ledger_at(scene, 0.03)
    assert abs(later["residual"]) <= MOST_RESIDUAL * scale
    assert later["numerical"] >= LEAST_NUMERICAL * scale


def test_random_scenes_leap():
    """Most of them do, with each mode of piston and rock."""
    scenes = [random_scene(np.random.default_rng(seed)) for seed in range(40)]
    counts = [ledger_at(scene, 0.03)[2]["leaps"] for scene in scenes]
    assert np.count_nonzero(counts) > 30
    assert {scene.effects.rock for scene in scenes} == {"bilinear", "spring", "wall", "none"}
    assert {scene.piston.model for scene in scenes} == {"elastic", "rigid", "absent"}


def test_feed_works_along_the_way_of_the_bit():
    """Cut steps, of which there are some in every blow, among the others."""
    scene = WAVES.replace(**{"feed.force": 2e4})
    simulation = Simulation(scene)
    simulation.advance(0.1)
    simulation.advance(simulation.solver.grid_point_after(simulation.save().state, 0.1))
    way = simulation.observe()["bit_position"]
    assert simulation.energy()["feed"] == pytest.approx(scene.feed.force * way, rel=1e-10)
