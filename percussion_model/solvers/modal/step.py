"""One step of the modal solver: forces that hold over it, up to the next event.

A step is 2^STEP ticks long, or as much shorter as it takes for an event to lie in its last
tick. Contact and rock answer with forces that are constant over a step and meet their laws
at its end (docs/modal.md, sections 2 and 3).
"""

from __future__ import annotations

import math

from percussion_model.physics.blows import (
    close_gap,
    open_gap,
    push_checkpoint,
    push_event,
    standstill_force,
    start_blow,
    starts_blow,
)
from percussion_model.physics.body import (
    bit_acceleration,
    book_bit_load,
    book_piston_load,
    hold_effects,
    piston_acceleration,
)
from percussion_model.physics.drive import drive_force, switch_drive
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import DriveKind, Mode, Piston, RockKind
from percussion_model.physics.rock import (
    REST_VELOCITY,
    book_dashpot,
    close_interface,
    crush,
    damping,
    enter_standstill,
    leave_by_velocity,
    leave_standstill,
    origin,
    overcomes_barrier,
    recoverable,
    spring_force,
    stiffness,
)
from percussion_model.solvers.modal.bar import (
    bit_kinetic,
    bit_vibration,
    carry,
    ends_after,
    low_after,
    low_offset,
    move_bar,
    piston_vibration,
    top_offset,
)
from percussion_model.solvers.modal.records import STEP, Reply
from percussion_model.solvers.modal.sets import LOOK, leave_out, take_all

WHOLE = 1 << STEP
# A standstill with less than this share of W_R stays one if nothing comes from outside.
QUIET_SHARE = 0.9


@inlined
def time_of(par, s):
    """Time of a state [s]."""
    return s.time * par.tick


@inlined
def has_piston(par):
    """Whether there is a piston."""
    return par.piston != Piston.ABSENT


@inlined
def gap_of(s, bars):
    """Gap between piston and bit by the places of their ends [m]."""
    top = s.u_b + top_offset(bars.wb, bars.cb, bars.cb.sizes[s.set]) + s.r_t
    return top - (s.u_p + low_offset(bars.wp, bars.cp, bars.wp.shape[1]) + s.r_p)


