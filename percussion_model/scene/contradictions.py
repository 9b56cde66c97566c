"""Parameters that contradict each other: what is said, and when, in numbers.

Kernels call `find_contradiction` as well: a library without Python refuses the same scenes.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any

from percussion_model.scene.parameters import row_of


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
    ACCURACY_AND_CELLS = 11
    ACCURACY_OF_ELEMENTS = 12
    ACCURACY_WITHOUT_PISTON = 13
    ACCURACY_WITHOUT_LOSS = 14
    ACCURACY_WITHOUT_LOSS_TIME = 15
    BARRIER = 16
    SETTLE = 17
    BREAKING_WITHOUT_HOLE = 18
    BREAKING_WITHOUT_BUTTONS = 19
    ROTATION_WITHOUT_RADIUS = 20
    ROTATION_AND_CUTTINGS = 21
    CASING_AND_DAMPER = 22
    MOTOR = 23
    STRING_WITHOUT_INERTIA = 24


_OF_STRING = (
    " computes piston and bit alone, but the scene has rods (effects.string): set solver.name to "
    "auto or wave, and solver.fidelity to wave"
)
_OF_RATE = "solver.accuracy = {solver.accuracy!r} is that of the rate of penetration, which "
_FINER = (
    "(docs/data/undamped.md): omit it and set solver.cells, or set effects.loss = true with "
    "loss.time above 0 s"
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
        "string.rods are given, but effects.string = false: set effects.string = true, or omit them"
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
    Rule.ACCURACY_AND_CELLS: (
        "solver.accuracy = {solver.accuracy!r} and solver.cells = {solver.cells!r} both choose "
        "the resolution: give one of them"
    ),
    Rule.ACCURACY_OF_ELEMENTS: (
        "solver.accuracy = {solver.accuracy!r} picks the cells of waves, no finite elements: set "
        "fem.elements, fem.courant and fem.contact_stiffness, or solver.name = "
        '"wave" or "auto"'
    ),
    Rule.ACCURACY_WITHOUT_PISTON: _OF_RATE
    + (
        'a bit alone (piston.model = "absent") does not have: omit it and '
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
    Rule.BREAKING_WITHOUT_HOLE: (
        "effects.breaking = true needs hole_diameter, the diameter of the hole: give it, or a bit "
        "(--bit), or set effects.breaking = false"
    ),
    Rule.BREAKING_WITHOUT_BUTTONS: (
        "effects.breaking = true needs breaking.buttons, the number of the bit's buttons: give it, "
        "or a bit (--bit), or set effects.breaking = false"
    ),
    Rule.ROTATION_WITHOUT_RADIUS: (
        "effects.rotation = true needs rotation.mean_radius, on which the bit's buttons are: give "
        "it, or a bit (--bit), or set effects.rotation = false"
    ),
    Rule.ROTATION_AND_CUTTINGS: (
        "effects.rotation and effects.cuttings both say what is left of craters: set one of them "
        "to false, or rotation.renewal_length = 0"
    ),
    Rule.CASING_AND_DAMPER: (
        'feed.on = "casing" and effects.damper = true both have a casing: set feed.on = "bit", '
        "which damper and feed then push, or effects.damper = false"
    ),
    Rule.MOTOR: (
        "rotation.full_torque = {rotation.full_torque!r} N m: must be at most "
        "rotation.stall_torque = {rotation.stall_torque!r} N m"
    ),
    Rule.STRING_WITHOUT_INERTIA: (
        "rotation.string_stiffness = {rotation.string_stiffness!r} N m/rad needs rotation.inertia, "
        "the moment of inertia that it turns: give it, or set rotation.string_stiffness = 0"
    ),
    Rule.SETTLE: ("run.settle = {run.settle!r} s: must be below run.duration = {run.duration!r} s"),
}


class Bodies(IntEnum):
    """Bodies that the named solver computes."""

    BOTH = 0
    ELASTIC = 1
    RIGID = 2


def _place(key: str, word: str) -> int:
    return list(row_of(key).choices).index(word)


ELASTIC, RIGID = _place("bit.model", "elastic"), _place("bit.model", "rigid")
PISTON_ELASTIC, PISTON_ABSENT = (_place("piston.model", word) for word in ("elastic", "absent"))
NO_DRIVE = _place("effects.drive", "none")
ON_CASING = _place("feed.on", "casing")
BILINEAR, POWER = (_place("effects.rock", word) for word in ("bilinear", "power"))
AUTO, FEM, WAVE = (_place("solver.name", word) for word in ("auto", "fem", "wave"))
BY_WAVES = _place("solver.fidelity", "wave")


def find_contradiction(v: Any, bodies: int, has_rods: bool, is_barrier_given: bool) -> Rule:
    """Find the first contradiction of a scene.

    Parameters
    ----------
    v : Values, or SCENE_NUMBERS record
    bodies : int
        `Bodies` of the solver that is named.
    has_rods : bool
        Whether there are rods.
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
    if found == Rule.NOTHING and v.solver_fidelity != BY_WAVES and v.solver_name != AUTO:
        found = Rule.FIDELITY_AND_NAME
    if found == Rule.NOTHING:
        found = _in_accuracy(v)
    if found != Rule.NOTHING:
        return found
    is_crushed = v.effects_rock == BILINEAR or v.effects_rock == POWER
    if v.effects_barrier and not is_crushed and is_barrier_given:
        return Rule.BARRIER
    if is_crushed:
        found = _in_breaking(v)
    has_casing = v.effects_damper and v.effects_string
    if has_casing and v.effects_feed and v.feed_on == ON_CASING:
        found = Rule.CASING_AND_DAMPER
    if found != Rule.NOTHING:
        return found
    return Rule.SETTLE if v.run_settle >= v.run_duration else Rule.NOTHING


