"""One step of the modal solver: forces that hold over it, up to the next event.

A step is as long as its set of modes allows, or as much shorter as it takes for an event to
lie in its last tick. Contact and rock answer with forces that are constant over a step and
meet their laws at its end (docs/modal.md, sections 2 and 3).
"""

from __future__ import annotations

from typing import NamedTuple

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.body import (
    bit_acceleration,
    book_bit_load,
    book_piston_load,
    hold_effects,
    piston_acceleration,
)
from percussion_model.physics.drive import drive_force, switch_drive
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import Mode, Piston, RockKind
from percussion_model.physics.rock import (
    book_dashpot,
    crush,
    damping,
    origin,
    recoverable,
    stiffness,
)
from percussion_model.solvers.modal.bar import LOW, end_offset, ends_after, low_after, move_bar
from percussion_model.solvers.modal.piston import (
    flip_contact,
    has_piston,
    park,
    switches,
    time_of,
    unpark,
)
from percussion_model.solvers.modal.records import Reply
from percussion_model.solvers.modal.rock_end import change_mode, end_standstill, look, passed

# Steps after which the running force of a standstill is noted.
CHECKPOINT = 64
# Openings and closures of one instant; more would be a loop.
MOST_FLIPS = 2


class Free(NamedTuple):
    """Where the ends would be after a step without forces between them [m]."""

    piston: float  # low end, or a bound of it
    top: float
    path: float  # way of the bit's low end
    v_low: float  # [m/s]
    yields: float  # compliance of the contact over the step [m/N]


class Trial(NamedTuple):
    """A step that may be made."""

    h: float  # [s]
    contact: float  # forces [N]
    force: float
    path: float  # of the penetration [m]
    work: float  # of the rock's dashpot [J]
    gap: float  # between piston and bit, where the piston is seen [m]
    u_p: float
    v_p: float
    u_b: float
    v_b: float
    v_low: float


@inlined
def fly_free(par, s, bars, level, a_p, a_b):
    """Where the ends are after 2^level ticks if nothing holds them."""
    h = par.tick * (1 << level)
    wb, cb, n = bars.wb, bars.cb, bars.cb.sizes[s.set]
    reply = cb.reply[s.set, level]
    top, low, v_low = ends_after(wb, cb, n, level)
    path = h * (s.v_b + 0.5 * h * a_b)
    top += s.u_b + path + reply[Reply.TOP_KEPT] * s.r_t
    path += low + reply[Reply.LOW_KEPT] * s.r_b - (end_offset(wb, cb, n, LOW) + s.r_b)
    end, yields = 0.0, reply[Reply.TOP]
    if has_piston(par):
        end = s.u_p + h * (s.v_p + 0.5 * h * a_p)
        if s.parked == 1:
            end += s.spread_p
        elif par.piston == Piston.ELASTIC:
            end += low_after(bars.wp, bars.cp, bars.wp.shape[1], level)
            end += bars.cp.reply[0, level, Reply.LOW_KEPT] * s.r_p
            yields += bars.cp.reply[0, level, Reply.LOW]
        else:
            yields += 0.5 * h * h / par.mass_p
    return Free(end, top, path, v_low + s.v_b + h * a_b, yields)


@inlined
def solve(par, s, free, reply, h):
    """Forces of contact and rock, and the way of the rock end, by the laws at the step's end.

    The rock's force is its mean over the step, K (p - P_R) + C v with p in the middle.
    """
    near = free.piston - free.top + s.offset
    cross = reply[Reply.CROSS]
    contact = 0.0
    if s.mode == Mode.FF:
        if s.closed == 1:
            contact = near / free.yields
        return contact, 0.0, free.path + cross * contact
    first, inverse = 0.0, 0.0
    if par.rock != RockKind.WALL:
        first = stiffness(s) * (s.p - origin(s))
        inverse = 1.0 / (0.5 * stiffness(s) + damping(s) / h)
    whole, due = reply[Reply.LOW] + inverse, free.path + first * inverse
    if s.closed == 1:
        det = free.yields * whole - cross * cross
        contact = (near * whole + cross * due) / det
        force = (due * free.yields + cross * near) / det
    else:
        force = due / whole
    return contact, force, (force - first) * inverse


@inlined
def try_step(par, s, bars, free, level, a_p, a_b):
    """Make out a step of 2^level ticks."""
    h = par.tick * (1 << level)
    reply = bars.cb.reply[s.set, level]
    contact, force, path = solve(par, s, free, reply, h)
    v_low = free.v_low + reply[Reply.CROSS_SPEED] * contact - reply[Reply.LOW_SPEED] * force
    gap = s.offset
    if s.closed == 0:
        gap = free.top - free.piston - reply[Reply.CROSS] * force
    v_p = s.v_p + h * a_p
    if s.closed == 1:
        v_p -= h * contact / par.mass_p
    v_b = s.v_b + h * (a_b + (contact - force) / par.mass_b)
    u_p, u_b = s.u_p + 0.5 * h * (s.v_p + v_p), s.u_b + 0.5 * h * (s.v_b + v_b)
    work = damping(s) * path * path / h
    return Trial(h, contact, force, path, work, gap, u_p, v_p, u_b, v_b, v_low)


