"""Steps of a bit that meets nothing but the rock: many of one mode in a row.

They are those of `step`, up to rounding, without what a step has to ask where the piston may
take part. The force of a step is found from where the modes would go without it, so that
the end of one step and the beginning of the next are one pass over the modes.
"""

from __future__ import annotations

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.body import (
    bit_acceleration,
    book_bit_load,
    book_piston_load,
    piston_acceleration,
)
from percussion_model.physics.drive import drive_force
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import Mode, RockKind
from percussion_model.physics.rock import (
    book_dashpot,
    crush,
    damping,
    origin,
    recoverable,
    stiffness,
)
from percussion_model.solvers.modal.bar import (
    L_QQ,
    L_QV,
    L_VV,
    LOW,
    QQ,
    QV,
    SOFT,
    TOP,
    VQ,
    VV,
    end_offset,
)
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, store, total
from percussion_model.solvers.modal.piston import has_piston, switches, time_of
from percussion_model.solvers.modal.records import Reply
from percussion_model.solvers.modal.rock_end import passed
from percussion_model.solvers.modal.step import CHECKPOINT


@merged
def may_go_alone(par, s):
    """Whether the next steps are the bit's alone."""
    if s.closed == 1 or (has_piston(par) and s.parked == 0) or par.effects == 1:
        return False
    if par.rock == RockKind.WALL or (s.mode == Mode.SS and s.alert == 1):
        return False
    return s.time < s.look


@inlined
def try_step(w, c, n, level, rows):
    """Where the modes go without a force: into two rows; both ends, and the low one's velocity."""
    m = c.move[level]
    top = low = speed = spread(0.0)
    for k in range(0, n, WIDTH):
        q0, v0, end = load(w, 0, k), load(w, 1, k), load(c.shape, LOW, k)
        q = load(m, QQ, k) * q0 + load(m, QV, k) * v0
        v = load(m, VQ, k) * q0 + load(m, VV, k) * v0
        store(rows, 0, k, q)
        store(rows, 1, k, v)
        top = top + load(c.shape, TOP, k) * q
        low = low + end * q
        speed = speed + end * v
    return total(top), total(low), total(speed)


@inlined
def take_step(w, c, n, level, rows, force):
    """Make the step that was tried, under a force at the low end; the loss [J], that end [m]."""
    m = c.move[level]
    lost = place = spread(0.0)
    for k in range(0, n, WIDTH):
        push = load(c.shape, LOW, k) * force
        still = load(c.shape, SOFT, k) * push
        y, v = load(w, 0, k) + still, load(w, 1, k)
        lost = lost + (load(m, L_QQ, k) * y + load(m, L_QV, k) * v) * y
        lost = lost + load(m, L_VV, k) * (v * v)
        q = load(rows, 0, k) - (still - load(m, QQ, k) * still)
        store(w, 0, k, q)
        place = place + load(c.shape, LOW, k) * q
        store(w, 1, k, load(rows, 1, k) - load(m, QV, k) * push)
    return total(lost), total(place)


@kernel
def go_alone(par, s, bars, rows, level, end):
    """Take steps of 2^level ticks up to a tick at most, as long as no event is ahead."""
    w, c = bars.wb, bars.cb
    which = s.set
    n = c.sizes[which]
    reply = c.reply[which, level]
    beyond_t, beyond = c.beyond[which, 0], c.beyond[which, 1]
    kept_t, kept = reply[Reply.TOP_KEPT], reply[Reply.LOW_KEPT]
    h = par.tick * (1 << level)
    piston = has_piston(par)
    push = drive_force(par, s)
    a_p = piston_acceleration(par, push) if piston else 0.0
    a_b = bit_acceleration(par, s)
    K, C, start = stiffness(s), damping(s), origin(s)
    rock = s.mode != Mode.FF
    inverse = 1.0 / (0.5 * K + C / h) if rock else 0.0
    yields = 1.0 / (reply[Reply.LOW] + inverse) if rock else 0.0
    heavy = h / par.mass_b
    place = end_offset(w, c, n, LOW) + s.r_b
    last = min(end, s.look)
    if par.leaps == 1 and s.no_plan > s.time:
        last = min(last, s.no_plan)
    made = 0
    # each number is booked step by step, so that it does not matter where a call ends
    while s.time + (1 << level) <= last:
        top, low, speed = try_step(w, c, n, level, rows)
        mean = h * (s.v_b + 0.5 * h * a_b)
        path = mean + (low + kept * s.r_b - place)
        speed += s.v_b + h * a_b
        force = work = 0.0
        if rock:
            first = K * (s.p - start)
            force = (path + first * inverse) * yields
            path = (force - first) * inverse
            work = C * path * path / h
            speed -= reply[Reply.LOW_SPEED] * force
        v_b = s.v_b + h * a_b - heavy * force
        way = 0.5 * h * (s.v_b + v_b)
        way_p = h * (s.v_p + 0.5 * h * a_p)
        if passed(par, s, s.p + path, speed, work, force):
            break
        if piston:
            u_r = (s.u_p + way_p) - (s.u_b + way)
            if s.u_p + way_p + s.spread_p > s.u_b + mean + top + kept_t * s.r_t:
                break
            if switches(par, s, u_r):
                break
            book_piston_load(par, s, push, way_p, push * h)
            s.u_p += way_p
            s.v_p += h * a_p
            s.u_r = u_r
            s.gap = -u_r
            s.b_stroke = max(s.b_stroke, -u_r)
        lost, place = take_step(w, c, n, level, rows, force)
        s.e_loss += lost
        off = s.r_b + beyond * force
        s.e_loss += 0.5 * (1.0 - kept * kept) * off * off / beyond
        s.r_b = kept * off - beyond * force
        s.e_loss += 0.5 * (1.0 - kept_t * kept_t) * s.r_t * s.r_t / beyond_t
        s.r_t *= kept_t
        place += s.r_b
        book_bit_load(par, s, way)
        before = recoverable(s)
        s.time += 1 << level
        s.count_steps += 1
        s.u_b += way
        s.v_b, s.v_low, s.f_rock = v_b, speed, force
        s.p += path
        if rock:
            s.i_bit += force * h
            s.rock_work += force * path
            book_dashpot(s, work)
            crush(par, s, s.p - path)
            s.b_peak_bit = max(s.b_peak_bit, force)
            if time_of(par, s) > s.peak_from:
                s.peak_bit_force = max(s.peak_bit_force, force)
            if s.mode == Mode.SS and s.count_steps % CHECKPOINT == 0:
                push_checkpoint(s, time_of(par, s))
        else:
            s.e_standstill += before - recoverable(s)
        made = 1
    return made
