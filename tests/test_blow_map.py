"""The blow map: its table against the waves, bits and states, refusals."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest
from blow_map_scenes import RANGES, mapped, run_by_hand

from percussion_model import Scene, SceneError, Simulation, SimulationError, simulate
from percussion_model.analysis.blow_maps import make_map
from percussion_model.solvers.blow_map.records import Axis, Entry
from percussion_model.solvers.blow_map.solver import BlowMapSolver
from tests.state_bits import run_bits

LONG = bool(os.environ.get("PERCUSSION_LONG"))


@pytest.fixture(scope="module")
def table():
    return make_map(mapped(), workers=1)


# -------------------------------------------------------------------------- table


def points(ranges, seed):
    """Scenes at random places of a table's range; the impact velocity follows from D_1."""
    rng = np.random.default_rng(seed)
    piston = Scene().piston.mass
    while True:
        force = rng.uniform(*ranges["force"])
        slow, fast = ranges["velocity"]
        v = rng.uniform(slow + 0.5, fast - 0.5)
        yield {
            "rock__loading_stiffness": math.exp(rng.uniform(*np.log(ranges["stiffness"]))),
            "feed__force": rng.uniform(*ranges["feed"]),
            "drive__force": force,
            # eq. 12 with the reference's restitution of a third
            "drive__reversal_distance": piston * v**2 * (1 - 0.36**2) / (4 * force),
            "start__piston_velocity": v,
        }


def check_points(scene_of, ranges, count, seed):
    left = count
    for changes in points(ranges, seed):
        scene = scene_of(**changes)
        try:
            fast = simulate(scene, 2.5, settle=0.5, record_events=False)
        except SimulationError as error:  # not a point inside the table
            if "the bit stands still" not in str(error):
                raise
            continue
        wave = simulate(scene.computed_by("wave"), 2.5, settle=0.5, record_events=False)
        off = fast.rate_of_penetration / wave.rate_of_penetration - 1
        assert abs(off) < 0.02, changes
        left -= 1
        if left == 0:
            return


def test_the_rate_is_that_of_the_waves_at_random_points(table):
    assert table.restless == 0
    check_points(mapped, RANGES, 30 if LONG else 10, seed=5)


@pytest.mark.slow
@pytest.mark.skipif(not LONG, reason="a table of 28 000 blows: PERCUSSION_LONG=1")
def test_the_rate_is_that_of_the_waves_all_over_the_usual_table():
    scene = Scene().replace(**{"solver.fidelity": "blow-map"})
    make_map(scene)
    ranges = {
        name: tuple(scene[f"blow_map.{name}_{end}"] for end in ("from", "to")) for name in RANGES
    }

    def scene_of(**changes):
        return scene.replace(**{key.replace("__", "."): v for key, v in changes.items()})

    check_points(scene_of, ranges, 30, seed=1)