def _in_string(v: Any, has_rods: bool) -> Rule:
    """A drill string that nothing computes, or that is none."""
    if not v.effects_string:
        return Rule.RODS_UNUSED if has_rods else Rule.NOTHING
    if not has_rods:
        return Rule.NO_RODS
    if v.bit_model == RIGID:
        return Rule.RIGID_BIT_OF_STRING
    if v.solver_fidelity != BY_WAVES:
        return Rule.FIDELITY_OF_STRING
    if v.solver_name != AUTO and v.solver_name != WAVE:
        return Rule.SOLVER_OF_STRING
    return Rule.NOTHING


def _in_breaking(v: Any) -> Rule:
    """What breaking and rotation need, or that goes with neither."""
    if v.effects_breaking:
        if not v.hole_diameter > 0.0:
            return Rule.BREAKING_WITHOUT_HOLE
        if not v.breaking_buttons > 0.0:
            return Rule.BREAKING_WITHOUT_BUTTONS
    if v.effects_rotation:
        if not v.rotation_mean_radius > 0.0:
            return Rule.ROTATION_WITHOUT_RADIUS
        if v.effects_cuttings and v.rotation_renewal_length > 0.0:
            return Rule.ROTATION_AND_CUTTINGS
        if v.rotation_stall_torque > 0.0 and v.rotation_full_torque > v.rotation_stall_torque:
            return Rule.MOTOR
        if v.rotation_string_stiffness > 0.0 and v.rotation_inertia == 0.0:
            return Rule.STRING_WITHOUT_INERTIA
    return Rule.NOTHING


def _in_accuracy(v: Any) -> Rule:
    """An accuracy that is said in two ways, that no rule picks a mesh for, or of no rate."""
    if math.isnan(v.solver_accuracy):
        return Rule.NOTHING
    if not math.isnan(v.solver_cells):
        return Rule.ACCURACY_AND_CELLS
    if v.solver_name == FEM:
        return Rule.ACCURACY_OF_ELEMENTS
    if v.piston_model == PISTON_ABSENT:
        return Rule.ACCURACY_WITHOUT_PISTON
    # rigid bodies have no waves, that lose or lose not
    if v.bit_model == ELASTIC and v.solver_fidelity == BY_WAVES:
        if not v.effects_loss:
            return Rule.ACCURACY_WITHOUT_LOSS
        if not v.loss_time > 0.0:
            return Rule.ACCURACY_WITHOUT_LOSS_TIME
    return Rule.NOTHING
