"""Quantities that are measured on a blow: their units and their definitions."""

from __future__ import annotations

from typing import NamedTuple


class Quantity(NamedTuple):
    """What is measured, and how tables show it."""

    words: str  # for tables
    si: str  # unit of all values
    unit: str  # that tables show
    scale: float  # SI value of that unit
    definition: str  # how it is read off a computed blow
    relative: bool = True  # whether a criterion is a share of the measured value; else a difference


QUANTITIES = {
    "first_wave": Quantity(
        "first wave", "Pa", "MPa", 1e6,
        "greatest compressive stress at the gauge before a wave can have come back to it from "
        "the bit's lower end",
    ),
    "indentation_velocity": Quantity(
        "indentation speed", "m/s", "m/s", 1.0,
        "slope of the bit's mean displacement from 10 to 90 % of its greatest value",
    ),
    "penetration": Quantity(
        "penetration", "m", "mm", 1e-3, "greatest displacement of the bit's lower end"
    ),
    "residual_penetration": Quantity(
        "residual penetration", "m", "mm", 1e-3,
        "displacement of the bit's lower end when its force on the rock is first zero after the "
        "greatest penetration",
    ),
    "rebound_velocity": Quantity(
        "rebound speed", "m/s", "m/s", 1.0,
        "upward mean velocity of the bit in its longest free flight after the greatest "
        "penetration, before the piston strikes it again",
    ),
    "restitution": Quantity(
        "restitution", "-", "-", 1.0, "rebound speed divided by indentation speed", False
    ),
    "loading_end": Quantity(
        "end of loading", "s", "us", 1e-6,
        "time of the greatest penetration, from the impact",
    ),
    "peak_force": Quantity("peak force", "N", "kN", 1e3, "greatest force on the rock"),
    "loading_stiffness": Quantity(
        "loading stiffness", "N/m", "kN/mm", 1e6,
        "slope of force over penetration between 10 and 90 % of the peak force while it rises",
    ),
    "secant_stiffness": Quantity(
        "secant stiffness", "N/m", "kN/mm", 1e6, "peak force divided by the penetration then"
    ),
}  # fmt: skip
