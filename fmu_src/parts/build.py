"""FMUs of parts, from their tables."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from fmu_src.archive import write_fmu
from fmu_src.description import About
from fmu_src.page import write_page
from fmu_src.parts import (
    controller,
    drill_string,
    rig_feed,
    rock_profile,
    supply,
)
from fmu_src.parts.part import COUNT, PartTable
from fmu_src.staging import stage
from fmu_src.units import fmi_unit
from fmu_src.variables import FILE, Variable, magnitude, number_row, write_variables

# First value references, units to display, and the default experiment [s].
FIRST = {"input": 1, "output": 100, "parameter": 200}
DISPLAYS = {"Pa": "bar", "N": "kN", "m/s": "mm/s", "Hz": "1/min"}
STOP_TIME, STEP_SIZE = 4.0, 1e-3
# Parts of a drilling system, by the name of their FMU.
PARTS = {
    module.TABLE.name: module.TABLE
    for module in (drill_string, rig_feed, supply, rock_profile, controller)
}


def part_variables(part: PartTable) -> list[Variable]:
    """Variables of a part, in the order of its table."""
    return [
        make(part, name, FIRST[causality] + k, causality, entry)
        for causality, entries, make in (
            ("input", part.inputs, _given),
            ("output", part.outputs, _output),
            ("parameter", part.parameters, _given),
        )
        for k, (name, entry) in enumerate(entries.items())
    ]


def _output(
    part: PartTable, name: str, reference: int, causality: Any, entry: tuple[Any, ...]
) -> Variable:
    unit, text = entry
    common: dict[str, Any] = {
        "name": name, "reference": reference, "causality": causality, "description": text,
        "at_start": part.at_start.get(name),
    }  # fmt: skip
    if unit is False:
        return Variable(type="Boolean", variability="discrete", **common)
    if unit == COUNT:
        return Variable(type="Integer", variability="discrete", **common)
    return _real(part, unit, **common)


def _given(
    part: PartTable, name: str, reference: int, causality: Any, entry: tuple[Any, ...]
) -> Variable:
    unit, lower, upper, start, text = entry
    row = number_row(name, "" if unit == COUNT else unit, lower, upper, text)
    discrete = "discrete" if causality == "input" else "fixed"
    common: dict[str, Any] = {
        "name": name, "reference": reference, "causality": causality, "description": text,
        "variability": discrete, "start": start, "row": row,
    }  # fmt: skip
    if isinstance(start, bool):
        return Variable(type="Boolean", **common | {"row": replace(row, kind="flag")})
    if isinstance(start, tuple):
        common |= {"start": 1, "row": replace(row, kind="choice", choices=start)}
        return Variable(
            type="Enumeration", lower=1, upper=len(start),
            enumeration=name.title().replace("_", ""),
            items=tuple((word, k + 1, "") for k, word in enumerate(start)), **common,
        )  # fmt: skip
    common |= {"lower": lower, "upper": upper}
    if unit == COUNT:
        return Variable(type="Integer", **common | {"row": replace(row, kind="whole number")})
    if causality == "input":
        common["variability"] = "continuous"
    return _real(part, unit, nominal=magnitude(start), **common)


def _real(part: PartTable, unit: str, **rest: Any) -> Variable:
    shown = fmi_unit(unit)
    given = {"variability": "continuous", "display": DISPLAYS.get(shown)} | rest
    return Variable(type="Real", unit=shown, **given)


def build_part(part: PartTable, path: Path, flat: bool = False) -> str:
    """Write the FMU of a part, with `flat` names of variables or not; return its GUID."""
    variables = part_variables(part)
    about = About(path.stem, part.description, STOP_TIME, STEP_SIZE, flat=flat)
    bundle = stage("drilling_system", "parts", with_model=False)
    return write_fmu(
        path, about, variables, bundle, part.slave, {FILE: write_variables(variables)},
        write_page(about, variables),
    )  # fmt: skip
