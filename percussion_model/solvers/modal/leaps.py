"""Leaps of the bit: any time of free flight or quiet standstill in one move."""

from __future__ import annotations

import math

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.body import (
    bit_acceleration,
    book_bit_load,
    book_piston_load,
    piston_acceleration,
)
from percussion_model.physics.drive import drive_force
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import DriveKind, Mode, RockKind
from percussion_model.physics.rock import barrier_off, recoverable
from percussion_model.solvers.modal.bar import bit_vibration, carry, low_offset, time_to_cover
from percussion_model.solvers.modal.records import STEP, LeapKind, Reply
from percussion_model.solvers.modal.step import (
    QUIET_SHARE,
    WHOLE,
    has_piston,
    standing_energy,
    time_of,
)

# A leap of fewer steps is not worth planning.
FEWEST = 4
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
        now = low_offset(bars.wb, bars.cb, bars.cb.sizes[s.set]) + s.r_b
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
def plan(par, s, bars, ops):
    """Decide whether the bit leaps next; s.leap_end says where to, or -1."""
    s.no_plan = s.time + FEWEST * WHOLE
    if s.closed == 1 or (has_piston(par) and s.parked == 0):
        return
    most = (1 << len(ops.powers)) - 1
    limit = 0.0
    if s.mode == Mode.FF:
        if par.rock == RockKind.NONE or s.p < s.p_u:
            limit = plan_flight(par, s, bars)
            s.leap_kind = LeapKind.FLIGHT
    elif s.mode == Mode.SS and par.rock == RockKind.BILINEAR and s.alert == 0:
        same = s.gamma * s.k_r == par.ss_stiffness and s.c_r == par.ss_damping
        if same and s.set + 1 == len(bars.cb.sizes) and not barrier_off(par, s):
            energy = standing_energy(par, s, bars)
            if energy <= QUIET_SHARE * s.w_r and keeps_contact(par, s, energy):
                limit = plan_standstill(par, s, bars, energy)
                s.leap_kind = LeapKind.STANDSTILL
    steps = min(float(most), limit / par.dt - 1.0)
    if steps >= FEWEST:
        s.leap_end = s.time + int(steps) * WHOLE


@inlined
def load_standstill(s, bars, ops, force):
    """Take the state about its rest under a force."""
    n = bars.cb.sizes[s.set]
    x, rest = ops.x, ops.rest
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
        total -= bars.cb.low[k] * x[k]
    x[2 * n] = total


@kernel
def apply(ops, power):
    """Apply one power of the map; what bar and dashpot take meanwhile [J]."""
    x, y = ops.x, ops.y
    a, f, g = ops.powers[power], ops.loss[power], ops.dashpot[power]
    m = len(x)
    lost = damped = 0.0
    for i in range(m):
        total = bar = dash = 0.0
        for j in range(m):
            total += a[i, j] * x[j]
            bar += f[i, j] * x[j]
            dash += g[i, j] * x[j]
        y[i] = total
        lost += x[i] * bar
        damped += x[i] * dash
    for i in range(m):
        x[i] = y[i]
    return lost, damped


@kernel
def leap_standstill(par, s, bars, ops, steps):
    """Carry the bit over whole steps of standstill; the path of its mean motion [m]."""
    n = bars.cb.sizes[s.set]
    a = bit_acceleration(par, s)
    force = par.mass_b * a
    K = s.gamma * s.k_r
    load_standstill(s, bars, ops, force)
    x, rest = ops.x, ops.rest
    u, before, v = x[2 * n], s.p - s.p_u, s.v_b
    lost = damped = 0.0
    for power in range(len(ops.powers)):
        if (steps >> power) & 1:
            bar, dash = apply(ops, power)
            lost += bar
            damped += dash
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
        s.v_low += bars.cb.low[k] * bars.wb[1, k]
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
    now = low_offset(bars.wb, bars.cb, n) + s.r_b
    s.e_loss += carry(bars.wb, bars.cb, n, ticks)
    beyond = bars.cb.beyond[s.set]
    s.e_loss += 0.5 * (s.r_t * s.r_t / beyond[0] + s.r_b * s.r_b / beyond[1])
    s.r_t = s.r_b = 0.0
    path = h * (s.v_b + 0.5 * h * a)
    s.v_b += h * a
    s.p += path + (low_offset(bars.wb, bars.cb, n) - now)
    s.v_low = s.v_b
    for k in range(n):
        s.v_low += bars.cb.low[k] * bars.wb[1, k]
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
    x = ops.x
    for k in range(steps):
        place = x[2 * n + 3]
        apply(ops, 0)
        change = x[2 * n + 3] - place
        if time_of(par, s) + (k + 1) * par.dt > s.peak_from:
            mean = force + K * (place + 0.5 * change) + s.c_r * change / par.dt
            s.peak_bit_force = max(s.peak_bit_force, mean)
        if k % WHOLE == 0:
            energy = K * place * place + par.mass_b * x[2 * n + 1] * x[2 * n + 1]
            for i in range(n):
                energy += x[i] * x[i] / bars.cb.soft[i] + x[n + i] * x[n + i]
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


KEPT_LOW = int(Reply.LOW_KEPT)
