"""Parameters that contradict each other: what is said, and when, in numbers.

Kernels call `find_contradiction` as well: a library without Python refuses the same scenes.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any

from percussion_model.physics.effects import EFFECTS
from percussion_model.scene.parameters import find_row


class Rule(IntEnum):
    """What contradicts what; 0: nothing."""

    NOTHING = 0
    NO_PISTON = 1
    RIGID_BIT = 2
    NEEDS_ELASTIC = 3
    NEEDS_RIGID = 4
    RODS_UNUSED = 5
    NO_RODS = 6
    RIGID_BIT_OF_STRING = 7
    SOLVER_OF_STRING = 8
    FIDELITY_OF_STRING = 9
    FIDELITY_AND_NAME = 10
    MAPPED_DRIVE = 11
    MAPPED_ROCK = 12
    MAPPED_BIT = 13
    MAPPED_EFFECT = 14
    RANGE_OF_VELOCITY = 15
    RANGE_OF_FEED = 16
    RANGE_OF_FORCE = 17
    RANGE_OF_STIFFNESS = 18
    ACCURACY_AND_CELLS = 19
    ACCURACY_OF_ELEMENTS = 20
    ACCURACY_OF_MAP = 21
    ACCURACY_WITHOUT_PISTON = 22
    ACCURACY_WITHOUT_LOSS = 23
    ACCURACY_WITHOUT_LOSS_TIME = 24
    BARRIER = 25
    SETTLE = 26
    MODES_OF_POWER = 27
    MODES_OF_CUTTINGS = 28
    MAPPED_CUTTINGS = 29


_OF_STRING = (
    " computes piston and bit alone, but the scene has rods (effects.string): set solver.name to "
    "auto or chain, and solver.fidelity to wave"
)
_OF_RATE = "solver.accuracy = {solver.accuracy!r} is that of the rate of penetration, which "
_FINER = (
    "(docs/undamped.md): leave it out and set solver.cells, or set effects.loss = true with "
    "loss.time above 0 s"
)


def _range(name: str) -> str:
    return (
        f"blow_map.{name}_from = {{blow_map.{name}_from!r}}: must be below blow_map.{name}_to = "
        f"{{blow_map.{name}_to!r}}"
    )


# Places stand for values of the scene.
TEXTS = {
    Rule.NO_PISTON: (
        'effects.drive = "{effects.drive}" needs a piston, but piston.model = "absent": '
        'set effects.drive = "none" or give a piston'
    ),
    Rule.RIGID_BIT: (
        'piston.model = "elastic" with bit.model = "rigid": no solver computes this; '
        'set bit.model = "elastic" or piston.model = "rigid"'
    ),
    Rule.NEEDS_ELASTIC: (
        'solver.name = "{solver.name}" needs bit.model = "elastic": '
        'set that, or solver.name = "rigid" or "auto"'
    ),
    Rule.NEEDS_RIGID: (
        'solver.name = "{solver.name}" computes no elastic bars: set piston.model = "rigid" and '
        'bit.model = "rigid", or another solver.name, as "auto"'
    ),
    Rule.RODS_UNUSED: (
        "string.rods are given, but effects.string = false: set effects.string = true, or "
        "leave them out"
    ),
    Rule.NO_RODS: "effects.string = true needs string.rods, or [[bars]] from drive to rock",
    Rule.RIGID_BIT_OF_STRING: (
        'effects.string = true needs bit.model = "elastic": waves run in rods'
    ),
    Rule.SOLVER_OF_STRING: '"{solver.name}"' + _OF_STRING,
    Rule.FIDELITY_OF_STRING: '"{solver.fidelity}"' + _OF_STRING,
    Rule.FIDELITY_AND_NAME: (
        'solver.fidelity = "{solver.fidelity}" and solver.name = "{solver.name}": a name '
        'says how elastic waves are computed; leave it "auto"'
    ),
    Rule.MAPPED_DRIVE: (
        'solver.fidelity = "blow-map" needs effects.drive = "pressure", not "{effects.drive}"'
    ),
    Rule.MAPPED_ROCK: (
        'solver.fidelity = "blow-map" needs effects.rock = "bilinear", not "{effects.rock}"'
    ),
    Rule.MAPPED_BIT: (
        'solver.fidelity = "blow-map" needs bit.model = "elastic", not "{bit.model}"'
    ),
    Rule.MAPPED_EFFECT: (
        'solver.fidelity = "blow-map" knows none of the effects '
        f"{', '.join(f'effects.{effect.name}' for effect in EFFECTS)}: set them to false"
    ),
    Rule.RANGE_OF_VELOCITY: _range("velocity"),
    Rule.RANGE_OF_FEED: _range("feed"),
    Rule.RANGE_OF_FORCE: _range("force"),
    Rule.RANGE_OF_STIFFNESS: _range("stiffness"),
    Rule.ACCURACY_AND_CELLS: (
        "solver.accuracy = {solver.accuracy!r} and solver.cells = {solver.cells!r} both choose "
        "the resolution: give one of them"
    ),
    Rule.ACCURACY_OF_ELEMENTS: (
        "solver.accuracy = {solver.accuracy!r} picks the cells of waves, no finite elements: set "
        "fem.elements, fem.courant and fem.contact_stiffness, or solver.name = "
        '"wave" or "auto"'
    ),
    Rule.ACCURACY_OF_MAP: (
        "solver.accuracy = {solver.accuracy!r}: a blow map is as accurate as its table "
        '(docs/fidelity.md); set blow_map.density, or solver.fidelity = "wave"'
    ),
    Rule.ACCURACY_WITHOUT_PISTON: _OF_RATE
    + (
        'a bit alone (piston.model = "absent") does not have: leave it out and '
        "set solver.cells, or give a piston"
    ),
    Rule.ACCURACY_WITHOUT_LOSS: _OF_RATE
    + f"has no limit with finer cells where effects.loss = false {_FINER}",
    Rule.ACCURACY_WITHOUT_LOSS_TIME: _OF_RATE
    + f"has no limit with finer cells where loss.time = 0.0 s {_FINER}",
    Rule.BARRIER: (
        'effects.barrier = true needs effects.rock = "bilinear" or "power", not "{effects.rock}": '
        "set effects.barrier = false"
    ),
    Rule.MODES_OF_POWER: (
        'solver.name = "modal" with effects.rock = "power": bars have modes on a rock of one '
        'stiffness; set solver.name = "wave" or "auto"'
    ),
    Rule.MODES_OF_CUTTINGS: (
        'solver.name = "modal" with effects.cuttings = true: set solver.name = "wave" or "auto", '
        "which follow them"
    ),
    Rule.MAPPED_CUTTINGS: (
        'solver.fidelity = "blow-map" knows no cuttings in the crater: set effects.cuttings = false'
    ),
    Rule.SETTLE: ("run.settle = {run.settle!r} s: must be below run.duration = {run.duration!r} s"),
}


class Bodies(IntEnum):
    """Bodies that the named solver computes."""

    BOTH = 0
    ELASTIC = 1
    RIGID = 2


def _place(key: str, word: str) -> int:
    row = find_row(key)
    assert row is not None
    return list(row.choices).index(word)


ELASTIC, RIGID = _place("bit.model", "elastic"), _place("bit.model", "rigid")
PISTON_ELASTIC, PISTON_ABSENT = (_place("piston.model", word) for word in ("elastic", "absent"))
NO_DRIVE, PRESSURE = (_place("effects.drive", word) for word in ("none", "pressure"))
BILINEAR, POWER = (_place("effects.rock", word) for word in ("bilinear", "power"))
AUTO, FEM, CHAIN, MODAL = (
    _place("solver.name", word) for word in ("auto", "fem", "chain", "modal")
)
WAVE, BLOW_MAP = (_place("solver.fidelity", word) for word in ("wave", "blow-map"))


def find_contradiction(
    v: Any, bodies: int, has_rods: bool, has_effects: bool, is_barrier_given: bool
) -> Rule:
    """Find the first contradiction of a scene.

    Parameters
    ----------
    v : Values, or SCENE_NUMBERS record
    bodies : int
        `Bodies` of the solver that is named.
    has_rods, has_effects : bool
        Whether there are rods, and effects that hold a force.
    is_barrier_given : bool
        Whether it was asked for, not left to its default.
    """
    if v.piston_model == PISTON_ABSENT and v.effects_drive != NO_DRIVE:
        return Rule.NO_PISTON
    if v.piston_model == PISTON_ELASTIC and v.bit_model == RIGID:
        return Rule.RIGID_BIT
    if bodies == Bodies.ELASTIC and v.bit_model == RIGID:
        return Rule.NEEDS_ELASTIC
    if bodies == Bodies.RIGID and v.bit_model == ELASTIC:
        return Rule.NEEDS_RIGID
    found = _in_string(v, has_rods)
    if found == Rule.NOTHING:
        found = _in_fidelity(v, has_effects)
    if found == Rule.NOTHING:
        found = _in_accuracy(v)
    if found != Rule.NOTHING:
        return found
    is_crushed = v.effects_rock == BILINEAR or v.effects_rock == POWER
    if v.effects_barrier and not is_crushed and is_barrier_given:
        return Rule.BARRIER
    if v.effects_rock == POWER and v.solver_name == MODAL:
        return Rule.MODES_OF_POWER
    if v.effects_cuttings and v.effects_rock == BILINEAR and v.solver_name == MODAL:
        return Rule.MODES_OF_CUTTINGS
    return Rule.SETTLE if v.run_settle >= v.run_duration else Rule.NOTHING


def _in_string(v: Any, has_rods: bool) -> Rule:
    """A drill string that nothing computes, or that is none."""
    if not v.effects_string:
        return Rule.RODS_UNUSED if has_rods else Rule.NOTHING
    if not has_rods:
        return Rule.NO_RODS
    if v.bit_model == RIGID:
        return Rule.RIGID_BIT_OF_STRING
    if v.solver_fidelity != WAVE:
        return Rule.FIDELITY_OF_STRING
    if v.solver_name != AUTO and v.solver_name != CHAIN:
        return Rule.SOLVER_OF_STRING
    return Rule.NOTHING


def _in_fidelity(v: Any, has_effects: bool) -> Rule:
    """A fidelity that a scene cannot have, or ranges of the blow map that do not rise."""
    if v.solver_fidelity == WAVE:
        return Rule.NOTHING
    if v.solver_name != AUTO:
        return Rule.FIDELITY_AND_NAME
    if v.solver_fidelity != BLOW_MAP:
        return Rule.NOTHING
    if v.effects_drive != PRESSURE:
        return Rule.MAPPED_DRIVE
    if v.effects_rock != BILINEAR:
        return Rule.MAPPED_ROCK
    if v.effects_cuttings:
        return Rule.MAPPED_CUTTINGS
    if v.bit_model != ELASTIC:
        return Rule.MAPPED_BIT
    if has_effects:
        return Rule.MAPPED_EFFECT
    if not v.blow_map_velocity_from < v.blow_map_velocity_to:
        return Rule.RANGE_OF_VELOCITY
    if not v.blow_map_feed_from < v.blow_map_feed_to:
        return Rule.RANGE_OF_FEED
    if not v.blow_map_force_from < v.blow_map_force_to:
        return Rule.RANGE_OF_FORCE
    if not v.blow_map_stiffness_from < v.blow_map_stiffness_to:
        return Rule.RANGE_OF_STIFFNESS
    return Rule.NOTHING


def _in_accuracy(v: Any) -> Rule:
    """An accuracy that is said in two ways, that no rule picks a mesh for, or of no rate."""
    if math.isnan(v.solver_accuracy):
        return Rule.NOTHING
    if not math.isnan(v.solver_cells):
        return Rule.ACCURACY_AND_CELLS
    if v.solver_name == FEM:
        return Rule.ACCURACY_OF_ELEMENTS
    if v.solver_fidelity == BLOW_MAP and v.bit_model == ELASTIC:
        return Rule.ACCURACY_OF_MAP
    if v.piston_model == PISTON_ABSENT:
        return Rule.ACCURACY_WITHOUT_PISTON
    # rigid bodies have no waves, that lose or lose not
    if v.bit_model == ELASTIC and v.solver_fidelity == WAVE:
        if not v.effects_loss:
            return Rule.ACCURACY_WITHOUT_LOSS
        if not v.loss_time > 0.0:
            return Rule.ACCURACY_WITHOUT_LOSS_TIME
    return Rule.NOTHING
