"""Rig feed: a hydraulic cylinder whose pressure a servo valve drives, pushing the head.

    V/B p' = q - A v - leak p,   q = clip(K (p_wanted - p), -q_max, q_max),   F = A p

with the pressure difference p of both sides, clipped by the relief valves. K follows
from the servo's time constant. Friction of the slide brakes the head: -c v.
"""

from __future__ import annotations

import math

from fmu_src.parts.part import FLAG, NUMBER, Law, PartTable
from percussion_model.physics.kernel import inlined, kernel

LONGEST_STEP = 1e-3  # of the integration, short against the servo [s]


@kernel
def begin(p, u, s, w):
    """Start with the force that is wanted."""
    s.pressure = p.start_force / p.cylinder_area
    s.speed = u.head_velocity


@inlined
def kept(value, least, most):
    """The value within bounds."""
    return min(max(value, least), most)


@kernel
def step(p, u, s, w, h):
    """Integrate the pressure, implicit in the flow of the valve."""
    area, leak, speed = p.cylinder_area, p.cylinder_leakage, u.head_velocity
    capacity = p.cylinder_volume / p.cylinder_bulk_modulus
    gain, flow_limit, highest = (
        capacity / p.servo_time,
        p.servo_velocity * area,
        p.force_limit / area,
    )
    wanted = kept(u.force_command / area, -highest, highest)
    s.speed = speed
    count = max(1, math.ceil(h / LONGEST_STEP))
    h = h / count
    share = h / capacity  # pressure for a flow
    for _ in range(count):
        held = s.pressure - share * area * speed
        new = (held + share * gain * wanted) / (1.0 + share * (gain + leak))
        flow = gain * (wanted - new)
        s.limited = abs(flow) > flow_limit
        if s.limited:
            flow = math.copysign(flow_limit, flow)
            new = (held + share * flow) / (1.0 + share * leak)
        clipped = kept(new, -highest, highest)
        s.relief_volume += capacity * abs(new - clipped)
        s.energy += h * flow * clipped
        s.pressure = clipped
    return 0


@kernel
def outputs(p, s, w, y):
    """Present values."""
    y.force = p.cylinder_area * s.pressure - p.slide_friction * s.speed
    y.rotation_speed = p.rotation_speed
    y.pressure, y.energy, y.relief_volume = s.pressure, s.energy, s.relief_volume
    y.limited = s.limited


LAW = Law(
    state=dict.fromkeys(("pressure", "relief_volume", "energy", "speed"), NUMBER)
    | {"limited": FLAG},
    begin=begin,
    step=step,
    outputs=outputs,
)

TABLE = PartTable(
    name="RigFeed",
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
        "cylinder.leakage": ("m^3/(s Pa)", 0.0, 1e-6, 0.0, "leak per pressure"),
        "servo.time": ("s", 1e-3, 10.0, 0.02, "time constant of the pressure"),
        "servo.velocity": ("m/s", 1e-3, 10.0, 0.3, "velocity of the head at full flow"),
        "force_limit": ("N", 0.0, 1e7, 2e4, "force at which the relief valves open"),
        "rotation.speed": ("rad/s", 0.0, 1e4, 4.0, "speed of the rotation's motor without load"),
        "slide.friction": ("N s/m", 0.0, 1e7, 2e3, "viscous friction of the slide"),
        "start.force": ("N", -1e6, 1e6, 0.0, "force at the start"),
    },
    at_start={"force": ("head_velocity",), "rotation_speed": (), "pressure": ()},
    law=LAW,
)  # fmt: skip
