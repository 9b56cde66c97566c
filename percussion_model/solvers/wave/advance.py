"""The loop of the travelling-wave solver, and reading a state without touching it."""

from __future__ import annotations

import math

from percussion_model.physics.drive import drive_force
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.records import PEAK_FIELDS, SAMPLE_FIELDS, Piston, Status
from percussion_model.solvers.wave.bar import kinetic_energy
from percussion_model.solvers.wave.leaps.leap import FEWEST_STEPS, leap, longest_leap, plan_leap
from percussion_model.solvers.wave.leaps.sleep import put_to_sleep, sleep_on, wake_piston
from percussion_model.solvers.wave.records import Row, Task
from percussion_model.solvers.wave.step import step
from percussion_model.solvers.wave.totals import bit_position, lost_in_faces, now, stored_energy

DONE, BLOWS_FULL, EVENTS_FULL = int(Status.DONE), int(Status.BLOWS_FULL), int(Status.EVENTS_FULL)
NOT_FINITE = int(Status.NOT_FINITE)
ABSENT = int(Piston.ABSENT)
ADVANCE, SAMPLE, STEP = int(Task.ADVANCE), int(Task.SAMPLE), int(Task.STEP)
FACE = int(Row.FACE)

# Where a longer row goes on.
PEAKS = len(SAMPLE_FIELDS)
LEDGER = PEAKS + len(PEAK_FIELDS)

# Events that one step can make besides the rock's crossings: two of the contact, one of
# the drive, one of the barrier.
OTHER_EVENTS = 4

# A time this close below a grid point is that grid point [steps].
GRID_ROUNDING = 1e-6


@merged
def plan(par, s, wp, cp, wb, cb, ops, x, v, y):
    """Wake the piston or put it to sleep, and plan the bit's next leap."""
    # a leap that ended just short of it is none to wait for
    due = s.asleep == 1 and s.step + FEWEST_STEPS > s.wake and s.leap_end < 0
    if due and not sleep_on(par, s, wb, cb):
        wake_piston(par, s, wp, cp, wb, cb, ops[0], x, y)
        s.no_sleep = s.step
        s.count_wakes += 1
    if par.piston != ABSENT and s.asleep == 0:
        if s.step < s.no_sleep:
            return
        put_to_sleep(par, s, wp, cp, wb, cb, ops, x, v, y)
        if s.asleep == 0:
            return
    if s.leap_end < 0 and s.step >= s.no_plan:
        most = longest_leap(par)
        if s.asleep == 1:
            most = min(most, s.wake - s.step)
        plan_leap(par, s, wb, cb, ops[2], x, v, most)


@merged
def in_reach(par, s, step, time):
    """Whether a step ends at `time` or before."""
    return (time - s.t_base) / par.dt + GRID_ROUNDING >= step


@merged
def go_on(par, s, wp, cp, wb, cb, ops, x, v, y, time, blows, events):
    """Advance to `time`, unless a pending leap passes it; a `Status`."""
    s.n_blows = 0
    s.n_events = 0
    while in_reach(par, s, s.step + 1, time):
        if s.n_blows >= blows.shape[0]:
            return BLOWS_FULL
        if s.events_on == 1 and s.n_events + par.most_crossings + OTHER_EVENTS > events.shape[0]:
            return EVENTS_FULL
        if not math.isfinite(s.p + s.v_b + s.v_p + s.u_r):
            return NOT_FINITE
        watched = par.leaps > 0 and s.leap_end < 0
        if watched:
            plan(par, s, wp, cp, wb, cb, ops, x, v, y)
        if s.leap_end >= 0:
            if not in_reach(par, s, s.leap_end, time):
                return DONE
            leap(par, s, wb, cb, ops, x, v, y, watched)
        else:
            step(par, s, wp, cp, wb, cb, par.dt, blows, events)
    return DONE


@merged
def bring(par, s, wp, cp, wb, cb, ops, x, v, y, time):
    """Bring bit and piston up to `time` within a pending leap, or as far as it goes."""
    stop = math.floor((time - s.t_base) / par.dt + GRID_ROUNDING)
    if s.leap_end >= 0 and stop > s.step:
        s.leap_end = min(stop, s.leap_end)
        leap(par, s, wb, cb, ops, x, v, y, False)
    s.leap_end = -1
    if s.asleep == 1:
        wake_piston(par, s, wp, cp, wb, cb, ops[0], x, y)
    s.no_plan = s.step
    s.no_sleep = s.step


