"""Loop of the travelling-wave solver, and reading a state without touching it."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.blows import end_of_step_with_blow
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.readings import fill_forces, fill_ledger, fill_motion
from percussion_model.physics.records import Piston, Status
from percussion_model.physics.reference import refer
from percussion_model.solvers.wave.bar import kinetic_energy
from percussion_model.solvers.wave.leaps.dormant import make_dormant, stays_dormant, wake_piston
from percussion_model.solvers.wave.leaps.leap import FEWEST_STEPS, leap, longest_leap, plan_leap
from percussion_model.solvers.wave.records import Row, Task
from percussion_model.solvers.wave.step import step
from percussion_model.solvers.wave.totals import (
    bit_position,
    lost_in_faces,
    stored_energy,
    time_of,
)

# Events that one step can make besides the rock's crossings: two of the contact, one of
# the drive, one of the barrier.
OTHER_EVENTS = 4

# A time this close below a grid point is that grid point [steps].
GRID_ROUNDING = 1e-6

# At a grid point itself, forces and mode are those of the first instant after it [steps].
SHORTEST = 1e-6

ADVANCE, READ = int(Task.ADVANCE), int(Task.READ)


@merged
def plan(par, s, bars, ops, scratch):
    """Wake the piston or let it wait, and plan the bit's next leap."""
    # a leap that ended just short of it is none to wait for
    due = s.dormant == 1 and s.step + FEWEST_STEPS > s.wake and s.leap_end < 0
    if due and not stays_dormant(par, s, bars.wb, bars.cb):
        wake_piston(par, s, bars, ops, scratch)
        s.no_dormancy = s.step
        s.count_wakes += 1
    if par.piston != Piston.ABSENT and s.dormant == 0:
        if s.step < s.no_dormancy:
            return
        make_dormant(par, s, bars, ops, scratch)
        if s.dormant == 0:
            return
    if s.leap_end < 0 and s.step >= s.no_plan:
        most = longest_leap(par)
        if s.dormant == 1:
            most = min(most, s.wake - s.step)
        plan_leap(par, s, bars.wb, bars.cb, ops.lookahead, scratch, most)


@merged
def ends_by(par, s, step, time):
    """Whether a step ends at `time` or before."""
    return (time - s.t_base) / par.dt + GRID_ROUNDING >= step


@kernel
def time_of_blow(par_, state):
    """Time at which the pending step is over, if a blow may start in it [s]; 0 if none may.

    One that is cut at the closure is over before.
    """
    par, s = par_[0], state[0]
    if s.leap_end >= 0:
        return 0.0
    return end_of_step_with_blow(par, s, s.t_base + (s.step + 1) * par.dt)


@merged
def advance_to(par, s, bars, ops, scratch, time, blows, events):
    """Advance to `time`, unless a pending leap passes it; a `Status`."""
    s.n_blows = 0
    s.n_events = 0
    while ends_by(par, s, s.step + 1, time):
        if s.n_blows >= blows.shape[0]:
            return Status.BLOWS_FULL
        if s.events_on == 1 and s.n_events + par.most_changes + OTHER_EVENTS > events.shape[0]:
            return Status.EVENTS_FULL
        if not math.isfinite(s.p + s.v_b + s.v_p + s.u_r):
            return Status.NOT_FINITE
        planned = par.leaps > 0 and s.leap_end < 0
        if planned:
            plan(par, s, bars, ops, scratch)
        if s.leap_end >= 0:
            if not ends_by(par, s, s.leap_end, time):
                return Status.DONE
            leap(par, s, bars.wb, bars.cb, ops, scratch, planned)
        else:
            step(par, s, bars, par.dt, blows, events)
    return Status.DONE


@merged
def commit_to(par, s, bars, ops, scratch, time):
    """Carry bit and piston to `time` within a pending leap, or as far as it goes."""
    stop = math.floor((time - s.t_base) / par.dt + GRID_ROUNDING)
    if s.leap_end >= 0 and stop > s.step:
        s.leap_end = min(stop, s.leap_end)
        leap(par, s, bars.wb, bars.cb, ops, scratch, False)
    s.leap_end = -1
    if s.dormant == 1:
        wake_piston(par, s, bars, ops, scratch)
    s.no_plan = s.step
    s.no_dormancy = s.step


