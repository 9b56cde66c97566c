"""FMUs of parts, from their tables: native ones, and of two that run by Python."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fmu_src.archive import write_fmu
from fmu_src.description import About
from fmu_src.native.archive import Version, needs_nothing, write_native
from fmu_src.native.library import PARTS as LIBRARY
from fmu_src.native.library import libraries
from fmu_src.native.part_tables import part_tables
from fmu_src.page import write_page
from fmu_src.parts import (
    controller,
    drill_string,
    rig_feed,
    rock_filter,
    rock_profile,
    supply,
    wave_string,
)
from fmu_src.parts import own_controller as own
from fmu_src.parts.part import COUNT, PartTable
from fmu_src.slave.native import this_platform
from fmu_src.staging import stage
from fmu_src.units import fmi_unit
from fmu_src.variables import FILE, Variable, magnitude, number_row, write_variables
from percussion_model.coupling.component import CouplingError
from percussion_model.coupling.fresh import fresh
from percussion_model.coupling.python_part import PythonPart, fault_text

# First value references, units to display, and the default experiment [s].
FIRST = {"input": 1, "output": 100, "parameter": 200}
DISPLAYS = {"Pa": "bar", "N": "kN", "m/s": "mm/s", "Hz": "1/min"}
STOP_TIME, STEP_SIZE = 4.0, 1e-3
# Parts of a drilling system, by the name of their FMU.
PARTS = {
    module.TABLE.name: module.TABLE
    for module in (
        drill_string,
        wave_string,
        rig_feed,
        supply,
        rock_profile,
        controller,
        rock_filter,
    )
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
    row = number_row(name, "" if unit in (COUNT, None) else unit, lower, upper, text)
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


def _real(part: PartTable, unit: str | None, **rest: Any) -> Variable:
    shown = None if unit is None else fmi_unit(unit)
    given = {"variability": "continuous", "display": DISPLAYS.get(shown or "")} | rest
    return Variable(type="Real", unit=shown, **given)


def build_part(
    part: PartTable,
    path: Path,
    flat: bool = False,
    version: Version = "2.0",
    platforms: Sequence[str] | Mapping[str, str] = (),
) -> str:
    """Write the FMU of a part; return its GUID.

    Parameters
    ----------
    flat : bool
        Whether names of variables have no dots.
    version : str
        Of FMI; a part that runs by Python has 2.0 alone.
    platforms : sequence of str, optional
        On which a native one is to run; this one if left out.

    Raises
    ------
    NoCompilerError
        If there is no library for a platform, and nothing that would make it.
    """
    variables = part_variables(part)
    # the name of the file is no identifier, that of the model is
    model = path.stem.partition("-")[0]
    about = About(model, part.description, STOP_TIME, STEP_SIZE, flat=flat)
    if part.law is not None:
        found = libraries(platforms or [this_platform()], which=LIBRARY)
        tables = functools.partial(part_tables, part, variables)
        page = write_page(about, variables, None, needs_nothing(found))
        return write_native(path, version, about, variables, page, found, tables)
    bundle = stage("drilling_system", "parts", with_model=False)
    return write_fmu(
        path, about, variables, bundle, part.slave, {FILE: write_variables(variables)},
        write_page(about, variables),
    )  # fmt: skip


def build_controller(file: Path, name: str, path: Path) -> str:
    """Write the FMU of a controller in Python; say why its state cannot be saved, if it cannot.

    Parameters
    ----------
    file, name : Path, str
        A class, a factory or a function, as `percussion_model.coupling.Coupling` takes it; the
        numbers that it can be given become parameters.

    Raises
    ------
    CouplingError
        If that is no controller, or fails in its first steps.
    """
    kept, starts = _tried(file, name)
    table = replace(
        controller.TABLE,
        name=path.stem,
        law=None,
        slave=own.OwnControllerPart,
        description=f"{name} of {file.name}, a controller of feed and pressure",
        inputs={one: controller.TABLE.inputs[one] for one in own.INPUTS},
        outputs={one: controller.TABLE.outputs[one] for one in own.SIGNALS},
        parameters={one: _argument(one, start) for one, start in starts.items()},
        at_start=dict.fromkeys(own.SIGNALS, tuple(controller.TABLE.inputs)),
    )
    variables = part_variables(table)
    about = About(
        table.name, table.description, STOP_TIME, STEP_SIZE, author="", saves=not kept
    )  # fmt: skip
    resources: dict[str, str | bytes] = {
        FILE: write_variables(variables), own.SOURCE: file.read_bytes(), own.NAME: name,
    }  # fmt: skip
    bundle = stage("drilling_system", "parts", with_model=False)
    write_fmu(path, about, variables, bundle, table.slave, resources, write_page(about, variables))
    return kept


def _argument(name: str, start: Any) -> tuple[Any, ...]:
    """Entry of an argument of a controller, whose unit and bounds nobody knows."""
    bound = own.LARGEST[type(start)]
    return COUNT if type(start) is int else None, -bound, bound, start, f"{name} of the controller"


def _tried(file: Path, name: str) -> tuple[str, dict[str, Any]]:
    """Let a controller do its first steps; its arguments, and why its state cannot be saved."""
    inputs = {one: entry[3] for one, entry in controller.TABLE.inputs.items()}
    did = f"{file}: cannot be loaded"
    try:
        given = own.loaded(file, name)
        did = f"{file}:{name}"
        work = fresh(str(file), given, is_new=True)
        part = PythonPart("controller", lambda: work, inputs)
        reader = part.reader(own.SIGNALS)
        part.begin()
        starts = own.arguments_of(given) if own.is_maker(given) else {}
        model = own.OwnController({**starts, own.SOURCE: file, own.NAME: name})
        for step in (0.0, STEP_SIZE, STEP_SIZE):
            part.step(0.0, step)
            reader.read()
            model.step(inputs, step)
    except CouplingError:
        raise
    except own.ControllerError as error:
        raise CouplingError(f"{file}: {error}") from None
    except (Exception, SystemExit) as error:
        raise CouplingError(f"{did}: {fault_text(error)}") from None
    return model.why_not_saved(), starts
