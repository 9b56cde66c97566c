"""The FMUs around the hammer: valid, described, saved, guarded; and the laws inside them."""

from __future__ import annotations

import math
import random
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy.validation import validate_fmu
from lxml import etree
from models import make_model, start_inputs

from fmu_src.parts.air_line import GAS_CONSTANT
from fmu_src.parts.build import PARTS, build_part, part_variables
from fmu_src.run import run_fmu
from fmu_src.units import UNITS
from percussion_model.physics.gas import AIR
from scenarios.harness import Instance

NAMES = sorted(PARTS)
SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi2" / "fmi2ModelDescription.xsd"


@pytest.fixture(scope="module")
def files(fmus, tmp_path_factory):
    found = {path.stem: path for path in fmus.values() if path.stem in PARTS}
    for name in {*PARTS} - {*found}:
        found[name] = tmp_path_factory.mktemp("other") / f"{name}.fmu"
        build_part(PARTS[name], found[name])
    return found


def drive(instance, steps=40, begin=0):
    """Step with inputs that move; return all outputs."""
    for k in range(begin, begin + steps):
        instance.time = k * 1e-3
        for name, one in instance.variables.items():
            if one.causality == "input" and one.type == "Real":
                size = {"N": 2000.0, "Pa": 2e6, "m": 1e-3, "m/s": 0.02}.get(one.unit, 0.5)
                instance.set({name: size * (1.0 + 0.1 * math.sin(0.3 * k))})
        instance.step(1e-3)
    return instance.values(instance.outputs)


@pytest.mark.parametrize("name", NAMES)
def test_a_part_is_valid(files, name):
    assert validate_fmu(str(files[name])) == []
    with zipfile.ZipFile(files[name]) as archive:
        tree = etree.fromstring(archive.read("modelDescription.xml"))
    schema = etree.XMLSchema(etree.parse(SCHEMA))
    assert schema.validate(tree), schema.error_log


@pytest.mark.parametrize("name", NAMES)
def test_every_variable_of_a_part_says_what_it_is(name):
    variables = part_variables(PARTS[name])
    assert len({one.reference for one in variables}) == len(variables)
    for one in variables:
        assert one.description
        if one.type == "Real":
            assert one.unit in UNITS
            assert one.display is None or one.display in UNITS[one.unit].displays
        if one.causality != "output" and one.type != "Boolean":
            assert one.lower <= one.start <= one.upper, one.name


@pytest.mark.parametrize("name", NAMES)
def test_a_restored_part_repeats_bit_for_bit(files, name):
    with Instance(files[name], "a") as one, Instance(files[name], "b") as other:
        one.start()
        drive(one)
        saved = one.save()
        wanted = drive(one, begin=40)
        one.restore(saved, 0.04)
        assert drive(one, begin=40) == wanted
        other.start()
        other.restore(saved, 0.04)
        assert drive(other, begin=40) == wanted
        assert len(other.save()) > 100


@pytest.mark.parametrize("name", NAMES)
def test_a_bad_input_is_named(files, name):
    with Instance(files[name]) as part:
        part.start()
        first = next(iter(PARTS[name].inputs))
        part.set({first: math.nan})
        with pytest.raises(Exception, match="DoStep"):
            part.step(1e-3)
        assert any(first in text and "must be" in text for text in part.messages)


@pytest.mark.parametrize("name", [name for name in NAMES if PARTS[name].law])
def test_a_part_of_fmi_3_is_that_of_fmi_2(files, tmp_path, name):
    """Valid, and the same bits."""
    path = tmp_path / f"{name}.fmu"
    build_part(PARTS[name], path, version="3.0")
    assert validate_fmu(str(path)) == []
    # a time of its own, which FMI 2.0 has no variable for
    three, two = (run_fmu(one, stop_time=0.02, step_size=1e-3) for one in (path, files[name]))
    assert set(two.dtype.names) <= set(three.dtype.names)
    for column in two.dtype.names:
        assert three[column].tolist() == two[column].tolist(), column


@pytest.mark.parametrize("name", [name for name in NAMES if PARTS[name].law])
def test_a_part_needs_no_python(files, name):
    with zipfile.ZipFile(files[name]) as archive:
        names = archive.namelist()
        libraries = [archive.read(one) for one in names if one.startswith("binaries/")]
    assert not [one for one in names if one.endswith((".py", ".txt")) and "license" not in one]
    assert len(libraries) == 1
    assert b"Py_" not in libraries[0]
    assert len(libraries[0]) < 400_000


