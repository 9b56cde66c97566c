"""Rig feed: a hydraulic cylinder whose pressure a servo valve drives, pushing the head.

    V/B p' = q - A v - leak p,   q = clip(K (p_wanted - p), -q_max, q_max),   F = A p

with the pressure difference p of both sides, clipped by the relief valves. K follows
from the servo's time constant. Friction of the slide brakes the head: -c v.
"""

from __future__ import annotations

import math
from typing import Any

from fmu_src.parts.part import Model, PartTable, slave_of

LONGEST_STEP = 1e-3  # of the integration, short against the servo [s]


class RigFeed(Model):
    """Cylinder with servo valve."""

    STATE = ("pressure", "relief_volume", "energy", "speed", "limited")

    def __init__(self, parameters: dict[str, Any]) -> None:
        super().__init__(parameters)
        p = parameters
        self.area = p["cylinder.area"]
        self.capacity = p["cylinder.volume"] / p["cylinder.bulk_modulus"]
        self.gain = self.capacity / p["servo.time"]
        self.flow_limit = p["servo.velocity"] * self.area
        self.highest = p["force_limit"] / self.area
        self.leak, self.friction = p["cylinder.leakage"], p["slide.friction"]
        self.pressure = self.relief_volume = self.energy = self.speed = 0.0
        self.limited = False

    def begin(self, inputs: dict[str, Any]) -> None:
        """Start with the force that is wanted."""
        self.pressure = self.parameters["start.force"] / self.area
        self.speed = inputs["head_velocity"]

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """Integrate the pressure, implicit in the flow of the valve."""
        highest, speed = self.highest, inputs["head_velocity"]
        wanted = min(max(inputs["force_command"] / self.area, -highest), highest)
        self.speed = speed
        count = max(1, math.ceil(step_size / LONGEST_STEP))
        h = step_size / count
        share = h / self.capacity  # pressure for a flow
        for _ in range(count):
            held = self.pressure - share * self.area * speed
            new = (held + share * self.gain * wanted) / (1.0 + share * (self.gain + self.leak))
            flow = self.gain * (wanted - new)
            self.limited = abs(flow) > self.flow_limit
            if self.limited:
                flow = math.copysign(self.flow_limit, flow)
                new = (held + share * flow) / (1.0 + share * self.leak)
            clipped = min(max(new, -highest), highest)
            self.relief_volume += self.capacity * abs(new - clipped)
            self.energy += h * flow * clipped
            self.pressure = clipped

    def signals(self) -> dict[str, Any]:
        """What the string takes."""
        return {
            "force": self.area * self.pressure - self.friction * self.speed,
            "rotation_speed": self.parameters["rotation.speed"],
        }

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        return self.signals() | {
            "pressure": self.pressure,
            "energy": self.energy,
            "relief_volume": self.relief_volume,
            "limited": self.limited,
        }


RigFeedPart = slave_of(RigFeed)


TABLE = PartTable(
    name="RigFeed",
    slave=RigFeedPart,
    description="Hydraulic cylinder with servo valve, which pushes the head",
    inputs={
        "force_command": ("N", -1e9, 1e9, 0.0, "force that is wanted on the head"),
        "head_velocity": ("m/s", -1e4, 1e4, 0.0, "velocity of the head"),
    },
    outputs={
        "force": ("N", "force on the head"),
        "rotation_speed": ("rad/s", "speed of the rotation's motor without load"),
        "pressure": ("Pa", "pressure difference over the piston"),
        "energy": ("J", "hydraulic energy used"),
        "relief_volume": ("m3", "volume through the relief valves"),
        "limited": (False, "whether the valve gives its full flow"),
    },
    parameters={
        "cylinder.area": ("m^2", 1e-5, 1.0, 4e-3, "area of the piston"),
        "cylinder.volume": ("m^3", 1e-5, 10.0, 1e-2, "volume under pressure, with hoses"),
        "cylinder.bulk_modulus": ("Pa", 1e5, 1e10, 2e8, "stiffness of oil and hoses"),
        "cylinder.leakage": ("m^3/(s Pa)", 0.0, 1e-6, 0.0, "leak by pressure"),
        "servo.time": ("s", 1e-3, 10.0, 0.02, "time constant of the pressure"),
        "servo.velocity": ("m/s", 1e-3, 10.0, 0.3, "velocity of the head at full flow"),
        "force_limit": ("N", 0.0, 1e7, 2e4, "force at which the relief valves open"),
        "rotation.speed": ("rad/s", 0.0, 1e4, 4.0, "speed of the rotation's motor without load"),
        "slide.friction": ("N s/m", 0.0, 1e7, 2e3, "viscous friction of the slide"),
        "start.force": ("N", -1e6, 1e6, 0.0, "force at the start"),
    },
    at_start={"force": ("head_velocity",), "rotation_speed": (), "pressure": ()},
)  # fmt: skip
