"""The FMU of a top hammer: a chain of bars, its rods as parameters, the library's bits."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from fmpy import extract, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from fmu_src.hammer.build import build_hammer
from percussion_model import Simulation
from percussion_model.scene.hammers import hammer
from scenarios import top_hammer_feed

SCENE = hammer("t38", 2)
# Shank, then rods; the FMU counts bars and sections from 1, the library from 0.
LAST = "rod 3"
ROD = "string.rods.2"
BODY, OUTSIDE = f"{ROD}.sections.1.length", "string.rods[3].sections[2].length"
BLOW = {
    "blow_time": "time", "blow_position": "bit_position", "impact_velocity": "impact_velocity",
    "piston.stroke": "stroke", "penetration_per_blow": "hole_advance",
}  # fmt: skip
NOW = {
    "hole_depth": "hole_depth", "bit.position": "bit_position", "bit.velocity": "bit_velocity",
    "bit.force": "bit_force", "contact.force": "contact_force",
    "piston.position": "piston_position", "piston.velocity": "piston_velocity",
    "bit.impulse": "bit_impulse", "contact.impulse": "contact_impulse",
    "drilling_mode": "drilling_mode",
}  # fmt: skip
STEP = 1.9e-3


@pytest.fixture(scope="module")
def archive(built_library, tmp_path_factory):
    """FMU of the T38 drifter with two rods."""
    path = tmp_path_factory.mktemp("top") / "TopHammer.fmu"
    build_hammer(SCENE, path)
    return path


@pytest.fixture(scope="module")
def unpacked(archive):
    """The same, unpacked; `make` takes it from here."""
    return {archive.stem: extract(str(archive), str(archive.with_suffix("")))}


@pytest.fixture
def top(make):
    """Make an initialised instance of it."""
    return partial(make, "TopHammer")


def same_now(instance, simulation):
    """The outputs of the present are those of the library, to the last bit."""
    now = simulation.observe()
    assert {name: instance.get(name) for name in NOW} == {
        name: now[field] for name, field in NOW.items()
    }


def same_blow(instance, simulation):
    """The numbers of the last blow are those of the library, to the last bit."""
    blows = simulation.blows
    assert instance.get("blow_count") == len(blows) > 0
    assert {name: instance.get(name) for name in BLOW} == {
        name: blows[-1][column] for name, column in BLOW.items()
    }


def follow(instance, simulation, count, before=lambda k: None):
    """Step both, side by side; the last blow agrees."""
    for k in range(count):
        before(k)
        instance.step(STEP)
        simulation.advance(instance.time)
        same_now(instance, simulation)
    same_blow(instance, simulation)


def test_fmpy_finds_no_problem(archive):
    assert validate_fmu(str(archive)) == []


def test_bars_and_rods_are_parameters(top):
    instance = top(start=False)
    names = set(instance.variables)
    for k, rod in enumerate(SCENE.string.rods, start=1):
        wanted = {f"string.rods[{k}].{name}" for name in ("gap", "preload", "thread_stiffness")}
        for i in range(1, len(rod.sections) + 1):
            wanted |= {
                f"string.rods[{k}].sections[{i}].{field}"
                for field in ("length", "area", "youngs_modulus", "density")
            }
        found = {name for name in names if name.startswith(f"string.rods[{k}]")}
        assert found == wanted
    assert not any(name.startswith("string.rods[4]") for name in names)
    bars = instance.find("gauge.bar").declaredType.items
    assert [one.name for one in bars] == ["piston", "bit", "rod 1", "rod 2", LAST]


def test_a_second_of_blows_is_that_of_the_library(archive):
    found = simulate_fmu(str(archive), stop_time=1.0, step_size=0.01, output_interval=0.01)
    simulation = Simulation(SCENE)
    simulation.advance(1.0)
    blows = simulation.blows
    at = np.searchsorted(found["blow_count"], np.arange(1, len(blows) + 1))
    seen = np.append(np.diff(at) > 0, True)  # of two in one step the last one
    for name, column in BLOW.items():
        np.testing.assert_array_equal(found[name][at][seen], blows[column][seen], err_msg=name)
    assert found["blow_count"][-1] == len(blows) > 50
    assert abs(found["energy_residual"][-1]) < 1e-11


@pytest.mark.parametrize("step", [1e-4, 7.3e-3])
def test_communication_steps_change_no_bit(top, step):
    instance = top()
    for _ in range(round(0.1 / step)):
        instance.step(step)
        instance.values(instance.outputs)
    simulation = Simulation(SCENE)
    simulation.advance(instance.time)
    same_now(instance, simulation)
    same_blow(instance, simulation)


def test_the_gauge_reads_the_last_rod(top):
    """Through the first blow: down the rod, back as tension, and past the gauge again."""
    place = 1.7
    instance = top(gauge__bar=LAST, gauge__position=place)
    simulation = Simulation(SCENE)
    rod = SCENE.bars[LAST]
    found = []
    for k in range(500):
        instance.time = k * 1e-5
        instance.step(1e-5)
        simulation.advance(instance.time)
        forces = simulation.fields()[f"{LAST}_force"]
        grid = simulation.solver.grid_of(LAST)
        # cells are counted by mass; the gauge is in the body, below the female end
        end, body = rod.sections
        mass = end.mass + body.mass * (place - end.length) / body.length
        cell = int(np.searchsorted(np.cumsum(grid.mass), mass, side="right"))
        found.append(instance.get("gauge_stress"))
        assert found[-1] == forces[cell] / body.area
    # the preload of the threads is no stress of the rods, and the blow is both
    assert max(found) > 50e6
    assert min(found) < -5e6


@pytest.mark.parametrize(
    ("outside", "key", "value"),
    [
        (OUTSIDE, BODY, 2.9),
        ("string.rods[2].preload", "string.rods.1.preload", 2e4),
        ("string.rods[1].gap", "string.rods.0.gap", 1e-4),
        ("damper.damping", "damper.damping", 3e4),
    ],
)
def test_a_parameter_that_is_set_before_the_start_takes_effect(top, outside, key, value):
    changed, usual = (Simulation(SCENE.replace(**given)) for given in ({key: value}, {}))
    follow(top(**{outside: value}), changed, 50)
    usual.advance(changed.time)
    assert usual.observe()["bit_position"] != changed.observe()["bit_position"]


@pytest.mark.parametrize(
    ("name", "value", "bound"),
    [
        (OUTSIDE, 0.0, "above 0"),
        ("string.rods[1].preload", -1.0, "from 0 to 1e9 N"),
        ("damper.casing_mass", 0.0, "above 0"),
        ("gauge.position", 4.0, "lies below the bit"),
    ],
)
def test_a_bad_parameter_is_refused_by_name(top, name, value, bound):
    instance = top(start=False)
    instance.set({name: value})
    with pytest.raises(FMICallException):
        instance.start()
    assert any(name in text and bound in text for text in instance.faults), instance.faults


def test_inputs_that_change_on_the_way_are_those_of_the_library(top):
    instance, simulation = top(), Simulation(SCENE)
    feeds = {10: 6e3, 25: 14e3, 40: 9e3}

    def change(k):
        if k in feeds:
            instance.set({"feed_force": feeds[k], "rock.loading_stiffness": 5e4 * feeds[k]})
            simulation.set_inputs(feed_force=feeds[k], loading_stiffness=5e4 * feeds[k])

    follow(instance, simulation, 60, change)


def go_on(instance, count):
    """Step with a feed that changes, and return all outputs after each step."""
    rows = []
    for k in range(count):
        instance.set({"feed_force": 9e3 + 500.0 * (k % 3)})
        instance.step(STEP)
        rows.append(instance.values(instance.outputs))
    return np.array(rows, dtype=float)


def test_a_restored_state_repeats_the_bits(top):
    first, second = (top(gauge__bar=LAST) for _ in range(2))
    rng = np.random.default_rng(7)
    for _ in range(8):
        first.step(float(rng.uniform(1e-6, 0.02)))
        time, saved = first.time, first.save()
        seen = first.values(first.outputs)
        wanted = go_on(first, 10)
        for one in (first, second):  # the other one has never been there
            one.restore(saved, time)
            assert one.values(one.outputs) == seen
            np.testing.assert_array_equal(go_on(one, 10), wanted)
        first.restore(saved, time)


def test_a_state_of_another_rod_is_refused(top):
    saved, other = top().save(), top(**{OUTSIDE: 3.0})
    before = other.save()
    with pytest.raises(FMICallException):
        other.restore(saved, 0.0)
    assert any("other parameters" in text for text in other.messages), other.messages
    assert other.save() == before


@pytest.fixture(scope="module")
def soft_layer(tmp_path_factory):
    """Both runs of the scenario with a soft layer, which has an FMU of its own."""
    path = tmp_path_factory.mktemp("scenario") / "TopHammer.fmu"
    top_hammer_feed.build(path)
    runs = {True: "tension watched", False: "pressure constant"}
    return path, {name: top_hammer_feed.simulate(path, on) for on, name in runs.items()}


def test_less_pressure_keeps_tension_out_of_the_string(soft_layer, tmp_path):
    _, runs = soft_layer
    watched, constant = map(top_hammer_feed.numbers, runs.values())
    # both are in firm rock at first, and come to the layer at the same time
    assert watched["entered"] == constant["entered"]
    # the integral holds the tension at its limit
    assert watched["tension"] == pytest.approx(top_hammer_feed.LIMIT, rel=0.08)
    assert constant["tension"] > 1.3 * top_hammer_feed.LIMIT
    # the feed comes back, as far as the pump allows without that
    assert constant["feed"] < 0.7 * top_hammer_feed.FEED < watched["feed"]
    assert watched["crossing"] > constant["crossing"]
    pressure = runs["tension watched"]["supply_pressure"]
    assert pressure.min() < 0.8 * top_hammer_feed.FULL
    assert pressure[-1] == pressure[0] == top_hammer_feed.FULL
    assert np.all(runs["pressure constant"]["supply_pressure"] == top_hammer_feed.FULL)
    # over a cycle the weight gives next to nothing and the drive 2 F_0 D_1
    stroke_energy = 2.0 * SCENE.drive.force * SCENE.drive.reversal_distance
    assert constant["energy"] == pytest.approx(stroke_energy, rel=0.1)
    assert watched["back"] == pytest.approx(constant["back"], rel=0.1)
    path = top_hammer_feed.draw(runs, tmp_path / "top_hammer_feed.png")
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_scenario_repeats_its_bits(soft_layer):
    path, runs = soft_layer
    again = top_hammer_feed.simulate(path, duration=0.3)
    for name, column in again.items():
        np.testing.assert_array_equal(column, runs["tension watched"][name][: len(column)])