@kernel
def unpark(par, s, bars):
    """Bring the vibration of the parked piston to the present."""
    ticks = s.time - s.piston_time
    s.e_loss += carry(bars.wp, bars.cp, bars.wp.shape[1], ticks)
    if s.r_p != 0.0:
        # what is beyond the modes dies away within a step or two
        compliance = bars.cp.beyond[0, 1]
        kept = bars.cp.reply[0, STEP, Reply.LOW_KEPT] ** (ticks // WHOLE)
        s.e_loss += 0.5 * s.r_p * s.r_p * (1.0 - kept * kept) / compliance
        s.r_p *= kept
    s.parked = 0
    s.no_park = s.time + LOOK * WHOLE
    s.gap = gap_of(s, bars)


@kernel
def park(par, s, bars):
    """Leave the vibration of the piston behind while it can touch nothing."""
    s.spread_p = par.bound_p * math.sqrt(2.0 * piston_vibration(s, bars)) + abs(s.r_p)
    if s.u_p + s.spread_p < s.u_b - s.spread_p:
        s.parked = 1
        s.piston_time = s.time
    else:
        s.no_park = s.time + LOOK * WHOLE


@kernel
def standing_energy(par, s, bars):
    """Energy of a standing bit about its rest [J]."""
    K = s.gamma * s.k_r
    force = par.mass_b * bit_acceleration(par, s)
    n, c, w = bars.cb.sizes[s.set], bars.cb, bars.wb
    total = par.mass_b * s.v_b * s.v_b
    for k in range(n):
        off = w[0, k] + c.soft[k] * c.low[k] * force
        total += w[1, k] * w[1, k] + off * off / c.soft[k]
    y = s.p - s.p_u - force / K
    r = s.r_b + c.beyond[s.set, 1] * force
    return 0.5 * (total + K * y * y + r * r / c.beyond[s.set, 1])


@kernel
def look(par, s, bars):
    """Look which modes are needed, and whether a standstill may end by itself."""
    s.look = s.time + LOOK * WHOLE
    if s.closed == 0:
        leave_out(par, s, bars)
    if s.mode == Mode.SS and s.closed == 0 and par.rock == RockKind.BILINEAR:
        s.alert = 1 if standing_energy(par, s, bars) > QUIET_SHARE * s.w_r else 0


@kernel
def flip_contact(par, s, bars, approach, blows, events):
    """Open or close the contact of piston and bit."""
    time = time_of(par, s)
    if s.closed == 1:
        s.closed = 0
        s.offset = 0.0
        s.f_contact = 0.0
        s.no_park = s.time + LOOK * WHOLE
        open_gap(s, events, time, approach)
    else:
        if starts_blow(par, s, time):
            still = standstill_force(s, time, s.i_bit)
            start_blow(par, s, blows, time, s.v_p, s.u_b, still)
        s.closed = 1
        close_gap(s, events, time, approach)
        take_all(s, bars)
        # the ends touch here: a tick's way is left between them as long as they do
        s.offset = gap_of(s, bars)
    s.alert = 1
    s.look = s.time + LOOK * WHOLE


@kernel
def change_mode(par, s, bars, events):
    """Make the change of mode that the present state asks for."""
    left, before, energy = s.mode, recoverable(s), bit_kinetic(par, s, bars)
    if s.mode == Mode.FF:
        close_interface(par, s, energy)
    elif par.rock != RockKind.BILINEAR:
        if par.rock == RockKind.WALL:
            s.p_u = s.p
        s.mode = Mode.FF
    elif s.mode == Mode.DFC and s.w >= s.w_r:
        s.mode = Mode.FC
    elif s.mode == Mode.SS:
        s.mode = Mode.FF
        s.e_standstill += before - recoverable(s)
    elif s.mode == Mode.BC and s.p < s.p_u:
        s.mode = Mode.FF
    else:
        leave_by_velocity(par, s, s.v_low, energy)
    if s.mode == Mode.FF:
        if par.rock == RockKind.SPRING or left == Mode.BC:
            s.e_overshoot += before
    if s.mode == Mode.SS:
        enter_standstill(s, time_of(par, s))
        push_checkpoint(s, time_of(par, s))
    elif s.mode == Mode.DFC or s.mode == Mode.FC:
        take_all(s, bars)
    s.alert = 1
    push_event(s, events, time_of(par, s), s.mode, spring_force(s))


@inlined
def passed(par, s, p, v, work, force):
    """Whether a state lies beyond the end of the present mode; energy apart."""
    if par.rock == RockKind.NONE:
        return False
    if s.mode == Mode.FF:
        return p > s.p_u and v > 0.0
    if par.rock == RockKind.SPRING:
        return p < 0.0
    if par.rock == RockKind.WALL:
        return force < 0.0
    if s.mode == Mode.DFC and s.w + work >= s.w_r:
        return True
    if s.mode == Mode.DFC or s.mode == Mode.FC:
        return v < -REST_VELOCITY
    if s.mode == Mode.BC:
        return p < s.p_u or v > REST_VELOCITY
    return par.release == 1 and force < 0.0


@merged
def switches(par, s, u_r):
    """Whether the drive turns at a relative displacement."""
    if par.drive != DriveKind.PRESSURE:
        return False
    return u_r >= 0.0 if s.alpha > 0 else u_r <= -s.reversal


@kernel
def step(par, s, bars, most, blows, events):
    """Go on by a step, of 2^most ticks at most, or to the next event."""
    cb, wb, cp, wp = bars.cb, bars.wb, bars.cp, bars.wp
    if s.time >= s.look:
        look(par, s, bars)
    hold_effects(par, s)
    piston = has_piston(par)
    if piston and s.parked == 0 and s.closed == 0 and s.time >= s.no_park:
        park(par, s, bars)
    alert = s.mode == Mode.SS and s.alert == 1 and par.rock == RockKind.BILINEAR
    if alert and overcomes_barrier(par, s, bit_kinetic(par, s, bars)):
        leave_standstill(par, s, s.v_low)
        if s.mode != Mode.BC:
            take_all(s, bars)
        push_event(s, events, time_of(par, s), s.mode, spring_force(s))
    push = drive_force(par, s)
    a_p = piston_acceleration(par, push) if piston else 0.0
    a_b = bit_acceleration(par, s)
    n_p = wp.shape[1] if par.piston == Piston.ELASTIC else 0
    K, C, start = stiffness(s), damping(s), origin(s)
    rock = s.mode != Mode.FF
    wall = par.rock == RockKind.WALL
    level = most
    flips = 0
    low_now = low_offset(wb, cb, cb.sizes[s.set]) + s.r_b
    while True:
        h = par.tick * (1 << level)
        n = cb.sizes[s.set]
        reply = cb.reply[s.set, level]
        top, low, v_low = ends_after(wb, cb, n, level)
        mean = s.u_b + h * (s.v_b + 0.5 * h * a_b)
        top += mean + reply[Reply.TOP_KEPT] * s.r_t
        path = (mean - s.u_b) + (low + reply[Reply.LOW_KEPT] * s.r_b - low_now)
        v_low += s.v_b + h * a_b
        end = approach = 0.0
        u_p = s.u_p + h * (s.v_p + 0.5 * h * a_p)
        gap_soft = reply[Reply.TOP]
        seen = False
        if piston:
            seen = s.parked == 0
            end = u_p
            if seen:
                if n_p > 0:
                    end += low_after(wp, cp, n_p, level)
                    end += cp.reply[0, level, Reply.LOW_KEPT] * s.r_p
                    gap_soft += cp.reply[0, level, Reply.LOW]
                else:
                    gap_soft += 0.5 * h * h / par.mass_p
            elif end + s.spread_p > top:
                unpark(par, s, bars)
                continue
        near = end - top + s.offset
        force = contact = 0.0
        inverse, first = 0.0, 0.0
        if rock:
            if not wall:
                inverse = 1.0 / (0.5 * K + C / h)
                first = K * (s.p - start)
            whole = reply[Reply.LOW] + inverse
            due = path + first * inverse
            if s.closed == 1:
                det = gap_soft * whole - reply[Reply.CROSS] * reply[Reply.CROSS]
                contact = (near * whole + reply[Reply.CROSS] * due) / det
                force = (due * gap_soft + reply[Reply.CROSS] * near) / det
            else:
                force = due / whole
        elif s.closed == 1:
            contact = near / gap_soft
        if rock:
            path = (force - first) * inverse if not wall else 0.0
        else:
            path += reply[Reply.CROSS] * contact
        v_low += reply[Reply.CROSS_SPEED] * contact - reply[Reply.LOW_SPEED] * force
        overlap = 0.0
        if piston:
            overlap = near - gap_soft * contact + reply[Reply.CROSS] * force
        flip = seen and (contact < 0.0 if s.closed == 1 else overlap > 0.0)
        work = C * path * path / h
        ends = passed(par, s, s.p + path, v_low, work, force)
        v_p = s.v_p + h * a_p
        v_b = s.v_b + h * (a_b + (contact - force) / par.mass_b)
        u_b = s.u_b + 0.5 * h * (s.v_b + v_b)
        if piston and s.closed == 1:
            v_p -= h * contact / par.mass_p
            u_p = s.u_p + 0.5 * h * (s.v_p + v_p)
        turns = piston and switches(par, s, u_p - u_b)
        if (flip or ends or turns) and level > 0:
            level -= 1
            continue
        if flip and flips < 2:
            approach = v_p - v_b
            flip_contact(par, s, bars, approach, blows, events)
            flips += 1
            level = most
            continue
        if wall and rock and ends:
            change_mode(par, s, bars, events)
            rock = False
            continue
        break
    # nothing but the bodies' motion up to here: it is made now
    begin = time_of(par, s)
    s.time += 1 << level
    s.count_steps += 1
    before = recoverable(s)
    n = cb.sizes[s.set]
    if seen:
        if n_p > 0:
            s.e_loss += move_bar(wp, cp, n_p, level, 0.0, -contact)
            kept, compliance = cp.reply[0, level, Reply.LOW_KEPT], cp.beyond[0, 1]
            off = s.r_p + compliance * contact
            s.e_loss += 0.5 * (1.0 - kept * kept) * off * off / compliance
            s.r_p = kept * off - compliance * contact
    reply = cb.reply[s.set, level]
    beyond = cb.beyond[s.set]
    s.e_loss += move_bar(wb, cb, n, level, contact, -force)
    off = s.r_t - beyond[0] * contact
    kept = reply[Reply.TOP_KEPT]
    s.e_loss += 0.5 * (1.0 - kept * kept) * off * off / beyond[0]
    s.r_t = kept * off + beyond[0] * contact
    off = s.r_b + beyond[1] * force
    kept = reply[Reply.LOW_KEPT]
    s.e_loss += 0.5 * (1.0 - kept * kept) * off * off / beyond[1]
    s.r_b = kept * off - beyond[1] * force
    book_bit_load(par, s, u_b - s.u_b)
    if piston:
        book_piston_load(par, s, push, u_p - s.u_p, push * h)
        s.u_p, s.v_p = u_p, v_p
        if seen:
            s.gap = s.offset - overlap
        else:
            s.gap = top - end
    s.u_b, s.v_b, s.v_low = u_b, v_b, v_low
    s.f_contact, s.f_rock = contact, force
    s.p += path
    if rock:
        s.rock_work += force * path
        s.i_bit += force * h
        book_dashpot(s, work)
        crush(par, s, s.p - path)
        s.b_peak_bit = max(s.b_peak_bit, force)
        if begin + h > s.peak_from:
            s.peak_bit_force = max(s.peak_bit_force, force)
    else:
        s.e_standstill += before - recoverable(s)
    if s.closed == 1:
        s.i_contact += contact * h
        s.b_peak_contact = max(s.b_peak_contact, contact)
        if begin + h > s.peak_from:
            s.peak_contact_force = max(s.peak_contact_force, contact)
    if piston:
        u_before = s.u_r
        s.u_r = s.u_p - s.u_b
        s.b_stroke = max(s.b_stroke, -s.u_r)
        switch_drive(par, s, u_before, begin, h, events)
    if ends:
        change_mode(par, s, bars, events)
    elif s.mode == Mode.SS and (s.n_check == 0 or s.count_steps % WHOLE == 0):
        push_checkpoint(s, time_of(par, s))
