"""The rock end of the bit, followed exactly through one step.

The bit end obeys F_R = z (v_free - v), the rock answers with
F_R = K (p - P_R) + C v: a scalar linear equation with constant input over a
step, so every crossing is a logarithm (docs/model.md, eqs 14-18, table 1).
"""

from __future__ import annotations

import math

from percussion_model.physics.blows import push_event
from percussion_model.physics.kernel import inlined, merged
from percussion_model.physics.records import Mode, RockKind
from percussion_model.physics.rock import (
    REST_VELOCITY,
    barrier_off,
    close_interface,
    crush,
    enter_standstill,
    leave_by_velocity,
    leave_standstill,
    origin,
    recoverable,
    stiffness,
)
from percussion_model.solvers.wave.bar import kinetic_energy
from percussion_model.solvers.wave.peaks import note_peak

FF, DFC, FC, BC, SS = (int(m) for m in Mode)
NO_ROCK, BILINEAR = int(RockKind.NONE), int(RockKind.BILINEAR)
SPRING, WALL = int(RockKind.SPRING), int(RockKind.WALL)


@merged
def time_in_mode(par, s, v_free, v, y, rate, y_end, rest):
    """How long the present contact mode lasts within the rest of the step.

    Returns
    -------
    time : float
        At most `rest` [s].
    next_mode : int
        Mode that follows, -1 where none does.
    """
    if s.mode == DFC:
        left = 1.0 - 2.0 * (s.w_r - s.w) * rate / (s.c_r * v * v)
        if left > 0.0:
            t = -0.5 * math.log(left) / rate
            if t < rest:
                return max(t, 0.0), FC
    elif s.mode == BC or (s.mode == FC and par.rock == SPRING):
        if v < 0.0 and y_end < 0.0:
            t = -math.log(-y_end / (y - y_end)) / rate if y > 0.0 else 0.0
            if t < rest:
                return t, FF
    elif s.mode == SS and par.release == 1:
        if v < 0.0 and v_free < 0.0:
            t = -math.log(v_free / v) / rate if v_free > v else 0.0
            if t < rest:
                return t, FF
    return rest, -1


@merged
def contact_stretch(par, s, v_free, z, rest, now):
    """Follow one contact mode until it ends or the step does, from time `now`.

    Returns
    -------
    time, d, q : float
        Duration [s], integral of velocity [m] and of its square [m2/s].
    next_mode : int
    """
    K = stiffness(s)
    C = s.c_r if s.mode == DFC or s.mode == SS else 0.0
    origin = s.p_u if s.mode == BC or s.mode == SS else 0.0
    y = s.p - origin
    v = (z * v_free - K * y) / (z + C)
    rate = K / (z + C)
    t, next_mode = time_in_mode(par, s, v_free, v, y, rate, y + v / rate, rest)
    fade = -math.expm1(-rate * t)
    d = v * fade / rate
    q = 0.5 * v * v * fade * (2.0 - fade) / rate
    p_before = s.p
    s.p += d
    if s.mode == DFC:
        s.e_barrier += C * q
        s.w += C * q
    elif s.mode == SS:
        s.e_standstill += C * q
    if (s.mode == DFC or s.mode == FC) and par.rock == BILINEAR:
        crush(s, p_before)
    if next_mode == FF and y < 0.0:
        # standstill had pulled the bit when its unloading began: the rock lets go
        s.e_standstill += recoverable(s)
    elif next_mode == FF and s.mode != SS:
        s.p = origin  # exactly unloaded
    last = z * (v_free - v * (1.0 - fade))
    s.b_peak_bit = max(s.b_peak_bit, K * y + C * v, last)
    if now + t > s.peak_from:
        note_peak(s, now, K * y + C * v, z * v, rate, last)
    return t, d, q, next_mode


@merged
def flight_stretch(par, s, v_free, rest):
    """Follow free flight until the interface closes or the step ends.

    Returns
    -------
    time : float
        Duration [s].
    closes : int
        1 where it ends in contact.
    """
    before = recoverable(s)
    t = rest
    closes = 0
    if par.rock != NO_ROCK and v_free > 0.0:
        reach = (s.p_u - s.p) / v_free
        if reach < rest:
            t = max(reach, 0.0)
            closes = 1
    if closes == 1 and s.p < s.p_u:
        s.p = s.p_u
    else:
        s.p += v_free * t
    # A rock that was still springing back relaxes without doing work.
    s.e_standstill += before - recoverable(s)
    return t, closes


@inlined
def rock_step(par, s, w, c, v_free, z, tau, time, events):
    """Advance the rock end of the bit by `tau`.

    Parameters
    ----------
    par, s : record
        Parameters and state.
    w, c : float array
        The bit, for its kinetic energy.
    v_free : float
        Velocity the end would have if it were free [m/s].
    z : float
        Its impedance, with the viscous share of the last cell [N s/m].
    tau, time : float
        Duration and start of the step [s].
    events : EVENT array

    Returns
    -------
    d, q : float
        Integrals of velocity [m] and of its square [m2/s].
    """
    r = 2 * s.parity
    if s.mode == SS and par.rock == BILINEAR:
        energy = kinetic_energy(w, c, par.n_b, r)
        if barrier_off(par, s) or energy > s.w_r:
            K = s.gamma * s.k_r
            force = K * (s.p - s.p_u)
            leave_standstill(par, s, (z * v_free - force) / (z + s.c_r))
            push_event(s, events, time, s.mode, force)
    rest = tau
    d = 0.0
    q = 0.0
    for _ in range(par.most_crossings):
        now = time + (tau - rest)
        if s.mode == FF:
            t, closes = flight_stretch(par, s, v_free, rest)
            step = v_free * t
            d += step
            q += v_free * v_free * t
            rest -= t
            if closes == 0:
                return d, q
            close_interface(par, s, kinetic_energy(w, c, par.n_b, r))
            if s.mode == SS:
                enter_standstill(s, now + t)
            push_event(s, events, now + t, s.mode, 0.0)
            continue
        if par.rock == WALL:
            if v_free > 0.0:
                s.b_peak_bit = max(s.b_peak_bit, z * v_free)
                if now + rest > s.peak_from:
                    s.peak_bit = max(s.peak_bit, z * v_free)
                return d, q
            s.mode = FF
            s.p_u = s.p
            push_event(s, events, now, s.mode, 0.0)
            continue
        if end_of_mode(par, s, w, c, v_free, z, r) == 1:
            if s.mode == SS:
                enter_standstill(s, now)
            push_event(s, events, now, s.mode, stiffness(s) * (s.p - origin(s)))
            continue
        t, step, square, next_mode = contact_stretch(par, s, v_free, z, rest, now)
        d += step
        q += square
        rest -= t
        if next_mode < 0:
            return d, q
        s.mode = next_mode
        push_event(s, events, now + t, s.mode, stiffness(s) * (s.p - origin(s)))
    s.locked += 1
    return d, q


@merged
def end_of_mode(par, s, w, c, v_free, z, r):
    """Whether the sign of the velocity ends the mode at once; sets the next."""
    K = stiffness(s)
    C = s.c_r if s.mode == DFC or s.mode == SS else 0.0
    v = (z * v_free - K * (s.p - origin(s))) / (z + C)
    energy = 0.0
    if s.mode == BC and v > REST_VELOCITY:
        energy = kinetic_energy(w, c, par.n_b, r)
    return leave_by_velocity(par, s, v, energy)
