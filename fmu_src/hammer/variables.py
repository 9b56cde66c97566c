"""The hammer's variables: parameters from the one table, inputs and outputs of an FMU.

`interface-1.json` holds names and value references: an interface, given once and kept. New
variables get the next free number of their kind by `python -m fmu_src.interface`; entries are
never changed or taken out. What cannot keep to that is version 2.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from fmu_src.hammer.inputs import NAMES_OUTSIDE
from fmu_src.hammer.outputs import MODES, OUTPUTS
from fmu_src.units import fmi_unit
from fmu_src.variables import Causality, Variable, magnitude, number_row
from percussion_model.components import COMPONENTS
from percussion_model.scene.inputs import INPUTS, PRESSURES
from percussion_model.scene.parameters import parameter_table, row_of
from percussion_model.scene.rows import ParameterRow
from percussion_model.scene.scene import Scene

VERSION = 1
INTERFACE = Path(__file__).with_name(f"interface-{VERSION}.json")
# Sections of a bar: this, plus SECTION for each, plus the place of the field in it.
FIRST_SECTION = {"piston": 10_000, "bit": 20_000}
SECTION = 10
# The same of a rod, this times its number more; and its joint, this more.
FIRST_ROD, JOINT = 100_000, 90_000

# Gauge pressure at which the drive gives the force of the scene [Pa].
SUPPLY_PRESSURE = 20e5
# Displays that people expect, by unit of the interface.
DISPLAYS = {
    "m": "mm",
    "N": "kN",
    "Pa": "bar",
    "m2": "mm2",
    "Hz": "1/min",
    "N/m": "kN/mm",
    "rad/s": "rpm",
}
DISPLAYS_OF = {"youngs_modulus": "MPa"}

# What an input of the FMU stands for in the table, rock before drive; the rest of a scene
# is a parameter. The drive force is the product of two numbers; chambers take one as it is.
TABLE_INPUTS = {
    NAMES_OUTSIDE[name]: one
    for name, one in sorted(INPUTS.items(), key=lambda item: item[1].at_once)
    if NAMES_OUTSIDE[name] != "supply_pressure"
}
PRESSURE_ROW = number_row(
    "supply_pressure", "Pa", 0.0, 1e9,
    "gauge pressure of the supply at the hammer; drive force of the pressure law F_0 = pressure * "
    "drive.effective_area",
)  # fmt: skip
AREA_ROW = number_row(
    "drive.effective_area", "m^2", 0.0, 10.0, "area of supply_pressure in the pressure law"
)
PLACE_ROW = number_row(
    "gauge.position", "m", 0.0, 1e5, "place of the gauge, from the top of its bar"
)

# Numbers that may be left out, and what the FMU takes for "left out".
LEFT_OUT = {
    "solver.cells": (0, "0: by the solver"),
    "solver.accuracy": (0.0, "0: none is asked for"),
    "contact.restitution": (-1.0, "-1: St Venant"),
    "gauge.position": (-1.0, "-1: the middle"),
    "fem.damping_ratio": (-1.0, "-1: by loss.time"),
    "hole_diameter": (0.0, "0: not known"),
    **{
        f"{one.name}.{name}": (0 if isinstance(least, int) else 0.0, "0: not given")
        for one in COMPONENTS
        for name, (default, _, _, least, _) in one.parameters.items()
        if default is None
    },
}


def hammer_variables(scene: Scene) -> list[Variable]:
    """Return the variables of an FMU that bakes in a scene, inputs first."""
    return [*_inputs(scene), *_outputs(), *_parameters(scene)]


@cache
def interface_entries() -> dict[str, dict[str, Any]]:
    """Entries of the interface by name; those of sections follow a rule instead."""
    found: dict[str, dict[str, Any]] = json.loads(INTERFACE.read_text(encoding="utf-8"))
    return found


@cache
def reference(name: str, kind: str) -> int:
    """Value reference of a variable; a free one for what is not in the file yet."""
    entries = interface_entries()
    if name in entries:
        return int(entries[name]["reference"])
    fresh = _fresh.setdefault(kind, [])
    fresh.append(name)
    used = [entry["reference"] for entry in entries.values() if entry["kind"] == kind]
    return int(max(used)) + len(fresh)


_fresh: dict[str, list[str]] = {}  # names that are not in the file yet, by kind


def split_drive_force(force: float) -> tuple[float, float]:
    """Pressure [Pa] and area [m2] whose floating-point product is exactly the force [N]."""
    pressure = SUPPLY_PRESSURE
    for _ in range(64):
        area = force / pressure
        for near in (area, math.nextafter(area, 0.0), math.nextafter(area, math.inf)):
            if pressure * near == force:
                return pressure, near
        pressure = math.nextafter(pressure, math.inf)
    raise ArithmeticError(f"no pressure and area give {force!r} N")


def start_pressure(scene: Scene) -> float:
    """Pressure at the hammer with which a scene begins [Pa]."""
    name = PRESSURES.get(scene.effects.drive)
    return scene[INPUTS[name].key] if name else split_drive_force(scene.drive.force)[0]


def effective_area(scene: Scene) -> float:
    """Area by which a pressure at the hammer makes the force of the pressure law [m2]."""
    name = PRESSURES.get(scene.effects.drive)
    pressure = scene[INPUTS[name].key] if name else 0.0
    return scene.drive.force / pressure if pressure else split_drive_force(scene.drive.force)[1]


def _inputs(scene: Scene) -> Iterator[Variable]:
    order = ["feed_force", "supply_pressure", "piston_force", "percussion_on"]
    order += [name for name in TABLE_INPUTS if name not in order]
    for name in order:
        if name == "percussion_on":
            yield Variable(
                name=name,
                reference=reference(name, "input"),
                type="Boolean",
                causality="input",
                description="whether the drive gets pressure, or passes piston_force on; off, air "
                "of chambers flows back, and pneumatic.air is below 0",
                variability="discrete",
                start=True,
            )
            continue
        if name == "supply_pressure":
            yield _number(PRESSURE_ROW, start_pressure(scene), "input")
            continue
        one, note = TABLE_INPUTS[name], ""
        if name == "piston_force":
            note = "; acts while effects.drive = external and percussion_on"
        elif not one.at_once:
            note = "; acts from the next drilling cycle on"
        yield _number(row_of(one.key), scene[one.key], "input", name, note=note)


def _outputs() -> Iterator[Variable]:
    for name, one in OUTPUTS.items():
        real = one.type == "Real"
        unit = fmi_unit(one.unit) if one.unit else ""
        display = {"rate_of_penetration": "mm/s", "gauge_stress": "MPa"}.get(name)
        modes: dict[str, Any] = {
            "enumeration": "DrillingMode",
            "items": tuple((mode.name, int(mode), text) for mode, text in MODES.items()),
        }
        yield Variable(
            name=name,
            reference=reference(name, "output" if real else "discrete output"),
            type=one.type,
            causality="output",
            description=one.description,
            variability="continuous" if real else "discrete",
            unit=unit or None,
            display=display or DISPLAYS.get(unit),
            lower=one.lower,
            upper=one.upper,
            nominal=one.nominal,
            at_start=one.at_start,
            **(modes if one.type == "Enumeration" else {}),
        )


def _parameters(scene: Scene) -> Iterator[Variable]:
    replaced = {one.key for one in INPUTS.values()}
    for row in parameter_table():
        group = row.key.partition(".")[0]
        if row.kind == "sections" and "*" not in row.key:
            yield from _sections(scene, group, FIRST_SECTION[group])
        if row.kind == "rods" and scene.effects.string:
            yield from _rods(scene, row.key)
        if row.kind in ("sections", "rods") or "*" in row.key or group == "run":
            continue
        if row.key not in replaced:
            yield _parameter(row.key, row, scene[row.key])
    yield _number(AREA_ROW, effective_area(scene))
    carriers = gauge_bars(scene)
    bars = tuple((name, k + 1, f"the {name}") for k, name in enumerate(carriers))
    gauge = _parameter("gauge.bar", _choice_row("gauge.bar", carriers), "bit")
    yield replace(gauge, key=None, enumeration="Bar", items=bars)
    yield _number(PLACE_ROW, 0.5 * scene.bit.length)


def gauge_bars(scene: Scene) -> tuple[str, ...]:
    """Bars that may carry the gauge; rods come last, for a scene with two bars has none."""
    return (*FIRST_SECTION, *(name for name in scene.bars if name not in FIRST_SECTION))


def _sections(scene: Scene, bar: str, first: int) -> Iterator[Variable]:
    fields = ("length", "area", "youngs_modulus", "density")
    for i in range(len(scene[f"{bar}.sections"])):
        for k, field in enumerate(fields):
            key = f"{bar}.sections.{i}.{field}"
            number = first + SECTION * i + k
            yield _number(row_of(key), scene[key], name=_outside(key), number=number, key=key)


def _rods(scene: Scene, rods: str) -> Iterator[Variable]:
    """Sections of each rod, and the numbers of its joint."""
    for i, rod in enumerate(scene[rods]):
        first = FIRST_ROD * (i + 1)
        yield from _sections(scene, f"{rods}.{i}", first)
        for name in rod.telling:
            key = f"{rods}.{i}.{name}"
            row = row_of(key)
            if row.kind == "number":
                number = first + JOINT + list(rod.rows).index(name)
                yield _number(row, scene[key], name=_outside(key), number=number, key=key)


def _outside(key: str) -> str:
    """Name of a variable in a list: FMI counts from 1."""
    parts = (f"[{int(one) + 1}]" if one.isdecimal() else f".{one}" for one in key.split("."))
    return "".join(parts).removeprefix(".")


def _parameter(key: str, row: ParameterRow, value: Any) -> Variable:
    if row.kind == "number" or row.kind == "whole number":
        return _number(row, value, key=key)
    common: dict[str, Any] = {
        "name": key, "reference": reference(key, "parameter"),
        "causality": "parameter", "variability": "fixed",
        "description": _described(row), "row": row, "key": key,
    }  # fmt: skip
    if row.kind == "flag":
        return Variable(type="Boolean", start=value, **common)
    if isinstance(row.choices[0], int):
        items = tuple(({1: "down", -1: "up"}[choice], choice, "") for choice in sorted(row.choices))
        start = value
    else:
        items = tuple((word, k + 1, "") for k, word in enumerate(row.choices))
        start = row.choices.index(value) + 1
    return Variable(
        type="Enumeration",
        start=start,
        enumeration="".join(part.capitalize() for part in key.replace(".", "_").split("_")),
        items=items,
        lower=min(number for _, number, _ in items),
        upper=max(number for _, number, _ in items),
        **common,
    )


def _number(
    row: ParameterRow,
    value: Any,
    causality: Causality = "parameter",
    name: str = "",
    number: int | None = None,
    note: str = "",
    key: str | None = None,
) -> Variable:
    """A number with unit and bounds of its row, and its name unless another one is given."""
    name = name or row.key
    left_out, meaning = LEFT_OUT.get(row.key, (None, ""))
    lower = row.lower if left_out is None else min(left_out, row.lower or 0.0)
    whole = row.kind == "whole number"
    unit = fmi_unit(row.unit)
    start: Any = left_out if value is None else value
    return Variable(
        name=name,
        reference=reference(name, causality) if number is None else number,
        type="Integer" if whole else "Real",
        causality=causality,
        description=_described(row) + note + (f" ({meaning})" if meaning else ""),
        variability="continuous" if causality == "input" else "fixed",
        unit=None if whole else unit,
        display=None if whole else DISPLAYS_OF.get(row.key.split(".")[-1], DISPLAYS.get(unit)),
        lower=int(lower) if whole and lower is not None else lower,
        upper=int(row.upper) if whole and row.upper is not None else row.upper,
        nominal=None if whole else magnitude(start),
        start=start if whole else float(start),
        row=row,
        key=key,
        left_out=left_out,
    )


def _described(row: ParameterRow) -> str:
    return row.description + (f"; has an effect where {row.effect}" if row.needs else "")


def _choice_row(key: str, choices: tuple[str, ...]) -> ParameterRow:
    row = number_row(key, "", 0.0, 0.0, "bar that carries the gauge")
    return replace(row, kind="choice", choices=choices)
