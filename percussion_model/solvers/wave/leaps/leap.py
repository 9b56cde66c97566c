"""Leaps of the bit: many steps of free flight, standstill or contact in one go.

While the bit's mode does not change, a step is a constant linear map of its
waves. Powers of that map, made once from the step itself, carry the bit over
any number of steps; a leap ends before the next event can happen
(docs/numerics.md, section 5).
"""

from __future__ import annotations

import math

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.loads import bit_acceleration, bit_load, book_bit_load, time_to_cover
from percussion_model.physics.records import Mode, RockKind
from percussion_model.physics.rock import (
    barrier_level,
    barrier_off,
    book_dashpot,
    crush,
    origin,
    recoverable,
)
from percussion_model.solvers.wave.bar import (
    deviation_energy,
    mean_velocity,
    strain_offset,
)
from percussion_model.solvers.wave.leaps.linear import (
    carry,
    carry_and_sum,
    dot,
    load,
    pad,
    remove_mean,
    store,
)
from percussion_model.solvers.wave.leaps.lookahead import (
    GRAIN,
    LOOKAHEAD,
    has_operators,
    load_contact,
    look_ahead,
    step_constants,
    steps_in_contact,
    steps_in_flight,
)
from percussion_model.solvers.wave.records import Coef, LeapKind
from percussion_model.solvers.wave.rock_end import note_peak
from percussion_model.solvers.wave.totals import time_of

# A leap shorter than this costs more than the steps it saves.
FEWEST_STEPS = 8
# Standstill can end only above W_R; below this share of it the barrier is safe.
QUIET_SHARE = 0.9

# Standstill is searched until its vibration is below this share of the force at rest.
STILL_SHARE = 1e-3

# What a vibration loses is not booked below this share of the energy put in so far,
# which changes no digit of the ledger.
NEGLIGIBLE = 1e-17


@merged
def longest_leap(par):
    """Most steps that the powers at hand can carry a bar."""
    return (1 << (2 * par.leaps)) - 1


@kernel
def standstill_energy(par, s, wb, cb):
    """Energy of the bit about its rest on the rock [J]."""
    a = bit_acceleration(par, s)
    K = s.gamma * s.k_r
    y = s.p - s.p_u - par.mass_b * a / K
    return deviation_energy(wb, cb, par.n_b, 2 * s.parity, 0.0, a) + 0.5 * K * y * y


@merged
def stays_below_barrier(par, s, energy):
    """Whether a standstill of that energy stays below the barrier."""
    if barrier_off(par, s):
        return False
    return energy <= QUIET_SHARE * barrier_level(par, s)


@merged
def keeps_contact(par, s, energy):
    """Whether a standstill of that energy cannot lose its contact force."""
    if par.release == 0:
        return True
    rest = bit_load(par, s)
    if rest <= 0.0:
        return False
    # |dF| <= K |dy| + C |v| with both terms bounded by the energy
    K = s.gamma * s.k_r
    spread = math.sqrt(2.0 * energy * K)
    end = 2.0 * math.sqrt(energy / (par.z_b * par.dt))
    return spread * (1.0 + s.c_r / par.z_b) + s.c_r * end < rest


@merged
def plan_flight(par, s, wb, cb, lookahead, scratch, most):
    """Steps of free flight before the rock can be met, at most `most`."""
    if par.rock == RockKind.NONE:
        return most
    if s.p >= s.p_u:  # let go while the rock still springs back
        return steps_in_flight(par, s, wb, cb, lookahead, scratch, most)
    energy = deviation_energy(wb, cb, par.n_b, 2 * s.parity, s.v_b, 0.0)
    a = bit_acceleration(par, s)
    room = s.p_u - s.p - 2.0 * par.bound_b * math.sqrt(2.0 * energy)
    limit = time_to_cover(room, s.v_b, a)
    if limit >= most * par.dt:
        return most
    steps = int(limit / par.dt) - 1
    if steps < LOOKAHEAD and par.rock == RockKind.BILINEAR:
        # the bound is too coarse so close to the rock: look
        steps = max(steps, steps_in_flight(par, s, wb, cb, lookahead, scratch, most))
    return steps


