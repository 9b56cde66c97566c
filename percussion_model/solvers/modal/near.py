"""A bit alone beside a piston that is near: looks at both of its ends, up to the next event.

What the bodies did is booked once for all looks, and for leaps alike (docs/modal.md, section 4).
"""

from __future__ import annotations

from typing import NamedTuple

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.body import (
    bit_acceleration,
    book_bit_load,
    book_piston_load,
    piston_acceleration,
)
from percussion_model.physics.drive import drive_force, switch_drive
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import Mode, Piston, RockKind
from percussion_model.physics.rock import (
    crush,
    damping,
    origin,
    overcomes_barrier,
    recoverable,
    stiffness,
)
from percussion_model.physics.state import CHECKPOINTS
from percussion_model.solvers.modal.bar import end_after, move_free
from percussion_model.solvers.modal.change import end_mode
from percussion_model.solvers.modal.forms import refresh_loads
from percussion_model.solvers.modal.pairs import (
    BIT_SPEED,
    FIRST_STRIDE,
    PQ,
    Sums,
    ahead_of,
    drop_pairs,
    energy_about_rest,
    keep_ahead,
    leave_out_pairs,
    present_sums,
    spell_out,
    sum_of,
    take_pairs,
    to_be_taken,
)
from percussion_model.solvers.modal.piston import (
    WHOLE,
    at_rest,
    flip_contact,
    has_piston,
    switches,
    time_of,
    unpark,
)
from percussion_model.solvers.modal.records import (
    LONGEST_STRIDE,
    STEP,
    View,
)
from percussion_model.solvers.modal.rock_end import (
    QUIET_SHARE,
    end_standstill,
    late_force,
    passed,
)
from percussion_model.solvers.modal.search import UNSURE, moving

# Steps after which the running force of a standstill is noted.
CHECKPOINT = 64

LOW_Q, LOW_V, SPEED_Q, SPEED_V = (int(row) for row in View)


class Look(NamedTuple):
    """Where bit and piston are after some time, and what that means."""

    sums: Sums
    p: float  # penetration [m]
    force: float  # of the rock [N]
    u_r: float  # relative displacement [m]
    low_p: float  # offset of the free piston's low end [m]
    gap: float  # between the ends, or as far as a waiting piston's may be apart [m]


@inlined
def look_at(par, s, bars, level, ticks):
    """Look 2^level ticks ahead of pairs that are `ticks` after the state."""
    sums = ahead_of(s, bars, level)
    p = s.p + (sums.low - s.low)
    force = stiffness(s) * (p - origin(s)) + damping(s) * sums.speed
    way_b = (sums.bit - s.at_b) / par.mass_b
    u_r, low_p, gap = s.u_r - way_b, 0.0, 0.0
    if has_piston(par):
        time = par.tick * (ticks + (1 << level))
        way_p = time * (s.v_p + 0.5 * time * s.a_p)
        u_r += way_p
        if s.parked == 1:
            low_p = s.spread_p
        elif par.piston == Piston.ELASTIC:
            low_p = end_after(bars.wp, bars.shape_p, bars.move_p[level], bars.wp.shape[1])
        top = s.u_b + way_b + (sums.top - sums.bit / par.mass_b) + s.offset
        gap = top - (s.u_p + way_p + low_p)
    return Look(sums, p, force, u_r, low_p, gap)


@kernel
def book_flight(par, s, h, v_b, look):
    """Book what the piston does alone for `h`, beside a bit that had a velocity."""
    push = drive_force(par, s)
    way, a = h * (s.v_p + 0.5 * h * s.a_p), s.a_p - (s.v_b - v_b) / h
    # the stroke's turning point may lie within
    turn = -(s.v_p - v_b) / a if a != 0.0 else -1.0
    if 0.0 < turn < h and s.v_p < v_b:
        s.b_stroke = max(s.b_stroke, -(s.u_r + 0.5 * (s.v_p - v_b) * turn))
    book_piston_load(par, s, push, way, push * h)
    s.u_p += way
    s.v_p += h * s.a_p
    s.u_r = s.u_p - s.u_b
    s.b_stroke = max(s.b_stroke, -s.u_r)
    s.low_p, s.gap = look.low_p, look.gap
    if s.parked == 1:
        s.low_p, s.gap = 0.0, s.u_b - s.u_p


@kernel
def book_way(par, s, bars, ticks, look):
    """Book what bit and piston did up to a look that is `ticks` after the state."""
    h, before, p, v_b, sums = ticks * par.tick, recoverable(s), s.p, s.v_b, look.sums
    s.v_b = sum_of(bars.laws.ends[s.law], BIT_SPEED, bars.w, s.pairs) / par.mass_b
    way_b = (sums.bit - s.at_b) / par.mass_b
    book_bit_load(par, s, way_b)
    s.u_b += way_b
    s.low, s.top, s.at_b, s.v_low = sums.low, sums.top, sums.bit, sums.speed
    s.p, s.f_rock, s.f_contact = look.p, look.force, 0.0
    if s.mode == Mode.FF:
        s.f_rock = 0.0
        s.e_standstill += before - recoverable(s)
    else:
        s.i_bit += par.mass_b * (h * s.a_b - (s.v_b - v_b))
        s.rock_work += 0.5 * stiffness(s) * (s.p - p) * (s.p + p - 2.0 * origin(s))
        crush(par, s, p)
    if has_piston(par):
        book_flight(par, s, h, v_b, look)
    s.time += ticks
    s.stride = min(2 * s.stride, LONGEST_STRIDE)
    if s.mode == Mode.SS:
        last = s.check_time[(s.n_check - 1) % CHECKPOINTS]
        if s.n_check == 0 or time_of(par, s) - last >= CHECKPOINT * par.dt:
            push_checkpoint(s, time_of(par, s))


