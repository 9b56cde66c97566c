"""Leaps of the bit: any time of free flight or quiet standstill in one move."""

from __future__ import annotations

import math

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.body import (
    bit_acceleration,
    book_bit_load,
    book_piston_load,
    piston_acceleration,
    time_to_cover,
)
from percussion_model.physics.drive import drive_force
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import DriveKind, Mode, RockKind
from percussion_model.physics.rock import barrier_off, recoverable
from percussion_model.solvers.modal.bar import (
    LOW,
    QQ,
    QV,
    STIFF,
    TOP,
    VQ,
    VV,
    bit_vibration,
    carry,
    end_offset,
)
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, store, total
from percussion_model.solvers.modal.piston import WHOLE, has_piston, switches, time_of
from percussion_model.solvers.modal.records import STEP, LeapKind
from percussion_model.solvers.modal.rock_end import QUIET_SHARE, standing_energy
from percussion_model.solvers.modal.standstill import POWERS

# Most steps of a leap.
LONGEST = (1 << POWERS) - 1
# A leap of fewer is not worth planning.
FEWEST = 4
# Where bounds tell too little, the next steps are looked at, 2^HOP at a time, so far ahead.
HOP, SEARCHED = 2, 1 << 9
# A standstill is searched for peaks until its vibration is below this share of the load.
STILL_SHARE = 1e-3


@merged
def keeps_contact(par, s, energy):
    """Whether a standstill of that energy about its rest cannot lose its contact force."""
    if par.release == 0:
        return True
    rest = par.mass_b * bit_acceleration(par, s)
    K = s.gamma * s.k_r
    # |dF| <= K |dy| + C |v|: the end's offset and, by all modes together, its velocity
    spread = math.sqrt(2.0 * energy * K)
    speed = math.sqrt(2.0 * energy) * par.end_speed
    return spread + s.c_r * speed < rest


@merged
def until_drive(par, s, v, a, spread):
    """Time before which the drive cannot turn, for a relative mean motion [s]."""
    if par.drive != DriveKind.PRESSURE:
        return math.inf
    if s.alpha > 0:
        return time_to_cover(-s.u_r - spread, v, a)
    return time_to_cover(s.reversal + s.u_r - spread, -v, -a)


@kernel
def quiet_time(par, s, v_b, a_b, spread_top, spread_mean):
    """Time before which the piston can neither meet the bit nor turn the drive [s].

    Parameters
    ----------
    v_b, a_b : float
        Mean motion of the bit [m/s, m/s2].
    spread_top, spread_mean : float
        How far its top end and its mean may be from that [m].
    """
    if not has_piston(par):
        return math.inf
    a = piston_acceleration(par, drive_force(par, s)) - a_b
    v = s.v_p - v_b
    room = s.u_b - s.u_p - s.spread_p - spread_top - spread_mean
    limit = time_to_cover(room, v, a)
    return min(limit, until_drive(par, s, v, a, spread_mean))


@kernel
def plan_flight(par, s, bars):
    """Time of free flight before anything can happen [s]."""
    spread = math.sqrt(2.0 * bit_vibration(par, s, bars))
    a = bit_acceleration(par, s)
    beyond = abs(s.r_t) + abs(s.r_b)
    limit = quiet_time(par, s, s.v_b, a, par.bound_t * spread + beyond, 0.0)
    if par.rock != RockKind.NONE:
        now = end_offset(bars.wb, bars.cb, bars.cb.sizes[s.set], LOW) + s.r_b
        room = s.p_u - s.p + now - par.bound_b * spread - beyond
        limit = min(limit, time_to_cover(room, s.v_b, a))
    return limit


@kernel
def plan_standstill(par, s, bars, energy):
    """Time of a quiet standstill before anything can happen [s]."""
    K = s.gamma * s.k_r
    size = math.sqrt(2.0 * energy)
    mean = size * (1.0 / math.sqrt(K) + par.bound_b)
    off = s.p_u + par.mass_b * bit_acceleration(par, s) / K - s.p
    return quiet_time(par, s, 0.0, 0.0, par.bound_t * size, 2.0 * mean + abs(off))


