"""Chains of bars: a list of all bars as the groups of a scene, and what no chain can be."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from percussion_model.scene.group import Parameters
from percussion_model.scene.rows import SceneError, show_value

if TYPE_CHECKING:
    from percussion_model.scene.scene import Scene


def refuse_joints(scene: Scene) -> None:
    """Raise `SceneError` for numbers of a joint that its kind does not have."""
    for k, rod in enumerate(scene.string.rods):
        for name in sorted(rod._given.difference(rod.telling)):
            if getattr(rod, name) == rod.rows[name].default:
                continue  # as a scene that is written in full has it
            raise SceneError(
                f'string.rods.{k}.{name}: a joint that is "{rod.joint}" has none: omit it'
            )


def chain_as_groups(values: Mapping[str, Any]) -> dict[str, Any]:
    """Bars that were given as one list, as piston, rods and bit; without a piston as the others.

    Raises
    ------
    SceneError
        If they are no list of two bars at least, or a bar is given twice.
    """
    rest = {name: value for name, value in values.items() if name != "bars"}
    bars = values["bars"]
    if not isinstance(bars, (list, tuple)) or not all(isinstance(bar, Mapping) for bar in bars):
        raise SceneError(f"bars = {show_value(bars)}: must be a list of tables, written [[bars]]")
    first = _group_of(rest, "piston").get("model") != "absent"
    least = 2 if first else 1
    if len(bars) < least:
        raise SceneError(f"bars: {len(bars)} given: must be {least} at least, from drive to rock")
    chain = [dict(bar) for bar in bars]
    piston, rods, bit = chain[: int(first)], chain[int(first) : -1], chain[-1]
    if piston and piston[0].pop("joint", "contact") != "contact":
        raise SceneError('bars.0.joint: must be "contact": a piston strikes the bar below it')
    if "joint" in bit:
        raise SceneError(f"bars.{len(bars) - 1}.joint: there is no bar below the last one")
    for name, own in [("piston", piston[0])] if piston else []:
        rest[name] = _joined(rest, name, own)
    rest["bit"] = _joined(rest, "bit", bit)
    if rods:
        rest["string"] = _joined(rest, "string", {"rods": rods})
        rest["effects"] = {"string": True, **_group_of(rest, "effects")}
    return rest


def _group_of(values: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """A group as a table; empty where there is none, or something else."""
    group = values.get(name, {})
    if isinstance(group, Parameters):
        return group.given_values()
    return group if isinstance(group, Mapping) else {}


def _joined(values: Mapping[str, Any], name: str, own: Mapping[str, Any]) -> dict[str, Any]:
    """A group and what a list of bars says of it."""
    group = _group_of(values, name)
    for key in own:
        if key in group:
            raise SceneError(f"bars and {name}.{key} are both given: omit one of them")
    return {**group, **own}
