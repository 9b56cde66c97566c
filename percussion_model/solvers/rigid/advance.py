"""Rigid piston and bit from event to event, all in closed form (docs/model.md, section 9)."""

from __future__ import annotations

import math

from numba import njit

from percussion_model.physics.records import PEAK_FIELDS, SAMPLE_FIELDS, Piston, Status
from percussion_model.solvers.rigid.events import happen, starts_blow
from percussion_model.solvers.rigid.law import (
    acceleration,
    bit_force,
    contact_force,
    drive_force,
    is_finite,
    kinetic_energy,
    recoverable,
    start_cycle,
    watch_standstill,
)
from percussion_model.solvers.rigid.move import bit_motion, impulses, move, piston_motion
from percussion_model.solvers.rigid.records import ROWS_AN_EVENT, Next
from percussion_model.solvers.rigid.schedule import schedule

# Where a longer row goes on.
PEAKS = len(SAMPLE_FIELDS)
LEDGER = PEAKS + len(PEAK_FIELDS)


@njit(cache=True, error_model="numpy")
def count_event(par, s):
    """Count the event that is about to happen; too many within a window are a storm."""
    s.last_event = s.time
    if s.time - s.window > par.storm_window:
        s.window = s.time
        s.window_events = 0
    s.window_events += 1
    if s.window_events == par.most_events:
        s.count_storms += 1


@njit(cache=True, error_model="numpy")
def advance(par_, state, t, blows, n_blows, events, n_events, record):
    """Let all events up to time t happen.

    The state comes to rest at the last of them, so that it does not depend on how an
    interval is divided into calls.

    Parameters
    ----------
    par_, state : RIGID_PAR, RIGID_STATE arrays of length 1
    t : float
        Time [s].
    blows, events : BLOW, EVENT arrays
        Filled from the counts on; events needs room for ROWS_AN_EVENT rows at least.
    n_blows, n_events : integer arrays of length 1
        Rows used up; raised here.
    record : bool
        Whether to keep events.

    Returns
    -------
    status : int
        A `Status`. After BLOWS_FULL or EVENTS_FULL a further call goes on as if there
        had been no interruption.
    """
    par = par_[0]
    s = state[0]
    while True:
        if s.scheduled == 0:
            schedule(par, s)
        if not s.next_time <= t or s.next_kind == Next.NOTHING:
            return Status.DONE
        if record and n_events[0] + ROWS_AN_EVENT > events.shape[0]:
            return Status.EVENTS_FULL
        ends_blow = (
            s.next_kind == Next.CLOSE and s.in_blow == 1 and starts_blow(par, s, s.next_time)
        )
        if ends_blow and n_blows[0] >= blows.shape[0]:
            return Status.BLOWS_FULL
        if s.next_tau > 0.0:
            move(par, s, s.next_tau)
            s.time = s.next_time
            s.standing_events = 0
        else:
            s.standing_events += 1
        if ends_blow:
            s.blow.period = s.time - s.blow.time
            blows[n_blows[0]] = s.blow
            n_blows[0] += 1
        count_event(par, s)
        happen(par, s)
        if record:
            for i in range(s.n_rows):
                row = events[n_events[0]]
                row.time = s.time
                row.value = s.row_value[i]
                row.bit_position = s.bit_position
                row.kind = s.row_kind[i]
                n_events[0] += 1
        s.scheduled = 0
        if not is_finite(s):
            return Status.NOT_FINITE


@njit(cache=True, error_model="numpy")
def commit(par_, state, t):
    """Carry the state itself to time t, before its next event, so that inputs may change."""
    par = par_[0]
    s = state[0]
    if t > s.time:
        move(par, s, t - s.time)
        s.time = t
        s.standing_events = 0
    watch_standstill(s)
    s.scheduled = 0


@njit(cache=True, error_model="numpy")
def begin(par_, state):
    """Complete a new state: rock law in force, a piston at rest on the bit, energy."""
    par = par_[0]
    s = state[0]
    mode = s.mode
    start_cycle(par, s, s.p)
    s.mode = mode
    s.standstill = 0.0
    if par.piston != Piston.ABSENT and s.gap == 0.0 and s.v_p == s.v_b:
        s.held = 1
        if not contact_force(par, s, acceleration(par, s)) > 0.0:
            s.held = 0
    s.initial_energy = kinetic_energy(par, s.v_p, s.v_b)


