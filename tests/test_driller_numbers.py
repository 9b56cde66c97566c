"""Numbers in the units of drillers: against arithmetic by hand, in every place that shows them."""

from __future__ import annotations

import dataclasses
import json
import math
import re

import numpy as np
import pytest

from percussion_model import Result, Scene, SceneError, settled, simulate
from percussion_model.analysis.drill_string import bar_stress
from percussion_model.interface.plotting.window import StressField, peak_stresses
from percussion_model.interface.report import headline_rows, mean_cards
from percussion_model.interface.terminal import show_settled, show_summary
from percussion_model.physics.records import BLOW
from percussion_model.scene.hammers import at_altitude, hammer, hammers, with_chambers
from percussion_model.simulation.driller_numbers import DRILLER_NUMBERS, driller_numbers
from percussion_model.simulation.means import by_volume, numbers_over, scatter_over
from percussion_model.simulation.rate import rate_of_blows
from percussion_model.simulation.warnings import unused_note

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
HOLE = 0.1
AREA = math.pi * 0.05**2


@pytest.fixture(scope="module")
def result():
    return simulate(Scene(hole_diameter=HOLE).replace(**RIGID), 2.0, settle=1.0)


def hand_made_blows():
    """Four blows: 2 J in all 10 ms but the last, 4 J in 20 ms; the hole advances 1 mm at each."""
    rows = np.zeros(4, BLOW)
    rows["blow_energy"], rows["period"] = [2.0, 2.0, 2.0, 4.0], [0.01, 0.01, 0.01, 0.02]
    rows["hole_advance"] = 1e-3
    return rows


def test_power_and_specific_energy_of_blows_made_by_hand():
    numbers = numbers_over(hand_made_blows())
    assert numbers["percussive_power"] == pytest.approx(10.0 / 0.05, rel=1e-15)
    assert numbers["energy_per_advance"] == pytest.approx(10.0 / 4e-3, rel=1e-15)
    found = by_volume(numbers, HOLE)["specific_energy"]
    assert found == pytest.approx(10.0 / (4e-3 * AREA), rel=1e-14)
    assert by_volume(numbers, None) == {}
    # every blow has the same power, so there is no scatter; the energies do scatter
    errors = scatter_over(hand_made_blows())
    assert errors["percussive_power"] == pytest.approx(0.0, abs=1e-12)
    assert errors["energy_per_advance"] > 0.0
    rows = hand_made_blows()
    rows["hole_advance"] = 0.0
    assert math.isnan(numbers_over(rows)["energy_per_advance"])


def test_a_summary_has_them_in_si_and_in_the_units_of_drillers(result):
    summary = json.loads(json.dumps(result.summary(), allow_nan=False))
    blows = result.counted
    power = float(blows["blow_energy"].sum() / blows["period"].sum())
    drilled = float(blows["hole_advance"].sum()) * AREA
    energy = float(blows["blow_energy"].sum()) / drilled
    expected = {
        "rate_of_penetration": (3600.0 * result.rate_of_penetration, "m/h"),
        "blow_frequency": (60.0 / float(blows["period"].mean()), "blows/min"),
        "percussive_power": (power / 1000.0, "kW"),
        "specific_energy": (energy / 1e6, "MJ/m^3"),
    }
    found = summary["driller_numbers"]
    assert found.keys() == expected.keys() == DRILLER_NUMBERS.keys()
    for key, (value, unit) in expected.items():
        assert found[key]["value"] == pytest.approx(value, rel=1e-12)
        assert (found[key]["unit"], bool(found[key]["definition"])) == (unit, True)
        factor = found[key]["value"] / summary[key]
        error = summary["errors"].get(key, summary.get(f"{key}_error"))
        assert found[key]["error"] == pytest.approx(factor * error, rel=1e-12)
    assert summary["specific_energy"] == pytest.approx(
        summary["percussive_power"] / (AREA * summary["rate_of_penetration"]), rel=1e-12
    )


