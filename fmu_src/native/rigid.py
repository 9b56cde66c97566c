"""Motions of rigid bodies in plain memory."""

from __future__ import annotations

from fmu_src.native.checks import record_fault
from fmu_src.native.layout import (
    ADVANCE,
    BLOW_ROOM,
    Kind,
    blow_rows,
    event_rows,
    head_records,
    make_memory,
    views_of,
    work_at,
)
from fmu_src.native.messages import Fault
from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Status
from percussion_model.solvers.rigid import advance as kernels
from percussion_model.solvers.rigid.prepare import begin, fill_rigid_parameters
from percussion_model.solvers.rigid.records import RIGID_LIMITS, RIGID_PAR, RIGID_STATE

parameters, state_in = views_of(RIGID_PAR, RIGID_STATE)
LOW, HIGH, MAY_BE_NAN, WHOLE = RIGID_LIMITS.rows
PAR_BYTES, MOVING = RIGID_PAR.itemsize, work_at(RIGID_STATE)


@preparing
def create(numbers):
    """Make the memory of a motion at time zero; its address, 0 where there is no memory left."""
    base = make_memory(Kind.RIGID.value, PAR_BYTES, MOVING, 0, 0)[0]
    if base == 0:
        return base
    fill_rigid_parameters(parameters(base)[0], numbers)
    at = base + head_records(base, 1)[0].state_at
    begin(parameters(base)[0], state_in(at)[0], numbers)
    return base


@preparing
def state_time(moving):
    """Time of the last event of a state [s]."""
    return state_in(moving)[0].time


@preparing
def is_quiet(base, t):
    """Whether nothing has to be done to come to a time."""
    s = state_in(base + head_records(base, 1)[0].state_at)[0]
    return s.scheduled == 1 and s.next_time > t


@preparing
def go(base, task, t, room):
    """Advance the state or commit it, with room for so many blows; status and blows."""
    state = state_in(base + head_records(base, 1)[0].state_at)
    if task != ADVANCE:
        kernels.commit(parameters(base), state, t)
        return Status.DONE.value, 0
    state[0].events_on = 0
    status = kernels.advance(parameters(base), state, t, blow_rows(base, room), event_rows(base))
    return status, state[0].n_blows


@preparing
def read(base, moving, t, reading):
    """Carry a copy of what moves to a time and read it."""
    blows, events = blow_rows(base, BLOW_ROOM), event_rows(base)
    kernels.read(parameters(base), state_in(moving), t, blows, events, reading)


@preparing
def find_fault(moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    number = Fault.RIGID_FIELD.value
    fault = record_fault(moving, LOW, HIGH, MAY_BE_NAN, WHOLE, number, facts)
    if fault > 0:
        return fault
    s = state_in(moving)[0]
    facts[0], facts[1] = s.time, t
    if s.scheduled == 0:  # its inputs have just been set, or it has not begun
        return 0 if s.time >= t else Fault.BEHIND.value
    facts[0] = s.next_time
    good = s.next_time == s.time + s.next_tau and s.next_time > t
    return 0 if good else Fault.NEXT_EVENT.value
