"""Supply of air or oil: source, hose volume, pressure drop, relief valve.

`medium = "air"` is in `air_line.py`. With "oil", the drive takes a volume for each blow,

    C p' = q_source - q_drive - q_relief,   p_drive = p - R q_drive

The source follows the wanted pressure by q = clip(K (p_wanted - p), -q_vent, q_max), where what
is below 0 leaves by a vent and its energy is lost; the drive leaks. All pressures are gauge.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from fmu_src.parts.air_line import AirLine
from fmu_src.parts.part import Model, PartTable, slave_of

LONGEST_STEP = 1e-3  # of the integration, short against filling the hose [s]


class OilLine:
    """Source with a hose, and a drive that takes a volume for each blow."""

    STATE: ClassVar[tuple[str, ...]] = (
        "pressure", "flow", "energy", "relief_volume", "drive_pressure",
    )  # fmt: skip

    def __init__(self, parameters: dict[str, Any]) -> None:
        self.parameters = parameters
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


# What there is of air alone.
WITHOUT_AIR = {"back_pressure": 0.0, "air_given": 0.0, "air_lost": 0.0, "air_stored": 0.0}


class Supply(Model):
    """Supply of what its parameters say."""

    STATE = ("line",)

    def __init__(self, parameters: dict[str, Any]) -> None:
        super().__init__(parameters)
        is_air = parameters["medium"] == "air"
        self.line: OilLine | AirLine = AirLine(parameters) if is_air else OilLine(parameters)

    def begin(self, inputs: dict[str, Any]) -> None:
        """As in `Model`."""
        self.line.begin(inputs)

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """As in `Model`."""
        self.line.step(inputs, step_size)

    def signals(self) -> dict[str, Any]:
        """As in `Model`."""
        return self.line.signals()

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        return WITHOUT_AIR | self.line.outputs()


SupplyPart = slave_of(Supply)


TABLE = PartTable(
    name="Supply",
    slave=SupplyPart,
    description="Supply of air or oil: source, hose volume, pressure drop, relief valve",
    inputs={
        "pressure_command": ("Pa", 0.0, 1e9, 2e6, "pressure that is wanted"),
        "percussion_on": ("", 0, 1, True, "whether the drive is open"),
        "blow_frequency": ("Hz", 0.0, 1e6, 0.0, "blows of the hammer"),
        "pressure_loss": ("1", 0.0, 1.0, 0.0, "share of the pressure that a fault takes"),
        "air_used": ("kg", -1e9, 1e9, 0.0, "running sum of the air that the hammer has used"),
        "bit_position": ("m", -1e5, 1e5, 0.0, "displacement of the bit, for the water's column"),
    },
    outputs={
        "supply_pressure": ("Pa", "gauge pressure at the hammer"),
        "hose_pressure": ("Pa", "gauge pressure at the source"),
        "flow": ("m3/s", "flow of the source; of a compressor, of air as it takes it in"),
        "energy": ("J", "energy given by the source"),
        "relief_volume": ("m3", "volume through the relief valve; of air as it was taken in"),
        "relief_open": (False, "whether the relief valve is open"),
        "back_pressure": ("Pa", "gauge pressure of the water at the hammer"),
        "air_given": ("kg", "air from the compressor"),
        "air_lost": ("kg", "air through vent and relief valve"),
        "air_stored": ("kg", "air in receiver and hose"),
    },
    parameters={
        "source.pressure_limit": ("Pa", 0.0, 1e9, 3e6, "highest pressure of the source"),
        "source.flow_limit": ("m^3/s", 0.0, 100.0, 2e-2, "highest flow of the source"),
        "source.time": ("s", 1e-4, 100.0, 0.02, "time constant of the source"),
        "vent.flow_limit": ("m^3/s", 0.0, 100.0, 0.1, "flow of the vent above what is wanted"),
        "hose.volume": ("m^3", 1e-6, 100.0, 2e-2, "volume of the hose, and of rods with air"),
        "hose.bulk_modulus": ("Pa", 1e4, 1e10, 2.1e6, "stiffness of oil and hose, or of gas"),
        "hose.resistance": ("Pa s/m^3", 0.0, 1e12, 2e7, "pressure drop by flow"),
        "drive.volume": ("m^3", 0.0, 1.0, 1.2e-4, "volume that the drive takes for a blow"),
        "drive.leakage": ("m^3/(s Pa)", 0.0, 1e-3, 2e-10, "flow past the piston by pressure"),
        "relief_pressure": ("Pa", 0.0, 1e9, 3.2e6, "pressure at which the relief valve opens"),
        "start.pressure": ("Pa", 0.0, 1e9, 2e6, "pressure at the start"),
        "medium": ("", 0, 0, ("oil", "air"), "a volume for each blow, or compressed air by mass; "
                   "what follows is of air, drive., bulk modulus and resistance are of oil"),
        "compressor.flow_limit": ("kg/s", 0.0, 100.0, 0.5, "most that the compressor gives"),
        "compressor.efficiency": ("1", 0.01, 1.0, 0.6, "its work if air stayed at its "
                                  "temperature, by its work; assumed"),
        "receiver.volume": ("m^3", 1e-4, 1e3, 0.3, "volume of the receiver"),
        "hose.length": ("m", 1e-2, 1e5, 30.0, "length of hose and rods, for their friction"),
        "hose.diameter": ("m", 1e-3, 10.0, 0.05, "their inner diameter"),
        "hose.friction": ("1", 1e-6, 10.0, 0.02, "their friction factor, after Darcy"),
        "ambient.pressure": ("Pa", 1e3, 1e7, 101_325.0, "pressure of the surroundings"),
        "air.temperature": ("K", 100.0, 2000.0, 300.0, "temperature of air and surroundings"),
        "hole.depth": ("m", 0.0, 1e5, 0.0, "depth of the hole at the start"),
        "water.depth": ("m", -1.0, 1e5, -1.0, "depth of the water's surface; below 0: dry"),
    },
    at_start={"supply_pressure": (), "hose_pressure": (), "relief_open": (), "air_stored": (),
              "back_pressure": ("bit_position",)},
)  # fmt: skip
