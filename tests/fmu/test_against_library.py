"""The FMU and the library compute the same, to the last bit, however it is stepped."""

from __future__ import annotations

import itertools
import os

import numpy as np
import pytest
from fmpy import simulate_fmu

from percussion_model import Scene, Simulation
from percussion_model.physics.records import READING

# Random steps between the shortest and the longest of a master [s].
SHORTEST, LONGEST = 1e-6, 0.06
BLOW = ("blow_time", "blow_position", "impact_velocity", "piston.stroke", "penetration_per_blow")
COLUMNS = ("time", "bit_position", "impact_velocity", "stroke", "hole_advance")
RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
compiles_long = pytest.mark.skipif(
    os.environ.get("PERCUSSION_LONG") != "1", reason="compiles for minutes; PERCUSSION_LONG=1"
)


@pytest.fixture(scope="module")
def library():
    """Half a second of the elastic and the rigid reference."""
    runs = {}
    for name, changes in {"PercussiveHammer": {}, "RigidHammer": RIGID}.items():
        runs[name] = Simulation(Scene().replace(**changes))
        runs[name].advance(0.5)
    return runs


def blows_seen(instance, steps):
    """Blow table as a master sees it, and the sum of the mean forces times the steps."""
    rows, sums, count = [], np.zeros(2), 0
    for step in steps:
        instance.step(float(step))
        sums += np.array(instance.values(["bit.force_mean", "contact.force_mean"])) * step
        if instance.get("blow_count") > count:
            count = instance.get("blow_count")
            rows.append(instance.values(BLOW))
    return np.array(rows), sums, count


def test_four_seconds_of_the_reference_are_identical(hammer, reference):
    found = simulate_fmu(str(hammer), stop_time=4.0, step_size=0.01, output_interval=0.01)
    blows = reference.blows
    at = np.searchsorted(found["blow_count"], np.arange(1, len(blows) + 1))
    for name, column in zip(BLOW, COLUMNS, strict=True):
        np.testing.assert_array_equal(found[name][at], blows[column], err_msg=name)
    assert found["blow_count"][-1] == len(blows)
    last = blows[-1]
    efficiency = last["rock_energy"] / last["blow_energy"]
    assert found["transfer_efficiency"][-1] == pytest.approx(efficiency, rel=1e-15)
    assert found["rate_of_penetration"][-1] == pytest.approx(
        last["hole_advance"] / last["period"], rel=1e-15
    )
    assert abs(found["energy_residual"][-1]) < 1e-12


@pytest.mark.parametrize(
    ("name", "step"),
    [
        *itertools.product(
            ["PercussiveHammer", "RigidHammer"], [1e-4, 1e-3, 7.3e-3, 0.05, "random"]
        ),
        ("NumbaRigidHammer", "random"),
        pytest.param("NumbaHammer", "random", marks=compiles_long),
    ],
)
def test_communication_steps_change_no_bit(make, library, name, step):
    simulation = library[name.replace("NumbaHammer", "PercussiveHammer").removeprefix("Numba")]
    rng = np.random.default_rng(3)
    if step == "random":
        steps = np.exp(rng.uniform(np.log(SHORTEST), np.log(LONGEST), 200))
        steps = steps[np.cumsum(steps) < 0.5]
    else:
        steps = np.full(int(0.5 / step), step)
    instance = make(name)
    found, sums, count = blows_seen(instance, steps)
    whole = Simulation(simulation.scene)
    whole.advance(instance.time)
    seen = np.searchsorted(whole.blows["time"], found[:, 0])
    for k, column in enumerate(COLUMNS):
        np.testing.assert_array_equal(found[:, k], whole.blows[column][seen], err_msg=column)
    assert count == len(whole.blows)
    assert len(found) >= min(count, 8)
    now = whole.observe()
    impulses = np.array([now["bit_impulse"], now["contact_impulse"]])
    np.testing.assert_allclose(sums, impulses, rtol=1e-12)
    assert instance.get("bit.impulse") == pytest.approx(now["bit_impulse"], rel=1e-15)


