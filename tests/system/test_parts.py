"""The FMUs around the hammer: valid, described, saved, guarded; and the laws inside them."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from fmu_src.system.parts import make_model, part_variables, start_inputs
from fmu_src.system.tables import PARTS
from fmu_src.units import UNITS
from scenarios.harness import Instance

NAMES = sorted(PARTS)
SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi2" / "fmi2ModelDescription.xsd"


@pytest.fixture(scope="module")
def files(fmus):
    return {path.stem: path for path in fmus.values() if path.stem in PARTS}


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


def test_a_state_of_another_part_is_refused(files):
    with Instance(files["RigFeed"]) as rig, Instance(files["Supply"]) as supply:
        rig.start()
        supply.start()
        with pytest.raises(Exception, match=r"(?i)fmustate"):
            supply.restore(rig.save(), 0.0)
        assert any("another FMU" in text for text in supply.messages)


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


def test_variation_has_its_seed_its_mean_and_its_spread():
    rocks = [make_model("RockProfile", variation__spread=0.3, variation__seed=s) for s in (1, 1, 2)]
    depths = [0.0037 * k for k in range(4000)]
    columns = [[rock.variation(z) for z in depths] for rock in rocks]
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


# controller


def test_the_pi_is_a_pi_and_does_not_wind_up():
    control = make_model("DrillController", feed_force=2500.0)
    p = control.parameters
    found = run(control, "DrillController", 100, feed_setpoint=2500.0, feed_force=2400.0)
    wanted = p["pi.gain"] * 100.0 * (1.0 + 0.1 / p["pi.time"])
    assert found["force_command"] == pytest.approx(wanted, rel=1e-9)
    found = run(control, "DrillController", 100_000, feed_setpoint=2500.0, feed_force=0.0)
    assert found["force_command"] <= p["force_limit"]
    found = run(control, "DrillController", 300, feed_setpoint=2500.0, feed_force=5000.0)
    assert found["force_command"] < p["force_limit"] - 1000.0


def test_a_void_cuts_percussion_back_until_there_is_rock():
    control = make_model("DrillController")
    found = run(control, "DrillController", 500, head_velocity=0.3, feed_force=300.0)
    assert found["mode"] == 1
    assert found["pressure_command"] == control.parameters["cutback.pressure"]
    found = run(control, "DrillController", 500, head_velocity=0.0, feed_force=300.0)
    assert found["mode"] == 1
    found = run(control, "DrillController", 500, head_velocity=0.0, feed_force=2000.0)
    assert found["mode"] == 0
    assert found["pressure_command"] == 2e6


def test_a_jam_is_answered_by_a_retract():
    control = make_model("DrillController", retract__force=-1500.0)
    assert run(control, "DrillController", 50, rotation_torque=400.0)["mode"] == 0
    found = run(control, "DrillController", 400, rotation_torque=400.0)
    assert found["mode"] == 2
    # at the start nothing was wanted of the rig beside 2.5 kN of feed
    assert found["force_command"] == pytest.approx(-2500.0 - 1500.0)
    assert run(control, "DrillController", 400, rotation_torque=20.0)["mode"] == 0


def test_pressure_follows_the_feed_where_it_is_told_to():
    control = make_model("DrillController", ratio__on=True)
    found = run(control, "DrillController", 1000, feed_force=2000.0)
    assert found["pressure_command"] == pytest.approx(2000.0 * 800.0)
    found = run(control, "DrillController", 1000, feed_force=0.0)
    assert found["pressure_command"] == control.parameters["ratio.lowest"]


@pytest.mark.parametrize("start", [1000.0, 2500.0, 6000.0])
def test_the_seeker_climbs_a_known_hill(start):
    """R = F exp(-F/3000) is best at 3000 N; the feed arrives 0.25 s late."""
    control = make_model("DrillController", seek__on=True, feed_setpoint=start)
    inputs = start_inputs("DrillController") | {"feed_setpoint": start}
    late = [start] * 25
    for _ in range(12_000):
        late.append(control.wanted)
        feed = late.pop(0)
        inputs |= {"feed_force": feed, "rate_of_penetration": feed * math.exp(-feed / 3000.0)}
        control.step(inputs, 1e-2)
    assert control.centre == pytest.approx(3000.0, rel=0.03)
