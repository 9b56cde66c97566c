"""The ledger of waves closes in any scene, step by step."""

from __future__ import annotations

import os

import numpy as np
import pytest

from percussion_model import Scene, Simulation
from percussion_model.physics.ledger import total, unexplained
from percussion_model.solvers.base import make_solver
from tests.invariants.ledger_scenes import random_scene

WAVES = Scene().computed_by("wave")
# Of a run's energy; rounding of each step besides, 1.6e-15 at most in 300 random scenes.
MOST_RESIDUAL, OF_A_STEP = 5e-11, 2e-15
LEAST_NUMERICAL = -1e-9
RANDOM = 300 if os.environ.get("PERCUSSION_LONG") else 40


def ledger_at(scene, end):
    """Ledger at the first grid point from `end` on, and what it is measured by."""
    simulation = Simulation(scene)
    simulation.advance(end)
    simulation.advance(simulation.solver.grid_point_after(simulation.save().state, end))
    ledger = simulation.energy()
    return ledger, unexplained(ledger | {"start": ledger["initial"]})[1]


def test_sums_have_the_roundings_of_compiled_code_in_every_python():
    assert total([1e16, 1.0, -1e16]) == 0.0


@pytest.mark.parametrize(
    ("changes", "end"),
    [
        ({"loss.time": 2e-6, "feed.force": 1e7, "solver.cells": 8}, 0.07),
        ({"loss.time": 2e-6, "solver.cells": 8}, 0.05),
        ({}, 0.1),
    ],
    ids=["much loss under 10 MN", "much loss", "reference"],
)
def test_the_ledger_closes(changes, end):
    ledger, scale = ledger_at(WAVES.replace(**changes), end)
    assert ledger["numerical"] > 0.0
    assert abs(ledger["residual"]) < MOST_RESIDUAL * scale


@pytest.mark.parametrize("seed", range(RANDOM))
def test_the_ledger_of_random_scenes(seed):
    scene = random_scene(np.random.default_rng(seed))
    for end in (0.004, 0.03):
        ledger, scale = ledger_at(scene, end)
        steps = end / make_solver(scene).time_step
        assert abs(ledger["residual"]) <= max(MOST_RESIDUAL, OF_A_STEP * steps) * scale
        assert ledger["numerical"] >= LEAST_NUMERICAL * scale


def test_random_scenes_differ():
    """All kinds of rock and piston are among them."""
    scenes = [random_scene(np.random.default_rng(seed)) for seed in range(40)]
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
