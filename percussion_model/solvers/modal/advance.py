"""Loop of the modal solver, and reading a state without touching it."""

from __future__ import annotations

import math

from percussion_model.physics.blows import end_with_blow
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import pass_time
from percussion_model.physics.readings import fill_ledger, fill_motion
from percussion_model.physics.records import Mode, Piston, Status
from percussion_model.physics.reference import refer
from percussion_model.physics.rock import recoverable
from percussion_model.solvers.modal.bar import (
    bit_kinetic,
    elastic_of,
    kinetic_of,
    piston_vibration,
    sag,
)
from percussion_model.solvers.modal.forms import follows_form
from percussion_model.solvers.modal.leaps import LONGEST, leap, plan
from percussion_model.solvers.modal.near import go_near
from percussion_model.solvers.modal.pairs import FIRST_STRIDE, drop_pairs, law_wanted
from percussion_model.solvers.modal.piston import WHOLE, has_piston, time_of, unpark
from percussion_model.solvers.modal.records import Task
from percussion_model.solvers.modal.step import level_of_step, step

# Events that one step can make: of the barrier, two of the contact, of the drive, of the rock.
MOST_EVENTS = 6
# A time this close below a tick is that tick [ticks].
TICK_ROUNDING = 1e-3


@merged
def tick_at(par, time):
    """Last tick up to a time."""
    return math.floor(time / par.tick + TICK_ROUNDING)


@merged
def full(s, blows, events):
    """Which list has no room for the rows of another step; `Status.DONE`: none."""
    if s.n_blows >= blows.shape[0]:
        return Status.BLOWS_FULL
    if s.events_on == 1 and s.n_events + MOST_EVENTS > events.shape[0]:
        return Status.EVENTS_FULL
    return Status.DONE


@inlined
def portion(s, law):
    """Ticks that bars go by pairs beside a piston before it is looked again which they need."""
    return (s.stride if s.law == law else FIRST_STRIDE) * WHOLE


@kernel
def time_of_blow(par_, state, bars_):
    """Time by which what is pending is over, if a blow may start in it [s]; 0 if none may.

    A portion is made when all of it is past, some tenths of a millisecond after a closure in it.
    """
    par, s = par_[0], state[0]
    if s.leap_end >= 0:
        return 0.0
    bars = refer(bars_)
    law = law_wanted(par, s, bars.laws)
    ticks = portion(s, law) if law >= 0 else 1 << level_of_step(par, s, bars)
    return end_with_blow(par, s, (s.time + ticks) * par.tick)


@merged
def advance_to(par, s, bars, end, blows, events):
    """Advance to a tick, unless a leap, or what is done in one go, passes it; a `Status`."""
    s.n_blows = 0
    s.n_events = 0
    while True:
        status = full(s, blows, events)
        if status != Status.DONE:
            return status
        if not math.isfinite(s.p + s.v_b + s.v_p + s.u_r):
            return Status.NOT_FINITE
        law = law_wanted(par, s, bars.laws)
        if law < 0:
            if s.law >= 0:
                drop_pairs(par, s, bars)
            level = level_of_step(par, s, bars)
            if s.time + (1 << level) > end:
                return Status.DONE
            step(par, s, bars, level, blows, events)
            continue
        if s.leap_end < 0:
            most = portion(s, law)
            if s.time + most > end:
                return Status.DONE
            far = plan(par, s, bars, law, LONGEST, events)
            if s.leap_end < 0 and s.law >= 0:
                go_near(par, s, bars, min(most, far), blows, events)
        if s.leap_end > end:
            return Status.DONE
        if s.leap_end >= 0:
            leap(par, s, bars, events)


@merged
def commit_to(par, s, bars, end, blows, events):
    """Carry bit and piston to a tick, within what is pending."""
    s.n_blows = 0
    s.n_events = 0
    s.leap_end = -1
    while s.time < end:
        status = full(s, blows, events)
        if status != Status.DONE:
            return status
        law = law_wanted(par, s, bars.laws)
        if law >= 0:
            most = portion(s, law)
            far = plan(par, s, bars, law, end - s.time, events)
            if s.leap_end >= 0:
                leap(par, s, bars, events)
            elif s.law >= 0:
                go_near(par, s, bars, min(most, far), blows, events)
            continue
        if s.law >= 0:
            drop_pairs(par, s, bars)
        level = level_of_step(par, s, bars)
        while s.time + (1 << level) > end:
            level -= 1
        step(par, s, bars, level, blows, events)
    if s.law >= 0:
        drop_pairs(par, s, bars)
    if has_piston(par) and s.parked == 1:
        unpark(par, s, bars)
    s.no_park = s.time
    return Status.DONE


@kernel
def read_at(par, s, bars, time, row):
    """Read a state, and its motion a fraction of a tick later."""
    row.bit_kinetic_energy = bit_kinetic(s, bars, bars.w)
    n, held = s.active, bars.forms.stiff[s.form]
    kinetic = kinetic_of(bars.w, n)
    elastic = elastic_of(bars.w, bars.forms.shape[s.form], n) - 0.5 * held * s.low * s.low
    if s.closed == 0 and has_piston(par):
        kinetic += 0.5 * par.mass_p * s.v_p * s.v_p
        if par.piston == Piston.ELASTIC:
            own = kinetic_of(bars.wp, bars.wp.shape[1])
            kinetic += own
            elastic += piston_vibration(bars) - own
    # within a tick forces stay, so that impulses and velocities agree
    rest = max(0.0, time - time_of(par, s))
    pass_time(par, s, rest)
    fill_ledger(s, row, kinetic, elastic, recoverable(par, s))
    fill_motion(par, s, row, time, s.u_p + par.start_gap, s.u_b)
    row.bit_end_velocity = s.v_low
    row.bit_force = s.f_rock
    row.bit_position += rest * s.v_b
    row.bit_end_position += rest * s.v_low
    row.bit_velocity += rest * (s.a_b + (s.f_contact - s.f_rock) / par.mass_b)
    if has_piston(par):
        row.piston_position += rest * s.v_p
        row.piston_velocity += rest * (s.a_p - s.f_contact / par.mass_p)
    if s.mode == Mode.SS and s.closed == 0 and held > 0.0 and follows_form(par, s):
        # what modes that are left out would hold of the load
        row.bit_force += par.mass_b * s.a_b - held * sag(s, bars)
    row.contact_force = s.f_contact
    row.bit_impulse += rest * s.f_rock
    row.contact_impulse += rest * s.f_contact
    row.drive_impulse += rest * row.drive_force


@kernel
def run(task, par_, state, bars_, time, blows, events, reading):
    """Do one `Task` with a state; the only entry into the modal kernels.

    Parameters
    ----------
    task : int
        ADVANCE: commit up to `time`, unless a pending leap or step passes it.
        COMMIT: cut it short at the last tick up to `time`.
        READ: as COMMIT, then evaluate; spoils the state, so give a copy.
    par_, state : MODAL_PAR, MODAL_STATE array of length 1
    bars_ : Bars
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
    bars = refer(bars_)
    end = tick_at(par, time)
    if task == Task.ADVANCE:
        return advance_to(par, s, bars, end, blows, events)
    if task == Task.READ:
        s.live = s.events_on = 0
    status = commit_to(par, s, bars, end, blows, events)
    if task == Task.READ:
        read_at(par, s, bars, time, reading[0])
    return status
