"""Hammers with air or oil in chambers through FMUs: what a driller sets, and what comes of it."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu

from fmu_src.hammer.build import build_hammer
from percussion_model import Scene, Simulation
from percussion_model.scene.hammers import with_chambers

STEP = 2.0**-9  # [s]
# Pressure falls, percussion rests, and both come back; with water in the hole at last.
CHANGES = {0.5: {"supply_pressure": 10e5}, 1.0: {"percussion_on": False},
           1.5: {"percussion_on": True, "supply_pressure": 24e5},
           2.0: {"pneumatic.back_pressure": 5e5}}  # fmt: skip
END = 2.5
OUTPUTS = ("blow_frequency", "blow_energy", "blow_count", "hole_depth", "pneumatic.air",
           "pneumatic.consumed", "pneumatic.upper_pressure", "pneumatic.lower_pressure",
           "pneumatic.exhaust_pressure", "pneumatic.supply", "pneumatic.gas_work")  # fmt: skip


@pytest.fixture(scope="module")
def scene():
    return with_chambers("dth5", 24e5)


@pytest.fixture(scope="module")
def signals():
    """Inputs as fmpy takes them: a step at each change."""
    now = {"supply_pressure": 24e5, "percussion_on": True, "pneumatic.back_pressure": 0.0}
    kinds = [(name, "?" if isinstance(value, bool) else "f8") for name, value in now.items()]
    rows = []
    for k in range(round(END / STEP) + 1):
        now |= CHANGES.get(k * STEP, {})
        rows.append((k * STEP, *now.values()))
    return np.array(rows, [("time", "f8"), *kinds])


@pytest.fixture(scope="module")
def expected(scene):
    """The same by the package: a row for each communication step, and the blows."""
    simulation, pressure, is_on = Simulation(scene), 24e5, True
    rows = []
    for k in range(round(END / STEP)):
        new = CHANGES.get(k * STEP, {})
        pressure, is_on = new.get("supply_pressure", pressure), new.get("percussion_on", is_on)
        if new:
            inputs = {"pneumatic_supply_pressure": pressure if is_on else 0.0}
            if "pneumatic.back_pressure" in new:
                inputs["pneumatic_back_pressure"] = new["pneumatic.back_pressure"]
            simulation.set_inputs(**inputs)
        simulation.advance((k + 1) * STEP)
        rows.append(simulation.observe())
    return rows, simulation.blows


@pytest.mark.parametrize("kind", ["slave", "2.0", "3.0"])
def test_pressure_and_percussion_act_on_the_chambers(
    kind, scene, signals, expected, write, tmp_path
):
    path = tmp_path / "Hammer.fmu" if kind == "slave" else write(scene, kind)
    if kind == "slave":
        build_hammer(scene, path)
    found = simulate_fmu(
        str(path), stop_time=END, step_size=STEP, output_interval=STEP, output=list(OUTPUTS),
        input=signals,
    )[1:]  # fmt: skip
    rows, blows = expected
    for name in OUTPUTS:
        column = name.replace(".", "_")
        if column in rows[0]:
            here = np.array([row[column] for row in rows])
            np.testing.assert_array_equal(found[name], here, err_msg=name)
    at = found["time"]
    frequency = {t: found["blow_frequency"][np.searchsorted(at, t)] for t in (0.5, 1.0, 1.5, 2.0)}
    for t in (0.5, 1.0, 2.0):  # that of the library's last blow
        last = blows[blows["time"] + blows["period"] < t][-1]
        assert frequency[t] == pytest.approx(1.0 / last["period"], rel=0.02)
        k = np.searchsorted(at, t)
        assert found["blow_energy"][k] == pytest.approx(last["blow_energy"], rel=0.05)
    assert frequency[1.0] < 0.75 * frequency[0.5]
    # a rebound comes down once more; then nothing is blown until percussion is on again
    rest = (at > 1.25) & (at < 1.5)
    assert np.ptp(found["blow_count"][rest]) == 0
    assert np.ptp(found["pneumatic.consumed"][rest]) < 1e-5
    assert frequency[1.5] < 0.2 * frequency[0.5]
    assert frequency[2.0] == pytest.approx(frequency[0.5], rel=0.02)
    assert found["blow_energy"][-1] < 0.85 * found["blow_energy"][np.searchsorted(at, 2.0)]
    assert np.all(found["pneumatic.exhaust_pressure"][at > 2.1] > 5e5)


OIL = ("blow_count", "hole_depth", "hydraulic.line_pressure", "hydraulic.used")


def test_the_same_pressure_is_the_pumps_of_a_hammer_with_oil(write):
    scene, step, end = with_chambers("hc25", 150e5, 1), 2.0**-8, 0.75
    changes = {0.25: 80e5, 0.5: 0.0}  # percussion off at last
    simulation, rows, signals = Simulation(scene), [], []
    pressure, is_on = 150e5, True
    for k in range(round(end / step)):
        if k * step in changes:
            simulation.set_inputs(hydraulic_supply_pressure=changes[k * step])
            pressure, is_on = changes[k * step] or pressure, changes[k * step] > 0.0
        signals.append((k * step, pressure, is_on))
        simulation.advance((k + 1) * step)
        rows.append(simulation.observe())
    kinds = [("time", "f8"), ("supply_pressure", "f8"), ("percussion_on", "?")]
    found = simulate_fmu(
        str(write(scene, "2.0")), stop_time=end, step_size=step, output_interval=step,
        output=list(OIL), input=np.array(signals, kinds),
    )[1:]  # fmt: skip
    for name in OIL[1:]:
        here = np.array([row[name.replace(".", "_")] for row in rows])
        np.testing.assert_array_equal(found[name], here, err_msg=name)
    counts = found["blow_count"][np.searchsorted(found["time"], (0.25, 0.5, 0.625, 0.75))]
    assert counts[0] > 12
    assert 0.9 * counts[0] > counts[1] - counts[0] > 0.5 * counts[0]
    assert counts[2] == counts[3]  # at rest


def test_with_and_without_a_library_the_chambers_are_the_same(make):
    """The host chooses the drive; pressure, percussion and a refusal, in Python and in C."""
    runs = []
    for name in ("RigidHammer", "NumbaRigidHammer"):
        instance = make(name, effects__drive="pneumatic", supply_pressure=18e5)
        rows = []
        for k, change in enumerate([{}, {"supply_pressure": 9e5}, {"percussion_on": False}]):
            instance.time = 0.1 * k
            instance.set(change)
            instance.step(0.1)
            rows.append(instance.values(instance.outputs))
        instance.set({"percussion_on": True, "supply_pressure": 3e7})
        with pytest.raises(Exception, match="failed"):
            instance.step(0.1)
        assert "supply_pressure = 30000000.0 Pa: must be" in instance.faults[0]
        instance.set({"supply_pressure": 9e5})
        instance.step(0.1)
        rows.append(instance.values(instance.outputs))
        runs.append(rows)
    assert runs[0] == runs[1]
    at = instance.outputs.index("pneumatic.consumed")
    assert 0.03 < runs[0][0][at] < runs[0][1][at] < runs[0][3][at]


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_pressure_of_the_scene_is_that_of_the_input(scene, version, write):
    """There is one input for it, which begins with it, and no other."""
    description = read_model_description(str(write(scene, version)))
    found = {one.name: one for one in description.modelVariables}
    assert float(found["supply_pressure"].start) == scene["pneumatic.supply_pressure"]
    assert "pneumatic.supply_pressure" not in found


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_pressure_beyond_the_chambers_is_refused(version, write, capfd):
    """Where the host chooses the drive: a law takes it, chambers do not."""
    path = write(Scene(), version)
    choices = Scene().row_of("effects.drive").choices
    for drive, fails in (("pressure", False), ("pneumatic", True)):
        start = {"supply_pressure": 3e7, "effects.drive": 1 + choices.index(drive)}
        run = {"stop_time": STEP, "step_size": STEP, "start_values": start}
        if not fails:
            simulate_fmu(str(path), **run)
            continue
        capfd.readouterr()
        with pytest.raises(Exception, match="failed"):
            simulate_fmu(str(path), **run)
        said = capfd.readouterr().out
        assert "supply_pressure = 30000000.0 Pa: must be a number from 0 to 2e7 Pa" in said