@kernel
def search_flight(par, s, bars, ops, most):
    """Steps of free flight, `most` at most, before the rock, piston or a switch is seen."""
    c, w, rows = bars.cb, bars.wb, ops.rows
    n = c.sizes[s.set]
    for k in range(n):
        rows[0, k], rows[1, k] = w[0, k], w[1, k]
    h = par.dt * (1 << HOP)
    a = bit_acceleration(par, s)
    piston = has_piston(par)
    a_p = piston_acceleration(par, drive_force(par, s)) if piston else 0.0
    beyond = abs(s.r_b) + abs(s.r_t)
    now = end_offset(w, c, n, LOW) + s.r_b
    steps = 0
    while steps + (1 << HOP) <= most:
        top, low = hop(rows, c, n, STEP + HOP)
        t = (steps >> HOP) * h + h
        path = t * (s.v_b + 0.5 * a * t)
        if par.rock != RockKind.NONE and s.p + path + low - now + beyond >= s.p_u:
            break
        if piston:
            end = s.u_p + t * (s.v_p + 0.5 * a_p * t)
            if end + s.spread_p + beyond >= s.u_b + path + top:
                break
            if switches(par, s, end - s.u_b - path):
                break
        steps += 1 << HOP
    return steps


@kernel
def search_standstill(par, s, bars, ops, most):
    """Steps of standstill, `most` at most, before the contact force is lost."""
    force = par.mass_b * bit_acceleration(par, s)
    load_standstill(s, bars, ops, force)
    m, steps = 2 * bars.cb.sizes[s.set] + 4, 0
    while steps + (1 << HOP) <= most:
        apply(ops, HOP, m)
        if force + pull(par, s, bars, ops.x[0]) <= 0.0:
            break
        steps += 1 << HOP
    return steps


@kernel
def plan(par, s, bars, ops):
    """Decide whether the bit leaps next; s.leap_end says where to, or -1."""
    s.no_plan = s.time + FEWEST * WHOLE
    if s.closed == 1 or (has_piston(par) and s.parked == 0):
        return
    steps = 0.0
    if s.mode == Mode.FF:
        if par.rock == RockKind.NONE or s.p < s.p_u:
            s.leap_kind = LeapKind.FLIGHT
            steps = min(plan_flight(par, s, bars) / par.dt - 1.0, LONGEST)
            if steps < SEARCHED:
                steps = max(steps, search_flight(par, s, bars, ops, SEARCHED))
    elif s.mode == Mode.SS and par.rock == RockKind.BILINEAR and s.alert == 0:
        same = s.gamma * s.k_r == par.ss_stiffness and s.c_r == par.ss_damping
        energy = standing_energy(par, s, bars)
        safe = not barrier_off(par, s) and energy <= QUIET_SHARE * s.w_r
        if same and safe and s.set + 1 == len(bars.cb.sizes):
            s.leap_kind = LeapKind.STANDSTILL
            steps = min(plan_standstill(par, s, bars, energy) / par.dt - 1.0, LONGEST)
            if not keeps_contact(par, s, energy):
                most = int(max(0.0, min(steps, float(SEARCHED))))
                steps = search_standstill(par, s, bars, ops, most)
    if steps >= FEWEST:
        s.leap_end = s.time + int(steps) * WHOLE


@inlined
def hop(rows, c, n, level):
    """Move copied free modes over 2^level ticks; offsets of top and low end [m]."""
    m = c.move[level]
    top = low = spread(0.0)
    for k in range(0, n, WIDTH):
        q0, v0 = load(rows, 0, k), load(rows, 1, k)
        q = load(m, QQ, k) * q0 + load(m, QV, k) * v0
        store(rows, 0, k, q)
        store(rows, 1, k, load(m, VQ, k) * q0 + load(m, VV, k) * v0)
        top = top + load(c.shape, TOP, k) * q
        low = low + load(c.shape, LOW, k) * q
    return total(top), total(low)


