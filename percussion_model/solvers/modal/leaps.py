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
    BIT,
    LOAD,
    LOW,
    QQ,
    QV,
    SOFT,
    STIFF,
    TOP,
    VQ,
    VV,
    Q,
    V,
    carry,
    row_sum,
)
from percussion_model.solvers.modal.forms import refresh_loads, refresh_sums, vibration
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, store, total
from percussion_model.solvers.modal.piston import WHOLE, has_piston, switches, time_of
from percussion_model.solvers.modal.records import STEP, LeapKind
from percussion_model.solvers.modal.rock_end import QUIET_SHARE, standing_energy
from percussion_model.solvers.modal.standstill import FEW, POWERS

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
    spread = math.sqrt(2.0 * vibration(s, bars))
    a = bit_acceleration(par, s)
    limit = quiet_time(par, s, s.v_b, a, par.bound_t * spread + abs(s.offset), 0.0)
    if par.rock != RockKind.NONE:
        now = s.low - s.at_b / par.mass_b
        room = s.p_u - s.p + now - par.bound_b * spread
        limit = min(limit, time_to_cover(room, s.v_b, a))
    return limit


@kernel
def plan_standstill(par, s, bars, energy):
    """Time of a quiet standstill before anything can happen [s]."""
    K = s.gamma * s.k_r
    size = math.sqrt(2.0 * energy)
    mean = size * (1.0 / math.sqrt(K) + par.bound_b)
    off = s.p_u + par.mass_b * bit_acceleration(par, s) / K - s.p
    spread = par.bound_t * size + abs(s.offset)
    return quiet_time(par, s, 0.0, 0.0, spread, 2.0 * mean + abs(off))


@kernel
def search_flight(par, s, bars, most):
    """Steps of free flight, `most` at most, before the rock, piston or a switch is seen."""
    w, rows, n = bars.w, bars.rows, s.active
    for k in range(n):
        rows[Q, k], rows[V, k] = w[Q, k], w[V, k]
    rows[Q, 0] = rows[V, 0] = 0.0
    h = par.dt * (1 << HOP)
    a = bit_acceleration(par, s)
    piston = has_piston(par)
    a_p = piston_acceleration(par, drive_force(par, s)) if piston else 0.0
    shape, m = bars.forms.shape[s.form], bars.forms.move[s.form, STEP + HOP]
    now = s.low - s.at_b / par.mass_b
    steps = 0
    while steps + (1 << HOP) <= most:
        top, low = hop(rows, shape, m, n)
        t = (steps >> HOP) * h + h
        path = t * (s.v_b + 0.5 * a * t)
        if par.rock != RockKind.NONE and s.p + path + low - now >= s.p_u:
            break
        if piston:
            end = s.u_p + t * (s.v_p + 0.5 * a_p * t)
            if end + s.spread_p >= s.u_b + path + top + s.offset:
                break
            if switches(par, s, end - s.u_b - path):
                break
        steps += 1 << HOP
    return steps


@kernel
def search_standstill(par, s, bars, ops, most):
    """Steps of standstill, `most` at most, before the contact force is lost."""
    force = par.mass_b * bit_acceleration(par, s)
    load_standstill(s, bars, ops)
    steps = 0
    while steps + (1 << HOP) <= most:
        apply(ops, HOP)
        if force + pull(s, bars, ops.x) <= 0.0:
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
                steps = max(steps, search_flight(par, s, bars, SEARCHED))
    elif s.form == 2 and s.mode == Mode.SS and s.alert == 0 and s.active == FEW:
        energy = standing_energy(s, bars)
        safe = not barrier_off(par, s) and energy <= QUIET_SHARE * s.w_r
        if safe and s.c_r == par.c_r:
            s.leap_kind = LeapKind.STANDSTILL
            steps = min(plan_standstill(par, s, bars, energy) / par.dt - 1.0, LONGEST)
            if not keeps_contact(par, s, energy):
                most = int(max(0.0, min(steps, float(SEARCHED))))
                steps = search_standstill(par, s, bars, ops, most)
    if steps >= FEWEST:
        s.leap_end = s.time + int(steps) * WHOLE


@kernel
def hop(rows, shape, m, n):
    """Move copied free modes; offsets of top and low end [m]."""
    top = low = spread(0.0)
    for k in range(0, n, WIDTH):
        q0, v0 = load(rows, Q, k), load(rows, V, k)
        q = load(m, QQ, k) * q0 + load(m, QV, k) * v0
        store(rows, Q, k, q)
        store(rows, V, k, load(m, VQ, k) * q0 + load(m, VV, k) * v0)
        top = top + load(shape, TOP, k) * q
        low = low + load(shape, LOW, k) * q
    return total(top), total(low)


@kernel
def pull(s, bars, x):
    """Force of the rock about that at rest, of a standstill [N]."""
    low = speed = spread(0.0)
    shape = bars.forms.shape[2]
    for k in range(0, FEW, WIDTH):
        low = low + load(shape, LOW, k) * load(x, 0, k)
        speed = speed + load(shape, LOW, k) * load(x, 0, FEW + k)
    return s.gamma * s.k_r * total(low) + s.c_r * total(speed)


