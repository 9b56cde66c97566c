"""The model description: checkers, and what no checker looks at."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from lxml import etree

from fmu_src.hammer.build import build_hammer
from fmu_src.hammer.outputs import OUTPUTS
from fmu_src.hammer.variables import (
    INTERFACE,
    effective_area,
    hammer_variables,
    split_drive_force,
)
from fmu_src.units import UNITS
from percussion_model import Scene, SceneError, Section
from percussion_model.components import DRIVES
from percussion_model.scene.hammers import with_chambers
from percussion_model.scene.parameters import parameter_table

NAMES = ["PercussiveHammer", "RigidHammer"]
SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi2" / "fmi2ModelDescription.xsd"


def description(path):
    with zipfile.ZipFile(path) as archive:
        return archive.read("modelDescription.xml")


@pytest.mark.parametrize("name", NAMES)
def test_fmpy_finds_no_problem(fmus, name):
    assert validate_fmu(str(fmus / f"{name}.fmu")) == []


@pytest.mark.parametrize("name", NAMES)
def test_the_schema_of_fmi_holds(fmus, name):
    schema = etree.XMLSchema(etree.parse(SCHEMA))
    tree = etree.fromstring(description(fmus / f"{name}.fmu"))
    assert schema.validate(tree), schema.error_log


@pytest.mark.parametrize("name", NAMES)
def test_every_variable_says_what_it_is(fmus, name):
    """What checkers let pass: bounds, starts, nominal values, enumerations, units."""
    model = read_model_description(str(fmus / f"{name}.fmu"))
    references = [one.valueReference for one in model.modelVariables]
    assert len(set(references)) == len(references)
    for one in model.modelVariables:
        assert one.description, one.name
        if one.type == "Real":
            assert one.unit, one.name
            assert float(one.min) < float(one.max), one.name
            assert one.nominal is None or float(one.nominal) > 0, one.name
        elif one.type == "Integer":
            assert int(one.min) < int(one.max), one.name
        elif one.type == "Enumeration":
            values = [int(item.value) for item in one.declaredType.items]
            assert len(set(values)) == len(values) > 1, one.name
            assert (int(one.min), int(one.max)) == (min(values), max(values)), one.name
            assert one.start is None or int(one.start) in values, one.name
        if one.start is not None and one.type in ("Real", "Integer"):
            assert float(one.min) <= float(one.start) <= float(one.max), one.name
        assert (one.start is None) == (one.causality == "output"), one.name
        assert one.causality in ("input", "output", "parameter"), one.name
    experiment = model.defaultExperiment
    assert float(experiment.startTime) < float(experiment.stopTime)
    assert 0 < float(experiment.stepSize) <= float(experiment.stopTime)


def test_units_are_what_they_are_made_of():
    dimension = {"m": (1, 0, 0), "kg": (0, 1, 0), "s": (0, 0, 1), "K": (0, 0, 0)}
    dimension["N"] = (1, 1, -2)
    dimension["J"] = (2, 1, -2)
    dimension["Pa"] = (-1, 1, -2)
    dimension["W"] = (2, 1, -3)
    dimension["Hz"], dimension["rad"] = (0, 0, -1), (0, 0, 0)
    dimension["m2"], dimension["m3"], dimension["s2"] = (2, 0, 0), (3, 0, 0), (0, 0, 2)
    for name, unit in UNITS.items():
        if name in ("1", "K", "rad"):
            continue
        above, _, below = name.partition("/")
        total = [0, 0, 0]
        for part, sign in [(above, 1), (below, -1)]:
            for factor in filter(None, part.strip("()").split(".")):
                total = [t + sign * d for t, d in zip(total, dimension[factor], strict=True)]
        assert total == [unit.base.get(base, 0) for base in ("m", "kg", "s")], name
    factors = {
        (name, display): factor
        for name, unit in UNITS.items()
        for display, factor in unit.displays.items()
    }
    assert 20e5 * factors["Pa", "bar"] == pytest.approx(20.0)
    assert 0.04 * factors["m", "mm"] == pytest.approx(40.0)
    assert 2500.0 * factors["N", "kN"] == pytest.approx(2.5)


def test_the_interface_keeps_its_names_and_references():
    """If this fails for a new variable: python -m fmu_src.interface. Never edit the rest."""
    held = json.loads(INTERFACE.read_text(encoding="utf-8"))
    for scene in (Scene(), Scene().replace(**{"piston.model": "rigid", "bit.model": "rigid"})):
        present = {one.name: one for one in hammer_variables(scene) if "[" not in one.name}
        assert set(present) == set(held)
        for name, entry in held.items():
            one = present[name]
            assert one.reference == entry["reference"], name
            assert one.causality == entry["kind"].removeprefix("discrete "), name
            assert (one.type, one.variability) == (entry["type"], entry["variability"]), name


def test_every_parameter_of_the_table_can_be_set():
    names = {one.key or one.row.key for one in hammer_variables(Scene()) if one.row is not None}
    for row in parameter_table():
        if row.kind in ("sections", "rods") or row.key.startswith("run."):
            continue
        if row.key.startswith("string.rods."):
            continue  # this scene has none: tests/fmu/test_top_hammer_fmu.py
        key = row.key.replace("*", "0")
        # what supply pressure stands for, in the pressure law times an area
        by_pressure = ("drive.force", *(f"{one.name}.supply_pressure" for one in DRIVES))
        assert key in names or row.key in names or row.key in by_pressure, row.key


def test_outputs_that_are_described_are_those_that_can_be_read():
    described = [one.name for one in hammer_variables(Scene()) if one.causality == "output"]
    assert sorted(described) == sorted(OUTPUTS)


def test_sections_have_places_of_their_own():
    two = [Section(length=0.1, area=0.005), Section(length=0.075, area=0.004)]
    found = {one.name: one for one in hammer_variables(Scene().replace(**{"piston.sections": two}))}
    assert found["piston.sections[1].length"].reference == 10_000
    assert found["piston.sections[2].area"].reference == 10_011
    assert found["piston.sections[2].area"].start == 0.004


@pytest.mark.parametrize("force", [3000.0, 0.0, 1e-3, 1234.5678901234567, 2.0 / 3.0, 9.87e8])
def test_pressure_times_area_is_the_drive_force_to_the_last_bit(force):
    pressure, area = split_drive_force(force)
    assert pressure * area == force
    assert pressure == pytest.approx(20e5)


def test_the_same_inputs_give_the_same_bytes(hammer, tmp_path):
    again = tmp_path / "PercussiveHammer.fmu"
    build_hammer(Scene(), again)
    assert again.read_bytes() == hammer.read_bytes()
    other = tmp_path / "other" / "PercussiveHammer.fmu"
    build_hammer(Scene().replace(**{"feed.force": 2501.0}), other)
    guids = [read_model_description(str(path)).guid for path in (again, other)]
    assert guids[0] != guids[1]


def test_icon_page_and_licence_are_inside(hammer):
    with zipfile.ZipFile(hammer) as archive:
        names = archive.namelist()
        page = archive.read("documentation/index.html").decode()
    assert {"model.png", "documentation/licenses/license.txt"} <= set(names)
    for one in hammer_variables(Scene()):
        assert one.name in page
    model = read_model_description(str(hammer))
    assert model.author
    assert model.version
    assert model.license == "BSD-3-Clause"
    # those that messages have: one that none has would make the log of a host silent
    names = [one.name for one in model.logCategories]
    assert names == ["logEvents", "logStatusWarning", "logStatusError"]


def test_a_name_that_is_no_identifier_is_refused(tmp_path):
    with pytest.raises(SceneError, match="letters, digits and underscores"):
        build_hammer(Scene(), tmp_path / "my-hammer.fmu")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("name", "pressure"), [("dth5", 18e5), ("hc25", 150e5)])
def test_pressure_of_chambers_gives_the_law_its_force_where_a_host_chooses_it(name, pressure):
    scene = with_chambers(name, pressure)
    assert effective_area(scene) * pressure == pytest.approx(scene.drive.force, rel=1e-15)