def test_a_state_of_another_part_is_refused(files):
    with Instance(files["RigFeed"]) as rig, Instance(files["Supply"]) as supply:
        rig.start()
        supply.start()
        with pytest.raises(Exception, match=r"(?i)fmustate"):
            supply.restore(rig.save(), 0.0)
        assert any("the saved state" in text for text in supply.messages)


# laws


def run(model, name, count, step=1e-3, **inputs):
    given = start_inputs(name) | inputs
    for _ in range(count):
        model.step(given, step)
    return model.outputs()


def test_the_rig_gives_the_force_that_is_wanted_with_its_time_constant():
    rig = make_model("RigFeed")
    time = rig.parameters["servo.time"]
    early = run(rig, "RigFeed", round(time / 1e-4), 1e-4, force_command=1000.0)["force"]
    assert early == pytest.approx(1000.0 * (1.0 - math.exp(-1.0)), rel=0.01)
    assert run(rig, "RigFeed", 500, force_command=4000.0)["force"] == pytest.approx(4000.0)


def test_the_rig_keeps_its_limits():
    rig = make_model("RigFeed")
    found = run(rig, "RigFeed", 2000, force_command=1e6)
    assert found["force"] == pytest.approx(rig.parameters["force_limit"])
    # a head faster than the full flow is not pushed at all
    fast = 2.0 * rig.parameters["servo.velocity"]
    found = run(rig, "RigFeed", 2000, force_command=4000.0, head_velocity=fast)
    assert found["limited"]
    assert found["pressure"] < 0.0


def test_a_moving_head_loses_force_by_the_time_of_the_servo():
    """Steady flow A v through the gain C / T costs A^2 T / C by velocity."""
    rig = make_model("RigFeed", slide__friction=0.0)
    p = rig.parameters
    capacity = p["cylinder.volume"] / p["cylinder.bulk_modulus"]
    droop = p["cylinder.area"] ** 2 * p["servo.time"] / capacity * 0.02
    found = run(rig, "RigFeed", 2000, force_command=4000.0, head_velocity=0.02)
    assert found["force"] == pytest.approx(4000.0 - droop, rel=1e-6)


def test_the_supply_drops_pressure_by_flow():
    supply = make_model("Supply", drive__leakage=0.0)
    p = supply.parameters
    found = run(supply, "Supply", 3000, blow_frequency=20.0)
    flow = p["drive.volume"] * 20.0
    assert found["flow"] == pytest.approx(flow, rel=1e-6)
    drop = found["hose_pressure"] - found["supply_pressure"]
    assert drop == pytest.approx(p["hose.resistance"] * flow, rel=1e-9)
    shut = run(supply, "Supply", 3000, blow_frequency=20.0, percussion_on=False)
    assert shut["supply_pressure"] == pytest.approx(2e6, rel=1e-6)


def test_a_weak_source_lets_the_pressure_fall_and_the_relief_valve_caps_it():
    weak = make_model("Supply", source__flow_limit=1e-3)
    assert run(weak, "Supply", 3000, blow_frequency=20.0)["supply_pressure"] < 1.5e6
    strong = make_model("Supply", relief_pressure=1.5e6, start__pressure=1e6)
    found = run(strong, "Supply", 500)
    assert found["relief_open"]
    assert found["hose_pressure"] == 1.5e6


SHUT = {
    "hose__diameter": 1e-3,
    "hose__length": 1e5,
    "hose__friction": 10.0,
}  # a hose through which nothing flows


def air(**values):
    return make_model("Supply", **{"medium": "air", "pressure_command": 24e5, **values})


def draw(supply, flow, count, step=1e-3, **inputs):
    """Outputs after steps in which the hammer takes a flow [kg/s]."""
    given = start_inputs("Supply") | {"pressure_command": 24e5} | inputs
    for _ in range(count):
        given["air_used"] = supply.state["used"] + flow * step
        supply.step(given, step)
    return supply.outputs()


