"""Messages of a blow map that does not answer."""

from __future__ import annotations

from typing import Any

import numpy as np

from percussion_model.scene.scene import Scene
from percussion_model.solvers.blow_map.records import Axis, Refusal
from percussion_model.solvers.blow_map.table import BlowTable, Nodes

_NAMES = {
    Refusal.STIFFNESS: (Axis.STIFFNESS, "rock.loading_stiffness", "N/m"),
    Refusal.VELOCITY: (Axis.VELOCITY, "the impact velocity", "m/s"),
    Refusal.FEED: (Axis.LOAD, "feed.force", "N"),
    Refusal.DRIVE: (Axis.DRIVE, "drive.force", "N"),
}
# Names of their ranges among the parameters of the map.
_RANGES = {
    Refusal.STIFFNESS: "stiffness",
    Refusal.VELOCITY: "velocity",
    Refusal.FEED: "feed",
    Refusal.DRIVE: "force",
}


def notes_outside(scene: Scene) -> list[str]:
    """Say which parameters of a scene lie outside the ranges of its blow map."""
    nodes = Nodes.of(scene)
    found = []
    for reason, (axis, name, _) in _NAMES.items():
        if reason != Refusal.VELOCITY:  # which the run finds
            value = float(scene[name])
            if not nodes.lowest[axis] <= value <= nodes.highest[axis]:
                found.append(_range_note(reason, value, nodes))
    return found


def _range_note(reason: Refusal, value: float, nodes: Nodes) -> str:
    axis, name, unit = _NAMES[reason]
    low, high = nodes.lowest[axis], nodes.highest[axis]
    key = f"blow_map.{_RANGES[reason]}_{'from' if value < low else 'to'}"
    return (
        f"{name} = {value:.6g} {unit}: the blow map covers {low:.6g} to {high:.6g} {unit}; "
        f"{key} widens it"
    )


def explain_refusal(table: BlowTable, s: Any) -> str:
    """Say why a blow map did not answer.

    Parameters
    ----------
    table : BlowTable
    s : record
        State, of MAP_STATE.
    """
    reason, value = Refusal(int(s["refusal"])), float(s["refused_value"])
    if reason in _NAMES:
        return _range_note(reason, value, table.nodes)
    if reason == Refusal.MOVING:
        rest = float(s["rest"])
        until = f"after {1e3 * rest:.3g} ms" if np.isfinite(rest) else "in no time of the table"
        return (
            f"the piston strikes {1e3 * value:.3g} ms after the last blow, but at "
            f"feed.force = {float(s['feed']):.6g} N the bit stands still {until}: "
            "the blow map holds for a bit at rest alone; take solver.fidelity = 'wave'"
        )
    if reason == Refusal.TURNED:
        return (
            f"drive.reversal_distance = {value:.6g} m: the drive turns before the last "
            "contact of the blow has opened, which the blow map does not know; "
            "take solver.fidelity = 'wave'"
        )
    return (
        f"drive.force = {value:.6g} N: the piston falls back on the bit before "
        "drive.reversal_distance, which the blow map does not know and no range of it changes; "
        "take solver.fidelity = 'wave'"
    )
