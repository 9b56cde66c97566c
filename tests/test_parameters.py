"""Parameters: values, bounds, the table, and the calibration of the drive."""

import dataclasses
import math

import numpy as np
import pytest

from percussion_model.scene.bar_groups import BitBar, PistonBar, Section
from percussion_model.scene.drive_calibration import calibrate_drive, piston_cycle
from percussion_model.scene.parameters import (
    GROUPS,
    Feed,
    RockLaw,
    Start,
    find_row,
    parameter_table,
)
from percussion_model.scene.scene import Scene, SceneError

PISTON_MASS = PistonBar().mass


def test_reference_bars_have_the_papers_scales():
    piston, bit = PistonBar(), BitBar()
    assert piston.mass == pytest.approx(7.555625, rel=1e-12)
    assert piston.sections[0].wave_speed == pytest.approx(math.sqrt(210e9 / 7850), rel=1e-14)
    assert piston.sections[0].impedance == pytest.approx(2.23309e5, rel=1e-5)
    assert piston.transit_time == pytest.approx(0.0338e-3, rel=2e-3)
    assert bit.transit_time / piston.transit_time == pytest.approx(23 / 20, rel=1e-14)


def test_a_stepped_bar_adds_up():
    upper = Section(length=0.1, area=2e-3)
    lower = Section(length=0.3, area=1e-3, youngs_modulus=100e9, density=4500)
    bar = BitBar(sections=(upper, lower))
    assert bar.length == pytest.approx(0.4, rel=1e-15)
    assert bar.mass == pytest.approx(upper.mass + lower.mass, rel=1e-15)
    assert bar.transit_time == pytest.approx(upper.transit_time + lower.transit_time, rel=1e-15)


def test_loss_time_is_that_of_the_papers_mesh():
    assert Scene().loss.time == pytest.approx(1.937e-7, rel=3e-4)


@pytest.mark.parametrize(
    ("model", "values"),
    [
        (Section, {"length": -0.1, "area": 1e-3}),
        (Section, {"length": 0.1, "area": 0}),
        (Section, {"length": 0.1, "area": 1e-3, "density": math.nan}),
        (Section, {"length": 0.1}),
        (RockLaw, {"unloading_ratio": 1}),
        (RockLaw, {"loading_stiffness": math.inf}),
        (Feed, {"force": True}),
        (Feed, {"force": "2500"}),
        (Feed, {"forse": 2500}),
        (Start, {"drive_direction": True}),
        (Start, {"drive_direction": 1.0}),
        (Start, {"drive_direction": 0}),
        (BitBar, {"model": "absent"}),
        (BitBar, {"sections": ()}),
    ],
)
def test_bad_values_are_refused(model, values):
    with pytest.raises(SceneError):
        model(**values)


def test_whole_numbers_pass_as_floats():
    force = Feed(force=-100).force
    assert force == -100.0
    assert isinstance(force, float)


def test_parameters_are_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Feed().force = 1.0


def field_names(model):
    return {field.name for field in dataclasses.fields(model)}


def test_the_table_has_a_row_for_each_field():
    fields = {f"{group}.{name}" for group, model in GROUPS.items() for name in field_names(model)}
    rows = {row.key for row in parameter_table()}
    assert fields <= rows
    assert {f"bit.sections.*.{name}" for name in field_names(Section)} <= rows
    assert set(GROUPS) == field_names(Scene) - {"title", "hole_diameter"}


@pytest.mark.parametrize("row", parameter_table(), ids=lambda row: row.key)
def test_each_row_is_complete(row):
    assert row.description
    if "number" in row.kind:
        assert row.unit
        assert row.lower < row.upper
        assert row.required or row.default is None or row.lower <= row.default <= row.upper
    for key in row.needs:
        assert find_row(key) is not None


def test_a_row_says_what_is_allowed():
    assert find_row("rock.unloading_ratio").allowed == "a number above 1 and up to 10000"
    assert find_row("bit.sections.3.area").allowed == "a number above 0 and up to 10 m^2"
    assert find_row("rock.barrier_energy").allowed == "a number from 0 to 1e6 J"
    assert find_row("solver.leaps").allowed == "true or false"
    assert find_row("drive.force").effect == 'effects.drive = "pressure"'
    assert find_row("rock.nothing") is None


def test_piston_cycle_of_the_reference():
    cycle = piston_cycle(3000, 0.040, PISTON_MASS, -3)
    assert cycle.impact_velocity == pytest.approx(8.51639, abs=5e-6)
    assert cycle.stroke == pytest.approx(91.333e-3, abs=5e-6)
    assert cycle.flight_time == pytest.approx(46.0535e-3, abs=5e-8)


def test_calibration_of_section_2_2():
    drive = calibrate_drive(PISTON_MASS, 8.5, -3, 45e-3)
    assert drive.reversal_distance == pytest.approx(38.995e-3, abs=5e-7)
    assert drive.force == pytest.approx(3063.8, abs=0.05)
    assert 0 < drive.reversal_distance < drive.stroke


@pytest.mark.parametrize("rebound", [0.0, -0.5, -3.0, -8.4])
def test_calibration_inverts_the_cycle(rebound):
    drive = calibrate_drive(5.0, 8.5, rebound, 0.03)
    cycle = piston_cycle(drive.force, drive.reversal_distance, 5.0, rebound)
    assert cycle.impact_velocity == pytest.approx(8.5, rel=1e-13)
    assert cycle.flight_time == pytest.approx(0.03, rel=1e-13)
    assert cycle.stroke == pytest.approx(drive.stroke, rel=1e-13)


def test_piston_cycle_agrees_with_integrated_motion():
    """Piecewise constant acceleration, written out phase by phase."""
    force, reversal, rebound = 2000.0, 0.05, 2.5
    acceleration = force / PISTON_MASS
    top_speed = math.sqrt(rebound**2 + 2 * acceleration * reversal)
    stroke = reversal + top_speed**2 / (2 * acceleration)
    impact = math.sqrt(2 * acceleration * stroke)
    time = (top_speed - rebound) / acceleration + (top_speed + impact) / acceleration
    cycle = piston_cycle(force, reversal, PISTON_MASS, -rebound)
    assert tuple(cycle) == pytest.approx((impact, stroke, time), rel=1e-13)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((7.5, 3.0, -3.0, 0.045), "rebound speed"),
        ((7.5, 8.5, 3.0, 0.045), "rebound velocity"),
        ((0.0, 8.5, -3.0, 0.045), "piston mass"),
        ((7.5, 8.5, -3.0, math.nan), "flight time"),
    ],
)
def test_calibration_without_solution(values, message):
    with pytest.raises(ValueError, match=message):
        calibrate_drive(*values)


@pytest.mark.parametrize("value", [np.float32(2500.0), np.float64(2500.0), np.int64(2500), 2500])
def test_numbers_of_all_kinds_are_kept_as_floats(value):
    assert type(Feed(force=value).force) is float
    assert Feed(force=value).force == 2500.0


@pytest.mark.parametrize("value", [10**400, -(10**400), np.float32("nan"), np.True_, "1", None])
def test_what_is_no_finite_number_is_refused(value):
    with pytest.raises(SceneError, match=r"feed\.force = .*: must be a number from -1e9 to 1e9 N"):
        Feed(force=value)


def test_a_group_on_its_own_names_its_key():
    with pytest.raises(SceneError, match=r"unknown key feed\.forse: did you mean feed\.force\?"):
        Feed(forse=1.0)
    with pytest.raises(SceneError, match=r"section\.area is missing: must be a number above 0"):
        Section(length=0.1)