def test_a_receiver_fills_straight_and_then_by_its_time():
    """p' = R T q / V of a compressor at its limit, exp(-t / time) near what is wanted."""
    supply = air(start__pressure=10e5, compressor__flow_limit=0.4, **SHUT)
    rate = AIR * 300.0 * 0.4 / supply.parameters["receiver.volume"]
    found = draw(supply, 0.0, 5000)
    assert found["hose_pressure"] == pytest.approx(10e5 + rate * 5.0, rel=1e-6)
    assert found["flow"] == pytest.approx(0.4 * AIR * 300.0 / 101_325.0, rel=1e-12)
    near = air(start__pressure=23.9e5, compressor__flow_limit=100.0, **SHUT)
    time = near.parameters["source.time"]
    found = draw(near, 0.0, 37)
    off = 0.1e5 * math.exp(-0.037 / time)
    assert 24e5 - found["hose_pressure"] == pytest.approx(off, rel=1e-6)


def test_a_compressor_gives_what_the_hammer_takes_and_the_hose_costs_pressure():
    supply = air(start__pressure=24e5)
    found = draw(supply, 0.45, 20_000)
    p, heat = supply.parameters, AIR * 300.0
    assert supply.state["flow"] == pytest.approx(0.45, rel=1e-9)
    droop = 0.45 * p["source.time"] * heat / p["receiver.volume"]
    assert found["hose_pressure"] == pytest.approx(24e5 - droop, rel=1e-9)
    area = 0.25 * math.pi * p["hose.diameter"] ** 2
    lost = p["hose.friction"] * p["hose.length"] * heat / (p["hose.diameter"] * area**2) * 0.45**2
    ends = (found[name] + 101_325.0 for name in ("hose_pressure", "supply_pressure"))
    before, behind = ends
    assert before**2 - behind**2 == pytest.approx(lost, rel=1e-9)
    assert found["supply_pressure"] < found["hose_pressure"] - 1e4


def test_a_hose_fills_from_a_large_receiver_in_finite_time():
    """p_2' = k (p_1^2 - p_2^2)^(1/2): p_2 = p_1 sin(k t + phase)."""
    supply = air(receiver__volume=1e3, hose__diameter=0.033, start__pressure=24e5)
    supply.change(hose=0.1 * supply.state["hose"])
    p, heat = supply.parameters, GAS_CONSTANT * 300.0
    resistance = p["hose.friction"] * p["hose.length"] * heat
    conductance = 0.25 * math.pi * 0.033**2 * math.sqrt(0.033 / resistance)
    full, k = 24e5 + 101_325.0, conductance * heat / p["hose.volume"]
    for count in (100, 500):
        time = 1e-3 * count + (0.1 if count == 500 else 0.0)
        found = draw(supply, 0.0, count)["supply_pressure"] + 101_325.0
        phase = k * time + math.asin(0.1)
        assert found == pytest.approx(full * math.sin(min(phase, 0.5 * math.pi)), rel=2e-3)
    assert k * 0.6 + math.asin(0.1) > 0.5 * math.pi  # it is full


def test_no_air_is_lost_whatever_happens():
    """Mass given is mass used, lost and stored, also where more is taken than there is."""
    rng = random.Random(2)
    supply = air(start__pressure=20e5, relief_pressure=25e5, compressor__flow_limit=0.3)
    before, used = supply.outputs(), 0.0
    for k in range(400):
        wanted = 10e5 if 100 < k < 150 else 30e5
        flow = rng.choice((-0.05, 0.0, 0.3, 2.0)) if k > 50 else 0.0
        found = draw(supply, flow, 1, 0.02, pressure_command=wanted)
        used += flow * 0.02
    assert min(found["air_given"], found["air_lost"]) > 0.5
    stored = found["air_stored"] - before["air_stored"]
    assert found["air_given"] - used - found["air_lost"] == pytest.approx(stored, abs=1e-12)


def test_water_in_the_hole_presses_by_its_height():
    supply = air(hole__depth=30.0, water__depth=20.0)
    found = [run(supply, "Supply", 1, bit_position=z)["back_pressure"] for z in (0.0, 5.0, -15.0)]
    assert found == [1000.0 * 9.81 * 10.0, 1000.0 * 9.81 * 15.0, 0.0]
    assert run(air(hole__depth=30.0), "Supply", 1)["back_pressure"] == 0.0


def layered(**values):
    return make_model(
        "RockProfile", **{"layers[2].top": 0.1, "layers[2].loading_stiffness": 2e9, **values}
    )


