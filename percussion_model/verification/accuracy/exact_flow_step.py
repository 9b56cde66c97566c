"""Steps of the exact flow: semi-discrete bars whose states are multiplied by exponentials.

Between events piston, bit and rock are a linear system with constant inputs; its state is
(u_p, v_p, u_b, v_b, 1, alpha), displacements counted from where the rock's spring has no
force. Matrices take it over steps of 2^k; a step that holds an event is halved.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from percussion_model.physics.blows import close_gap, open_gap, push_event, start_blow, starts_blow
from percussion_model.physics.kernel import compiled, fused, inlined, kernel, merged
from percussion_model.physics.loads import switch_drive
from percussion_model.physics.readings import fill_ledger, fill_motion
from percussion_model.physics.records import DriveKind, Mode, RockKind, Status
from percussion_model.physics.rock import (
    REST_VELOCITY,
    book_dashpot,
    close_interface,
    crush,
    damping,
    leave_by_velocity,
    leave_standstill,
    origin,
    overcomes_barrier,
    recoverable,
    stiffness,
)
from percussion_model.physics.state import COMMON_PARAMETERS, COMMON_STATE

# Halvings and doublings of the step in which events are looked for.
FINE, LONG = 14, 8
LEVELS = FINE + 1 + LONG
# In the short mode with a dashpot that is counted, steps are so many times halved.
SHORTER = 2
# Steps between two looks at the energy of a standing bit.
LOOK = 32
# A standing bit with less energy of vibration [J] meets no event by itself.
CALM_ENERGY = 1e-4
THIRD = 1.0 / 3.0

FLOW_PAR = np.dtype(
    [
        ("step", "f8"),  # in which events are looked for [s]
        ("eta", "f8"),  # Kelvin-Voigt time [s]
        ("start_gap", "f8"),  # [m]
        ("soft", "f8"),  # what two ends that meet give way by an impulse [m/s / N s]
        ("n_p", "i8"),  # nodes
        ("n_b", "i8"),
        *COMMON_PARAMETERS,
    ],
    align=True,
)

FLOW_STATE = np.dtype(
    [
        ("time", "f8"),  # [s]
        ("force", "f8"),  # on the rock [N]
        ("contact_force", "f8"),
        ("calm", "i8"),  # 1: the bit stands, with next to no vibration
        ("look_in", "i8"),  # steps to the next look at its energy
        *COMMON_STATE,
    ],
    align=True,
)


class Flow(NamedTuple):
    """Matrices of the flow, by mode of the rock and by level of the step; columns are rows."""

    piston: np.ndarray  # shape (1, LEVELS, 2 n_p + 2, 2 n_p), of a piston that is free
    bit: np.ndarray  # shape (5, LEVELS, 2 n_b + 2, 2 n_b)
    # shape (5, LEVELS, 2 n_p + 2 n_b + 2, 2 n_p + 2 n_b), of piston and bit that touch
    both: np.ndarray
    force: np.ndarray  # shape (5, 2 n_p + 2 n_b + 2), contact force by the state [N]
    kick: np.ndarray  # shape (2 n_p + 2 n_b + 2,), what an impulse of the contact does to the state
    share: np.ndarray  # shape (n_p + n_b,), mass that moves with a node [kg]
    # shape (2, n_b), of the bit: diagonal of its matrix, and what is next to it [kg]
    mass: np.ndarray
    # shape (2, n_b): stiffness below a node [N/m]; mass above the middle between it and the next
    spring: np.ndarray


@fused
def multiply(m, x, y, first, n, last):
    """Take `n` entries of `x` from `first` on, and the two from `last` on, to `y`."""
    at = np.uint64(first)
    one = x[last]
    alpha = x[last + 1]
    for i in range(np.uint64(n)):
        y[at + np.uint64(i)] = m[n, i] * one + m[n + 1, i] * alpha
    for half in range(n // 2):
        # two columns at once: half the traffic of `y`
        j = 2 * half
        a, b = x[first + j], x[first + j + 1]
        for i in range(np.uint64(n)):
            y[at + np.uint64(i)] += m[j, i] * a + m[j + 1, i] * b


@compiled(error_model="numpy", _nrt=False, fastmath={"reassoc", "contract"})
def weigh(weights, x, first, n, by):
    """Sum of weights times entries of `x`."""
    total = 0.0
    for j in range(n):
        total += weights[first + j] * x[by + j]
    return total


@kernel
def flow_on(par, s, f, x, y, level):
    """Take the state `x` to `y` over a step."""
    n, m = 2 * par.n_p, 2 * par.n_b
    if s.closed == 1:
        multiply(f.both[s.mode, level], x, y, 0, n + m, n + m)
    else:
        if n > 0:
            multiply(f.piston[0, level], x, y, 0, n, n + m)
        multiply(f.bit[s.mode, level], x, y, n, m, n + m)
    y[n + m] = x[n + m]
    y[n + m + 1] = x[n + m + 1]


@inlined
def relative_motion(par, f, x, velocity):
    """Mean of the piston less mean of the bit: displacement or, with 1, velocity."""
    n, m = par.n_p, par.n_b
    upper = weigh(f.share, x, 0, n, velocity * n) / par.mass_p
    return upper - weigh(f.share, x, n, m, 2 * n + velocity * m) / par.mass_b


@kernel
def kinetic_energy(par, f, x):
    """Kinetic energy of the bit [J]."""
    first = 2 * par.n_p + par.n_b
    energy = 0.0
    for i in range(par.n_b):
        v = x[first + i]
        energy += 0.5 * f.mass[0, i] * v * v
        if i + 1 < par.n_b:
            energy += f.mass[1, i] * v * x[first + i + 1]
    return energy


@kernel
def standing_energy(par, s, f, x):
    """Energy of a bit that stands on the rock, less what it would have at rest [J]."""
    energy = kinetic_energy(par, f, x)
    load = par.gravity + s.feed / par.mass_b
    first = 2 * par.n_p
    for i in range(par.n_b - 1):
        stiff = f.spring[0, i]
        off = stiff * (x[first + i + 1] - x[first + i]) + load * f.spring[1, i]
        energy += 0.5 * off * off / stiff
    off = stiffness(s) * x[first + par.n_b - 1] - load * par.mass_b
    return energy + 0.5 * off * off / stiffness(s)


@inlined
def dashpot_work(s, v0, v1, h):
    """Work of the rock's dashpot while the velocity goes from `v0` to `v1` [J]."""
    return damping(s) * h * THIRD * (v0 * v0 + v0 * v1 + v1 * v1)


