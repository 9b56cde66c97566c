"""Loop of the rigid-body solver: from event to event, in closed form (docs/model.md, section 9)."""

from __future__ import annotations

from percussion_model.physics.kernel import kernel
from percussion_model.physics.loads import hold_components
from percussion_model.physics.readings import fill_ledger, fill_motion
from percussion_model.physics.records import Status
from percussion_model.physics.rock import recoverable
from percussion_model.solvers.rigid.events import process_event
from percussion_model.solvers.rigid.forces import (
    acceleration,
    bit_force,
    contact_force,
    is_finite,
    kinetic_energy,
    mark_standstill,
)
from percussion_model.solvers.rigid.move import move
from percussion_model.solvers.rigid.records import ROWS_AN_EVENT, Next
from percussion_model.solvers.rigid.schedule import schedule


@kernel
def count_event(par, s):
    """Zeno guard: count an event; too many within a window are a storm."""
    s.last_event = s.time
    if s.time - s.window_from > par.window:
        s.window_from = s.time
        s.window_events = 0
    s.window_events += 1
    if s.window_events == par.most_events:
        s.count_storms += 1


@kernel
def advance(par_, state, t, blows, events):
    """Process all events up to time t.

    The state comes to rest at the last of them, so that it does not depend on how an
    interval is divided into calls.

    Parameters
    ----------
    par_, state : RIGID_PAR, RIGID_STATE arrays of length 1
    t : float
        Time [s].
    blows, events : BLOW, EVENT arrays
        Filled from index 0; the state says how far. Events needs room for ROWS_AN_EVENT
        rows at least, where they are listed.

    Returns
    -------
    status : int
        A `Status`. After BLOWS_FULL or EVENTS_FULL a further call goes on as if there
        had been no interruption.
    """
    par = par_[0]
    s = state[0]
    s.n_blows = 0
    s.n_events = 0
    while True:
        if s.scheduled == 0:
            schedule(par, s)
        if not s.next_time <= t or s.next_kind == Next.NOTHING:
            return Status.DONE
        if s.live == 1:
            if s.n_blows >= blows.shape[0]:
                return Status.BLOWS_FULL
            if s.events_on == 1 and s.n_events + ROWS_AN_EVENT > events.shape[0]:
                return Status.EVENTS_FULL
        if s.next_tau > 0.0:
            move(par, s, s.next_tau)
            s.time = s.next_time
            s.standing_events = 0
        else:
            s.standing_events += 1
        if s.next_kind != Next.HOLD and s.next_kind != Next.LINE:
            count_event(par, s)
        process_event(par, s, blows, events)
        s.scheduled = 0
        if not is_finite(s):
            return Status.NOT_FINITE


@kernel
def commit(par_, state, t):
    """Carry the state itself to time t, before its next event, so that inputs may change."""
    par = par_[0]
    s = state[0]
    if t > s.time:
        hold_components(par, s, t - s.time)
        move(par, s, t - s.time)
        s.time = t
        s.standing_events = 0
    mark_standstill(s)
    s.scheduled = 0


@kernel
def read(par_, state, t, blows, events, reading):
    """Carry a state to time t and tell what it is like; spoils it, so give a copy.

    Parameters
    ----------
    blows, events : BLOW, EVENT arrays
        Not filled.
    reading : READING array of length 1

    Returns
    -------
    int
        A `Status`.
    """
    par = par_[0]
    s = state[0]
    row = reading[0]
    s.live = 0
    status = advance(par_, state, t, blows, events)
    if t > s.time:
        hold_components(par, s, t - s.time)
        move(par, s, t - s.time)
        s.time = t
    s.u_r = -s.gap
    here = s.x_r + s.p
    fill_motion(par, s, row, t, here + s.start_gap - s.gap, here)
    row.bit_end_velocity = s.v_b
    row.bit_force = bit_force(par, s, s.p, s.v_b)
    row.contact_force = 0.0
    if s.held == 1:
        row.contact_force = contact_force(par, s, acceleration(par, s))
    row.bit_kinetic_energy = 0.5 * par.mass_b * s.v_b * s.v_b
    fill_ledger(s, row, kinetic_energy(par, s.v_p, s.v_b), 0.0, recoverable(par, s))
    return status
