"""Lookahead: the next steps within a mode of the bit, seen in the present waves.

The velocity of the rock end and its compression at the start of each of the
next steps are linear in the present waves, and so are the motions of the ends
that meet. One product shows all of them, and with them the step in which the
mode ends or the gap closes (docs/numerics.md, section 5).
"""

from __future__ import annotations

from percussion_model.physics.elementary import expm1
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.loads import bit_acceleration, drive_force
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import REST_VELOCITY, damping, origin, stiffness
from percussion_model.solvers.wave.bar import strain_offset
from percussion_model.solvers.wave.leaps.linear import PADDING, load, multiply, pad
from percussion_model.solvers.wave.records import Coef

# Steps predicted at in one go, a power of four.
LOOKAHEAD = 64
# Leaps end on multiples of this: the few steps more are cheaper than the
# products that they would save.
GRAIN = 4
# A leap of so many steps needs this many powers of a step, one to four of each.
LOOKAHEAD_LEVELS = 4


@merged
def has_operators(par, s):
    """Whether operators exist for the mode and the rock law in force."""
    if s.gamma * s.k_r != par.ss_stiffness or (par.power == 1 and s.mode != Mode.SS):
        return False
    if s.mode != Mode.SS and s.k_r != par.ss_loading:
        return False
    return s.c_r == par.ss_damping or s.mode == Mode.BC or s.mode == Mode.FC


@kernel
def load_contact(par, s, wb, cb, x):
    """Deviation of bit and rock from rest under the present mode's stiffness.

    Returns
    -------
    still : float
        Penetration at rest [m].
    """
    a = bit_acceleration(par, s)
    still = origin(s) + par.mass_b * a / stiffness(s)
    load(x, wb, cb, par.n_b, 2 * s.parity, 0.0, a)
    x[2 * par.n_b] = s.p - still
    pad(x, 2 * par.n_b + 1, par.size_r)
    return still


