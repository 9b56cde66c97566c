"""Quantities that are measured on a blow; `blow` reads each of them off a computed one."""

from __future__ import annotations

from typing import NamedTuple


class Quantity(NamedTuple):
    """What is measured, and how tables show it."""

    words: str  # for tables
    si: str  # unit of all values
    unit: str  # that tables show
    scale: float  # SI value of that unit
    relative: bool = True  # whether a criterion is a share of the measured value; else a difference


QUANTITIES = {
    "first_wave": Quantity("first wave", "Pa", "MPa", 1e6),
    "indentation_velocity": Quantity("indentation speed", "m/s", "m/s", 1.0),
    "penetration": Quantity("penetration", "m", "mm", 1e-3),
    "residual_penetration": Quantity("residual penetration", "m", "mm", 1e-3),
    "rebound_velocity": Quantity("rebound speed", "m/s", "m/s", 1.0),
    "restitution": Quantity("restitution", "-", "-", 1.0, False),
    "loading_end": Quantity("end of loading", "s", "us", 1e-6),
    "peak_force": Quantity("peak force", "N", "kN", 1e3),
    "loading_stiffness": Quantity("loading stiffness", "N/m", "kN/mm", 1e6),
    "secant_stiffness": Quantity("secant stiffness", "N/m", "kN/mm", 1e6),
}
