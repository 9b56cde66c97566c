"""The map of the drive: against closed forms, an independent model, and runs by its laws."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from typer.testing import CliRunner

from percussion_model import Scene, SceneError, settled, simulate
from percussion_model.analysis.drive_map import (
    IN_ROCK,
    LAW,
    LEFT_OUT,
    blow_row,
    drive_map,
    law_cycle,
    law_of,
    on_a_wall,
    settled_row,
)
from percussion_model.interface.cli import app
from percussion_model.interface.commands import common
from percussion_model.scene.hammers import AIR, with_chambers

BAR = 1e5


@pytest.fixture(scope="module")
def found():
    return drive_map(with_chambers("dth5", 24 * BAR), [12 * BAR, 18 * BAR, 24 * BAR])


def test_a_law_without_weight_is_that_of_the_closed_form():
    mass, v, e, period = 15.3, 11.92, 0.3, 1.0 / 29.11
    v_0 = e * v
    v_1 = math.sqrt((v * v + v_0 * v_0) / 2.0)
    force = mass * (2.0 * v_1 + v - v_0) / period
    expected = force, mass * (v * v - v_0 * v_0) / (4.0 * force)
    assert law_of(mass, 0.0, v, e, period) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("weight", [0.0, 150.0, 1500.0])
def test_a_law_gives_the_cycle_that_it_was_made_of(weight):
    law = law_of(15.3, weight, 8.0, 0.4, 0.05)
    assert law_cycle(15.3, weight, *law, 0.4) == pytest.approx((8.0, 0.05), rel=1e-12)
    assert np.isnan(law_of(15.3, 1e6, 8.0, 0.4, 0.05)).all()


@pytest.mark.parametrize(
    ("name", "bar", "rebound"),
    [("dth5", 6, 0.1), ("dth5", 24, 0.3), ("dth5", 24, 0.5), ("hc25", 120, 0.25)],
)
def test_a_run_by_the_law_has_velocity_and_period_of_the_chambers(name, bar, rebound):
    scene = with_chambers(name, bar * BAR)
    row = blow_row(scene, rebound)
    law = {f"drive.{name}": float(row[name]) for name in ("force", "reversal_distance")}
    by_law = on_a_wall(scene.replace(**{"effects.drive": "pressure", **law}), rebound)
    blow = settled(by_law).counted[-1]
    assert blow["impact_velocity"] == pytest.approx(row["impact_velocity"], rel=1e-4)
    assert 1.0 / blow["period"] == pytest.approx(row["frequency"], rel=1e-4)


def test_errors_by_the_rebound_are_those_of_an_independent_model():
    """5 inch, 15.30 kg, 24 bar: the law of rebound 0.3 at 0.1 and 0.5, energy and period in %."""
    steel = {"length": 0.4, "area": 15.30 / 0.4 / 7850.0, "density": 7850.0}
    scene = with_chambers("dth5", 24 * BAR).replace(**{"piston.sections": [steel]})
    usual = blow_row(scene, 0.3)
    law = float(usual["force"]), float(usual["reversal_distance"])
    # 470 N/bar and 42.8 mm are means from 6 to 35 bar
    assert law == pytest.approx((470.0 * 24, 42.8e-3), rel=2e-2)
    for rebound, energy, period in ((0.1, -11, -5), (0.5, 14, 10)):
        row = blow_row(scene, rebound)
        v, t = law_cycle(15.30, 15.30 * 9.81, *law, rebound)
        off = (v / row["impact_velocity"]) ** 2 - 1.0, t * row["frequency"] - 1.0
        assert (100.0 * off[0], 100.0 * off[1]) == pytest.approx((energy, period), abs=0.6)


def test_the_error_in_rock_is_that_of_the_rebound(found):
    """A row of another rebound is off as it is over a bit at rest, that of the own is not."""
    for rows, own in zip(found.rows, found.own, strict=True):
        assert 0.36 < own["rebound"] < 0.40
        assert rows["rock_blow_energy"][0] > 0.1 > 0.05 > abs(rows["rock_blow_energy"][1])
        assert rows["rock_blow_energy"][2] < -0.05
        assert max(abs(own[name]) for name in IN_ROCK) < 0.04
    assert found.worst["rows"] > 5.0 * max(found.worst["left_out"], found.worst["own"])


def test_rows_are_left_out_between_others_alone(found):
    known = np.isfinite(found.rows[LEFT_OUT[1]])
    ends = [False, True, True, False]
    assert known.tolist() == [ends, [True] * 4, ends]
    row, (below, above) = found.rows[1, 0], found.rows[[0, 2], 0]
    law = [0.5 * (below[name] + above[name]) for name in ("force", "reversal_distance")]
    mass = with_chambers("dth5", BAR).piston.mass
    v, period = law_cycle(mass, mass * 9.81, *law, 0.1)
    off = 1.0 / (period * row["frequency"]) - 1.0, (v / row["impact_velocity"]) ** 2 - 1.0
    assert [row[name] for name in LEFT_OUT] == pytest.approx(off, rel=1e-9)
    assert found.law(18 * BAR, 0.1) == (row["force"], row["reversal_distance"])
    assert found.law(15 * BAR, 0.1)[0] == pytest.approx(0.5 * (below["force"] + row["force"]))


@pytest.mark.parametrize("name", AIR)
def test_hammers_with_air_have_the_law_that_stands_for_their_chambers(name):
    """Between stored pressures, at the rebound of their rock."""
    scene = with_chambers(name, 21 * BAR)
    row = blow_row(scene, float(settled_row(scene)["rebound"]))
    law = scene.drive.force, scene.drive.reversal_distance
    assert law == pytest.approx([float(row[key]) for key in LAW], rel=5e-3)
    assert (
        with_chambers(name, 50 * BAR).drive.force > 1.4 * with_chambers(name, 35 * BAR).drive.force
    )


def test_a_hammer_set_back_to_the_law_goes_on_as_with_its_chambers():
    by_air = with_chambers("dth5", 24 * BAR)
    air, law = (
        settled_row(by_air.replace(**{"effects.drive": d})) for d in ("pneumatic", "pressure")
    )
    for name, bound in (("frequency", 0.01), ("blow_energy", 0.03), ("rate", 0.05)):
        assert law[name] == pytest.approx(air[name], rel=bound)


def test_the_law_that_stands_by_is_not_told_to_be_given_in_vain():
    scene = with_chambers("dth5", 24 * BAR)
    assert set(scene.unused) == {"drive.force", "drive.reversal_distance"}
    assert not any("without effect" in text for text in simulate(scene, 0.1).warnings)
    alone = Scene().replace(**{"effects.drive": "pneumatic", "drive.force": 5e3})
    assert any("effect in this scene: drive.force" in t for t in simulate(alone, 0.1).warnings)
    none = scene.replace(**{"effects.drive": "none", "drive.force": 5e3})
    assert "drive.force" in none.given_in_vain


def test_a_hammer_on_another_rock_is_told_to_have_the_law_of_its_usual_one(tmp_path, monkeypatch):
    monkeypatch.setattr(common, "_hinted", set())
    words = ["--hammer", "dth5", "--pressure", "24 bar"]
    for rock, told in (([], False), (["--rock", "kuru-granite"], True)):
        done = CliRunner().invoke(app, ["new", str(tmp_path / f"{told}.toml"), *words, *rock])
        assert done.exit_code == 0
        assert ("percussion drive-map" in done.stderr) == told


@pytest.mark.parametrize("pressure", ["24 bar", "60 bar"])
def test_oil_below_the_precharge_is_told_of_where_a_scene_is_made(tmp_path, pressure):
    file = tmp_path / "t38.toml"
    words = ["--hammer", "t38", "--rods", "1", "--pressure", pressure]
    told = " ".join(CliRunner().invoke(app, ["new", str(file), *words]).stderr.split())
    warnings = simulate(Scene.from_toml(file), 0.5, error_estimate=False).warnings
    wanted = [text for text in warnings if "must be 59.0 bar at least" in text]
    assert len(wanted) == (pressure == "24 bar") == bool(told)
    assert all(told.endswith(text.partition(": ")[2]) for text in wanted)


@pytest.mark.parametrize("pressure", [-1e5, 3e7])
def test_a_pressure_out_of_bounds_is_refused_by_its_name(pressure):
    with pytest.raises(SceneError, match=r"pneumatic.supply_pressure = "):
        with_chambers("dth5", pressure)


def test_pressures_at_which_blows_die_out_have_no_law():
    found = drive_map(with_chambers("dth5", 24 * BAR), [0.2 * BAR, 24 * BAR], [0.3])
    assert np.isnan(found.rows["force"]).tolist() == [[True], [False]]
    assert np.isnan(found.own["rock_rate"][0])
    assert found.worst.keys() == {"rows", "own"}
    assert drive_map(with_chambers("dth5", 24 * BAR), [0.2 * BAR], [0.3]).worst == {}


def test_the_command_writes_the_map_and_says_what_its_main_error_is(tmp_path):
    scene, file = tmp_path / "air.toml", tmp_path / "map.csv"
    with_chambers("dth5", 24 * BAR).to_toml(scene)
    words = ["drive-map", str(scene), "--pressures", "18bar,24bar", "--out", str(file)]
    done = CliRunner().invoke(app, [*words, "--rebounds", "0.1,0.3"])
    assert done.exit_code == 0
    assert "main error is the rebound" in " ".join(done.stdout.split())
    rows = list(csv.DictReader(file.read_text().splitlines()))
    assert [row["of_the_rock"] for row in rows] == ["0", "0", "1"] * 2
    own = drive_map(Scene.from_toml(scene), [18 * BAR, 24 * BAR], [0.1, 0.3]).own
    assert float(rows[-1]["rock_rate"]) == pytest.approx(own["rock_rate"][1], rel=1e-6)


def test_what_cannot_be_mapped_is_refused(tmp_path):
    with pytest.raises(SceneError, match='"pressure": must be "pneumatic"'):
        drive_map(Scene())
    with pytest.raises(SceneError, match="must be numbers from 0 on and below 1"):
        drive_map(with_chambers("dth5", 24 * BAR), None, [1.0])
    scene = tmp_path / "air.toml"
    with_chambers("dth5", 24 * BAR).to_toml(scene)
    done = CliRunner().invoke(app, ["drive-map", str(scene), "--pressures", "10,x bar"])
    assert done.exit_code == 2
    assert "--pressures 10,x bar: give each value its unit" in done.stderr