@merged
def look_ahead(shown, size, x, v, steps, add):
    """Put into v, or add to it, what `shown` shows of `x` over the next steps.

    Parameters
    ----------
    shown : float array, shape (size, LOOKAHEAD)
    steps : int
        How many of them are asked for.
    """
    count = min(LOOKAHEAD, (steps + PADDING - 1) // PADDING * PADDING)
    multiply(shown, x, v, size, count, add)


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
    C = damping(s)
    z = par.z_b * (1.0 + par.kappa_b)
    rate = K / (z + C)
    fade = -expm1(-rate * par.dt)
    return K, C, z, fade, fade / rate, 0.5 * fade * (2.0 - fade) / rate


@kernel
def steps_in_contact(par, s, wb, cb, lookahead, scratch, most):
    """Number of steps before the one in which the contact mode ends.

    Parameters
    ----------
    lookahead : float array, shape (modes, size, LOOKAHEAD)
    scratch : Scratch
        Its v receives the end velocity at the start of each step.
    most : int
        No more than this many, nor than LOOKAHEAD.
    """
    x, v = scratch.x, scratch.v
    load_contact(par, s, wb, cb, x)
    look_ahead(lookahead[s.mode], par.size_r, x, v, most, False)
    K, C, z, fade, d, q = step_constants(par, s)
    y = s.p - origin(s)
    most = min(most, LOOKAHEAD)
    work = s.w
    for k in range(most):
        if s.mode == Mode.SS:
            force = K * y + C * v[k]
            if par.release == 1 and (force <= 0.0 or force + z * v[k] * fade <= 0.0):
                return k
        elif s.mode == Mode.BC:
            if v[k] > REST_VELOCITY or y + v[k] * d <= 0.0:
                return k
        elif v[k] < -REST_VELOCITY:
            return k
        elif s.mode == Mode.DFC:
            work += C * q * v[k] * v[k]
            if work >= s.w_r:
                return k
        y += v[k] * d
    return most


@kernel
def steps_in_flight(par, s, wb, cb, lookahead, scratch, most):
    """Number of steps of free flight before the one in which the rock is met.

    The mean motion is a parabola; what the vibration adds at the rock end is
    watched.

    Parameters
    ----------
    lookahead : float array, shape (modes, size, LOOKAHEAD)
    scratch : Scratch
        Its v receives the strain offset at the end of each step.
    most : int
        No more than this many, nor than LOOKAHEAD.
    """
    x, v = scratch.x, scratch.v
    load(x, wb, cb, par.n_b, 2 * s.parity, s.v_b, 0.0)
    pad(x, 2 * par.n_b, par.size_r)
    look_ahead(lookahead[0], par.size_r, x, v, most, False)
    a = bit_acceleration(par, s)
    mean = s.p + strain_offset(wb, cb, par.n_b, 2 * s.parity, Coef.BOTTOM)
    most = min(most, LOOKAHEAD)
    before = s.p
    for k in range(most):
        t = (k + 1) * par.dt
        here = mean + (s.v_b + 0.5 * a * t) * t - v[k]
        if here >= s.p_u and here > before:
            return k
        before = here
    return most


@merged
def top_at_rest(c, n, a):
    """Way from the bottom end to the top end of a bar at rest [m].

    Positive where the static load of the body acceleration `a` shortens it.
    """
    way = 0.0
    for i in range(n):
        way += 2.0 * a * c[Coef.STATIC, i] * (c[Coef.TOP, i] + c[Coef.BOTTOM, i])
    return way


@kernel
def steps_with_open_gap(par, s, bars, of_bit, of_piston, scratch, steps):
    """Number of steps, at most `steps`, before which no gap closes.

    Nor within half a step after, so that a closure finds its step uncut
    (docs/numerics.md, section 6).

    Parameters
    ----------
    of_bit : float array, shape (modes, size, LOOKAHEAD)
        By mode: motion of the bit's top end, less the mean motion in FF.
    of_piston : float array, shape (size, LOOKAHEAD)
        Strain offset of the piston's bottom end.
    scratch : Scratch
    steps : int
        Over which the bit stays in its mode, at most LOOKAHEAD.
    """
    x, y = scratch.x, scratch.y
    r = 2 * s.parity
    a_b = bit_acceleration(par, s)
    v_b, base = 0.0, 0.0
    if s.mode == Mode.FF:
        v_b = s.v_b
        load(x, bars.wb, bars.cb, par.n_b, r, v_b, 0.0)
        pad(x, 2 * par.n_b, par.size_r)
        base = -strain_offset(bars.wb, bars.cb, par.n_b, r, Coef.TOP)
    else:
        base = load_contact(par, s, bars.wb, bars.cb, x) + top_at_rest(bars.cb, par.n_b, a_b)
        base -= s.p + strain_offset(bars.wb, bars.cb, par.n_b, r, Coef.BOTTOM)
        base -= strain_offset(bars.wb, bars.cb, par.n_b, r, Coef.TOP)
        a_b = 0.0  # part of the map
    look_ahead(of_bit[s.mode], par.size_r, x, y, steps, False)
    if par.piston == Piston.ELASTIC:
        load(x, bars.wp, bars.cp, par.n_p, r, s.v_p, 0.0)
        pad(x, 2 * par.n_p, par.size_p)
        look_ahead(of_piston, par.size_p, x, y, steps, True)
        base -= strain_offset(bars.wp, bars.cp, par.n_p, r, Coef.BOTTOM)
    base += s.gap
    v = v_b - s.v_p
    a = a_b - par.gravity - drive_force(par, s) / par.mass_p
    before = s.gap
    for k in range(steps):
        t = (k + 1) * par.dt
        gap = base + y[k] + (v + 0.5 * a * t) * t
        if gap + 0.5 * min(gap - before, 0.0) <= 0.0:
            return k
        before = gap
    return steps