@kernel
def plan_leap(par, s, wb, cb, lookahead, scratch, most):
    """Decide how far the bit may leap next, at most `most` steps.

    s.leap_end says where to, or -1.
    """
    steps = 0
    predicted = False
    s.v_b = mean_velocity(wb, cb, par.n_b, 2 * s.parity, par.mass_b)
    if s.mode == Mode.FF:
        s.leap_kind = LeapKind.FLIGHT
        if par.rock == RockKind.NONE or par.rock == RockKind.BILINEAR or s.p < s.p_u:
            steps = plan_flight(par, s, wb, cb, lookahead, scratch, most)
            predicted = par.rock == RockKind.BILINEAR
    elif par.rock == RockKind.BILINEAR and has_operators(par, s):
        s.leap_kind = LeapKind.CONTACT
        if s.mode == Mode.SS:
            energy = standstill_energy(par, s, wb, cb)
            if not stays_below_barrier(par, s, energy):
                most = 0
            elif keeps_contact(par, s, energy):
                s.leap_kind = LeapKind.STANDSTILL
                steps = most
        if s.leap_kind == LeapKind.CONTACT and most >= FEWEST_STEPS:
            steps = steps_in_contact(par, s, wb, cb, lookahead, scratch, most)
            predicted = True
    if steps >= FEWEST_STEPS:
        s.leap_end = s.step + steps - steps % GRAIN
    elif predicted:
        s.no_plan = s.step + steps + 1  # just past the event
    else:
        s.no_plan = s.step + FEWEST_STEPS


@merged
def is_booked(s, energy):
    """Whether what a vibration of that energy [J] loses shows in the ledger."""
    given = abs(s.e_start) + abs(s.e_drive) + abs(s.e_feed) + abs(s.e_gravity)
    return energy > NEGLIGIBLE * given


@kernel
def leap_free_bar(par, s, w, c, n, mass, v0, v1, steps, powers, loss, size, scratch):
    """Carry the vibration of a free bar over `steps` steps."""
    x, y = scratch.x, scratch.y
    r = 2 * s.parity
    load(x, w, c, n, r, v0, 0.0)
    pad(x, 2 * n, size)
    lossy = par.loss > 0 and is_booked(s, deviation_energy(w, c, n, r, v0, 0.0))
    lost, _ = carry_and_sum(powers, loss, loss, lossy, False, steps, x, y, size)
    s.e_loss += lost
    remove_mean(x, c, n, mass)
    store(x, w, c, n, r, v1, 0.0)


@merged
def leap_flight(par, s, wb, cb, ops, steps, scratch):
    """Carry the bit over `steps` steps of free flight."""
    powers, loss = ops.bit[Mode.FF], ops.loss[Mode.FF]
    r = 2 * s.parity
    a = bit_acceleration(par, s)
    time = steps * par.dt
    offset = strain_offset(wb, cb, par.n_b, r, Coef.BOTTOM)
    unloading = recoverable(par, s)
    v0 = s.v_b
    s.v_b = v0 + a * time
    path = (v0 + 0.5 * a * time) * time
    size = par.size_r
    leap_free_bar(
        par, s, wb, cb, par.n_b, par.mass_b, v0, s.v_b, steps, powers, loss, size, scratch
    )
    s.p += path - (strain_offset(wb, cb, par.n_b, r, Coef.BOTTOM) - offset)
    s.e_standstill += unloading - recoverable(par, s)
    return path


