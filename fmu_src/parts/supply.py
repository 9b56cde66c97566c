"""Supply of air or oil: source, hose volume, pressure drop, relief valve.

`medium = "air"` is in `air_line.py`. With "oil", the drive takes a volume for each blow,

    C p' = q_source - q_drive - q_relief,   p_drive = p - R q_drive

The source follows the wanted pressure by q = clip(K (p_wanted - p), -q_vent, q_max), where what
is below 0 leaves by a vent and its energy is lost; the drive leaks. All pressures are gauge.
"""

from __future__ import annotations

import math

from fmu_src.parts import air_line
from fmu_src.parts.part import NUMBER, Law, PartTable
from percussion_model.physics.kernel import kernel

AIR = 1  # choice of the medium
LONGEST_STEP = 1e-3  # of the integration, short against filling the hose [s]


@kernel
def begin(p, u, s, w):
    """Start with the hose full."""
    s.pressure = s.drive_pressure = p.start_pressure
    if p.medium == AIR:
        air_line.begin(p, u, s)


@kernel
def step(p, u, s, w, h):
    """Advance by a communication step."""
    if p.medium == AIR:
        air_line.step(p, u, s, h)
    else:
        flow_of_oil(p, u, s, h)
    return 0


@kernel
def flow_of_oil(p, u, s, step_size):
    """Integrate the pressure of the hose, implicit in it."""
    capacity, resistance = p.hose_volume / p.hose_bulk_modulus, p.hose_resistance
    gain = capacity / p.source_time
    wanted = min(u.pressure_command, p.source_pressure_limit) * (1.0 - u.pressure_loss)
    taken = leak = 0.0
    if u.percussion_on:
        taken, leak = p.drive_volume * u.blow_frequency, p.drive_leakage
    # the leak of the drive sees what is left behind the hose
    lost = leak / (1.0 + leak * resistance)
    count = max(1, math.ceil(step_size / LONGEST_STEP))
    h = step_size / count
    for _ in range(count):
        held = s.pressure - h / capacity * taken
        new = (held + h / capacity * gain * wanted) / (1.0 + h / capacity * (gain + lost))
        flow = gain * (wanted - new)
        if not -p.vent_flow_limit <= flow <= p.source_flow_limit:
            flow = min(max(flow, -p.vent_flow_limit), p.source_flow_limit)
            new = (held + h / capacity * flow) / (1.0 + h / capacity * lost)
        new = max(new, 0.0)
        if new > p.relief_pressure:
            s.relief_volume += capacity * (new - p.relief_pressure)
            new = p.relief_pressure
        s.flow, s.pressure = max(flow, 0.0), new
        s.energy += h * s.flow * new
    drawn = taken + leak * s.pressure
    s.drive_pressure = max(0.0, (s.pressure - resistance * drawn) / (1.0 + leak * resistance))


@kernel
def outputs(p, s, w, y):
    """Present values."""
    if p.medium == AIR:
        air_line.outputs(p, s, y)
        return
    y.supply_pressure, y.hose_pressure, y.flow = s.drive_pressure, s.pressure, s.flow
    y.energy, y.relief_volume = s.energy, s.relief_volume
    y.relief_open = s.pressure >= p.relief_pressure
    y.back_pressure = y.air_given = y.air_lost = y.air_stored = 0.0


LAW = Law(
    state=dict.fromkeys(("pressure", "drive_pressure", "flow", "energy", "relief_volume"), NUMBER)
    | air_line.STATE,
    begin=begin,
    step=step,
    outputs=outputs,
)


TABLE = PartTable(
    name="Supply",
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
        "hose.resistance": ("Pa s/m^3", 0.0, 1e12, 2e7, "pressure drop per flow"),
        "drive.volume": ("m^3", 0.0, 1.0, 1.2e-4, "volume that the drive takes for a blow"),
        "drive.leakage": ("m^3/(s Pa)", 0.0, 1e-3, 2e-10, "flow past the piston per pressure"),
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
    law=LAW,
)  # fmt: skip