@kernel
def rock_event(par, s, f, x, y, h):
    """Whether the rock's mode is over at `y`."""
    end = 2 * par.n_p + par.n_b - 1
    p, v = y[end] + origin(s), y[end + par.n_b]
    if par.rock == RockKind.NONE:
        return False
    if s.mode == Mode.FF:
        return p > s.p_u and v > 0.0
    if par.rock == RockKind.SPRING:
        return p < 0.0
    if s.mode == Mode.DFC:
        work = dashpot_work(s, x[end + par.n_b], v, h)
        return v < -REST_VELOCITY or s.w + work >= s.w_r
    if s.mode == Mode.FC:
        return v < -REST_VELOCITY
    if s.mode == Mode.BC:
        return p < s.p_u or v > REST_VELOCITY
    if par.release == 1 and stiffness(s) * y[end] + damping(s) * v < 0.0:
        return True
    return s.calm == 0 and overcomes_barrier(par, s, kinetic_energy(par, f, y))


@kernel
def contact_event(par, s, f, y):
    """Whether the gap closes, or the ends no longer press on each other, at `y`."""
    n = par.n_p
    if n == 0:
        return False
    if s.closed == 1:
        return weigh(f.force[s.mode], y, 0, y.shape[0], 0) < 0.0
    return y[2 * n] < y[n - 1]


@inlined
def drive_event(par, s, f, y):
    """Whether the drive has to turn at `y`."""
    if par.n_p == 0 or par.drive != DriveKind.PRESSURE:
        return False
    u_r = relative_motion(par, f, y, 0)
    return u_r >= 0.0 if s.alpha > 0 else u_r <= -s.reversal


@kernel
def accept(par, s, f, x, y, h):
    """Make `y` the state, and book what the rock has taken."""
    end = 2 * par.n_p + par.n_b - 1
    before, v0, v1 = s.p, x[end + par.n_b], y[end + par.n_b]
    s.p = y[end] + origin(s)
    if s.mode != Mode.FF:
        work = dashpot_work(s, v0, v1, h)
        book_dashpot(s, work)
        s.rock_work += work + stiffness(s) * 0.5 * (y[end] * y[end] - x[end] * x[end])
        crush(par, s, before)
    s.force = stiffness(s) * y[end] + damping(s) * v1
    s.b_peak_bit = max(s.b_peak_bit, s.force)
    s.peak_bit_force = max(s.peak_bit_force, s.force)
    if s.closed == 1:
        before = s.contact_force
        s.contact_force = weigh(f.force[s.mode], y, 0, y.shape[0], 0)
        s.i_contact += 0.5 * h * (before + s.contact_force)
        s.b_peak_contact = max(s.b_peak_contact, s.contact_force)
        s.peak_contact_force = max(s.peak_contact_force, s.contact_force)
    for i in range(x.shape[0]):
        x[i] = y[i]
    s.time += h


@kernel
def read_means(par, s, f, x):
    """Mean velocities, and u_r; returns the mean displacement of the bit [m]."""
    n, m = par.n_p, par.n_b
    s.v_b = weigh(f.share, x, n, m, 2 * n + m) / par.mass_b
    if n > 0:
        s.v_p = weigh(f.share, x, 0, n, n) / par.mass_p
        s.gap = x[2 * n] - x[n - 1]
        s.u_r = relative_motion(par, f, x, 0)
    return s.x_r + origin(s) + weigh(f.share, x, n, m, 2 * n) / par.mass_b