# At a grid point itself, forces are those of the first instant after it [steps].
SHORTEST = 1e-6


@merged
def fill_sample(par, s, wp, cp, wb, cb, time, tau, blows, events, row):
    """Let the ends meet for `tau` and write what is seen then (SAMPLE_FIELDS)."""
    energy = kinetic_energy(wb, cb, par.n_b, 2 * s.parity)
    before = bit_position(s, wb, cb, par.n_b, 2 * s.parity)
    v_before = s.v_b
    # counted from zero, so that a short time keeps its digits in a long run
    bit, contact = s.i_bit, s.i_contact
    s.i_bit = 0.0
    s.i_contact = 0.0
    step(par, s, wp, cp, wb, cb, tau, blows, events)
    here = before + 0.5 * (v_before + s.v_b) * tau
    row[0] = time
    row[1] = s.u_r - s.u_start + here
    row[2] = s.v_p
    row[3] = here
    row[4] = s.v_b
    row[5] = s.x_r + s.p
    row[6] = wb[FACE, par.n_b]
    row[7] = s.gap
    row[8] = s.u_r
    row[9] = s.p
    row[10] = s.i_bit / tau
    row[11] = s.i_contact / tau
    row[12] = drive_force(par, s)
    row[13] = s.mode
    row[14] = energy
    row[15] = bit + s.i_bit
    row[16] = contact + s.i_contact
    row[17] = s.i_drive
    if row.shape[0] > LEDGER:
        row[PEAKS] = s.peak_bit
        row[PEAKS + 1] = s.peak_contact
    if par.piston == ABSENT:
        for k in (1, 2, 7, 8):
            row[k] = math.nan


@kernel
def fill_ledger(par, s, wp, cp, wb, cb, row):
    """Write the energies at the grid point of the state (LONG_SAMPLE_FIELDS)."""
    row[LEDGER] = s.e_drive
    row[LEDGER + 1] = s.e_feed
    row[LEDGER + 2] = s.e_gravity
    row[LEDGER + 3] = s.e_crushing
    row[LEDGER + 4] = s.e_barrier
    row[LEDGER + 5] = s.e_standstill
    row[LEDGER + 6] = s.e_loss + lost_in_faces(par, wp, wb)
    row[LEDGER + 7] = s.e_contact
    row[LEDGER + 8] = s.e_numerical
    row[LEDGER + 9] = s.e_overshoot
    kinetic, elastic, rock = stored_energy(par, s, wp, cp, wb, cb)
    row[LEDGER + 10] = s.e_start
    row[LEDGER + 11] = kinetic
    row[LEDGER + 12] = elastic
    row[LEDGER + 13] = rock


@kernel
def run(task, par_, state, wp, cp, wb, cb, ops, x, v, y, time, blows, events, row):
    """Do one `Task` with a state; the only entry into the travelling-wave kernels.

    Parameters
    ----------
    task : int
        ADVANCE: commit up to `time`, unless a pending leap passes it.
        BRING: cut a pending leap short at the last grid point up to `time`, and
        wake the piston.
        SAMPLE: as BRING, then evaluate at `time`; spoils the state, so give a copy.
        STEP: one step without leaps.
    par_, state : WAVE_PAR, WAVE_STATE array of length 1
    wp, cp, wb, cb : float array
        Waves and coefficients of piston and bit.
    ops : tuple of float arrays
        Leap operators (`LeapOperators.arrays`).
    x, v, y : float array
        Scratch.
    time : float
        [s]
    blows, events : BLOW, EVENT array
        Filled from index 0; the state says how far.
    row : float array
        Of the length of SAMPLE_FIELDS or of LONG_SAMPLE_FIELDS.

    Returns
    -------
    int
        A `Status`.
    """
    par = par_[0]
    s = state[0]
    if task == ADVANCE:
        return go_on(par, s, wp, cp, wb, cb, ops, x, v, y, time, blows, events)
    if task == STEP:
        step(par, s, wp, cp, wb, cb, par.dt, blows, events)
        return DONE
    bring(par, s, wp, cp, wb, cb, ops, x, v, y, time)
    if task == SAMPLE:
        s.live = 0
        if row.shape[0] > LEDGER:
            fill_ledger(par, s, wp, cp, wb, cb, row)
        tau = max(time - now(par, s), SHORTEST * par.dt)
        fill_sample(par, s, wp, cp, wb, cb, time, tau, blows, events, row)
    return DONE
