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

# Texts of these refusals, without their numbers.
RANGE = "{name} = {value} {unit}: the blow map covers {low} to {high} {unit}; {key} widens it"
MOVING = (
    "the piston strikes {flight} ms after the last blow, but at feed.force = {feed} N the bit "
    "stands still {until}: the blow map holds for a bit at rest alone; take "
    "solver.fidelity = 'wave'"
)
TURNED = (
    "drive.reversal_distance = {reversal} m: the drive turns before the last contact of the blow "
    "has opened, which the blow map does not know; take solver.fidelity = 'wave'"
)
FALLEN = (
    "drive.force = {force} N: the piston falls back on the bit before drive.reversal_distance, "
    "which the blow map does not know and no range of it changes; take solver.fidelity = 'wave'"
)


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
    return RANGE.format(
        name=name, value=f"{value:.6g}", unit=unit, low=f"{low:.6g}", high=f"{high:.6g}", key=key
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
        return MOVING.format(
            flight=f"{1e3 * value:.3g}", feed=f"{float(s['feed']):.6g}", until=until
        )
    if reason == Refusal.TURNED:
        return TURNED.format(reversal=f"{value:.6g}")
    return FALLEN.format(force=f"{value:.6g}")
