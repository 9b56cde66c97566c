"""A simple pneumatic drive as a slave: two chambers, a valve that the piston turns.

Each chamber holds an ideal gas at constant temperature and is connected by the valve
to the supply or to the open air, through a port whose mass flow is proportional to the
difference of pressures. The valve turns as the pressure law of the hammer does: up at
u = 0, down at u = -D_1, where u is the displacement of the piston relative to the bit.
"""

from __future__ import annotations

import math
import struct
from typing import Any

from fmu_src.slave.calls import Phase, guarded
from fmu_src.slave.slave import Slave
from fmu_src.slave.states import fingerprint, pack, unpack
from fmu_src.slave.values import Read

GAS_CONSTANT = 287.0  # of air [J/(kg K)]
AMBIENT = 101_325.0  # [Pa], absolute; pressures in the chambers are gauge
# Steps of the integration: short against filling a chamber [s].
LONGEST_STEP = 2e-5

NUMBERS = struct.Struct("<Bdd7d")


class PneumaticDrive(Slave):
    """Force on the piston from two chambers."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.direction = 1.0  # 1: the upper chamber is supplied, -1: the lower one
        self.upper = self.lower = 0.0  # gauge pressures [Pa]
        self.used = 0.0  # mass of air taken from the supply [kg]

    def value(self, name: str) -> float:
        """Value of a parameter or an input."""
        return float(self.values[self.by_name[name]])

    def begin(self) -> None:
        """Fill the chamber that is supplied."""
        self.direction = 1.0
        self.upper, self.lower, self.used = self.value("supply_pressure"), 0.0, 0.0

    def step(self, time: float, step_size: float) -> None:
        """Integrate the pressures, the piston moving on with its velocity."""
        self.take_late()
        self.check([one.reference for one in self.known.values() if one.causality == "input"])
        count = max(1, math.ceil(step_size / LONGEST_STEP))
        h = step_size / count
        u, v = self.value("displacement"), self.value("velocity")
        for _ in range(count):
            self.turn(u)
            self.exchange(u, v, h)
            u += v * h
        self.turn(u)

    def turn(self, u: float) -> None:
        """Turn the valve where the piston passes one of its two places."""
        if self.direction > 0.0 and u >= 0.0:
            self.direction = -1.0
        elif self.direction < 0.0 and u <= -self.value("reversal_distance"):
            self.direction = 1.0

    def exchange(self, u: float, v: float, h: float) -> None:
        """Pressures after a time: p V = m R T, with flow through the ports."""
        supply, area = self.value("supply_pressure"), self.value("area")
        rest, stroke = self.value("clearance"), self.value("longest_stroke")
        rt = GAS_CONSTANT * self.value("temperature")
        conductance = self.value("conductance")
        # the upper chamber grows as the piston goes down
        volumes = (area * max(stroke + rest + u, rest), area * max(rest - u, rest))
        sources = (supply, 0.0) if self.direction > 0.0 else (0.0, supply)
        found = []
        for p, volume, source, growth in zip(
            (self.upper, self.lower), volumes, sources, (area * v, -area * v), strict=True
        ):
            absolute = p + AMBIENT
            # implicit in the pressure, so that no step is too long
            fill = rt * conductance / volume
            new = (absolute + h * fill * (source + AMBIENT)) / (1.0 + h * (fill + growth / volume))
            if source == supply:
                self.used += h * conductance * (supply + AMBIENT - new)
            found.append(new - AMBIENT)
        self.upper, self.lower = found

    def reader(self, references: list[int]) -> Read:
        """What gives the present values of these outputs."""
        names = [self.known[reference].name for reference in references]

        def read(drive: PneumaticDrive) -> list[Any]:
            found = drive.outputs()
            return [found[name] for name in names]

        return read

    def outputs(self) -> dict[str, Any]:
        """Present values of outputs."""
        return {
            "piston_force": self.value("area") * (self.upper - self.lower),
            "valve_down": self.direction > 0.0,
            "upper.pressure": self.upper,
            "lower.pressure": self.lower,
            "air_used": self.used,
        }

    def fingerprint(self) -> bytes:
        """Hash of the parameters."""
        known = self.known.values()
        return fingerprint(
            "pneumatic drive",
            [self.values[one.reference] for one in known if one.causality == "parameter"],
        )

    @guarded
    def _get_fmu_state(self) -> bytes:
        self.take_late()
        inputs = (self.value("supply_pressure"), self.value("displacement"), self.value("velocity"))
        chambers = (self.direction, self.upper, self.lower, self.used)
        body = NUMBERS.pack(self.phase, self.start_time, self.now, *inputs, *chambers)
        return pack(self.fingerprint(), body)

    @guarded
    def _set_fmu_state(self, state: bytes) -> None:
        body = unpack(self.fingerprint(), state)
        phase, self.start_time, self.now, *numbers = NUMBERS.unpack(body)
        self.phase = Phase(phase)
        self.late.clear()
        for name, value in zip(("supply_pressure", "displacement", "velocity"), numbers[:3],
                               strict=True):  # fmt: skip
            self.values[self.by_name[name]] = value
        self.direction, self.upper, self.lower, self.used = numbers[3:]
