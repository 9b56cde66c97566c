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

from fmu_src.parts.part import NUMBER
from percussion_model.physics.elementary import expm1, log
from percussion_model.physics.kernel import kernel

GAS_CONSTANT = 287.05  # of air [J/(kg K)]
WATER, GRAVITY = 1000.0, 9.81  # [kg/m^3], [m/s^2]
LONGEST_STEP = 1e-3  # of the integration, short against filling the hose [s]
# A pressure that has come to that of the relief valve by rounding opens it.
ROUNDING = 1e-12
# Mass of air in receiver and hose, what the drive has told to have used; air from the compressor,
# by vent and relief valve, and by the latter alone [kg]; displacement of the bit [m].
STATE = dict.fromkeys(("receiver", "hose", "used", "given", "lost", "relieved", "depth"), NUMBER)


@kernel
def heat_of(p):
    """R T of the air [J/kg]."""
    return GAS_CONSTANT * p.air_temperature


@kernel
def begin(p, u, s):
    """Start with receiver and hose full."""
    start = p.start_pressure + p.ambient_pressure
    s.receiver = p.receiver_volume / heat_of(p) * start
    s.hose = p.hose_volume / heat_of(p) * start
    s.used, s.depth = u.air_used, u.bit_position


@kernel
def step(p, u, s, h):
    """Advance the masses by a communication step [s]."""
    wanted = min(u.pressure_command, p.source_pressure_limit)
    wanted = wanted * (1.0 - u.pressure_loss) + p.ambient_pressure
    drawn = (u.air_used - s.used) / h
    s.used, s.depth = u.air_used, u.bit_position
    in_receiver = p.receiver_volume / heat_of(p)  # mass by pressure [kg/Pa]
    count = max(1, math.ceil(h / LONGEST_STEP))
    for _ in range(count):
        advance(p, s, in_receiver * wanted, drawn, h / count)


@kernel
def advance(p, s, wanted, drawn, h):
    """The same by a step in which the flow of the hose is held [s]."""
    heat, time, through = heat_of(p), p.source_time, through_hose(p, s, h)
    in_receiver, ambient = p.receiver_volume / heat, p.ambient_pressure
    # mean flow of a source that follows, with what the hose takes
    aim = wanted - through * time
    flow = through - expm1(-h / time) * (aim - s.receiver) / h
    vent = p.vent_flow_limit * s.receiver / p.receiver_volume
    flow = min(max(flow, -vent), p.compressor_flow_limit)
    s.receiver += h * (flow - through)
    s.hose += h * (through - drawn)
    s.flow = max(flow, 0.0)
    s.given += h * s.flow
    s.lost += h * (s.flow - flow)
    excess = s.receiver - in_receiver * (p.relief_pressure + ambient)
    if excess > 0.0:
        s.receiver -= excess
        s.lost += excess
        s.relieved += excess
    work = heat * log(max(s.receiver / in_receiver / ambient, 1.0))
    s.energy += h * s.flow * work / p.compressor_efficiency


@kernel
def through_hose(p, s, h):
    """Flow from receiver to hammer, no more than makes pressures equal [kg/s]."""
    heat = heat_of(p)
    in_receiver, in_hose = p.receiver_volume / heat, p.hose_volume / heat
    area = 0.25 * math.pi * (p.hose_diameter * p.hose_diameter)
    conductance = area * math.sqrt(p.hose_diameter / (p.hose_friction * p.hose_length * heat))
    before, behind = s.receiver / in_receiver, s.hose / in_hose
    drop = before * before - max(behind, 0.0) * max(behind, 0.0)
    flow = math.copysign(conductance * math.sqrt(abs(drop)), drop)
    equal = (before - behind) / (1.0 / in_receiver + 1.0 / in_hose) / h
    return min(flow, equal) if equal > 0.0 else max(flow, equal)


@kernel
def outputs(p, s, y):
    """Present values."""
    heat = heat_of(p)
    pressure = s.receiver / (p.receiver_volume / heat) - p.ambient_pressure
    y.supply_pressure = max(s.hose / (p.hose_volume / heat) - p.ambient_pressure, 0.0)
    y.back_pressure = 0.0
    if p.water_depth >= 0.0:
        height = p.hole_depth + s.depth - p.water_depth
        y.back_pressure = WATER * GRAVITY * max(height, 0.0)
    taken_in = heat / p.ambient_pressure  # volume by mass, in the surroundings
    y.hose_pressure, y.flow, y.energy = pressure, s.flow * taken_in, s.energy
    y.relief_volume = s.relieved * taken_in
    y.relief_open = pressure >= p.relief_pressure * (1.0 - ROUNDING)
    y.air_given, y.air_lost, y.air_stored = s.given, s.lost, s.receiver + s.hose