def test_what_is_not_known_is_not_shown(result, capsys):
    other = dataclasses.replace(result, scene=result.scene.replace(hole_diameter=None))
    assert other.summary()["specific_energy"] is None
    assert "specific_energy" not in other.summary()["driller_numbers"]
    show_summary(other)
    shown = capsys.readouterr().out
    assert "Percussive power" in shown
    assert "Specific energy" not in shown
    assert not [row for row in headline_rows(other.summary()) if "Specific" in row[0]]
    nothing = simulate(Scene(hole_diameter=HOLE).replace(**RIGID), 0.02, settle=0.0)
    assert nothing.summary()["driller_numbers"] == {}
    show_summary(nothing)
    assert "kW" not in capsys.readouterr().out


def test_the_table_shows_them_beside_si(result, capsys):
    show_summary(result)
    lines = capsys.readouterr().out.splitlines()
    rows = [[cell.strip() for cell in line.split("│")[1:-1]] for line in lines if "│" in line]
    by_unit = {unit: (name, float(number)) for name, number, unit in rows if unit in UNITS}
    summary = result.summary()
    for key, one in DRILLER_NUMBERS.items():
        name, value = by_unit[one.unit]
        assert value == pytest.approx(one.factor * summary[key], rel=1e-3)
        assert name == (one.behind or one.name)
    at = {unit: k for k, (_, _, unit) in enumerate(rows)}
    assert at["m/h"] == at["mm/s"] + 1
    assert at["blows/min"] == at["Hz"] + 1


UNITS = {one.unit for one in DRILLER_NUMBERS.values()}


def test_the_report_shows_them_with_their_errors(result):
    summary = result.summary()
    summary["errors"] = {
        **summary["errors"], "percussive_power": 12.0, "specific_energy": 3.0e5,
        "blow_frequency": 0.02,
    }  # fmt: skip
    shown = {name: (si, other) for name, si, other in headline_rows(summary)}
    power = next(texts for name, texts in shown.items() if name.startswith("Percussive power"))
    assert re.fullmatch(r"\d{4} ± 12 W", power[0])
    assert re.fullmatch(r"\d\.\d{3} ± 0\.012 kW", power[1])
    energy = next(texts for name, texts in shown.items() if name.startswith("Specific energy"))
    assert re.fullmatch(r"\d+\.\d\d ± 0\.30 MJ/m³", energy[1])
    assert re.fullmatch(r"\d+\.\d ± 1\.2 blows/min", shown["Blow frequency"][1])
    assert shown["Rate in an hour"][1].endswith("m/h")
    assert any("kW" in name for _, name in mean_cards(summary))


def test_a_saved_result_tells_the_same(result, tmp_path):
    result.save(tmp_path)
    read = Result.load(tmp_path)
    assert read.scene.hole_diameter == HOLE
    for key in ("driller_numbers", "errors", "specific_energy", "percussive_power"):
        assert read.summary()[key] == result.summary()[key]


def test_a_settled_motion_shows_them(capsys):
    found = settled(Scene(hole_diameter=HOLE).replace(**RIGID), error_estimate=True)
    summary = found.summary()
    blow = found.cycle[0]
    assert found.order == 1
    power = float(blow["blow_energy"] / blow["period"])
    assert summary["percussive_power"] == pytest.approx(power, rel=1e-14)
    assert summary["specific_energy"] == pytest.approx(
        float(blow["blow_energy"] / blow["hole_advance"]) / AREA, rel=1e-14
    )
    before = found.blows[-2]
    change = abs(power - float(before["blow_energy"] / before["period"]))
    assert summary["percussive_power_error"] == pytest.approx(change, rel=1e-9)
    assert summary["blow_frequency"] * summary["blow_period"] == pytest.approx(1.0, rel=1e-15)
    assert summary["driller_numbers"] == driller_numbers(summary)
    show_settled(found)
    shown = capsys.readouterr().out
    for unit in UNITS:
        assert f" {unit}" in shown


