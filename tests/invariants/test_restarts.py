"""Partitions, restarts, depth and inputs: what must not change the motion, whatever the solver."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model import Scene, Simulation
from tests.state_bits import run_bits

SOLVERS = {
    "wave": {"solver.name": "wave"},
    "modal": {"solver.name": "modal"},
    "fem": {"solver.name": "fem"},
    "rigid": {"solver.name": "rigid", "piston.model": "rigid", "bit.model": "rigid"},
}
SCENES = {"reference": {}, "short stroke": {"drive.reversal_distance": 0.004}}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("solver", SOLVERS)
def test_ten_thousand_calls_give_the_same_bits_as_one(solver, name):
    scene = Scene().replace(**SOLVERS[solver], **SCENES[name])
    whole, divided = Simulation(scene), Simulation(scene)
    end = 0.5
    whole.advance(end)
    rng = np.random.default_rng(3)
    for k, t in enumerate(np.sort(rng.uniform(0.0, end, 10_000))):
        divided.advance(float(t))
        if k % 100 == 0:
            divided.observe()
            divided.energy()
            divided.fields()
    divided.advance(end)
    assert run_bits(divided) == run_bits(whole)


@pytest.mark.parametrize("solver", SOLVERS)
def test_saved_and_restored_runs_repeat(solver):
    simulation = Simulation(Scene().replace(**SOLVERS[solver]))
    rng = np.random.default_rng(4)
    saved = []
    for t in np.sort(rng.uniform(0.0, 0.2, 20)):
        simulation.advance(float(t))
        saved.append(simulation.save())
    simulation.advance(0.3)
    last = run_bits(simulation)
    for snapshot in saved:
        again = Simulation(simulation.scene)
        again.restore(snapshot)
        again.advance(0.3)
        assert run_bits(again) == last


@pytest.mark.parametrize("solver", SOLVERS)
def test_depth_changes_no_bit(solver):
    scene = Scene().replace(**SOLVERS[solver])
    shallow, deep = (Simulation(scene.replace(**{"start.depth": d})) for d in (0.0, 60.0))
    for simulation in (shallow, deep):
        simulation.advance(1.0)
    assert len(shallow.blows) > 15
    assert run_bits(shallow) == run_bits(deep)


LIMITS = {
    "feed_force": (0.0, 2e4),
    "drive_force": (1500.0, 5000.0),
    "reversal_distance": (0.01, 0.06),
    "loading_stiffness": (2e8, 2e9),
    "unloading_ratio": (1.5, 20.0),
    "barrier_damping": (1e3, 3e4),
    "barrier_energy": (1e-3, 0.5),
}


@pytest.mark.parametrize("solver", [*SOLVERS, "modal without leaps"])
@pytest.mark.parametrize("seed", range(4))
def test_inputs_at_random_times_leave_the_ledger_closed(seed, solver):
    rng = np.random.default_rng(seed)
    changes = SOLVERS.get(solver, SOLVERS["modal"] | {"solver.leaps": False})
    simulation = Simulation(Scene().replace(**changes))
    end = 0.4
    for t in np.sort(rng.uniform(0.0, end, 60)):
        simulation.advance(float(t))
        names = rng.choice(list(LIMITS), rng.integers(1, 4), replace=False)
        simulation.set_inputs(**{name: float(rng.uniform(*LIMITS[name])) for name in names})
        assert abs(simulation.energy()["residual_relative"]) < 1e-9
    simulation.advance(end)
    assert abs(simulation.energy()["residual_relative"]) < 1e-9
    seen = simulation.observe()
    m_p, m_b = simulation.scene.piston.mass, simulation.scene.bit.mass
    piston = m_p * (seen["piston_velocity"] - 10.0)
    given = m_p * 10.0 * end + seen["drive_impulse"] - seen["contact_impulse"]
    assert piston == pytest.approx(given, abs=1e-9 * seen["contact_impulse"])
    assert np.isfinite(m_b * seen["bit_velocity"])


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_changed_input_loses_no_blow_and_no_event(solver):
    """Not even where the part of a step up to the change holds the event."""
    scene = Scene().replace(**SOLVERS[solver], **SCENES["short stroke"])
    plain = Simulation(scene)
    plain.advance(0.1)
    step = plain.solver.time_step or 1e-6
    simulation = Simulation(scene)
    for time in np.unique(plain.events["time"]):
        if (t := float(time) + 0.1 * step) > simulation.time:
            simulation.advance(t)
            simulation.set_inputs(feed_force=scene.feed.force)
    counts, blows = simulation.statistics(), simulation.blows
    assert len(simulation.events) == counts["events"]
    assert len(blows) == counts["blows"] - 1  # the last one is under way
    np.testing.assert_allclose((blows["time"] + blows["period"])[:-1], blows["time"][1:])
