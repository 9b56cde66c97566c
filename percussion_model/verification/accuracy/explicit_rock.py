"""Rock end of the explicit elements: its mass follows the rock law in closed form.

It obeys m x'' = a m - F_R(x, x') from the middle of a step to that of the next, where what the
rest of the bit does to it, a m, is held: a linear equation in each mode of the rock law, solved
as such, with the step divided where the mode changes.
"""

from __future__ import annotations

import math

from percussion_model.physics.blows import push_event
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import Mode, RockKind
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
    spring_force,
    stiffness,
)

# Halvings of a step in search of a change of mode.
HALVINGS = 30


@kernel
def kinetic_energy(par, s, runs, w, v, share):
    """Kinetic energy of the bit a share of a step after the velocities [J]."""
    energy = 0.0
    for r in range(par.bit_from, runs.shape[0]):
        i, n = runs[r].first, runs[r].n
        kick = share * runs[r].kappa
        inner = 0.0
        for j in range(i + 1, i + n):
            speed = v[j] + kick * ((w[j - 1] - w[j]) + (w[j + 1] - w[j]))
            inner += speed * speed
        low = s.v_end if r == runs.shape[0] - 1 else v[i + n]
        energy += runs[r].half * (inner + 0.5 * (v[i] * v[i] + low * low))
    return energy


@inlined
def ride(k, c, a, x, v, h):
    """Solve x'' = a - k x - c x' over `h`; the closed form of each kind of damping."""
    if k == 0.0:
        return x + h * (v + 0.5 * h * a), v + h * a
    rest = a / k
    y = x - rest
    delta = 0.5 * c
    square = k - delta * delta
    root = math.sqrt(abs(square))
    decay = math.exp(-delta * h)
    if square > 0.0:
        cosine = math.cos(root * h)
        sine = math.sin(root * h) / root
    else:
        cosine = math.cosh(root * h)
        sine = math.sinh(root * h) / root
    y1 = decay * ((cosine + delta * sine) * y + sine * v)
    v1 = decay * ((cosine - delta * sine) * v - k * sine * y)
    return rest + y1, v1


@inlined
def ride_on_rock(par, s, a, h):
    """Penetration and velocity of the rock end after `h` in the present mode."""
    p_r = origin(s)
    k = stiffness(s) / par.end_mass
    x, v = ride(k, damping(s) / par.end_mass, a, s.p - p_r, s.v_end, h)
    return p_r + x, v


@kernel
def prepare_mode(par, s):
    """Take what a whole step in the present mode does."""
    k, c = stiffness(s) / par.end_mass, damping(s) / par.end_mass
    s.by_a = 1.0 / k if k > 0.0 else 0.0
    s.p_by_p, s.v_by_p = ride(k, c, 0.0, 1.0, 0.0, par.dt)
    s.p_by_v, s.v_by_v = ride(k, c, 0.0, 0.0, 1.0, par.dt)


@inlined
def work_of_dashpot(par, s, a, p, v):
    """Work of the rock's dashpot on the way from the present state, by the energy law [J]."""
    if damping(s) == 0.0:
        return 0.0
    spring = stiffness(s) * (0.5 * (p + s.p) - origin(s)) * (p - s.p)
    return par.end_mass * (a * (p - s.p) - 0.5 * (v - s.v_end) * (v + s.v_end)) - spring


@inlined
def passed(par, s, p, v, work):
    """Whether a state lies beyond the end of the present mode; energy apart."""
    if s.mode == Mode.FF:
        return p > s.p_u and v > 0.0
    if par.rock == RockKind.SPRING:
        return p < 0.0
    if s.mode == Mode.DFC and s.w + work >= s.w_r:
        return True
    if s.mode == Mode.DFC or s.mode == Mode.FC:
        return v < -REST_VELOCITY
    if s.mode == Mode.BC:
        return p < s.p_u or v > REST_VELOCITY
    return par.release == 1 and s.gamma * s.k_r * (p - s.p_u) + s.c_r * v < 0.0