def test_hammers_on_the_market_have_the_hole_of_their_bit():
    """The head of the comment of each names the bit, docs/top_hammer.md the same."""
    from percussion_model.scene import hammers as package

    for name in hammers():
        text = (package._HERE / f"{name}.toml").read_text(encoding="utf-8")
        bit = re.search(r"bit of (\d+) mm", text.partition("\n")[0])
        assert hammer(name).hole_diameter == pytest.approx(float(bit[1]) / 1000.0, rel=1e-15)


def test_greatest_stresses_have_their_place():
    """Two bars by hand: 3 cells of 1, 2 and 3 m, two times."""
    edges, times = np.array([0.0, 1.0, 3.0, 6.0]), np.array([-0.5, 0.5, 1.5])
    upper = np.array([[1.0, 2.0], [5.0, -4.0], [0.0, 3.0]])
    found = peak_stresses({
        "piston": StressField(times, edges, upper), "bit": StressField(times, edges, -upper),
    })  # fmt: skip
    assert dataclasses.astuple(found["piston"].compression) == (5.0, 2.0, 0.0)
    assert dataclasses.astuple(found["piston"].tension) == (-4.0, 2.0, 1.0)
    assert dataclasses.astuple(found["bit"].tension) == (-5.0, 2.0, 0.0)
    assert found["piston"] == bar_stress(upper.T, edges, np.array([0.0, 1.0]))


def test_an_fmu_knows_the_hole():
    pytest.importorskip("pythonfmu")
    from fmu_src.hammer.variables import hammer_variables

    starts = {one.name: one.start for one in hammer_variables(Scene(hole_diameter=HOLE))}
    assert starts["hole_diameter"] == HOLE
    assert {one.name: one.start for one in hammer_variables(Scene())}["hole_diameter"] == 0.0


# ------------------------------------------------------------------- chambers of air


@pytest.fixture(scope="module")
def on_air():
    return simulate(with_chambers("dth5", 24e5).computed_by("rigid"), 1.0, settle=0.5)


def test_power_and_efficiency_of_air_are_those_of_the_blows(on_air):
    summary, blows = on_air.summary(), on_air.counted
    mass, time = on_air.scene.piston.mass, float(blows["period"].sum())
    before = 0.5 * mass * float((blows["impact_velocity"] ** 2).sum()) / time
    after = 0.5 * mass * float((blows["rebound_velocity"] ** 2).sum()) / time
    air = float((blows["pneumatic_air"] * blows["period"]).sum()) / time
    assert summary["percussive_power"] == pytest.approx(before, rel=1e-12)
    assert summary["net_percussive_power"] == pytest.approx(before - after, rel=1e-12)
    # reversible expansion at the temperature of the surroundings: p V ln of the ratio
    volume = air * 287.05 * 293.15 / 101325.0
    power = 101325.0 * volume * math.log(1.0 + on_air.hammer_pressure / 101325.0)
    assert summary["air_efficiency"] == pytest.approx(before / power, rel=1e-9)
    assert 0.2 < summary["air_efficiency"] < 0.4
    assert summary["hammer_pressure"] == pytest.approx(24e5, rel=1e-3)


def test_a_run_on_air_tells_it_in_words_of_drillers(on_air, capsys):
    show_summary(on_air)
    shown = capsys.readouterr().out
    summary = on_air.summary()
    for name, number, unit in (
        ("Pressure at the hammer", 24.0, "bar, at the end"),
        (r"Free air \(0 °C, 1 atm\)", summary["pneumatic_air"] * 60.0 / 1.2923, "m³/min"),
        ("Percussive power", summary["percussive_power"] / 1e3, "kW"),
        ("Power less the rebound", summary["net_percussive_power"] / 1e3, "kW"),
        ("Percussive power by air power", 100.0 * summary["air_efficiency"], "%"),
    ):
        row = re.search(rf"│ {name} +│ +([\d.]+)[^│]*│ {unit} *│", shown)
        assert float(row[1]) == pytest.approx(number, rel=5e-3), name
    told = {name: other for name, _, other in headline_rows(summary)}
    assert told["Percussive power less the rebound"].endswith("kW")
    assert told["Pressure at the hammer, at the end"] == "≈24.0 bar"


