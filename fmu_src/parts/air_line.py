"""Air on its way to the hammer: compressor, receiver, hose, and water that stands in the hole.

    V_1 p_1' = R T (q_c - q_h),   V_2 p_2' = R T (q_h - q_d),
    q_h^2 = D A^2 (p_1^2 - p_2^2) / (f L R T),   p_hole = rho g (depth - depth of the water)

1 is the receiver and 2 the hammer's end of the hose, both at the temperature of the surroundings;
the flow of the hose is that of a long pipe at one temperature (Darcy's friction). The compressor
follows the wanted pressure by q_c = clip((m_wanted - m_1) / time, -q_vent, q_max), where what is
below 0 leaves by a vent. The drive's flow is what it tells to have used since the step before.
Masses are the state, so none is lost; pressures in these equations are absolute.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

GAS_CONSTANT = 287.05  # of air [J/(kg K)]
WATER, GRAVITY = 1000.0, 9.81  # [kg/m^3], [m/s^2]
LONGEST_STEP = 1e-3  # of the integration, short against filling the hose [s]


class AirLine:
    """Masses of air in receiver and hose, and what went through.

    Attributes
    ----------
    receiver, hose : float
        Mass of air in them [kg].
    used : float
        What the drive has told to have used [kg].
    given, lost, relieved : float
        Air from the compressor, by vent and relief valve, and by the latter alone [kg].
    flow : float
        Of the compressor [kg/s].
    """

    STATE: ClassVar[tuple[str, ...]] = (
        "receiver", "hose", "used", "given", "lost", "relieved", "flow", "energy", "depth",
    )  # fmt: skip

    def __init__(self, parameters: dict[str, Any]) -> None:
        self.parameters = p = parameters
        self.heat = GAS_CONSTANT * p["air.temperature"]  # R T [J/kg]
        # mass by pressure [kg/Pa]
        self.in_receiver = p["receiver.volume"] / self.heat
        self.in_hose = p["hose.volume"] / self.heat
        area = 0.25 * math.pi * p["hose.diameter"] ** 2
        resistance = p["hose.friction"] * p["hose.length"] * self.heat
        self.conductance = area * math.sqrt(p["hose.diameter"] / resistance)
        self.ambient = p["ambient.pressure"]
        self.receiver = self.hose = self.used = self.given = self.lost = self.relieved = 0.0
        self.flow = self.energy = self.depth = 0.0

    def begin(self, inputs: dict[str, Any]) -> None:
        """Start with receiver and hose full."""
        start = self.parameters["start.pressure"] + self.ambient
        self.receiver, self.hose = self.in_receiver * start, self.in_hose * start
        self.used, self.depth = inputs["air_used"], inputs["bit_position"]

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """Advance the masses by a communication step [s]."""
        p = self.parameters
        wanted = min(inputs["pressure_command"], p["source.pressure_limit"])
        wanted = wanted * (1.0 - inputs["pressure_loss"]) + self.ambient
        drawn = (inputs["air_used"] - self.used) / step_size
        self.used, self.depth = inputs["air_used"], inputs["bit_position"]
        count = max(1, math.ceil(step_size / LONGEST_STEP))
        for _ in range(count):
            self._advance(self.in_receiver * wanted, drawn, step_size / count)

    def _advance(self, wanted: float, drawn: float, h: float) -> None:
        """The same by a step in which the flow of the hose is held [s]."""
        p, time = self.parameters, self.parameters["source.time"]
        through = self._through_hose(h)
        # mean flow of a source that follows, with what the hose takes
        aim = wanted - through * time
        flow = through - math.expm1(-h / time) * (aim - self.receiver) / h
        vent = p["vent.flow_limit"] * self.receiver / p["receiver.volume"]
        flow = min(max(flow, -vent), p["compressor.flow_limit"])
        self.receiver += h * (flow - through)
        self.hose += h * (through - drawn)
        self.flow = max(flow, 0.0)
        self.given += h * self.flow
        self.lost += h * (self.flow - flow)
        excess = self.receiver - self.in_receiver * (p["relief_pressure"] + self.ambient)
        if excess > 0.0:
            self.receiver -= excess
            self.lost += excess
            self.relieved += excess
        work = self.heat * math.log(max(self.receiver / self.in_receiver / self.ambient, 1.0))
        self.energy += h * self.flow * work / p["compressor.efficiency"]

    def _through_hose(self, h: float) -> float:
        """Flow from receiver to hammer, no more than makes pressures equal [kg/s]."""
        before, behind = self.receiver / self.in_receiver, self.hose / self.in_hose
        drop = before * before - max(behind, 0.0) ** 2
        flow = math.copysign(self.conductance * math.sqrt(abs(drop)), drop)
        equal = (before - behind) / (1.0 / self.in_receiver + 1.0 / self.in_hose) / h
        return min(flow, equal) if equal > 0.0 else max(flow, equal)

    def signals(self) -> dict[str, Any]:
        """What hammer, rock and controller take."""
        height = self.parameters["hole.depth"] + self.depth - self.parameters["water.depth"]
        is_wet = self.parameters["water.depth"] >= 0.0
        return {
            "supply_pressure": max(self.hose / self.in_hose - self.ambient, 0.0),
            "back_pressure": WATER * GRAVITY * max(height, 0.0) if is_wet else 0.0,
        }

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        pressure = self.receiver / self.in_receiver - self.ambient
        taken_in = self.heat / self.ambient  # volume by mass, in the surroundings
        return {
            **self.signals(),
            "hose_pressure": pressure,
            "flow": self.flow * taken_in,
            "energy": self.energy,
            "relief_volume": self.relieved * taken_in,
            "relief_open": pressure >= self.parameters["relief_pressure"] * (1.0 - 1e-12),
            "air_given": self.given,
            "air_lost": self.lost,
            "air_stored": self.receiver + self.hose,
        }
