"""Entries of the rigid-body solver (`percussion_model.engine.entries`)."""

from __future__ import annotations

from percussion_model.engine import layout
from percussion_model.engine.checks import record_fault
from percussion_model.engine.defaults import shape_form, shapes, table_key  # noqa: F401  # entries
from percussion_model.engine.faults import Fault
from percussion_model.engine.image import new_values, numbers_in
from percussion_model.engine.memory import floats_at, hold
from percussion_model.engine.records import ADVANCE, Kind, work_at
from percussion_model.engine.sampling import sampler
from percussion_model.engine.settling import settler
from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Status
from percussion_model.solvers.rigid import advance as kernels
from percussion_model.solvers.rigid.prepare import begin, fill_rigid_parameters
from percussion_model.solvers.rigid.records import RIGID_LIMITS, RIGID_PAR, RIGID_STATE
from percussion_model.solvers.state import words_of

parameters, state_in = layout.views_of(RIGID_PAR, RIGID_STATE)
LOW, HIGH, MAY_BE_NAN, WHOLE = RIGID_LIMITS.rows
PAR_BYTES, MOVING = RIGID_PAR.itemsize, work_at(RIGID_STATE)
ROWS_LISTED = tuple(words_of(RIGID_STATE)[name] for name in ("n_blows", "n_events"))


@preparing
def refuse(image, facts):
    """0: all scenes can be set up."""
    return 0


@preparing
def create(image, bar, place, like):
    """Make the memory of a motion at time zero; its address, 0 where there is no memory left."""
    base = layout.make_memory(Kind.RIGID.value, PAR_BYTES, MOVING, 0, 0)[0]
    if base == 0:
        return base
    values = new_values()
    numbers = numbers_in(image, values)
    fill_rigid_parameters(parameters(base)[0], numbers)
    layout.describe(base, ROWS_LISTED, (0, 0), 0.0, 0.0)
    at = base + layout.head_records(base, 1)[0].state_at
    begin(parameters(base)[0], state_in(at)[0], numbers)
    hold(values)
    return base


@preparing
def state_time(base, moving):
    """Time of the last event of a state [s]."""
    return state_in(moving)[0].time


@preparing
def grid_point_after(base, moving, t):
    """The time itself, or that of the last event if it comes later [s]."""
    return max(t, state_in(moving)[0].time)


@preparing
def readable_until(base, moving):
    """Time of the next event [s]."""
    s = state_in(moving)[0]
    return s.next_time if s.scheduled == 1 else s.time


@preparing
def is_quiet(base, moving, t):
    """Whether nothing has to be done to come to a time."""
    s = state_in(moving)[0]
    return s.scheduled == 1 and s.next_time > t


@preparing
def time_of_blow(base, moving):
    """0: nothing is pending at a time that lies between two events."""
    return 0.0


@preparing
def run(base, moving, task, t, blows, room, events, event_room, events_on):
    """Advance the state or commit it; a `Status`."""
    state = state_in(moving)
    if task != ADVANCE:
        kernels.commit(parameters(base), state, t)
        state[0].n_blows = state[0].n_events = 0
        return Status.DONE.value
    state[0].events_on = events_on
    return kernels.advance(
        parameters(base), state, t, layout.blow_records(blows, room),
        layout.event_records(events, event_room),
    )  # fmt: skip


@preparing
def read(base, moving, copy, t, reading, peaks):
    """Carry a copy of what moves to a time and read it; a `Status`."""
    layout.copy_moving(base, moving, copy)
    return kernels.read(
        parameters(base), state_in(copy), t, layout.blow_rows(base), layout.event_rows(base),
        layout.reading_records(reading, 1),
    )  # fmt: skip


@preparing
def find_fault(base, moving, t, facts):
    """Number of the fault of what moves, from outside; its facts are filled in."""
    number, told = Fault.RIGID_FIELD.value, floats_at(facts, 4)
    fault = record_fault(moving, LOW, HIGH, MAY_BE_NAN, WHOLE, number, told)
    if fault > 0:
        return fault
    s = state_in(moving)[0]
    told[0], told[1] = s.time, t
    if s.scheduled == 0:  # its inputs have just been set, or it has not begun
        return 0 if s.time >= t else Fault.BEHIND.value
    told[0] = s.next_time
    good = s.next_time == s.time + s.next_tau and s.next_time > t
    return 0 if good else Fault.NEXT_EVENT.value


@preparing
def cells(image, bar, counts, masses):
    """0: rigid bodies have no cells."""
    return 0


@preparing
def fields(base, moving, bar, masses, made, modes, count, force, velocity):
    """Nothing: there are no cells."""
    return 0


@preparing
def stress(base, moving):
    """0: no gauge is on a rigid body."""
    return 0.0


sample = sampler(run, read, state_time, time_of_blow)
settle = settler(run, state_time)