@inlined
def pull(par, s, bars, x):
    """Force of the rock about that at rest, of a standstill [N]."""
    n = bars.cb.sizes[s.set]
    speed = x[2 * n + 1]
    for k in range(n):
        speed += bars.cb.shape[LOW, k] * x[n + k]
    return s.gamma * s.k_r * x[2 * n + 3] + s.c_r * speed


@inlined
def load_standstill(s, bars, ops, force):
    """Take the state about its rest under a force."""
    n = bars.cb.sizes[s.set]
    x, rest = ops.x[0], ops.rest
    for k in range(n):
        x[k] = bars.wb[0, k] - force * rest[k]
        x[n + k] = bars.wb[1, k]
    # places along the hole count from where the rock is unloaded
    x[2 * n] = -force * rest[2 * n]
    x[2 * n + 1] = s.v_b
    x[2 * n + 2] = s.r_b - force * rest[2 * n + 2]
    x[2 * n + 3] = (s.p - s.p_u) - force * rest[2 * n + 3]
    total = x[2 * n + 3] - x[2 * n + 2]
    for k in range(n):
        total -= bars.cb.shape[LOW, k] * x[k]
    x[2 * n] = total


@inlined
def multiply(columns, x, y, m):
    """Product of a map, column by column, with `x`; into `y`."""
    for i in range(0, y.shape[1], WIDTH):
        even = odd = spread(0.0)
        for k in range(0, m, 2):
            even = even + load(columns, k, i) * x[0, k]
            odd = odd + load(columns, k + 1, i) * x[0, k + 1]
        store(y, 0, i, even + odd)


@inlined
def quadratic(form, x, y, m):
    """Value of a symmetric form at `x` [J]."""
    multiply(form, x, y, m)
    value = spread(0.0)
    for i in range(0, y.shape[1], WIDTH):
        value = value + load(x, 0, i) * load(y, 0, i)
    return total(value)


@inlined
def apply(ops, power, m):
    """Apply one power of the map to `ops.x`."""
    multiply(ops.powers[power], ops.x, ops.y, m)
    for i in range(0, ops.x.shape[1], WIDTH):
        store(ops.x, 0, i, load(ops.y, 0, i))


@kernel
def leap_standstill(par, s, bars, ops, steps):
    """Carry the bit over whole steps of standstill; the path of its mean motion [m]."""
    n = bars.cb.sizes[s.set]
    a = bit_acceleration(par, s)
    force = par.mass_b * a
    K = s.gamma * s.k_r
    load_standstill(s, bars, ops, force)
    m, x, rest = 2 * n + 4, ops.x[0], ops.rest
    u, before, v = x[2 * n], s.p - s.p_u, s.v_b
    lost = damped = 0.0
    for power in range(len(ops.powers)):
        if (steps >> power) & 1:
            lost += quadratic(ops.loss[power], ops.x, ops.y, m)
            damped += quadratic(ops.dashpot[power], ops.x, ops.y, m)
            apply(ops, power, m)
    for k in range(n):
        bars.wb[0, k] = x[k] + force * rest[k]
        bars.wb[1, k] = x[n + k]
    s.v_b = x[2 * n + 1]
    s.r_b = x[2 * n + 2] + force * rest[2 * n + 2]
    after = x[2 * n + 3] + force * rest[2 * n + 3]
    s.p += after - before
    s.r_t = 0.0
    s.v_low = s.v_b
    for k in range(n):
        s.v_low += bars.cb.shape[LOW, k] * bars.wb[1, k]
    s.f_rock = K * after + s.c_r * s.v_low
    s.e_loss += lost
    s.e_standstill += damped
    s.rock_work += 0.5 * K * (after - before) * (after + before) + damped
    s.i_bit += force * (steps * par.dt) - par.mass_b * (s.v_b - v)
    return x[2 * n] - u