def test_a_node_answers_with_its_own_blow(table):
    """At a node nothing is interpolated: the first blow of a run is the entry."""
    at = [n // 2 - (n == 2) for n in table.nodes.counts]
    k_r, v, load, drive = (table.nodes.values(axis)[i] for axis, i in zip(Axis, at, strict=True))
    v *= 1 + 1e-9  # the edge of the range itself is lost to rounding
    scene = mapped(
        rock__loading_stiffness=float(k_r),
        start__piston_velocity=float(v),
        start__gap=0.0,
        feed__force=float(load * v - table.nodes.weight),
        drive__force=float(drive * v),
    )
    simulation = Simulation(scene)
    simulation.advance(0.1)
    blow = simulation.blows[0]
    entry = table.values[tuple(at)]
    assert blow["impact_velocity"] == pytest.approx(v, rel=1e-12)
    assert blow["penetration"] == pytest.approx(v * entry[Entry.PENETRATION], rel=1e-7)
    assert blow["peak_bit_force"] == pytest.approx(v * entry[Entry.PEAK_BIT], rel=1e-7)
    assert blow["contacts"] == entry[Entry.CONTACTS]


def test_the_hole_gets_deeper_blow_by_blow(table):
    """It follows the bit into the rock, but not back, and ends each blow as the table says."""
    simulation = Simulation(mapped(rock__loading_stiffness=8e8))
    seen = simulation.sample(np.linspace(0.0, 0.5, 4000))
    depth, bit = seen["hole_depth"], seen["bit_position"] - simulation.scene.start.rock_gap
    assert np.diff(depth).min() >= 0.0
    still = seen["bit_velocity"] == 0.0
    assert np.count_nonzero(still) > 1000
    np.testing.assert_allclose(depth[still], bit[still], atol=1e-12)
    rows = simulation.blows
    assert np.all(rows["hole_advance"] > 1e-4)
    np.testing.assert_allclose(rows["hole_advance"], rows["penetration"], rtol=1e-9)
    np.testing.assert_allclose(np.diff(rows["hole_depth"]), rows["hole_advance"][:-1], rtol=1e-9)
    starts = np.interp(rows["time"][1:], seen["time"], depth)
    np.testing.assert_allclose(starts, rows["hole_depth"][1:], rtol=0.02)


def test_ledger_and_impulses(table):
    """Momentum to rounding; energy to what is lost between nodes."""
    result = simulate(mapped(), 2.0)
    scene = result.scene
    weight = (scene.piston.mass + scene.bit.mass) * scene.gravity.acceleration
    rows = result.counted[5:]
    total = rows["bit_impulse"] - rows["drive_impulse"]
    expected = (scene.feed.force + weight) * rows["period"]
    momentum = scene.piston.mass * rows["impact_velocity"]
    drift = np.append(np.diff(momentum), 0.0)
    np.testing.assert_allclose((total - expected + drift)[:-1], 0.0, atol=1e-9 * momentum[0])
    assert abs(result.energy["residual_relative"]) < 2e-3
    assert result.energy["crushing"] > 0.5 * result.energy["drive"]
    assert not result.warnings


# ----------------------------------------------------------------- bits and states


def test_calls_and_readings_change_no_bit(table):
    whole, divided = Simulation(mapped()), Simulation(mapped())
    whole.advance(1.0)
    rng = np.random.default_rng(3)
    for k, t in enumerate(np.sort(rng.uniform(0.0, 1.0, 5000))):
        divided.advance(float(t))
        if k % 50 == 0:
            divided.observe()
            divided.energy()
            divided.fields()
    divided.advance(1.0)
    assert run_bits(divided) == run_bits(whole)


def test_restored_runs_repeat_with_inputs_changed(table):
    simulation = Simulation(mapped())

    def go_on():
        simulation.set_inputs(feed_force=3000.0, drive_force=3300.0, loading_stiffness=8e8)
        simulation.advance(1.5)
        return run_bits(simulation)

    simulation.advance(0.73)
    saved = simulation.save()
    first = go_on()
    simulation.restore(saved)
    assert go_on() == first
    assert simulation.blows["standstill_force"][-1] == pytest.approx(3000.0 + table.nodes.weight)


def test_the_drive_acts_at_once_and_the_rock_at_the_next_blow(table):
    simulation, other = Simulation(mapped()), Simulation(mapped())
    for one in (simulation, other):
        one.advance(0.52)
    other.set_inputs(loading_stiffness=8e8, feed_force=3000.0)
    start = simulation.observe()
    for one in (simulation, other):
        one.advance(0.525)
    here, there = simulation.observe(), other.observe()
    assert here["piston_position"] == pytest.approx(there["piston_position"], rel=1e-14)
    simulation.set_inputs(drive_force=2600.0)
    assert abs(simulation.observe()["drive_force"]) == 2600.0
    assert abs(start["drive_force"]) == 3000.0
    simulation.advance(0.6)
    other.advance(0.6)
    assert len(simulation.blows) == len(other.blows)


# ----------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"feed_force": 100.0}, "feed.force = 100 N: the blow map covers 2000 to 3500 N"),
        ({"loading_stiffness": 2e9}, "rock.loading_stiffness = 2e+09 N/m: the blow map covers"),
        ({"drive_force": 2000.0}, "drive.force = 2000 N: the blow map covers 2500 to 3500 N"),
        ({"reversal_distance": 0.08}, "the impact velocity = 1[0-9.]+ m/s: the blow map covers"),
    ],
)
def test_outside_there_is_one_clear_error(table, change, words):
    simulation = Simulation(mapped())
    simulation.advance(0.51)
    simulation.set_inputs(**change)
    count = len(simulation.blows)
    with pytest.raises(SimulationError, match=words.replace("+", r"\+").replace(r"]\+", "]+")):
        simulation.advance(3.0)
    assert simulation.time == 0.51
    assert np.isfinite(simulation.observe()["piston_position"])
    assert len(simulation.blows) <= count + 2


def test_a_piston_that_falls_back_is_refused(table):
    simulation = Simulation(mapped())
    simulation.advance(0.502)
    assert simulation.observe()["drive_force"] < 0  # on its way up
    simulation.set_inputs(drive_force=0.0, reversal_distance=0.9)
    with pytest.raises(SimulationError, match=r"drive\.force = 0 N: the piston falls back"):
        simulation.advance(3.0)


def test_after_a_refusal_a_good_input_goes_on(table):
    simulation = Simulation(mapped())
    simulation.advance(0.51)
    simulation.set_inputs(feed_force=100.0)
    with pytest.raises(SimulationError):
        simulation.advance(0.6)
    simulation.set_inputs(feed_force=2500.0)
    simulation.advance(1.0)
    untouched = Simulation(mapped())
    untouched.advance(1.0)
    assert simulation.blows["penetration"][-1] == pytest.approx(
        untouched.blows["penetration"][-1], rel=1e-9
    )


def test_a_bit_that_moves_at_impact_is_refused():
    with pytest.raises(SimulationError, match="the bit stands still after 500 ms"):
        run_by_hand(mapped(effects__gravity=False), 3.0, rebound=-0.37, rest=0.5)


def test_a_drive_that_turns_within_the_contacts_is_refused():
    with pytest.raises(SimulationError, match=r"drive\.reversal_distance = 0\.04 m"):
        run_by_hand(mapped(effects__gravity=False), 3.0, rebound=-0.37, opened=0.02)


def test_what_is_fixed_in_the_table_is_refused_by_name(table):
    simulation = Simulation(mapped())
    with pytest.raises(SceneError, match=r"rock\.unloading_ratio = 7\.0: .* made for 5\.0"):
        simulation.set_inputs(unloading_ratio=7.0)
    simulation.set_inputs(unloading_ratio=5.0)
    with pytest.raises(SceneError, match=r"loss\.time = 1e-07: the blow map was made for"):
        BlowMapSolver(mapped(loss__time=1e-7), table)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"effects__drive": "none"}, 'needs effects.drive = "pressure"'),
        ({"effects__rock": "spring"}, 'needs effects.rock = "bilinear"'),
        ({"solver__name": "fem"}, 'solver.name = "fem"'),
        ({"blow_map__feed_to": 1500.0}, "blow_map.feed_from = 2000.0: must be below"),
    ],
)
def test_scenes_without_a_map_are_refused(changes, words):
    with pytest.raises(SceneError, match=words):
        mapped(**changes)


def test_a_bit_off_the_rock_is_refused(table):
    with pytest.raises(SceneError, match="stands on"):
        Simulation(mapped(start__rock_gap=0.1))
