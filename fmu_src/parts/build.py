"""Makes the FMU of a part from its table."""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fmu_src.archive import write_fmu
from fmu_src.description import About
from fmu_src.page import write_page
from fmu_src.parts.part import Model
from fmu_src.parts.tables import PARTS, PartTable
from fmu_src.staging import stage
from fmu_src.units import fmi_unit
from fmu_src.variables import Variable, magnitude, number_row
from percussion_model.scene.rows import Row

FIRST = {"input": 1, "output": 100, "parameter": 200}
DISPLAY = {"Pa": "bar", "N": "kN", "m/s": "mm/s", "Hz": "1/min"}
STEP_SIZE, STOP_TIME = 1e-3, 4.0  # of the default experiment [s]
WHOLE = "count"


def part_variables(part: PartTable) -> list[Variable]:
    """Variables of a part, in the order of its table."""
    found = [
        _given(name, FIRST["input"] + k, "input", entry)
        for k, (name, entry) in enumerate(part.inputs.items())
    ]
    for k, (name, (unit, text)) in enumerate(part.outputs.items()):
        found.append(_output(name, FIRST["output"] + k, unit, text))
    found += [
        _given(name, FIRST["parameter"] + k, "parameter", entry)
        for k, (name, entry) in enumerate(part.parameters.items())
    ]
    return found


def _output(name: str, reference: int, unit: Any, text: str) -> Variable:
    common: dict[str, Any] = {
        "name": name, "reference": reference, "causality": "output", "description": text,
    }  # fmt: skip
    if unit is False:
        return Variable(type="Boolean", variability="discrete", **common)
    if unit == WHOLE:
        return Variable(type="Integer", variability="discrete", **common)
    shown = fmi_unit(unit)
    return Variable(
        type="Real", variability="continuous", unit=shown, display=DISPLAY.get(shown), **common
    )


def _given(name: str, reference: int, causality: Any, entry: tuple[Any, ...]) -> Variable:
    unit, lower, upper, start, text = entry
    row = number_row(name, "" if unit == WHOLE else unit, lower, upper, text)
    common: dict[str, Any] = {
        "name": name, "reference": reference, "causality": causality, "description": text,
    }  # fmt: skip
    if isinstance(start, bool):
        return Variable(
            type="Boolean",
            variability="discrete" if causality == "input" else "fixed",
            start=start,
            row=_of_kind(row, "flag"),
            **common,
        )
    if isinstance(start, tuple):
        items = tuple((word, k + 1, "") for k, word in enumerate(start))
        return Variable(
            type="Enumeration", variability="fixed", start=1, lower=1, upper=len(start),
            enumeration=name.title().replace("_", ""), items=items,
            row=_of_kind(row, "choice", start), **common,
        )  # fmt: skip
    if unit == WHOLE:
        return Variable(
            type="Integer", variability="fixed", start=start, lower=lower, upper=upper,
            row=_of_kind(row, "whole number"), **common,
        )  # fmt: skip
    shown = fmi_unit(unit)
    return Variable(
        type="Real",
        variability="continuous" if causality == "input" else "fixed",
        unit=shown,
        display=DISPLAY.get(shown),
        lower=lower,
        upper=upper,
        nominal=magnitude(start),
        start=start,
        row=row,
        **common,
    )


def _of_kind(row: Row, kind: Any, choices: tuple[str, ...] = ()) -> Row:
    return Row(**{**vars(row), "kind": kind, "choices": choices})


def build_part(name: str, path: Path) -> str:
    """Write the FMU of a part; return its GUID."""
    part = PARTS[name]
    variables = part_variables(part)
    about = About(
        model=path.stem,
        description=part.description,
        author="percussion_model developers",
        version=version("percussion_model"),
        license="BSD-3-Clause",
        stop_time=STOP_TIME,
        step_size=STEP_SIZE,
    )
    bundle = stage("drilling_system", "parts", with_model=False)
    text = json.dumps([variable.for_instance() for variable in variables], indent=1)
    return write_fmu(
        path, about, variables, bundle, ("parts.part", part.slave),
        {"variables.json": text + "\n"}, write_page(about, variables),
    )  # fmt: skip


def make_model(name: str, **values: Any) -> Model:
    """A part without FMI: its model, begun with the starts of its table.

    Parameters
    ----------
    values : dict
        Parameters and inputs by name, `__` for a dot; the rest keep their starts.
    """
    import importlib

    from fmu_src.parts import part as slaves

    part = PARTS[name]
    given = {key.replace("__", "."): value for key, value in values.items()}
    unknown = sorted(given.keys() - part.inputs.keys() - part.parameters.keys())
    if unknown:
        raise ValueError(f"{name} has no variable {', '.join(unknown)}")
    module, class_name = getattr(slaves, part.slave).MODEL
    package = slaves.__name__.rpartition(".")[0]
    kind = getattr(importlib.import_module(f"{package}.{module}"), class_name)
    model: Model = kind({key: given.get(key, _start(e)) for key, e in part.parameters.items()})
    model.begin({key: given.get(key, _start(entry)) for key, entry in part.inputs.items()})
    return model


def start_inputs(name: str) -> dict[str, Any]:
    """Inputs of a part at their starts."""
    return {key: _start(entry) for key, entry in PARTS[name].inputs.items()}


def _start(entry: tuple[Any, ...]) -> Any:
    start = entry[3]
    return start[0] if isinstance(start, tuple) else start
