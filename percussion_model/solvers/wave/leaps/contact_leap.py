"""Leaps within a contact mode, after looking at every step beforehand.

The velocity of the rock end and its compression at the start of each of the
next steps are linear in the present waves. One product shows all of them, and
with them the step in which the mode ends.
"""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import REST_VELOCITY, crush, origin, stiffness
from percussion_model.solvers.wave.bar import deviation_energy, mean_velocity, strain_offset
from percussion_model.solvers.wave.leaps.linear import (
    PADDING,
    carry,
    dot,
    load,
    multiply,
    pad,
    store,
)
from percussion_model.solvers.wave.peaks import note_steps
from percussion_model.solvers.wave.records import Coef
from percussion_model.solvers.wave.totals import now

BOTTOM = int(Coef.BOTTOM)
DFC, FC, BC, SS = int(Mode.DFC), int(Mode.FC), int(Mode.BC), int(Mode.SS)

# Steps looked at in one go, a power of four.
WATCHED = 64
# Leaps end on multiples of this: the few steps more are cheaper than the
# products that they would save.
GRAIN = 4
# A leap of so many steps needs this many powers of a step, one to four of each.
WATCH_LEVELS = 4


@merged
def can_watch(par, s):
    """Whether operators exist for the rock law in force."""
    if s.gamma * s.k_r != par.ss_stiffness or s.k_r != par.ss_loading:
        return False
    return s.c_r == par.ss_damping or s.mode == BC or s.mode == FC


@kernel
def load_contact(par, s, wb, cb, x):
    """Deviation of bit and rock from rest under the present mode's stiffness.

    Returns
    -------
    still : float
        Penetration at rest [m].
    """
    a = par.gravity + s.feed / par.mass_b
    still = origin(s) + par.mass_b * a / stiffness(s)
    load(x, wb, cb, par.n_b, 2 * s.parity, 0.0, a)
    x[2 * par.n_b] = s.p - still
    pad(x, 2 * par.n_b + 1, par.size_r)
    return still


@merged
def look_ahead(watch, size, x, v, steps, add):
    """Put into v, or add to it, what `watch` shows of `x` over the next steps.

    Parameters
    ----------
    watch : float array, shape (size, WATCHED)
    steps : int
        How many of them are asked for.
    """
    count = min(WATCHED, (steps + PADDING - 1) // PADDING * PADDING)
    multiply(watch, x, v, size, count, add)


@kernel
def step_constants(par, s):
    """Of one step in the present mode, for unit velocity at its start.

    Returns
    -------
    K, C, z : float
        Stiffness, damping, impedance of the end.
    fade : float
        1 - exp(-rate dt).
    d, q : float
        Integrals of velocity and of its square.
    """
    K = stiffness(s)
    C = s.c_r if s.mode == DFC or s.mode == SS else 0.0
    z = par.z_b * (1.0 + par.kappa_b)
    rate = K / (z + C)
    fade = -math.expm1(-rate * par.dt)
    return K, C, z, fade, fade / rate, 0.5 * fade * (2.0 - fade) / rate


@kernel
def watch_contact(par, s, wb, cb, watch, x, v, most):
    """Number of steps before the one in which the contact mode ends.

    Parameters
    ----------
    watch : float array, shape (modes, size, WATCHED)
    x, v : float array
        Scratch; v receives the end velocity at the start of each step.
    most : int
        No more than this many, nor than WATCHED.
    """
    load_contact(par, s, wb, cb, x)
    look_ahead(watch[s.mode], par.size_r, x, v, most, False)
    K, C, z, fade, d, q = step_constants(par, s)
    y = s.p - origin(s)
    most = min(most, WATCHED)
    work = s.w
    for k in range(most):
        if s.mode == SS:
            force = K * y + C * v[k]
            if par.release == 1 and (force <= 0.0 or force + z * v[k] * fade <= 0.0):
                return k
        elif s.mode == BC:
            if v[k] > REST_VELOCITY or y + v[k] * d <= 0.0:
                return k
        elif v[k] < -REST_VELOCITY:
            return k
        elif s.mode == DFC:
            work += C * q * v[k] * v[k]
            if work >= s.w_r:
                return k
        y += v[k] * d
    return most


@kernel
def watch_flight(par, s, wb, cb, watch, x, v, most):
    """Number of steps of free flight before the one in which the rock is met.

    The mean motion is a parabola; what the vibration adds at the rock end is
    watched.

    Parameters
    ----------
    watch : float array, shape (modes, size, WATCHED)
    x, v : float array
        Scratch; v receives the strain offset at the end of each step.
    most : int
        No more than this many, nor than WATCHED.
    """
    load(x, wb, cb, par.n_b, 2 * s.parity, s.v_b, 0.0)
    pad(x, 2 * par.n_b, par.size_r)
    look_ahead(watch[0], par.size_r, x, v, most, False)
    a = par.gravity + s.feed / par.mass_b
    mean = s.p + strain_offset(wb, cb, par.n_b, 2 * s.parity, BOTTOM)
    most = min(most, WATCHED)
    before = s.p
    for k in range(most):
        t = (k + 1) * par.dt
        here = mean + (s.v_b + 0.5 * a * t) * t - v[k]
        if here >= s.p_u and here > before:
            return k
        before = here
    return most


@kernel
def leap_contact(par, s, wb, cb, powers, sums, steps, x, v, y):
    """Carry the bit over `steps` steps within a contact mode.

    Parameters
    ----------
    v : float array
        End velocities that `watch_contact` found.

    Returns
    -------
    path : float
        Path of the bit's mean motion as its body forces see it [m].
    """
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
    begin = now(par, s)
    if begin + steps * par.dt > s.peak_from:
        first = K * (s.p - origin(s))
        note_steps(s, begin, par.dt, first, v, steps, K, C, z, fade, d, 0.0)
    before = contact_energy(par, s, wb, cb, K, s.p - still)
    path = dot(sums[s.mode], x, par.size_r)
    carry(powers[s.mode], steps, x, y, par.size_r)
    path -= dot(sums[s.mode], x, par.size_r)
    a = par.gravity + s.feed / par.mass_b
    store(x, wb, cb, par.n_b, 2 * s.parity, 0.0, a)
    if par.loss > 0:
        after = contact_energy(par, s, wb, cb, K, x[2 * par.n_b])
        elsewhere = (C * q + par.z_b * (q - d * d / par.dt)) * squares
        s.e_loss += before - after - elsewhere
    book_contact(par, s, wb, cb, K, C, still + x[2 * par.n_b], d, q, squares, steps)
    return path


@kernel
def contact_energy(par, s, wb, cb, K, y):
    """Energy of bit and rock about rest, `y` away from it [J]."""
    a = par.gravity + s.feed / par.mass_b
    return deviation_energy(wb, cb, par.n_b, 2 * s.parity, 0.0, a) + 0.5 * K * y * y


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
    if s.mode == SS:
        s.e_standstill += damped
    elif s.mode == DFC:
        s.e_barrier += damped
        s.w += damped
    if s.mode == DFC or s.mode == FC:
        crush(s, before)
    s.e_numerical += par.z_b * (q - d * d / par.dt) * squares
    v0 = s.v_b
    a = par.gravity + s.feed / par.mass_b
    s.v_b = mean_velocity(wb, cb, par.n_b, 2 * s.parity, par.mass_b)
    s.i_bit += par.mass_b * (a * steps * par.dt - (s.v_b - v0))