@merged
def leap_standstill(par, s, wb, cb, ops, steps, scratch):
    """Carry the bit over `steps` steps of standstill.

    Returns
    -------
    path : float
        Path of the bit's mean motion as its body forces see it [m].
    """
    r = 2 * s.parity
    n, size = par.n_b, par.size_r
    x, y = scratch.x, scratch.y
    a = bit_acceleration(par, s)
    K = s.gamma * s.k_r
    still = s.p_u + par.mass_b * a / K
    v0 = s.v_b
    spring = 0.5 * K * (s.p - s.p_u) * (s.p - s.p_u)
    load(x, wb, cb, n, r, 0.0, a)
    x[2 * n] = s.p - still
    pad(x, 2 * n + 1, size)
    booked = is_booked(s, standstill_energy(par, s, wb, cb))
    path = dot(ops.sums[Mode.SS], x, size)
    lost, squares = carry_and_sum(
        ops.bit[Mode.SS], ops.loss[Mode.SS], ops.squares,
        booked and par.loss > 0, booked, steps, x, y, size,
    )  # fmt: skip
    path -= dot(ops.sums[Mode.SS], x, size)
    store(x, wb, cb, n, r, 0.0, a)
    s.p = still + x[2 * n]
    _K, C, _z, _fade, d, q = step_constants(par, s)
    damped = C * q * squares
    s.e_standstill += damped
    s.e_numerical += par.z_b * (q - d * d / par.dt) * squares
    s.e_loss += lost
    s.v_b = mean_velocity(wb, cb, n, r, par.mass_b)
    s.i_bit += par.mass_b * (a * steps * par.dt - (s.v_b - v0))
    s.rock_work += 0.5 * K * (s.p - s.p_u) * (s.p - s.p_u) - spring + damped
    return path


@kernel
def note_steps(s, time, dt, spring, v, steps, K, C, z, fade, d, level):
    """Bit force of steps in one contact mode from the end velocities at their starts.

    Parameters
    ----------
    time, dt : float
        Start of the first step, and duration of each [s].
    spring : float
        Force of the rock's spring at the start [N].
    v : float array
        End velocities [m/s].
    K, C, z, fade, d : float
        From `step_constants`.
    level : float
        [N]

    Returns
    -------
    float
        Greatest distance of the force from `level` at the start of a step [N].
    """
    rate = K / (z + C)
    amplitude = 0.0
    for k in range(steps):
        first = spring + C * v[k]
        begin = time + k * dt
        if begin + dt > s.peak_from:
            note_peak(s, begin, first, z * v[k], rate, first + z * v[k] * fade)
        spring += K * d * v[k]
        amplitude = max(amplitude, abs(first - level))
    return amplitude


@kernel
def note_standstill_peak(par, s, wb, cb, ops, steps, scratch):
    """Note the greatest bit force of a leap of `steps` steps about to be made.

    The lookahead of a leap in contact, chunk by chunk, until the vibration has
    died away.
    """
    x, v, y = scratch.x, scratch.v, scratch.y
    load_contact(par, s, wb, cb, x)
    K, C, z, fade, d, _q = step_constants(par, s)
    level = bit_load(par, s)
    time = time_of(par, s)
    done = 0
    if s.peak_from > time:
        done = min(int((s.peak_from - time) / par.dt), steps - 1)
        carry(ops.bit[Mode.SS], done, x, y, par.size_r)
    while done < steps:
        count = min(LOOKAHEAD, steps - done)
        look_ahead(ops.lookahead[Mode.SS], par.size_r, x, v, count, False)
        spring = level + K * x[2 * par.n_b]
        begin = time + done * par.dt
        amplitude = note_steps(s, begin, par.dt, spring, v, count, K, C, z, fade, d, level)
        if amplitude < STILL_SHARE * abs(level):
            s.peak_bit_force = max(s.peak_bit_force, level)
            return
        carry(ops.bit[Mode.SS], LOOKAHEAD, x, y, par.size_r)
        done += LOOKAHEAD