def test_steps_shorter_than_those_of_the_solver_change_no_bit(make, library):
    """A microsecond through the first blow, a tenth of it around the impact."""
    instance = make("PercussiveHammer")
    sums = np.zeros(2)
    for step, count in ((1e-7, 300), (1e-6, 3000)):
        sums += blows_seen(instance, np.full(count, step))[1]
    whole = Simulation(Scene())
    whole.advance(instance.time)
    now = whole.observe()
    np.testing.assert_allclose(sums, [now["bit_impulse"], now["contact_impulse"]], rtol=1e-12)
    found, _, _ = blows_seen(instance, np.full(20, 5e-3))
    blows = library["PercussiveHammer"].blows
    np.testing.assert_array_equal(found[:, 0], blows["time"][: len(found)])
    np.testing.assert_array_equal(found[:, 1], blows["bit_position"][: len(found)])
    assert len(found) == 2


def test_an_input_of_the_same_value_changes_no_bit(make, library):
    instance = make("PercussiveHammer")
    for k in range(100):
        instance.time = k * 1.3e-3
        instance.set({"feed_force": 2500.0, "supply_pressure": instance.get("supply_pressure")})
        instance.step(1.3e-3)
    blows = library["PercussiveHammer"].blows
    count = instance.get("blow_count")
    assert count == 2
    assert instance.get("blow_time") == blows["time"][count - 1]
    assert instance.get("blow_position") == blows["bit_position"][count - 1]


def test_outputs_between_the_blows_are_those_of_the_library(make, library):
    names = {
        "hole_depth": "hole_depth",
        "bit.position": "bit_position", "bit.velocity": "bit_velocity", "bit.force": "bit_force",
        "contact.force": "contact_force", "piston.position": "piston_position",
        "piston.velocity": "piston_velocity", "bit.impulse": "bit_impulse",
        "contact.impulse": "contact_impulse", "drilling_mode": "drilling_mode",
    }  # fmt: skip
    for name in ("PercussiveHammer", "RigidHammer"):
        instance, simulation = make(name), Simulation(library[name].scene)
        for k in range(120):
            instance.time = k * 7e-4
            instance.step(7e-4)
            simulation.advance(instance.time)
            now = simulation.observe()
            for output, field in names.items():
                assert instance.get(output) == now[field], output
            assert instance.get("casing_force") == -now["drive_force"]
            assert instance.get("casing.impulse") == -now["drive_impulse"]


def test_the_gauge_reads_the_stress_of_its_cell(make):
    scene = Scene()
    place = 0.13
    instance = make("PercussiveHammer", gauge__bar="piston", gauge__position=place)
    simulation = Simulation(scene)
    reading = np.zeros(1, READING)
    found = []
    for k in range(400):
        instance.time = k * 1e-6
        instance.step(1e-6)
        simulation.advance(instance.time)
        here = simulation.solver.read(simulation._state, instance.time, reading)
        stress = simulation.solver.fields(here)["piston_force"] / scene.piston.sections[0].area
        found.append(instance.get("gauge_stress"))
        assert found[-1] == stress[int(place / scene.piston.length * len(stress))]
    greatest = max(found)
    # equal bars: half of Z v over the area
    assert greatest == pytest.approx(1116.547e3 / scene.piston.sections[0].area, rel=0.05)


def test_rates_fall_towards_zero_where_no_blow_comes(make):
    instance = make("RigidHammer")
    for _ in range(30):
        instance.step(0.01)
    rate, frequency = instance.values(["rate_of_penetration", "blow_frequency"])
    assert 0.01 < rate < 0.03
    assert 15.0 < frequency < 30.0
    instance.set({"percussion_on": False})
    found, times = [], []
    for _ in range(200):
        instance.step(0.01)
        found.append(instance.values(["rate_of_penetration", "blow_frequency", "blow_count"]))
        times.append(instance.time)
    found, times = np.array(found), np.array(times)
    alone = found[:, 2] == found[-1, 2]  # since the last whole blow was booked
    period = 1.0 / found[alone, 1][0]
    ended = instance.get("blow_time") + period
    late = alone & (times > ended + 2.0 * period)
    assert np.count_nonzero(late) > 20
    assert np.all(np.diff(found[late, :2], axis=0) < 0)
    # two periods are allowed for; then one blow less for each that is missed
    wanted = 1.0 / (times[late] - ended - period)
    np.testing.assert_allclose(found[late, 1], wanted, rtol=1e-9)
    share = found[late, 0] / found[late, 1]
    np.testing.assert_allclose(share, instance.get("penetration_per_blow"), rtol=1e-12)
