"""A simple pneumatic drive, which can push the hammer's piston: two chambers and a valve.

Each chamber holds an ideal gas at constant temperature and is connected by the valve
to the supply or to the open air, through a port whose mass flow is proportional to the
difference of pressures. The valve turns as the pressure law of the hammer does: up at
u = 0, down at u = -D_1, where u is the displacement of the piston relative to the bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fmu_src.parts.part import Model, PartTable, slave_of

GAS_CONSTANT = 287.0  # of air [J/(kg K)]
AMBIENT = 101_325.0  # [Pa], absolute; pressures in the chambers are gauge
# Steps of the integration: short against filling a chamber [s].
LONGEST_STEP = 2e-5


class PneumaticDrive(Model):
    """Force on the piston from two chambers.

    Attributes
    ----------
    direction : float
        1: the upper chamber is supplied, -1: the lower one.
    upper, lower : float
        Gauge pressures [Pa].
    used : float
        Mass of air taken from the supply [kg].
    """

    STATE = ("direction", "upper", "lower", "used")

    def begin(self, inputs: dict[str, Any]) -> None:
        """Fill the chamber that is supplied."""
        self.direction = 1.0
        self.upper, self.lower, self.used = inputs["supply_pressure"], 0.0, 0.0

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """Integrate the pressures, the piston moving on with its velocity."""
        count = max(1, math.ceil(step_size / LONGEST_STEP))
        h = step_size / count
        supply, u, v = inputs["supply_pressure"], inputs["displacement"], inputs["velocity"]
        for _ in range(count):
            self._turn(u)
            self._fill(supply, u, v, h)
            u += v * h
        self._turn(u)

    def _turn(self, u: float) -> None:
        """Turn the valve where the piston passes one of its two places."""
        if self.direction > 0.0 and u >= 0.0:
            self.direction = -1.0
        elif self.direction < 0.0 and u <= -self.parameters["reversal_distance"]:
            self.direction = 1.0

    def _fill(self, supply: float, u: float, v: float, h: float) -> None:
        """Pressures after a time: p V = m R T, with flow through the ports."""
        p, area = self.parameters, self.parameters["area"]
        rest, stroke, conductance = p["clearance"], p["longest_stroke"], p["conductance"]
        rt = GAS_CONSTANT * p["temperature"]
        # the upper chamber grows as the piston goes down
        volumes = (area * max(stroke + rest + u, rest), area * max(rest - u, rest))
        sources = (supply, 0.0) if self.direction > 0.0 else (0.0, supply)
        found = []
        for gauge, volume, source, growth in zip(
            (self.upper, self.lower), volumes, sources, (area * v, -area * v), strict=True
        ):
            absolute = gauge + AMBIENT
            # implicit in the pressure, so that no step is too long
            fill = rt * conductance / volume
            new = (absolute + h * fill * (source + AMBIENT)) / (1.0 + h * (fill + growth / volume))
            if source == supply:
                self.used += h * conductance * (supply + AMBIENT - new)
            found.append(new - AMBIENT)
        self.upper, self.lower = found

    def state_fault(self, saved: Mapping[str, Any]) -> str:
        """As in `Model`: the valve is in one of its two places."""
        if saved["direction"] not in (1.0, -1.0):
            return f"direction = {saved['direction']!r}, which must be 1 or -1"
        return ""

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        return {
            "piston_force": self.parameters["area"] * (self.upper - self.lower),
            "valve_down": self.direction > 0.0,
            "upper.pressure": self.upper,
            "lower.pressure": self.lower,
            "air_used": self.used,
        }


PneumaticDrivePart = slave_of(PneumaticDrive)


# Chambers that give about the 3000 N of the reference drive at 20 bar, and fill in a few
# milliseconds.
TABLE = PartTable(
    name="PneumaticDrive",
    slave=PneumaticDrivePart,
    description="A simple pneumatic drive: two chambers and a valve turned by the piston",
    inputs={
        "supply_pressure": ("Pa", 0.0, 1e8, 20e5, "gauge pressure of the supply"),
        "displacement": (
            "m", -100.0, 100.0, 0.0,
            "displacement of the piston relative to the bit, down positive",
        ),
        "velocity": ("m/s", -1000.0, 1000.0, 0.0, "the same of the velocity"),
    },
    outputs={
        "piston_force": ("N", -1e9, 1e9, 1e3, "force on the piston, down positive"),
        "upper.pressure": ("Pa", -1.1e5, 1e9, 1e6, "gauge pressure in the upper chamber"),
        "lower.pressure": ("Pa", -1.1e5, 1e9, 1e6, "gauge pressure in the lower chamber"),
        "air_used": ("kg", -1e6, 1e6, 1e-2, "mass of air taken from the supply"),
        "valve_down": (False, "whether the upper chamber is supplied"),
    },
    parameters={
        "area": ("m^2", 1e-6, 10.0, 1.6e-3, "cross-section of both chambers"),
        "clearance": ("m", 1e-3, 10.0, 0.03, "height of a chamber at its smallest"),
        "longest_stroke": ("m", 1e-3, 10.0, 0.15, "room for the piston above the bit"),
        "reversal_distance": ("m", 1e-6, 10.0, 0.040, "D_1: piston this far up turns the valve"),
        "conductance": ("m s", 0.0, 1.0, 1e-6, "mass flow of a port by its pressure difference"),
        "temperature": ("K", 1.0, 5000.0, 293.0, "temperature of the gas"),
    },
    at_start={"piston_force": ("supply_pressure",), "upper.pressure": ("supply_pressure",)},
    first={"input": 0, "output": 10, "parameter": 20},
    displays={"Pa": "bar", "m": "mm", "N": "kN"},
    stop_time=1.0,
    step_size=1e-4,
    bundle="pneumatic_drive",
)  # fmt: skip