@merged
def read_at(par, s, bars, time, blows, events, row):
    """Read the ledger at the grid point, then let the ends meet up to `time` and read the rest.

    Returns
    -------
    bool
        False where the step was cut before: read again, from there.
    """
    begin = s.step
    kinetic, elastic, rock = stored_energy(par, s, bars)
    fill_ledger(s, row, kinetic, elastic, rock)
    row.e_loss += lost_in_faces(par, bars)
    tau = max(time - time_of(par, s), SHORTEST * par.dt)
    row.bit_kinetic_energy = kinetic_energy(bars.wb, bars.cb, par.n_b, 2 * s.parity)
    before = bit_position(s, bars.wb, bars.cb, par.n_b, 2 * s.parity)
    v_before = s.v_b
    # counted from zero, so that a short time keeps its digits in a long run
    bit, contact = s.i_bit, s.i_contact
    s.i_bit = 0.0
    s.i_contact = 0.0
    at_grid_point = time - time_of(par, s) <= SHORTEST * par.dt
    if at_grid_point:  # nothing has moved in that instant
        fill_motion(par, s, row, time, s.u_r - s.u_start + before, before)
    step(par, s, bars, tau, blows, events)
    if s.step > begin:
        s.i_bit += bit
        s.i_contact += contact
        return False
    if at_grid_point:
        row.drilling_mode = s.mode
    else:
        here = before + 0.5 * (v_before + s.v_b) * tau
        fill_motion(par, s, row, time, s.u_r - s.u_start + here, here)
    row.bit_end_velocity = bars.wb[Row.FACE, par.n_b]
    fill_forces(s, row, tau, bit, contact, at_grid_point)
    return True


@kernel
def run(task, par_, state, bars_, ops_, scratch_, time, blows, events, reading):
    """Do one `Task` with a state; the only entry into the travelling-wave kernels.

    Parameters
    ----------
    task : int
        ADVANCE: commit up to `time`, unless a pending leap passes it.
        COMMIT: cut a pending leap short at the last grid point up to `time`, and
        wake the piston.
        READ: as COMMIT, then evaluate at `time`; spoils the state, so give a copy.
    par_, state : WAVE_PAR, WAVE_STATE array of length 1
    bars_ : Bars
    ops_ : LeapOperators
    scratch_ : Scratch
    time : float
        [s]
    blows, events : BLOW, EVENT array
        Filled from index 0; the state says how far.
    reading : READING array of length 1

    Returns
    -------
    int
        A `Status`.
    """
    par = par_[0]
    s = state[0]
    bars, ops, scratch = refer(bars_), refer(ops_), refer(scratch_)
    if task == Task.ADVANCE:
        return advance_to(par, s, bars, ops, scratch, time, blows, events)
    commit_to(par, s, bars, ops, scratch, time)
    if task == Task.READ:
        s.live = 0
        while not read_at(par, s, bars, time, blows, events, reading[0]):
            pass
    return Status.DONE


@kernel
def sample(par_, state, bars, memory, spare, spare_bars, spare_memory, ops, scratch, times, blows,
           events, reading, row, out):  # fmt: skip
    """Advance through rising times and read at each, as `run` does it call by call.

    Parameters
    ----------
    par_, state, bars, ops, scratch, blows, events : as for `run`
    memory : (int64 array, float64 array)
        All of the state: the words of its record, and its waves.
    spare, spare_bars, spare_memory : as state, bars, memory
        Of a copy that readings may spoil.
    times : float64 array
        [s]
    reading : READING array of length 1
    row : float64 array
        Its beginning, of which each row of `out` is a copy.
    out : float64 array, shape (times, numbers of a row)

    Returns
    -------
    status : int
        Of the last advance, a `Status`.
    count : int
        Times that were read: fewer than all where blows or events were listed, or a blow may start.
    """
    # as numbers of a type that `run` has been compiled for, not as constants of their own
    advance, read = np.int64(ADVANCE), np.int64(READ)
    for k in range(len(times)):
        status = run(advance, par_, state, bars, ops, scratch, times[k], blows, events, reading)
        if status != Status.DONE:
            return status, k
        if k > 0 and time_of_blow(par_, state) > times[k]:  # it is looked for between two calls
            return Status.DONE, k
        listed = state[0].n_blows + state[0].n_events
        for i in range(len(memory[0])):
            spare_memory[0][i] = memory[0][i]
        for i in range(len(memory[1])):
            spare_memory[1][i] = memory[1][i]
        # nobody asks here for peaks, dear in standstill, or for what leaps lose: infinite energy
        # put in makes any loss too small to book
        spare[0].peak_from = spare[0].e_start = math.inf
        here = max(times[k], time_of(par_[0], state[0]))
        run(read, par_, spare, spare_bars, ops, scratch, here, blows, events, reading)
        for i in range(out.shape[1]):
            out[k, i] = row[i]
        if listed:
            return status, k + 1
    return Status.DONE, len(times)