@inlined
def move_end(par, s, a, p, v, h):
    """Put the rock end into a state that it comes to in `h`, and book what the rock takes."""
    if s.mode != Mode.FF:
        work = work_of_dashpot(par, s, a, p, v)
        book_dashpot(s, work)
        s.rock_work += work + stiffness(s) * (0.5 * (p + s.p) - origin(s)) * (p - s.p)
        s.i_bit += par.end_mass * (a * h - (v - s.v_end))
        before = s.p
        s.p = p
        crush(par, s, before)
    s.p = p
    s.v_end = v
    s.force = spring_force(par, s) + damping(s) * v
    s.b_peak_bit = max(s.b_peak_bit, s.force)
    s.peak_bit_force = max(s.peak_bit_force, s.force)


@kernel
def change_mode(par, s, energy, time, events):
    """Make the change of mode that the rock end's state asks for."""
    if s.mode == Mode.FF:
        close_interface(par, s, energy)
    elif par.rock == RockKind.SPRING:
        s.mode = Mode.FF
    elif s.mode == Mode.DFC and s.w >= s.w_r:
        s.mode = Mode.FC
    elif s.mode == Mode.SS or (s.mode == Mode.BC and s.p < s.p_u):
        s.mode = Mode.FF
    else:
        leave_by_velocity(par, s, s.v_end, energy)
    s.alert = 1
    prepare_mode(par, s)
    push_event(s, events, time, s.mode, spring_force(par, s))


@kernel
def find_end(par, s, a, h):
    """Shortest stretch of `h` after which the present mode is over, halved and halved."""
    low = 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + h)
        p, v = ride_on_rock(par, s, a, middle)
        if passed(par, s, p, v, work_of_dashpot(par, s, a, p, v)):
            h = middle
        else:
            low = middle
    return h


@kernel
def divide_step(par, s, runs, w, v, a, events):
    """Move the rock end over a step in which the mode changes."""
    h = par.dt
    for _ in range(par.most_changes):
        p, speed = ride_on_rock(par, s, a, h)
        if not passed(par, s, p, speed, work_of_dashpot(par, s, a, p, speed)):
            move_end(par, s, a, p, speed, h)
            return
        part = find_end(par, s, a, h)
        p, speed = ride_on_rock(par, s, a, part)
        move_end(par, s, a, p, speed, part)
        h -= part
        share = 1.0 - h / par.dt
        energy = kinetic_energy(par, s, runs, w, v, share)
        change_mode(par, s, energy, s.time + (share - 0.5) * par.dt, events)
    s.count_locked += 1
    p, speed = ride_on_rock(par, s, a, h)
    move_end(par, s, a, p, speed, h)


@merged
def step_rock_end(par, s, runs, w, v, a, events):
    """Move the rock end from the middle of the last step to the middle of this one."""
    s.force_before = s.force
    alert = s.mode == Mode.SS and s.alert == 1
    if alert and overcomes_barrier(par, s, kinetic_energy(par, s, runs, w, v, 0.0)):
        leave_standstill(par, s, s.v_end)
        prepare_mode(par, s)
        push_event(s, events, s.time - 0.5 * par.dt, s.mode, spring_force(par, s))
    if s.mode == Mode.FF:
        p = s.p + par.dt * (s.v_end + 0.5 * par.dt * a)
        speed = s.v_end + par.dt * a
        if speed > 0.0 and p > s.p_u and par.rock != RockKind.NONE:
            divide_step(par, s, runs, w, v, a, events)
            return
        s.p = p
        s.v_end = speed
        s.force = 0.0
        return
    rest = origin(s) + a * s.by_a
    p = rest + s.p_by_p * (s.p - rest) + s.p_by_v * s.v_end
    speed = s.v_by_p * (s.p - rest) + s.v_by_v * s.v_end
    if passed(par, s, p, speed, work_of_dashpot(par, s, a, p, speed)):
        divide_step(par, s, runs, w, v, a, events)
    else:
        move_end(par, s, a, p, speed, par.dt)