def test_without_chambers_nothing_is_told_of_air(result):
    summary = result.summary()
    for key in ("hammer_pressure", "net_percussive_power", "energy_per_air", "air_efficiency"):
        assert summary[key] is None
        assert key not in summary["errors"]


def test_hammers_on_air_are_told_to_be_starved_or_to_have_stalled():
    scene = with_chambers("dth5", 24e5).computed_by("rigid", **{"run.error_estimate": False})
    small = {"pneumatic.supply_flow": 0.3, "pneumatic.supply_volume": 0.01}
    starved = simulate(scene.replace(**small), 2.0)
    assert [text for text in starved.warnings if text.startswith("the hammer is starved")]
    assert starved.hammer_pressure < 20e5
    # a large supply falls for hours, and no two blows are alike
    falling = scene.replace(**small | {"pneumatic.supply_volume": 5.0})
    told = settled(falling, most_blows=40, error_estimate=True).warnings
    assert any("while it falls no two blows are alike" in text for text in told)
    held = simulate(scene.replace(**small | {"pneumatic.supply_volume": 0.0}), 0.5).warnings
    assert any(text.startswith("pneumatic.supply_flow has no effect") for text in held)
    by_law = with_chambers("dth5", 24e5).replace(**{"effects.drive": "pressure"})
    assert unused_note(by_law.given_in_vain).endswith("in this scene: pneumatic (18 keys)")
    # between the edges of both intakes, with no way out of it
    rest = {"start.gap": 0.047, "start.piston_velocity": 0.0, "effects.gravity": False}
    stalled = simulate(scene.replace(**rest, **{"pneumatic.leak": 0.0}), 0.5)
    assert any(text.startswith("the hammer has stalled: no whole") for text in stalled.warnings)
    weak = simulate(scene.replace(**{"pneumatic.back_pressure": 10e5}), 1.0)
    assert weak.rate_of_penetration == 0.0
    assert any(text.startswith("no rock breaks: no blow") for text in weak.warnings)
    still = simulate(scene.replace(**{"pneumatic.back_pressure": 15e5}), 0.5)
    for found, has_reason in ((weak, True), (still, True), (stalled, False)):
        told = [one for one in found.warnings if one.startswith("pneumatic.back_pressure = 1")]
        assert len(told) == has_reason


def test_a_pump_that_gives_all_it_can_is_told():
    for pressure, is_told in ((150e5, False), (220e5, True)):
        scene = with_chambers("hc25", pressure).replace(**{"run.error_estimate": False})
        told = simulate(scene, 0.5).warnings
        assert is_told == any("the pump gives too little oil" in text for text in told)


def test_a_hammer_goes_up_a_mountain():
    """ISO 2533: 70,109 Pa and 268.65 K at 3,000 m; air by mass hardly changes at equal gauge."""
    scene = with_chambers("dth5", 24e5).computed_by("rigid", **{"run.error_estimate": False})
    high = at_altitude(scene, 3000.0)
    around = [high[f"pneumatic.ambient_{name}"] for name in ("pressure", "temperature")]
    assert around == pytest.approx([70_109.0, 268.65], rel=1e-5)
    air = [simulate(one, 1.0).summary()["pneumatic_air"] for one in (high, scene)]
    assert air[0] == pytest.approx(air[1], rel=0.01)
    with pytest.raises(SceneError, match="needs air in chambers"):
        at_altitude(Scene(), 3000.0)


def test_rounding_of_a_depth_is_no_advance():
    blows = np.zeros(5, BLOW)
    blows["hole_advance"], blows["period"], blows["blow_energy"] = 3e-19, 0.1, 10.0
    found = numbers_over(blows)
    assert found["penetration_per_blow"] == 0.0
    assert math.isnan(found["energy_per_advance"])
    assert rate_of_blows(blows) == (0.0, 0.0)
