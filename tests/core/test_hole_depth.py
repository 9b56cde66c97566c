"""Hole depth: where the rock lets go, what a rest tells, never less; the same rate as the bit."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model import EventKind, Mode, Scene, Simulation, simulate

RIGID = {"solver.name": "rigid", "piston.model": "rigid", "bit.model": "rigid"}
SOLVERS = {
    "wave": {"solver.name": "wave"},
    "modal": {"solver.name": "modal", "solver.cells": 40},
    "fem": {"solver.name": "fem", "fem.elements": 20},
    "rigid": RIGID,
}
# A depth is a sum over drilling cycles of lengths of a millimetre. Elements read between steps
# by a step of its own, whose end is off by the error of a step. Modes ring ahead of the front
# of a blow while the bit is in DFC (docs/modal.md, section 5); samples of 20 us see little of it,
# `test_few_modes_ring_ahead_of_a_blow_by_nanometres` all [m].
ROUNDING = {"wave": 1e-15, "modal": 2e-9, "fem": 1e-12, "rigid": 1e-15}
SHORT_STROKE = {"drive.force": 8143.0, "drive.reversal_distance": 0.002}


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_hole_is_as_deep_as_the_rock_lets_go(solver):
    """After a blow the bit leaves the rock where its surface is when nothing presses on it."""
    changes = {"start.bit_velocity": 5.25, "piston.model": "absent", "effects.drive": "none"}
    scene = Scene().replace(**{**SOLVERS[solver], **changes})
    simulation = Simulation(scene)
    simulation.advance(2e-3)
    events = simulation.events
    # the first time that the spring has pushed it off; ringing closes and opens it once more
    left = events["time"][events["kind"] == EventKind.MODE_FF]
    assert len(left)
    simulation = Simulation(scene)
    seen = simulation.sample(left)
    assert seen["hole_depth"][-1] > 1e-4
    surface = seen["bit_end_position"] - scene.start.rock_gap
    np.testing.assert_allclose(seen["hole_depth"], surface, atol=2e-8)


@pytest.mark.parametrize("solver", SOLVERS)
def test_at_rest_the_spring_is_all_that_lies_between_hole_and_bit(solver):
    scene = Scene().replace(
        **{**SOLVERS[solver], "piston.model": "absent", "effects.drive": "none"}
    )
    simulation = Simulation(scene)
    simulation.advance(1.0)
    now = simulation.observe()
    assert now["drilling_mode"] == Mode.SS
    force = scene.feed.force + scene.bit.mass * scene.gravity.acceleration
    pressed = force / (scene.rock.unloading_ratio * scene.rock.loading_stiffness)
    assert now["hole_depth"] == pytest.approx(
        now["bit_end_position"] - scene.start.rock_gap - pressed, abs=1e-3 * pressed
    )


def wandering_rock(simulation, end, step=2e-3):
    """Give the rock other properties every few milliseconds, under load too."""
    random, depth = np.random.default_rng(6), []
    for t in np.arange(step, end, step):
        stiffness, ratio = np.exp(random.uniform(np.log([2e8, 3.0]), np.log([2e9, 10.0])))
        simulation.set_inputs(loading_stiffness=stiffness, unloading_ratio=ratio)
        depth.append(simulation.sample(np.linspace(t - step, t, 200)[1:])["hole_depth"])
    return np.concatenate(depth)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("changes", [{}, {"feed.force": 150.0}, SHORT_STROKE], ids=str)
def test_the_hole_never_gets_less_deep(solver, changes):
    scene = Scene().replace(**SOLVERS[solver], **changes)
    end = 0.1 if solver == "fem" else 0.4
    depth = Simulation(scene).sample(np.linspace(0.0, end, 20_000))["hole_depth"]
    assert depth[0] == 0.0
    assert depth[-1] > 1e-4
    assert np.diff(depth).min() >= -ROUNDING[solver]


@pytest.mark.parametrize(("modes", "most"), [(20, 2.5e-8), (40, 5e-9), (80, 1e-9)])
def test_few_modes_ring_ahead_of_a_blow_by_nanometres(modes, most):
    """Seen in each instant before the front of a blow comes to the rock end."""
    scene = Scene().replace(**{"solver.name": "modal", "solver.cells": modes})
    run = Simulation(scene)
    run.advance(0.2)
    blow = run.blows["time"][3]
    depth = Simulation(scene).sample(np.linspace(blow - 1e-6, blow + 3e-5, 1000))["hole_depth"]
    fall = float((np.maximum.accumulate(depth) - depth).max())
    assert 0.0 < fall < most


@pytest.mark.parametrize("solver", SOLVERS)
def test_other_rock_under_load_makes_no_hole_less_deep(solver):
    simulation = Simulation(Scene().replace(**SOLVERS[solver]))
    depth = wandering_rock(simulation, 0.1 if solver == "fem" else 0.4)
    assert np.diff(depth).min() >= -ROUNDING[solver]
    assert depth[-1] > 1e-3
    # what springs of other rock move is small: the bit is still at the bottom of its hole
    bit = simulation.blows["bit_position"][-1]
    assert bit == pytest.approx(simulation.blows["hole_depth"][-1], rel=0.1)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("rock", ["spring", "wall", "none"])
def test_what_is_not_crushed_has_no_hole(solver, rock):
    changes = {**SOLVERS[solver], "effects.rock": rock, "effects.barrier": False}
    seen = Simulation(Scene().replace(**changes)).sample(np.linspace(0.0, 0.05, 500))
    assert not seen["hole_depth"].any()


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_blow_table_has_the_depth_at_its_starts(solver):
    result = simulate(Scene().replace(**SOLVERS[solver]), 0.3, settle=0.0)
    rows = result.blows
    seen = Simulation(result.scene).sample(rows["time"])["hole_depth"]
    np.testing.assert_allclose(rows["hole_depth"], seen, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(
        rows["hole_depth"][:-1] + rows["hole_advance"][:-1], rows["hole_depth"][1:], rtol=1e-12
    )


@pytest.mark.parametrize("solver", ["wave", "modal", "rigid"])
def test_hole_and_bit_advance_alike_where_motion_is_periodic(solver):
    rows = simulate(Scene().replace(**SOLVERS[solver]), error_estimate=False).counted
    hole, bit = (
        rows[name].sum() / rows["period"].sum() for name in ("hole_advance", "penetration")
    )
    assert hole == pytest.approx(bit, rel=1e-9)
