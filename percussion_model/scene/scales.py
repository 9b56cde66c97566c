"""Intrinsic scales of a scene: its times, lengths and stiffness ratio (docs/model.md, section 11).

Eqs 26 to 33 of the paper, which tell before any run how a scene will behave.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.scene.bars import bar_compliance
from percussion_model.scene.scene import Scene

__all__ = ["Scale", "barrier_shares", "scales"]


class Scale(NamedTuple):
    """A scale: its symbol in the paper, its value, its unit."""

    symbol: str
    value: float
    unit: str


def scales(scene: Scene) -> dict[str, Scale]:
    """Find the scales of a scene; what it has not, as T_3 without a pressure drive, is left out.

    Returns
    -------
    dict of Scale
        By name, SI units.
    """
    piston, bit, rock, drive = scene.piston, scene.bit, scene.rock, scene.drive
    found = {}
    if piston.model != "absent":
        found["piston_transit_time"] = Scale("T_1", piston.transit_time, "s")
        found["piston_length"] = Scale("L_1", piston.length, "m")
    found["bit_transit_time"] = Scale("T_2", bit.transit_time, "s")
    soft = scene.effects.rock in ("bilinear", "spring", "power")
    if soft:
        cycle = math.sqrt(bit.mass / scene.loading_stiffness)
        ratio = scene.loading_stiffness * bar_compliance(bit.numbers)
        found["drilling_cycle_time"] = Scale("T_4", cycle, "s")
        found["stiffness_ratio"] = Scale("eta = K_R L_b/(EA)", ratio, "-")
    energy = drive.force * drive.reversal_distance
    if scene.effects.drive == "pressure" and energy > 0.0:
        flight = math.sqrt(piston.mass * drive.reversal_distance / drive.force)
        found["piston_flight_time"] = Scale("T_3", flight, "s")
        if soft:
            depth = math.sqrt(energy / scene.loading_stiffness)
            found["penetration_scale"] = Scale("L_2", depth, "m")
        if scene.barrier_on:
            share = rock.barrier_energy / energy
            found["barrier_time"] = Scale("T_5", share * piston.mass / rock.barrier_damping, "s")
            found["barrier_share"] = Scale("W_R/(F_0 D_1)", share, "-")
    return dict(sorted(found.items(), key=lambda item: item[1].symbol))


def barrier_shares(scene: Scene) -> tuple[float, float]:
    """Time of the barrier by that of a drilling cycle, T_5/T_4, and its energy by F_0 D_1.

    Eq. 30 of the paper wants both far below 1. Zero where there is no barrier or no blow.
    """
    found = scales(scene)
    if "barrier_time" not in found:
        return 0.0, 0.0
    time_share = found["barrier_time"].value / found["drilling_cycle_time"].value
    return time_share, found["barrier_share"].value