@merged
def leap_flight(par, s, bars, ticks):
    """Carry the bit over free flight; the path of its mean motion [m]."""
    n = bars.cb.sizes[s.set]
    h = ticks * par.tick
    a = bit_acceleration(par, s)
    before = recoverable(s)
    now = end_offset(bars.wb, bars.cb, n, LOW) + s.r_b
    s.e_loss += carry(bars.wb, bars.cb, n, ticks)
    beyond = bars.cb.beyond[s.set]
    s.e_loss += 0.5 * (s.r_t * s.r_t / beyond[0] + s.r_b * s.r_b / beyond[1])
    s.r_t = s.r_b = 0.0
    path = h * (s.v_b + 0.5 * h * a)
    s.v_b += h * a
    s.p += path + (end_offset(bars.wb, bars.cb, n, LOW) - now)
    s.v_low = s.v_b
    for k in range(n):
        s.v_low += bars.cb.shape[LOW, k] * bars.wb[1, k]
    s.f_rock = 0.0
    s.e_standstill += before - recoverable(s)
    return path


@kernel
def note_peak(par, s, bars, ops, steps):
    """Note the greatest bit force of a standstill leap about to be made."""
    n = bars.cb.sizes[s.set]
    force = par.mass_b * bit_acceleration(par, s)
    K = s.gamma * s.k_r
    load_standstill(s, bars, ops, force)
    m, x = 2 * n + 4, ops.x[0]
    for k in range(steps):
        place = x[2 * n + 3]
        apply(ops, 0, m)
        change = x[2 * n + 3] - place
        if time_of(par, s) + (k + 1) * par.dt > s.peak_from:
            mean = force + K * (place + 0.5 * change) + s.c_r * change / par.dt
            s.peak_bit_force = max(s.peak_bit_force, mean)
        if k % WHOLE == 0:
            energy = K * place * place + par.mass_b * x[2 * n + 1] * x[2 * n + 1]
            for i in range(n):
                energy += x[i] * x[i] * bars.cb.shape[STIFF, i] + x[n + i] * x[n + i]
            if K * energy < (STILL_SHARE * force) ** 2:
                s.peak_bit_force = max(s.peak_bit_force, force)
                return


@kernel
def leap(par, s, bars, ops):
    """Carry bit and mean motion of the piston to s.leap_end in one go."""
    ticks = s.leap_end - s.time
    h = ticks * par.tick
    if s.mode == Mode.SS:
        push_checkpoint(s, time_of(par, s))
        if time_of(par, s) + h > s.peak_from:
            note_peak(par, s, bars, ops, ticks >> STEP)
    if s.leap_kind == LeapKind.FLIGHT:
        path = leap_flight(par, s, bars, ticks)
    else:
        path = leap_standstill(par, s, bars, ops, ticks >> STEP)
    book_bit_load(par, s, path)
    s.u_b += path
    if has_piston(par):
        push = drive_force(par, s)
        a = piston_acceleration(par, push)
        way = h * (s.v_p + 0.5 * h * a)
        # the stroke's turning point lies within
        turn = -(s.v_p - s.v_b) / a if a != 0.0 else -1.0
        if 0.0 < turn < h and s.v_p < 0.0:
            s.b_stroke = max(s.b_stroke, -(s.u_r + 0.5 * (s.v_p - s.v_b) * turn))
        book_piston_load(par, s, push, way, push * h)
        s.u_p += way
        s.v_p += h * a
        s.u_r = s.u_p - s.u_b
        s.b_stroke = max(s.b_stroke, -s.u_r)
        s.gap = s.u_b - s.u_p
    s.time = s.leap_end
    s.leap_end = -1
    s.no_plan = s.time
    s.count_leaps += 1
    if s.mode == Mode.SS:
        push_checkpoint(s, time_of(par, s))