def test_layers_change_at_their_depth_and_do_not_come_back():
    rock = layered()
    places = (0.0, 0.0999, 0.1, 0.2, 0.05)
    found = [run(rock, "RockProfile", 1, bit_position=z) for z in places]
    assert [one["layer"] for one in found] == [1, 1, 2, 2, 2]
    assert [one["loading_stiffness"] for one in found] == [7.5e8, 7.5e8, 2e9, 2e9, 2e9]
    assert found[-1]["depth"] == 0.2


def test_without_any_layer_all_is_rock_of_the_first_one():
    """Stiffness, ratio and torque alike, at every depth."""
    first = {"loading_stiffness": 4e8, "unloading_ratio": 7.0, "torque_factor": 3.0}
    values = {f"layers[1].{name}": value for name, value in first.items()}
    found = []
    for top in (-1.0, 0.0):
        rock = make_model("RockProfile", **values, **{"layers[1].top": top})
        found += [run(rock, "RockProfile", 1, bit_position=z, feed_force=2e3) for z in (0.0, 5.0)]
    assert found[:2] == found[2:]
    assert found[0]["rotation_torque"] == pytest.approx(3.0 * 0.04 * 2e3)
    assert [one["layer"] for one in found] == [1, 1, 1, 1]


def variation(rock, depth):
    """Factor on the stiffness at a depth that is no less than those before [m]."""
    found = run(rock, "RockProfile", 1, bit_position=depth)["loading_stiffness"]
    return found / rock.parameters["layers[1].loading_stiffness"]


def test_variation_has_its_seed_its_mean_and_its_spread():
    rocks = [make_model("RockProfile", variation__spread=0.3, variation__seed=s) for s in (1, 1, 2)]
    depths = [0.0037 * k for k in range(4000)]
    columns = [[variation(rock, z) for z in depths] for rock in rocks]
    assert columns[0] == columns[1]
    assert columns[0] != columns[2]
    logs = [math.log(value) for value in columns[0]]
    mean = sum(logs) / len(logs)
    spread = math.sqrt(sum((x - mean) ** 2 for x in logs) / len(logs))
    # some 1500 knots: the mean within 4 standard errors of -s^2/2
    assert mean == pytest.approx(-0.045, abs=4 * 0.3 / math.sqrt(1500))
    assert spread == pytest.approx(0.3, rel=0.1)


def test_stiffness_is_lowest_at_the_best_feed():
    rock = make_model("RockProfile", best_feed__force=2000.0, best_feed__factor=4.0)
    for feed, factor in ((1000.0, 2.0), (2000.0, 1.0), (3000.0, 2.0)):
        found = run(rock, "RockProfile", 1, feed_force=feed)
        assert found["loading_stiffness"] == pytest.approx(7.5e8 * factor)


@pytest.mark.parametrize("vent", [0.0, 0.05])
def test_the_vent_lets_pressure_out_that_is_not_wanted(vent):
    """Without it the pressure stays, and the energy of what leaves is not given back."""
    supply = make_model("Supply", vent__flow_limit=vent, drive__leakage=0.0)
    p = supply.parameters
    inputs = {"pressure_command": 1e6, "percussion_on": False}
    found = run(supply, "Supply", 100, **inputs)
    # 0.1 s at the greatest flow of the vent, out of the volume of the hose
    lost = 0.1 * vent * p["hose.bulk_modulus"] / p["hose.volume"]
    assert found["hose_pressure"] == pytest.approx(2e6 - lost, rel=1e-9)
    assert found["flow"] == found["energy"] == 0.0
    found = run(supply, "Supply", 2000, **inputs)
    assert found["hose_pressure"] == pytest.approx(2e6 if vent == 0.0 else 1e6, rel=1e-6)


def test_stiffness_is_lowest_at_the_best_pressure():
    rock = make_model("RockProfile", best_pressure__pressure=2e6, best_pressure__factor=8.0)
    for pressure, factor in ((1e6, 3.0), (2e6, 1.0), (3e6, 3.0)):
        found = run(rock, "RockProfile", 1, supply_pressure=pressure)
        assert found["loading_stiffness"] == pytest.approx(7.5e8 * factor)


def test_the_variation_above_the_first_knot_is_that_of_its_depth():
    """A rock that is asked there first, and one that has been elsewhere."""
    values = {"variation__spread": 0.5, "variation__length": 0.5}
    fresh, used = make_model("RockProfile", **values), make_model("RockProfile", **values)
    variation(used, 0.7)
    for rock in (fresh, used):
        rock.change(depth=-0.1)
    assert variation(fresh, -0.1) == variation(used, -0.1)