@merged
def take_loads(par, s, bars):
    """Take the forces on the bodies; pairs under others are given up."""
    push = drive_force(par, s)
    a_p = piston_acceleration(par, push) if has_piston(par) else 0.0
    a_b = bit_acceleration(par, s)
    if s.law >= 0 and a_b != s.a_b:
        drop_pairs(par, s, bars)
    if s.law < 0:
        refresh_loads(s, bars, a_b, a_p)
    s.a_b, s.a_p = a_b, a_p


@merged
def ready(par, s, bars, law):
    """Take the pairs that the next looks need."""
    take_loads(par, s, bars)
    if s.law < 0:
        take_pairs(par, s, bars, law)
    elif s.stride > FIRST_STRIDE:
        leave_out_pairs(par, s, bars)


@kernel
def watch_barrier(par, s, bars, law, events):
    """Leave standstill where the bit's energy passes the barrier."""
    energy = energy_about_rest(s, bars, spell_out(s, bars, bars.w, PQ))
    s.alert = 1 if energy > QUIET_SHARE * s.w_r else 0
    if s.alert == 1 and overcomes_barrier(par, s, energy):
        # of which the kinetic part alone counts
        drop_pairs(par, s, bars)
        end_standstill(par, s, bars, events)
        if s.mode == Mode.SS:
            take_pairs(par, s, bars, law)


@merged
def present_look(par, s, bars):
    """Where a bit alone is now."""
    sums = present_sums(s, bars)
    p = s.p + (sums.low - s.low)
    force = stiffness(s) * (p - origin(s)) + damping(s) * sums.speed
    return Look(sums, p, force, 0.0, 0.0, 0.0)


@kernel
def go_near(par, s, bars, most, blows, events):
    """Go on by looks at both ends of the bit, `most` ticks at most, or to the next event."""
    if s.mode == Mode.SS and s.alert == 1 and par.rock == RockKind.BILINEAR:
        most = min(most, WHOLE)
    most = at_rest(s, most)
    usual = moving(s, bars, bars.w, PQ).level
    if has_piston(par) and s.parked == 0:
        # which vibrates as well
        usual = min(usual, STEP + 1)
    level, ticks, known = usual, 0, -1
    last = Look(Sums(s.low, s.v_low, s.top, s.at_b), s.p, s.f_rock, s.u_r, s.low_p, s.gap)
    C, taken, sampled, u_before = damping(s), 0.0, 0.0, s.u_r
    cutting, piston = s.mode == Mode.DFC, has_piston(par)
    if cutting:
        taken = C * (s.takes - to_be_taken(bars.laws.taken[s.law], bars.w, PQ, s.pairs))
    meets = ends = turns = False
    while ticks < most:
        while ticks + (1 << level) > most:
            level -= 1
        look = look_at(par, s, bars, level, ticks)
        work, share = 0.0, 0.0
        if cutting:
            speed, earlier = look.sums.speed, last.sums.speed
            share = 0.5 * C * (speed * speed + earlier * earlier) * (par.tick * (1 << level))
            work = taken
            if s.w + taken + UNSURE * (sampled + share) >= s.w_r:
                left = to_be_taken(bars.laws.taken[s.law], bars.rows, 0, s.pairs)
                work = C * (s.takes - left)
        meets = piston and look.gap < 0.0
        if meets and s.parked == 1:
            break
        ends = passed(par, s, look.p, look.sums.speed, work, look.force)
        turns = piston and switches(par, s, look.u_r)
        if level > 0 and (meets or ends or turns):
            known = ticks + (1 << level)
            level -= 1
            continue
        if meets:
            break
        keep_ahead(s, bars)
        ticks += 1 << level
        s.count_steps += 1
        sampled += share
        note(par, s, bars, level, ticks, last.force, look)
        u_before, last = last.u_r, look
        if ends or turns:
            break
        if ticks < known:
            level = max(level - 1, 0)
        else:
            level, known = usual, -1
    if ticks > 0:
        book_way(par, s, bars, ticks, last)
    if meets and s.parked == 1:
        unpark(par, s, bars)
    elif meets:
        drop_pairs(par, s, bars)
        flip_contact(par, s, bars, s.v_p - s.v_b, blows, events)
    else:
        if turns:
            switch_drive(par, s, u_before, time_of(par, s) - par.tick, par.tick, events)
        if ends:
            end_mode(par, s, bars, events)


@inlined
def note(par, s, bars, level, ticks, before, look):
    """Book what every look counts for: peaks, and the loss of a piston in flight.

    Parameters
    ----------
    before : float
        Force of the rock at the look before [N].
    """
    if s.mode != Mode.FF:
        time, h = time_of(par, s) + ticks * par.tick, par.tick * (1 << level)
        s.b_peak_bit = max(s.b_peak_bit, look.force)
        s.peak_bit_force = max(s.peak_bit_force, late_force(s, time, h, before, look.force))
    if has_piston(par) and s.parked == 0 and par.piston == Piston.ELASTIC:
        s.e_loss += move_free(bars.wp, bars.move_p[level], bars.wp.shape[1])
