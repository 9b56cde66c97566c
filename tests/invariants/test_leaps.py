"""Leaps, partitions, restarts, depth and inputs: what must not change the motion."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model import BLOW, Scene, Simulation

# At the power of the reference, and as it is: the bit still rings at impact. There the
# motion is aperiodic and rounding grows tenfold a blow: a start velocity off by its last
# digit makes other events after 0.2 s, so that a few blows are compared.
SCENES = {
    "reference": {},
    "short stroke": {"drive.reversal_distance": 0.004},
    "short stroke, same power": {
        "drive.reversal_distance": 0.004,
        "drive.force": 3000.0 * 10 ** (1 / 3),
    },
}
ENDS = {"reference": 0.3, "short stroke": 0.06, "short stroke, same power": 0.04}
# Of the blow table's columns and of the stress in the bars, by the greatest of each.
BOUND = 1e-6
FORCE, SPEED = 1.1e6, 10.0  # of an impact at 10 m/s [N], [m/s]


def bits(simulation):
    """State, blow table and events as bytes."""
    state = simulation.save().state
    record = state.record.copy()
    record["n_blows"] = record["n_events"] = 0  # rows filled in the last call
    plain = record.tobytes() + state.workspace.tobytes()
    return plain, simulation.blows.tobytes(), simulation.events.tobytes()


@pytest.mark.parametrize("name", SCENES)
def test_leaps_change_nothing_but_the_time_it_takes(name):
    times = np.linspace(0.0, ENDS[name], 101)[1:]
    runs = []
    for leaps in (True, False):
        simulation = Simulation(Scene().replace(**SCENES[name], **{"solver.leaps": leaps}))
        fields = []
        for t in times:
            simulation.advance(float(t))
            # at a grid point: a field is that of the last or the next one
            grid = simulation.solver.grid_point_after(simulation.save().state, float(t))
            simulation.advance(grid)
            fields.append(simulation.fields())
        runs.append((simulation, fields))
    (leaping, there), (stepping, here) = runs
    assert leaping.statistics()["leaps"] > 0
    assert stepping.statistics()["leaps"] == 0
    np.testing.assert_array_equal(leaping.events["kind"], stepping.events["kind"])
    worst = {}
    for column in BLOW.names:
        a, b = leaping.blows[column], stepping.blows[column]
        np.testing.assert_array_equal(np.isnan(a), np.isnan(b))
        known = np.isfinite(b)
        scale = np.abs(b[known]).max(initial=1e-300)
        worst[column] = np.abs(a - b)[known].max(initial=0.0) / scale
    for key in here[0]:
        a, b = (np.array([fields[key] for fields in run]) for run in (there, here))
        worst[key] = np.abs(a - b).max() / (FORCE if key.endswith("force") else SPEED)
    # read between checkpoints of leaps or of steps, which ringing in a short one shows
    standstill = worst.pop("standstill_force")
    assert name != "reference" or standstill < 1e-4
    assert max(worst.values()) < BOUND, worst
    for one in (leaping, stepping):
        assert abs(one.energy()["residual_relative"]) < 1e-11


@pytest.mark.parametrize("name", ["reference", "short stroke"])
def test_ten_thousand_calls_give_the_same_bits_as_one(name):
    scene = Scene().replace(**SCENES[name])
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
    assert bits(divided) == bits(whole)


def test_saved_and_restored_runs_repeat():
    simulation = Simulation(Scene())
    rng = np.random.default_rng(4)
    saved = []
    for t in np.sort(rng.uniform(0.0, 0.2, 20)):
        simulation.advance(float(t))
        saved.append(simulation.save())
    simulation.advance(0.3)
    last = bits(simulation)
    for snapshot in saved:
        again = Simulation(simulation.scene)
        again.restore(snapshot)
        again.advance(0.3)
        assert bits(again) == last


def test_depth_changes_no_bit():
    shallow, deep = (Simulation(Scene().replace(**{"start.depth": d})) for d in (0.0, 60.0))
    for simulation in (shallow, deep):
        simulation.advance(1.0)
    assert len(shallow.blows) > 15
    assert bits(shallow) == bits(deep)


LIMITS = {
    "feed_force": (0.0, 2e4),
    "drive_force": (1500.0, 5000.0),
    "reversal_distance": (0.01, 0.06),
    "loading_stiffness": (2e8, 2e9),
    "unloading_ratio": (1.5, 20.0),
    "barrier_damping": (1e3, 3e4),
    "barrier_energy": (1e-3, 0.5),
}


@pytest.mark.parametrize("leaps", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_inputs_at_random_times_leave_the_ledger_closed(seed, leaps):
    rng = np.random.default_rng(seed)
    simulation = Simulation(Scene().replace(**{"solver.leaps": leaps}))
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