@kernel
def load_standstill(s, bars, ops):
    """Take the state about its rest."""
    shape = bars.forms.shape[2]
    for k in range(0, FEW, WIDTH):
        rest = load(shape, SOFT, k) * load(bars.w, LOAD, k)
        store(ops.x, 0, k, load(bars.w, Q, k) - rest)
        store(ops.x, 0, FEW + k, load(bars.w, V, k))


@inlined
def multiply(columns, x, y):
    """Product of a map, column by column, with `x`; into `y`."""
    m = columns.shape[0]
    for i in range(0, m, WIDTH):
        even = odd = spread(0.0)
        for k in range(0, m, 2):
            even = even + load(columns, k, i) * x[0, k]
            odd = odd + load(columns, k + 1, i) * x[0, k + 1]
        store(y, 0, i, even + odd)


@kernel
def quadratic(form, x, y):
    """Value of a symmetric form at `x` [J]."""
    multiply(form, x, y)
    value = spread(0.0)
    for i in range(0, y.shape[1], WIDTH):
        value = value + load(x, 0, i) * load(y, 0, i)
    return total(value)


@kernel
def apply(ops, power):
    """Apply one power of the map to `ops.x`."""
    multiply(ops.powers[power], ops.x, ops.y)
    for i in range(0, ops.x.shape[1], WIDTH):
        store(ops.x, 0, i, load(ops.y, 0, i))


@kernel
def leap_standstill(par, s, bars, ops, steps):
    """Carry the bit over whole steps of standstill; the path of its mean motion [m]."""
    shape, K = bars.forms.shape[2], s.gamma * s.k_r
    before, mean, v_b = s.low, s.at_b, s.v_b
    load_standstill(s, bars, ops)
    lost = damped = 0.0
    for power in range(len(ops.powers)):
        if (steps >> power) & 1:
            lost += quadratic(ops.loss[power], ops.x, ops.y)
            damped += quadratic(ops.dashpot[power], ops.x, ops.y)
            apply(ops, power)
    for k in range(0, FEW, WIDTH):
        rest = load(shape, SOFT, k) * load(bars.w, LOAD, k)
        store(bars.w, Q, k, load(ops.x, 0, k) + rest)
        store(bars.w, V, k, load(ops.x, 0, FEW + k))
    refresh_sums(s, bars)
    s.v_low = row_sum(shape, LOW, bars.w, V, FEW)
    s.v_b = row_sum(shape, BIT, bars.w, V, FEW) / par.mass_b
    s.p += s.low - before
    s.f_rock = K * s.low + s.c_r * s.v_low
    s.e_loss += lost
    s.e_standstill += damped
    s.rock_work += 0.5 * K * (s.low - before) * (s.low + before) + damped
    s.i_bit += par.mass_b * (s.a_b * (steps * par.dt) - (s.v_b - v_b))
    return (s.at_b - mean) / par.mass_b


@merged
def leap_flight(par, s, bars, ticks):
    """Carry the bit over free flight; the path of its mean motion [m]."""
    h = ticks * par.tick
    a, root = bit_acceleration(par, s), math.sqrt(par.mass_b)
    before, low = recoverable(s), s.low
    s.e_loss += carry(bars.w, bars.forms.move[0], 1, s.active, ticks)
    path = h * (s.v_b + 0.5 * h * a)
    s.v_b += h * a
    bars.w[Q, 0] += root * path
    bars.w[V, 0] = root * s.v_b
    refresh_sums(s, bars)
    s.p += s.low - low
    s.v_low = row_sum(bars.forms.shape[0], LOW, bars.w, V, s.active)
    s.f_rock = 0.0
    s.e_standstill += before - recoverable(s)
    return path


@kernel
def note_peak(par, s, bars, ops, steps):
    """Note the greatest bit force of a standstill leap about to be made."""
    force, shape = par.mass_b * bit_acceleration(par, s), bars.forms.shape[2]
    K = s.gamma * s.k_r
    load_standstill(s, bars, ops)
    place = row_sum(shape, LOW, ops.x, 0, FEW)
    for k in range(steps):
        apply(ops, 0)
        before, place = place, row_sum(shape, LOW, ops.x, 0, FEW)
        if time_of(par, s) + (k + 1) * par.dt > s.peak_from:
            mean = force + 0.5 * K * (before + place) + s.c_r * (place - before) / par.dt
            s.peak_bit_force = max(s.peak_bit_force, mean)
        if k % WHOLE == 0:
            energy = 0.0
            for i in range(FEW):
                energy += ops.x[0, i] * ops.x[0, i] * shape[STIFF, i]
                energy += ops.x[0, FEW + i] * ops.x[0, FEW + i]
            if K * energy < (STILL_SHARE * force) ** 2:
                s.peak_bit_force = max(s.peak_bit_force, force)
                return


@kernel
def leap(par, s, bars, ops):
    """Carry bit and mean motion of the piston to s.leap_end in one go."""
    ticks = s.leap_end - s.time
    h = ticks * par.tick
    if s.a_b != bit_acceleration(par, s):
        refresh_loads(s, bars, bit_acceleration(par, s), s.a_p)
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
