"""Motions by a blow map in plain memory; the map stays where the shell has it."""

from __future__ import annotations

import math

import numpy as np
from numba import carray

from fmu_src.native.checks import record_fault
from fmu_src.native.layout import (
    ADVANCE,
    Kind,
    blow_rows,
    directory,
    event_rows,
    head_records,
    make_memory,
    views_of,
    work_at,
)
from fmu_src.native.memory import (
    float_pointer,
    floats_1,
    floats_at,
    put_tables,
    table_bytes,
    viewing,
)
from fmu_src.native.messages import Fault
from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Status
from percussion_model.scene.bars import bar_mass
from percussion_model.scene.inputs import INPUTS
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.blow_map import advance as kernels
from percussion_model.solvers.blow_map import flight
from percussion_model.solvers.blow_map.prepare import (
    begin,
    fill_map_parameters,
    first_value,
    scene_fault,
    shape_of,
    stands_on_rock,
    words_fault,
)
from percussion_model.solvers.blow_map.records import (
    ENTRIES,
    MAP_LIMITS,
    MAP_PAR,
    MAP_STATE,
    Axis,
    Refusal,
)
from percussion_model.solvers.blow_map.words import FIXED_INPUTS, FLIGHT_INPUTS, WordFault

parameters, state_in = views_of(MAP_PAR, MAP_STATE)
LOW, HIGH, MAY_BE_NAN, WHOLE = MAP_LIMITS.rows
PAR_BYTES, MOVING = MAP_PAR.itemsize, work_at(MAP_STATE)
FOUND = 0  # row of the directory: room for what is looked up
# Inputs that the flight follows, and those that are fixed in a map.
FOLLOWED = sum(1 << k for k, name in enumerate(INPUTS) if name in FLIGHT_INPUTS)
KEPT = sum(1 << k for k, name in enumerate(INPUTS) if name in FIXED_INPUTS)
AXIS_OF = tuple(
    {Refusal.STIFFNESS: int(Axis.STIFFNESS), Refusal.VELOCITY: int(Axis.VELOCITY),
     Refusal.FEED: int(Axis.LOAD), Refusal.DRIVE: int(Axis.DRIVE)}.get(one, -1)
    for one in Refusal
)  # fmt: skip


@viewing
def values_of(base):
    """Values of the map, by its axes and entries."""
    address = head_records(base, 1)[0].table_address
    words = floats_at(address, 1 << 30)
    a, b, c, d, _ = shape_of(words)
    return carray(float_pointer(address + 8 * first_value(words)), (a, b, c, d, ENTRIES))


@preparing
def refuse(numbers, facts):
    """Number of why a scene cannot be set up, 0 for none: the bit must stand on the rock."""
    if stands_on_rock(numbers):
        return 0
    facts[0], facts[1] = numbers.values.start_rock_gap, numbers.values.start_bit_velocity
    return Fault.NO_STAND.value


@preparing
def refuse_map(numbers, table, size, facts):
    """Number of why a map is none for a scene, 0 for none.

    Parameters
    ----------
    table, size : int
        Address and length of the map as a row of numbers.
    """
    if size == 0:
        return Fault.NO_MAP.value
    words, values = floats_at(table, size), numbers.values
    gravity = values.gravity_acceleration if values.effects_gravity else 0.0
    if words_fault(words, bar_mass(numbers.bit) * gravity) != WordFault.NONE:
        return Fault.BAD_MAP.value
    fault, place = scene_fault(words, numbers)
    facts[0] = place
    if fault == WordFault.NONE:
        return 0
    if fault == WordFault.SECTIONS:
        return Fault.MAP_SECTIONS.value
    return Fault.MAP_SECTION.value if fault == WordFault.SECTION else Fault.MAP_FIXED.value


@preparing
def create(numbers, table):
    """Make the memory of a motion at time zero; its address, 0 where there is no memory left."""
    arrays = (np.zeros(ENTRIES), np.zeros(0))
    base, room_at, _ = make_memory(Kind.MAP.value, PAR_BYTES, MOVING, table_bytes(arrays), 0)
    if base == 0:
        return base
    put_tables(base, directory(base), FOUND, room_at, arrays)
    head_records(base, 1)[0].table_address = table
    words = floats_at(table, 1 << 30)
    fill_map_parameters(parameters(base)[0], numbers, words)
    at = base + head_records(base, 1)[0].state_at
    begin(parameters(base)[0], state_in(at)[0], numbers)
    return base


@preparing
def state_time(moving):
    """Start of the present piece of flight [s]."""
    return state_in(moving)[0].t


@preparing
def is_quiet(base, t):
    """Whether nothing has to be done to come to a time."""
    return state_in(base + head_records(base, 1)[0].state_at)[0].t_next > t


@preparing
def go(base, task, t, room):
    """Advance the state or commit it, with room for so many blows; status and blows."""
    state = state_in(base + head_records(base, 1)[0].state_at)
    if task != ADVANCE:
        flight.commit(parameters(base), state, t)
        return Status.DONE.value, 0
    state[0].events_on = 0
    found = floats_1(base, directory(base), FOUND)
    status = kernels.advance(
        parameters(base), state, values_of(base), found, t, blow_rows(base, room), event_rows(base)
    )
    return status, state[0].n_blows


@preparing
def refuse_inputs(acting, wanted, facts):
    """Number of why inputs cannot change, 0 for none: what the map is made for stays."""
    for k in range(len(wanted)):
        if KEPT & (1 << k) and wanted[k] != acting[k]:
            facts[0], facts[1], facts[2] = wanted[k], acting[k], k + 1.0
            return Fault.MAP_INPUT.value
    return 0


@preparing
def take_inputs(base, changed):
    """Let the flight follow inputs that have changed, by their bits."""
    if changed & FOLLOWED:
        flight.plan_next(parameters(base), state_in(base + head_records(base, 1)[0].state_at))


@preparing
def read(base, moving, t, reading):
    """Read a copy of what moves at a time."""
    flight.read(parameters(base), state_in(moving), t, reading)


@preparing
def explain(base, facts):
    """Number of why the map did not answer; its facts are filled in."""
    s, p = state_in(base + head_records(base, 1)[0].state_at)[0], parameters(base)[0]
    facts[0], reason = s.refused_value, s.refusal
    axis = AXIS_OF[reason]
    if axis >= 0:
        facts[1], facts[2] = p.lowest[axis], p.highest[axis]
        facts[3] = 1.0 if facts[0] < facts[1] else 2.0
    elif reason == Refusal.MOVING:
        facts[0], facts[1], facts[2] = 1e3 * s.refused_value, s.feed, 1e3 * s.rest
        if not s.rest < math.inf:
            return Fault.MAP_NEVER_RESTS.value
    return Fault.MAP_REFUSAL.value + reason - 1


@preparing
def find_fault(moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    number = Fault.MAP_FIELD.value
    fault = record_fault(moving, LOW, HIGH, MAY_BE_NAN, WHOLE, number, facts)
    if fault > 0:
        return fault
    facts[0], facts[1] = state_in(moving)[0].t_next, t
    return 0 if facts[0] > t else Fault.NEXT_EVENT.value