@merged
def move_piston(par, s, bars, level, contact):
    """Move the modes of the piston, and what is beyond them."""
    if par.piston != Piston.ELASTIC:
        return
    cp = bars.cp
    s.e_loss += move_bar(bars.wp, cp, bars.wp.shape[1], level, 0.0, -contact)
    kept, beyond = cp.reply[0, level, Reply.LOW_KEPT], cp.beyond[0, 1]
    off = s.r_p + beyond * contact
    s.e_loss += 0.5 * (1.0 - kept * kept) * off * off / beyond
    s.r_p = kept * off - beyond * contact


@merged
def move_bit(s, bars, level, contact, force):
    """Move the modes of the bit, and what is beyond them."""
    cb = bars.cb
    reply, beyond = cb.reply[s.set, level], cb.beyond[s.set]
    s.e_loss += move_bar(bars.wb, cb, cb.sizes[s.set], level, contact, -force)
    kept, off = reply[Reply.TOP_KEPT], s.r_t - beyond[0] * contact
    s.e_loss += 0.5 * (1.0 - kept * kept) * off * off / beyond[0]
    s.r_t = kept * off + beyond[0] * contact
    kept, off = reply[Reply.LOW_KEPT], s.r_b + beyond[1] * force
    s.e_loss += 0.5 * (1.0 - kept * kept) * off * off / beyond[1]
    s.r_b = kept * off - beyond[1] * force


@merged
def book_rock(par, s, trial, before):
    """Book what the rock takes in a step, from an energy that it would give back before [J]."""
    if s.mode == Mode.FF:
        s.e_standstill += before - recoverable(s)
        return
    s.rock_work += trial.force * trial.path
    s.i_bit += trial.force * trial.h
    book_dashpot(s, trial.work)
    crush(par, s, s.p - trial.path)
    s.b_peak_bit = max(s.b_peak_bit, trial.force)
    if time_of(par, s) > s.peak_from:
        s.peak_bit_force = max(s.peak_bit_force, trial.force)


@merged
def book_contact(par, s, trial):
    """Book what piston and bit do to each other in a step."""
    if s.closed == 1:
        s.i_contact += trial.contact * trial.h
        # at the first instant a bar with loss resists without bound: a mean over a step
        s.peak_time += trial.h
        s.peak_impulse += trial.contact * trial.h
        if s.peak_time >= 0.999 * par.dt:
            mean = s.peak_impulse / s.peak_time
            s.b_peak_contact = max(s.b_peak_contact, mean)
            if time_of(par, s) > s.peak_from:
                s.peak_contact_force = max(s.peak_contact_force, mean)
            s.peak_time = s.peak_impulse = 0.0


@kernel
def make(par, s, bars, level, trial, push, events):
    """Make a step that was tried."""
    begin, before = time_of(par, s), recoverable(s)
    s.time += 1 << level
    s.count_steps += 1
    if has_piston(par):
        if s.parked == 0:
            move_piston(par, s, bars, level, trial.contact)
        book_piston_load(par, s, push, trial.u_p - s.u_p, push * trial.h)
        s.u_p, s.v_p, s.gap = trial.u_p, trial.v_p, trial.gap
    move_bit(s, bars, level, trial.contact, trial.force)
    book_bit_load(par, s, trial.u_b - s.u_b)
    s.u_b, s.v_b, s.v_low = trial.u_b, trial.v_b, trial.v_low
    s.f_contact, s.f_rock = trial.contact, trial.force
    s.p += trial.path
    book_rock(par, s, trial, before)
    book_contact(par, s, trial)
    if has_piston(par):
        u_before = s.u_r
        s.u_r = s.u_p - s.u_b
        s.b_stroke = max(s.b_stroke, -s.u_r)
        switch_drive(par, s, u_before, begin, trial.h, events)


@kernel
def step(par, s, bars, most, blows, events):
    """Go on by a step, of 2^most ticks at most, or to the next event."""
    if s.time >= s.look:
        look(par, s, bars)
    hold_effects(par, s)
    piston = has_piston(par)
    if piston and s.parked == 0 and s.closed == 0 and s.time >= s.no_park:
        park(par, s, bars)
    if s.mode == Mode.SS and s.alert == 1 and par.rock == RockKind.BILINEAR:
        end_standstill(par, s, bars, events)
    push = drive_force(par, s)
    a_p = piston_acceleration(par, push) if piston else 0.0
    a_b = bit_acceleration(par, s)
    level, flips = most, 0
    while True:
        free = fly_free(par, s, bars, level, a_p, a_b)
        if piston and s.parked == 1 and free.piston > free.top:
            unpark(par, s, bars)
            continue
        trial = try_step(par, s, bars, free, level, a_p, a_b)
        flip = False
        if piston and s.parked == 0:
            flip = trial.contact < 0.0 if s.closed == 1 else trial.gap < 0.0
        ends = passed(par, s, s.p + trial.path, trial.v_low, trial.work, trial.force)
        turns = piston and switches(par, s, trial.u_p - trial.u_b)
        if level > 0 and (flip or ends or turns):
            level -= 1
        elif flip and flips < MOST_FLIPS:
            flip_contact(par, s, bars, trial.v_p - trial.v_b, blows, events)
            level, flips = most, flips + 1
        elif ends and s.mode != Mode.FF and par.rock == RockKind.WALL:
            change_mode(par, s, bars, events)
        else:
            break
    make(par, s, bars, level, trial, push, events)
    if ends:
        change_mode(par, s, bars, events)
    elif s.mode == Mode.SS and (s.n_check == 0 or s.count_steps % CHECKPOINT == 0):
        push_checkpoint(s, time_of(par, s))