@kernel
def leap_contact(par, s, wb, cb, ops, steps, scratch):
    """Carry the bit over `steps` steps within a contact mode.

    Parameters
    ----------
    scratch : Scratch
        Its v holds the end velocities that `steps_in_contact` found.

    Returns
    -------
    path : float
        Path of the bit's mean motion as its body forces see it [m].
    """
    x, v, y = scratch.x, scratch.v, scratch.y
    still = load_contact(par, s, wb, cb, x)
    K, C, z, fade, d, q = step_constants(par, s)
    squares = 0.0
    spring = K * (s.p - origin(s))
    peak = s.b_peak_bit
    for k in range(steps):
        squares += v[k] * v[k]
        force = spring + C * v[k]
        spring += K * d * v[k]
        peak = max(peak, force + max(0.0, z * fade * v[k]))
    s.b_peak_bit = peak
    begin = time_of(par, s)
    if begin + steps * par.dt > s.peak_from:
        first = K * (s.p - origin(s))
        note_steps(s, begin, par.dt, first, v, steps, K, C, z, fade, d, 0.0)
    path = dot(ops.sums[s.mode], x, par.size_r)
    loss = ops.loss[s.mode]
    lost, _ = carry_and_sum(
        ops.bit[s.mode], loss, loss, par.loss > 0, False, steps, x, y, par.size_r
    )
    s.e_loss += lost
    path -= dot(ops.sums[s.mode], x, par.size_r)
    a = bit_acceleration(par, s)
    store(x, wb, cb, par.n_b, 2 * s.parity, 0.0, a)
    book_contact(par, s, wb, cb, K, C, still + x[2 * par.n_b], d, q, squares, steps)
    return path


@merged
def book_contact(par, s, wb, cb, K, C, p, d, q, squares, steps):
    """Penetration, impulse and ledger after a leap in contact.

    Parameters
    ----------
    K, C : float
        Of the mode.
    p : float
        Penetration at the end [m].
    d, q : float
        Integrals over a step of unit velocity at its start, and its square.
    squares : float
        Sum over the steps of the square of that velocity [m2/s2].
    """
    before = s.p
    start = origin(s)
    s.p = p
    damped = C * q * squares
    s.rock_work += 0.5 * K * (p - before) * (p + before - 2.0 * start) + damped
    book_dashpot(s, damped)
    crush(par, s, before)
    s.e_numerical += par.z_b * (q - d * d / par.dt) * squares
    v0 = s.v_b
    a = bit_acceleration(par, s)
    s.v_b = mean_velocity(wb, cb, par.n_b, 2 * s.parity, par.mass_b)
    s.i_bit += par.mass_b * (a * steps * par.dt - (s.v_b - v0))


@kernel
def leap(par, s, wb, cb, ops, scratch, planned):
    """Carry the bit to s.leap_end in one go.

    Parameters
    ----------
    ops : LeapOperators
    scratch : Scratch
    planned : bool
        Whether its v still holds what the plan of this leap saw.
    """
    steps = s.leap_end - s.step
    if s.mode == Mode.SS:
        push_checkpoint(s, time_of(par, s))
    if s.leap_kind == LeapKind.FLIGHT:
        path = leap_flight(par, s, wb, cb, ops, steps, scratch)
    elif s.leap_kind == LeapKind.STANDSTILL:
        if time_of(par, s) + steps * par.dt > s.peak_from:
            note_standstill_peak(par, s, wb, cb, ops, steps, scratch)
        path = leap_standstill(par, s, wb, cb, ops, steps, scratch)
    else:
        if not planned:
            steps_in_contact(par, s, wb, cb, ops.lookahead, scratch, steps)
        path = leap_contact(par, s, wb, cb, ops, steps, scratch)
    book_bit_load(par, s, path)
    s.step = s.leap_end
    s.leap_end = -1
    s.count_leaps += 1
    s.count_leap_steps += steps
    if s.mode == Mode.SS:
        push_checkpoint(s, time_of(par, s))