@kernel
def change_contact(par, s, f, x, blows, events):
    """Close the gap by an inelastic impulse, or open it."""
    n = par.n_p
    approach = x[2 * n - 1] - x[2 * n + par.n_b]
    u_b = read_means(par, s, f, x)
    s.calm = 0
    if s.closed == 1:
        s.closed = 0
        s.contact_force = 0.0
        open_gap(s, events, s.time, approach)
        return
    if starts_blow(par, s, s.time):
        start_blow(par, s, blows, s.time, s.v_p, u_b, math.nan)
    close_gap(s, events, s.time, approach)
    s.closed = 1
    impulse = approach / par.soft
    s.i_contact += impulse
    for i in range(x.shape[0]):
        x[i] += impulse * f.kick[i]
    x[2 * n] = x[n - 1]


@kernel
def change_mode(par, s, f, x, events):
    """Make the change of the rock's mode that the state asks for; then count from its origin."""
    end = 2 * par.n_p + par.n_b - 1
    v = x[end + par.n_b]
    if s.mode == Mode.FF:
        close_interface(par, s, kinetic_energy(par, f, x))
    elif par.rock == RockKind.SPRING:
        s.mode = Mode.FF
    elif s.mode == Mode.DFC and s.w >= s.w_r:
        s.mode = Mode.FC
    elif s.mode == Mode.SS:
        if overcomes_barrier(par, s, kinetic_energy(par, f, x)):
            leave_standstill(par, s, v)
        else:
            s.mode = Mode.FF
    elif s.mode == Mode.BC and s.p < s.p_u:
        s.mode = Mode.FF
    else:
        leave_by_velocity(par, s, v, kinetic_energy(par, f, x))
    s.calm = 0
    shift = s.p - origin(s) - x[end]
    for i in range(par.n_p):
        x[i] += shift
    for i in range(end + 1 - par.n_b, end + 1):
        x[i] += shift
    push_event(s, events, s.time, s.mode, stiffness(s) * x[end])


@kernel
def turn(par, s, f, x, events):
    """Turn the pressure of the drive."""
    s.u_r = relative_motion(par, f, x, 0)
    switch_drive(par, s, s.u_r, s.time, 0.0, events)
    x[x.shape[0] - 1] = s.alpha


@merged
def longest(par, s, f, x):
    """Level of the longest step that may be taken: long where nothing but the gap can end it."""
    if s.mode == Mode.DFC:
        return FINE - SHORTER
    if s.mode != Mode.SS or s.closed == 1:
        return FINE
    s.look_in -= 1
    if s.calm == 0 and s.look_in < 0:
        s.look_in = LOOK
        s.calm = 1 if standing_energy(par, s, f, x) < CALM_ENERGY else 0
    return LEVELS - 1 if s.calm == 1 else FINE


@merged
def advance_to(par, s, f, x, y, time, blows, events):
    """Advance as near to `time` as the finest step allows; a `Status`."""
    s.n_blows = 0
    s.n_events = 0
    finest = par.step * 0.5**FINE
    while s.time + finest <= time:
        if s.live == 1:
            if s.n_blows >= blows.shape[0]:
                return Status.BLOWS_FULL
            if s.events_on == 1 and s.n_events + 3 >= events.shape[0]:
                return Status.EVENTS_FULL
        level = longest(par, s, f, x)
        h = finest * 2.0**level
        while s.time + h > time:
            level -= 1
            h *= 0.5
        while True:
            flow_on(par, s, f, x, y, level)
            s.count_steps += 1
            contact, drive = contact_event(par, s, f, y), drive_event(par, s, f, y)
            rock = rock_event(par, s, f, x, y, h)
            if level == 0 or not (contact or drive or rock):
                break
            level -= 1
            h *= 0.5
        accept(par, s, f, x, y, h)
        if contact:
            change_contact(par, s, f, x, blows, events)
        if drive:
            turn(par, s, f, x, events)
        if rock:
            change_mode(par, s, f, x, events)
            if not math.isfinite(s.p):
                return Status.NOT_FINITE
    return Status.DONE


@kernel
def read_here(par, s, f, x, time, row):
    """Write what is seen of a state."""
    u_b = read_means(par, s, f, x)
    kinetic = kinetic_energy(par, f, x)
    fill_ledger(s, row, kinetic, 0.0, recoverable(par, s))
    fill_motion(par, s, row, time, s.u_r + u_b + par.start_gap, u_b)
    row.bit_end_velocity = x[2 * par.n_p + 2 * par.n_b - 1]
    row.bit_kinetic_energy = kinetic
    row.bit_force = s.force
    row.contact_force = s.contact_force


@kernel
def run(reads, par_, state, f, x, y, time, blows, events, reading):
    """Advance to `time`, and read the state there where `reads` is 1; then give a copy."""
    par = par_[0]
    s = state[0]
    if reads == 1:
        s.live = 0
    status = advance_to(par, s, f, x, y, time, blows, events)
    if reads == 1:
        read_here(par, s, f, x, time, reading[0])
    return status
