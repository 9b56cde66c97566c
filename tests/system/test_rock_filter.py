"""The part that tells the rock beside a controller, and layers of crushing energy."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from models import make_model, start_inputs

from fmu_src.parts.python_part import form_fault
from fmu_src.parts.rock_filter import TABLE, RockFilter
from fmu_src.system.archive import build_fmus, read_plan, write_system
from percussion_model import Simulation, SimulationError
from percussion_model.analysis.identify.observation import Q
from percussion_model.analysis.identify.part import from_numbers
from percussion_model.scene.hammers import hammer
from percussion_model.scene.text import read_toml
from scenarios import rock_following

STARTS = {name: entry[3] for name, entry in TABLE.parameters.items()}
NUMBERS = read_toml(rock_following.SYSTEM)["parameters"]["filter"]
SETTING = {"supply_pressure": 1.7e6, "feed_force": 8000.0, "rotation_speed": 5.7}


def model(**changes):
    return RockFilter({**STARTS, **NUMBERS, **changes})


def drill(part, seconds, hard=0.0, place=0.0, step=0.01):
    """Step a part through rock of its own table; `hard` is added to ln q of the prior."""
    known = from_numbers({**STARTS, **NUMBERS})
    unknowns = known.mean.copy()
    unknowns[Q] += hard
    setting = np.array(list(SETTING.values()))
    signals = np.exp(known.table.predict(unknowns[np.newaxis], setting)[0])
    names = ("rate_of_penetration", "blow_frequency", "rotation_torque")
    inputs = {**SETTING, **dict(zip(names, signals.tolist(), strict=True))}
    for _ in range(round(seconds / step)):
        place += inputs["rate_of_penetration"] * step
        part.step({**inputs, "bit_position": place}, step)
    return place


def begun(**changes):
    part = model(**changes)
    part.begin({"bit_position": 0.0})
    return part


def test_the_part_tells_the_rock_and_its_change():
    part = begun()
    place = drill(part, 20.0)
    told = part.outputs()
    prior = math.exp(NUMBERS["prior.apparent_energy"])
    assert told["apparent_energy"] == pytest.approx(prior, rel=0.05)
    assert told["apparent_energy_low"] < prior < told["apparent_energy_high"]
    drill(part, 20.0, 0.6, place)
    after = part.outputs()
    assert after["layers"] == 1
    assert after["apparent_energy"] == pytest.approx(prior * math.exp(0.6), rel=0.05)


def test_set_points_follow_within_bounds():
    part = begun(**{"follow.pressure_power": 0.5, "follow.feed_power": -1.0,
                    "follow.lowest_feed": 6500.0, "follow.highest_pressure": 2.5e6})  # fmt: skip
    drill(part, 20.0)
    hard = part.outputs()["apparent_energy"] / part.parameters["follow.energy"]
    found = part.signals()
    pressure = part.parameters["follow.pressure"] * hard**0.5
    assert found["pressure_setpoint"] == pytest.approx(pressure, rel=1e-12)
    feed = max(part.parameters["follow.feed"] / hard, 6500.0)
    assert found["feed_setpoint"] == pytest.approx(feed, rel=1e-12)
    held = begun(**{"follow.on": False})
    assert held.signals()["pressure_setpoint"] == held.parameters["follow.pressure"]


def test_what_is_no_drilling_tells_nothing():
    """Percussion off, a feed out of the table, a bit that stands still."""
    for change in ({"supply_pressure": 1e5}, {"feed_force": 0.0}, {"rate_of_penetration": 0.0}):
        part = begun()
        before = part.outputs()
        inputs = {**SETTING, "rate_of_penetration": 0.01, "blow_frequency": 30.0,
                  "rotation_torque": 100.0, "bit_position": 0.0, **change}  # fmt: skip
        for _ in range(200):
            part.step(inputs, 0.01)
        assert part.outputs() == before


def test_its_state_goes_out_and_comes_back():
    part = begun()
    place = drill(part, 20.3)
    saved = json.loads(json.dumps(part.save()))
    assert form_fault(saved, part.save()) == ""
    assert part.state_fault(saved) == ""
    other = begun()
    other.restore(saved)
    drill(part, 9.9, 0.5, place)
    drill(other, 9.9, 0.5, place)
    assert other.outputs() == part.outputs()
    for key, value in (("p", [1.0]), ("memory", [7.0]), ("x", [])):
        damaged = {**saved, "filter": {**saved["filter"], key: value}}
        assert part.state_fault(damaged) != ""
    assert part.state_fault({**saved, "sums": [0.0]}) != ""


def test_the_system_has_the_numbers_of_its_hammer():
    found = rock_following.numbers()
    told = {name: NUMBERS[name] for name in found}
    assert found == pytest.approx(told, rel=1e-4, abs=1e-4)


def test_in_its_system_it_tells_the_rock_and_the_pressure_follows(built_library, tmp_path):
    """Coupled with hammer, string, rig, supply and controller, through one change of rock."""
    plan = read_plan(rock_following.SYSTEM)
    archive = write_system(plan, build_fmus(plan, tmp_path), tmp_path / "system.ssp")
    found = rock_following.run(archive, {"rock.layers[2].top": 0.08}, 16.0)
    rock = found["rock.crushing_energy"] / plan.parameters["hammer"]["breaking.efficiency"]
    depth, time = found["hammer.bit.position"], found["time"]
    for at in (np.searchsorted(depth, 0.075), len(time) - 1):
        low, high = (found[f"filter.apparent_energy_{end}"][at] for end in ("low", "high"))
        assert low < rock[at] < high < 1.7 * low
    assert found["filter.layers"][-1] >= 1
    soft, hard = (found["supply.supply_pressure"][at] for at in (np.searchsorted(depth, 0.07), -1))
    assert hard > 1.08 * soft
    scores = rock_following.scores(found)
    assert 0.8 < scores["rate"] * (time[-1] - 2.0) / (depth[-1] - depth[time < 2.0][-1]) < 1.2


def test_layers_have_a_crushing_energy():
    rock = make_model("RockProfile", **{"layers[2].top": 0.5, "layers[2].crushing_energy": 9e7})
    assert rock.outputs()["crushing_energy"] == 5.5e7
    rock.step({**start_inputs("RockProfile"), "bit_position": 0.6}, 1e-3)
    assert rock.outputs()["crushing_energy"] == 9e7


def test_a_crushing_energy_that_changes_changes_the_rate_in_inverse_proportion():
    """As an input of a run; the ledger closes all the same."""
    simulation = Simulation(hammer("dth5").computed_by("rigid"))
    rates = []
    for energy in (5.5e7, 1.1e8):
        simulation.set_inputs(breaking_crushing_energy=energy)
        simulation.advance_blows(10, simulation.time + 5.0)
        blows = simulation.blows[-6:]
        rates.append(np.mean(blows["breaking_blow_volume"]) / np.mean(blows["period"]))
    assert rates[0] / rates[1] == pytest.approx(2.0, rel=1e-3)
    assert abs(simulation.energy()["residual"]) < 1e-6
    with pytest.raises(SimulationError, match="breaking_crushing_energy"):
        Simulation(hammer("dth5").replace(**{"effects.breaking": False})).set_inputs(
            breaking_crushing_energy=1e7
        )
