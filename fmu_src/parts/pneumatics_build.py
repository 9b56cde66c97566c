"""Makes the FMU of a simple pneumatic drive, which can push the hammer's piston."""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fmu_src.archive import write_fmu
from fmu_src.description import About
from fmu_src.page import write_page
from fmu_src.staging import stage
from fmu_src.units import fmi_unit
from fmu_src.variables import Variable, magnitude, number_row

# name: unit, bounds, start, description. Chambers that give about the 3000 N of the
# reference drive at 20 bar, and fill in a few milliseconds.
_INPUTS = {
    "supply_pressure": ("Pa", 0.0, 1e8, 20e5, "gauge pressure of the supply"),
    "displacement": (
        "m", -100.0, 100.0, 0.0,
        "displacement of the piston relative to the bit, down positive",
    ),
    "velocity": ("m/s", -1000.0, 1000.0, 0.0, "the same of the velocity"),
}  # fmt: skip
_PARAMETERS = {
    "area": ("m^2", 1e-6, 10.0, 1.6e-3, "cross-section of both chambers"),
    "clearance": ("m", 1e-3, 10.0, 0.03, "height of a chamber at its smallest"),
    "longest_stroke": ("m", 1e-3, 10.0, 0.15, "room for the piston above the bit"),
    "reversal_distance": ("m", 1e-6, 10.0, 0.040, "D_1: piston this far up turns the valve"),
    "conductance": ("m s", 0.0, 1.0, 1e-6, "mass flow of a port by its pressure difference"),
    "temperature": ("K", 1.0, 5000.0, 293.0, "temperature of the gas"),
}
_OUTPUTS = {
    "piston_force": ("N", -1e9, 1e9, 1e3, "force on the piston, down positive"),
    "upper.pressure": ("Pa", -1.1e5, 1e9, 1e6, "gauge pressure in the upper chamber"),
    "lower.pressure": ("Pa", -1.1e5, 1e9, 1e6, "gauge pressure in the lower chamber"),
    "air_used": ("kg", -1e6, 1e6, 1e-2, "mass of air taken from the supply"),
}
_DISPLAY = {"Pa": "bar", "m": "mm", "N": "kN"}
FIRST_OUTPUT, FIRST_PARAMETER = 10, 20


def pneumatic_variables() -> list[Variable]:
    """Return the variables of the drive."""
    found = [_number(name, k, "input", *entry) for k, (name, entry) in enumerate(_INPUTS.items())]
    for k, (name, (unit, lower, upper, nominal, text)) in enumerate(_OUTPUTS.items()):
        found.append(
            Variable(
                name=name,
                reference=FIRST_OUTPUT + k,
                type="Real",
                causality="output",
                description=text,
                variability="continuous",
                unit=unit,
                display=_DISPLAY.get(unit),
                lower=lower,
                upper=upper,
                nominal=nominal,
            )
        )
    found.append(
        Variable(
            name="valve_down",
            reference=FIRST_OUTPUT + len(_OUTPUTS),
            type="Boolean",
            causality="output",
            description="whether the upper chamber is supplied",
            variability="discrete",
        )
    )
    for k, (name, entry) in enumerate(_PARAMETERS.items()):
        found.append(_number(name, FIRST_PARAMETER + k, "parameter", *entry))
    return found


def _number(
    name: str,
    reference: int,
    causality: Any,
    unit: str,
    lower: float,
    upper: float,
    start: float,
    text: str,
) -> Variable:
    shown = fmi_unit(unit)
    return Variable(
        name=name,
        reference=reference,
        type="Real",
        causality=causality,
        description=text,
        variability="continuous" if causality == "input" else "fixed",
        unit=shown,
        display=_DISPLAY.get(shown),
        lower=lower,
        upper=upper,
        nominal=magnitude(start),
        start=start,
        row=number_row(name, unit, lower, upper, text),
    )


def build_pneumatics(path: Path) -> str:
    """Write the FMU; return its GUID."""
    about = About(
        model=path.stem,
        description="A simple pneumatic drive: two chambers and a valve turned by the piston",
        author="percussion_model developers",
        version=version("percussion_model"),
        license="BSD-3-Clause",
        stop_time=1.0,
        step_size=1e-4,
    )
    variables = pneumatic_variables()
    bundle = stage("pneumatic_drive", "parts", with_model=False)
    text = json.dumps([variable.for_instance() for variable in variables], indent=1)
    page = write_page(about, variables)
    return write_fmu(
        path,
        about,
        variables,
        bundle,
        ("parts.pneumatic_drive", "PneumaticDrive"),
        {"variables.json": text + "\n"},
        page,
    )
