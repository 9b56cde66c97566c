"""Air or oil supply: source, hose volume, pressure drop, relief valve.

    C p' = q_source - q_drive - q_relief,   p_drive = p - R q_drive

The source follows the wanted pressure by q = clip(K (p_wanted - p), -q_vent, q_max), where what
is below 0 leaves by a vent and its energy is lost; the drive takes a volume for each blow at its
pressure, and leaks. All pressures are gauge.
"""

from __future__ import annotations

import math
from typing import Any

from fmu_src.parts.part import Model

LONGEST_STEP = 1e-3  # of the integration, short against filling the hose [s]


class Supply(Model):
    """Source with a hose."""

    STATE = ("pressure", "flow", "energy", "relief_volume", "drive_pressure")

    def __init__(self, parameters: dict[str, Any]) -> None:
        super().__init__(parameters)
        self.pressure = self.flow = self.energy = self.relief_volume = 0.0
        self.drive_pressure = 0.0
        p = parameters
        self.capacity = p["hose.volume"] / p["hose.bulk_modulus"]
        self.gain = self.capacity / p["source.time"]
        self.resistance, self.relief = p["hose.resistance"], p["relief_pressure"]
        self.flows = -p["vent.flow_limit"], p["source.flow_limit"]

    def begin(self, inputs: dict[str, Any]) -> None:
        """Start with the hose full."""
        self.pressure = self.drive_pressure = self.parameters["start.pressure"]

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """Integrate the pressure of the hose, implicit in it."""
        p, capacity, gain, resistance = self.parameters, self.capacity, self.gain, self.resistance
        wanted = min(inputs["pressure_command"], p["source.pressure_limit"])
        wanted *= 1.0 - inputs["pressure_loss"]
        taken = leak = 0.0
        if inputs["percussion_on"]:
            taken, leak = p["drive.volume"] * inputs["blow_frequency"], p["drive.leakage"]
        # the leak of the drive sees what is left behind the hose
        lost = leak / (1.0 + leak * resistance)
        count = max(1, math.ceil(step_size / LONGEST_STEP))
        h = step_size / count
        for _ in range(count):
            held = self.pressure - h / capacity * taken
            new = (held + h / capacity * gain * wanted) / (1.0 + h / capacity * (gain + lost))
            flow = gain * (wanted - new)
            if not self.flows[0] <= flow <= self.flows[1]:
                flow = min(max(flow, self.flows[0]), self.flows[1])
                new = (held + h / capacity * flow) / (1.0 + h / capacity * lost)
            new = max(new, 0.0)
            if new > self.relief:
                self.relief_volume += capacity * (new - self.relief)
                new = self.relief
            self.flow, self.pressure = max(flow, 0.0), new
            self.energy += h * self.flow * new
        drawn = taken + leak * self.pressure
        self.drive_pressure = max(0.0, (self.pressure - resistance * drawn)
                                  / (1.0 + leak * resistance))  # fmt: skip

    def signals(self) -> dict[str, Any]:
        """What hammer, rock and controller take."""
        return {"supply_pressure": self.drive_pressure}

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        return {
            "supply_pressure": self.drive_pressure,
            "hose_pressure": self.pressure,
            "flow": self.flow,
            "energy": self.energy,
            "relief_volume": self.relief_volume,
            "relief_open": self.pressure >= self.parameters["relief_pressure"],
        }
