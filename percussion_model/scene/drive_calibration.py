"""The pressure law of a rigid piston over a bit at rest, and its calibration.

Section 2.2 of the paper: from the velocity of the rebound the drive lifts the
piston over the reversal distance D_1, turns, slows it and throws it back down.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class PistonCycle(NamedTuple):
    """One cycle of a rigid piston, from rebound to impact."""

    impact_velocity: float  # [m/s], down positive
    stroke: float  # greatest height over the bit [m]
    flight_time: float  # [s]


class DriveCalibration(NamedTuple):
    """Parameters of the pressure law that give a wanted cycle."""

    force: float  # F_0 [N]
    reversal_distance: float  # D_1 [m]
    stroke: float  # greatest height over the bit [m]


def piston_cycle(
    force: float, reversal_distance: float, piston_mass: float, rebound_velocity: float
) -> PistonCycle:
    """Predict the cycle that a pressure law gives (eq. 12 of the paper; docs/model.md, section 5).

    Parameters
    ----------
    force : float
        Drive force F_0 [N].
    reversal_distance : float
        D_1, height at which the drive turns downward [m].
    piston_mass : float
        Mass of the piston [kg].
    rebound_velocity : float
        Velocity of the piston after the impact, down positive: not above zero [m/s].

    Returns
    -------
    PistonCycle
        Impact velocity [m/s], stroke [m] and flight time [s].
    """
    _require_positive("drive force", force, "N")
    _require_positive("reversal distance", reversal_distance, "m")
    _require_positive("piston mass", piston_mass, "kg")
    _require_rebound(rebound_velocity)
    cycle_energy = force * reversal_distance
    ratio = 0.5 * piston_mass * rebound_velocity**2 / cycle_energy
    return PistonCycle(
        impact_velocity=math.sqrt(cycle_energy / piston_mass) * math.sqrt(4 + 2 * ratio),
        stroke=reversal_distance * (2 + ratio),
        flight_time=math.sqrt(reversal_distance * piston_mass / force) * _flight_factor(ratio),
    )


def calibrate_drive(
    piston_mass: float,
    impact_velocity: float,
    rebound_velocity: float,
    flight_time: float,
) -> DriveCalibration:
    """Find F_0 and D_1 from impact velocity, rebound velocity and flight time.

    The inverse of `piston_cycle`, in closed form: the two velocities fix the
    energy F_0 D_1 of a cycle, the flight time the quotient D_1/F_0.

    Parameters
    ----------
    piston_mass : float
        Mass of the piston [kg].
    impact_velocity : float
        Velocity of the piston at impact, down positive [m/s].
    rebound_velocity : float
        Velocity of the piston after the impact, down positive: not above zero [m/s].
    flight_time : float
        Time from rebound to the next impact [s].

    Returns
    -------
    DriveCalibration
        Drive force F_0 [N], reversal distance D_1 [m] and stroke [m].

    Raises
    ------
    ValueError
        If no pressure law gives this cycle.
    """
    _require_positive("piston mass", piston_mass, "kg")
    _require_positive("impact velocity", impact_velocity, "m/s")
    _require_positive("flight time", flight_time, "s")
    _require_rebound(rebound_velocity)
    if impact_velocity <= -rebound_velocity:
        raise ValueError(
            f"impact velocity = {impact_velocity:g} m/s: must be above the rebound speed "
            f"{-rebound_velocity:g} m/s, for the drive adds energy over a cycle"
        )
    cycle_energy = piston_mass * (impact_velocity**2 - rebound_velocity**2) / 4
    ratio = 0.5 * piston_mass * rebound_velocity**2 / cycle_energy
    compliance = (flight_time / _flight_factor(ratio)) ** 2 / piston_mass  # D_1/F_0
    reversal_distance = math.sqrt(cycle_energy * compliance)
    return DriveCalibration(
        force=math.sqrt(cycle_energy / compliance),
        reversal_distance=reversal_distance,
        stroke=reversal_distance * (2 + ratio),
    )


def _flight_factor(ratio: float) -> float:
    """Return the flight time by sqrt(D_1 M_p/F_0), for the energy ratio mu."""
    return math.sqrt(4 + 2 * ratio) + 2 * math.sqrt(2 + 2 * ratio) - math.sqrt(2 * ratio)


def _require_positive(name: str, value: float, unit: str) -> None:
    if not (value > 0 and math.isfinite(value)):
        raise ValueError(f"{name} = {value:g} {unit}: must be a number above 0 {unit}")


def _require_rebound(value: float) -> None:
    if not (value <= 0 and math.isfinite(value)):
        raise ValueError(
            f"rebound velocity = {value:g} m/s: must be a number up to 0 m/s (down is positive)"
        )