@njit(cache=True, error_model="numpy")
def fill_ledger(par, s, tau, row):
    """Carry the state over `tau` and write peaks and energies (LONG_SAMPLE_FIELDS)."""
    if tau > 0.0:
        move(par, s, tau)
        s.time += tau
    row[PEAKS] = s.peak_bit
    row[PEAKS + 1] = s.peak_contact
    row[LEDGER] = s.drive
    row[LEDGER + 1] = s.feed
    row[LEDGER + 2] = s.gravity
    row[LEDGER + 3] = s.crushing
    row[LEDGER + 4] = s.barrier
    row[LEDGER + 5] = s.standstill
    row[LEDGER + 6] = s.loss
    row[LEDGER + 7] = s.contact
    row[LEDGER + 8] = s.numerical
    row[LEDGER + 9] = s.overshoot
    row[LEDGER + 10] = s.initial_energy
    row[LEDGER + 11] = kinetic_energy(par, s.v_p, s.v_b)
    row[LEDGER + 12] = 0.0
    row[LEDGER + 13] = recoverable(par, s, s.p)


@njit(cache=True, error_model="numpy")
def fill_sample(par, s, t, row):
    """Write what is seen at time t, up to the next event (SAMPLE_FIELDS)."""
    tau = t - s.time
    d_b, v_b = bit_motion(par, s, tau)
    d_p, v_p = piston_motion(par, s, tau, d_b, v_b)
    bit, contact = impulses(par, s, tau, v_b)
    force = bit_force(par, s, s.p + d_b, v_b)
    gap = s.gap + (d_b - d_p)
    row[0] = t
    row[1] = s.bit_position + d_b + s.first_gap - gap
    row[2] = v_p
    row[3] = s.bit_position + d_b
    row[4] = v_b
    row[5] = row[3]
    row[6] = v_b
    row[7] = gap
    row[8] = -gap
    row[9] = s.p + d_b
    row[10] = force
    row[11] = 0.0
    if s.held == 1:
        before = acceleration(par, s)
        # The common acceleration changes with the bit force alone.
        change = (bit_force(par, s, s.p, s.v_b) - force) / (par.M_p + par.M_b)
        row[11] = contact_force(par, s, before + change)
    row[12] = 0.0
    row[13] = s.mode
    row[14] = 0.5 * par.M_b * v_b * v_b
    row[15] = s.bit_impulse + bit
    row[16] = s.contact_impulse + contact
    row[17] = s.drive_impulse
    if par.piston == Piston.ABSENT:
        row[1] = math.nan
        row[2] = math.nan
        row[7] = math.nan
        row[8] = math.nan
    else:
        row[12] = drive_force(par, s)
        row[17] += row[12] * tau
    if row.shape[0] > LEDGER:
        fill_ledger(par, s, tau, row)


@njit(cache=True, error_model="numpy")
def run_to(par_, copy, t, blows, n_blows, events, n_events):
    """Advance a copy that is only read to time t; its blows are dropped."""
    status = Status.BLOWS_FULL
    while status == Status.BLOWS_FULL:
        n_blows[0] = 0
        status = advance(par_, copy, t, blows, n_blows, events, n_events, False)
    return status


@njit(cache=True, error_model="numpy")
def sample(par_, copy, times, out, blows, n_blows, events, n_events):
    """Fill a row of SAMPLE_FIELDS for each of the rising `times`.

    Parameters
    ----------
    par_, copy : RIGID_PAR, RIGID_STATE arrays of length 1
        The state is a copy: it is used up.
    times : float array
        Not before the time of the state [s].
    out : float array, one row per time
    blows, n_blows, events, n_events : arrays of length 1
        Room that `advance` needs; nothing of it is kept.

    Returns
    -------
    status : int
    """
    for i in range(times.shape[0]):
        status = run_to(par_, copy, times[i], blows, n_blows, events, n_events)
        if status != Status.DONE:
            return status
        fill_sample(par_[0], copy[0], times[i], out[i])
    return Status.DONE


@njit(cache=True, error_model="numpy")
def stored_energy(par_, state):
    """Kinetic energy and energy that the rock would give back [J]."""
    par = par_[0]
    s = state[0]
    return kinetic_energy(par, s.v_p, s.v_b), recoverable(par, s, s.p)
