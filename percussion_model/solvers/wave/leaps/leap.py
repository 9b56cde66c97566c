"""Leaps of the bit: many steps of free flight, standstill or contact in one go.

While the bit's mode does not change, a step is a constant linear map of its
waves. Powers of two of that map, made once from the step itself, carry the
bit over any number of steps; a leap ends before the next event can happen
(docs/numerics.md, section 5).
"""

from __future__ import annotations

import math

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.records import Mode, RockKind
from percussion_model.physics.rock import recoverable
from percussion_model.solvers.wave.bar import (
    deviation_energy,
    mean_velocity,
    strain_offset,
    time_to_cover,
)
from percussion_model.solvers.wave.leaps.contact_leap import (
    GRAIN,
    WATCHED,
    can_watch,
    leap_contact,
    watch_contact,
    watch_flight,
)
from percussion_model.solvers.wave.leaps.linear import (
    carry,
    dot,
    load,
    pad,
    quadratic,
    remove_mean,
    store,
)
from percussion_model.solvers.wave.leaps.standstill_peak import watch_standstill
from percussion_model.solvers.wave.records import Coef, LeapKind
from percussion_model.solvers.wave.totals import now

FF, SS = int(Mode.FF), int(Mode.SS)
NO_ROCK, BILINEAR = int(RockKind.NONE), int(RockKind.BILINEAR)
BOTTOM = int(Coef.BOTTOM)
FLIGHT, STANDSTILL, CONTACT = (int(kind) for kind in LeapKind)

# A leap shorter than this costs more than the steps it saves.
FEWEST_STEPS = 8
# Standstill can end only above W_R; below this share of it the barrier is safe.
QUIET_SHARE = 0.9

# What a vibration of less than this gives to the rock is not booked [J].
NEGLIGIBLE = 1e-13

# Quadratic forms of what a standstill will ever lose; a leap loses the
# difference of before and after. So does the structural loss: the energy's,
# less these two (docs/numerics.md, section 5; tests hold it against every step).
DASHPOT_FORM, NUMERICAL_FORM = 0, 1


@merged
def longest_leap(par):
    """Most steps that the powers at hand can carry a bar."""
    return (1 << (2 * par.leaps)) - 1


@kernel
def standstill_energy(par, s, wb, cb):
    """Energy of the bit about its rest on the rock [J]."""
    a = par.gravity + s.feed / par.mass_b
    K = s.gamma * s.k_r
    y = s.p - s.p_u - par.mass_b * a / K
    return deviation_energy(wb, cb, par.n_b, 2 * s.parity, 0.0, a) + 0.5 * K * y * y


@merged
def drills_not(par, s, energy):
    """Whether a standstill of that energy stays below the barrier."""
    if par.barrier == 0 or s.next_w_r == 0.0 or s.next_c_r == 0.0:
        return False
    return energy <= QUIET_SHARE * s.w_r


@merged
def lifts_not(par, s, energy):
    """Whether a standstill of that energy cannot lose its contact force."""
    if par.release == 0:
        return True
    rest = par.mass_b * par.gravity + s.feed
    if rest <= 0.0:
        return False
    # |dF| <= K |dy| + C |v| with both terms bounded by the energy
    K = s.gamma * s.k_r
    spread = math.sqrt(2.0 * energy * K)
    end = 2.0 * math.sqrt(energy / (par.z_b * par.dt))
    return spread * (1.0 + s.c_r / par.z_b) + s.c_r * end < rest


@merged
def plan_flight(par, s, wb, cb, watch, x, v, most):
    """Steps of free flight before the rock can be met, at most `most`."""
    if par.rock == NO_ROCK:
        return most
    if s.p >= s.p_u:  # let go while the rock still springs back
        return watch_flight(par, s, wb, cb, watch, x, v, most)
    energy = deviation_energy(wb, cb, par.n_b, 2 * s.parity, s.v_b, 0.0)
    a = par.gravity + s.feed / par.mass_b
    room = s.p_u - s.p - 2.0 * par.bound_b * math.sqrt(2.0 * energy)
    limit = time_to_cover(room, s.v_b, a)
    if limit >= most * par.dt:
        return most
    steps = int(limit / par.dt) - 1
    if steps < WATCHED and par.rock == BILINEAR:
        # the bound is too coarse so close to the rock: look
        steps = max(steps, watch_flight(par, s, wb, cb, watch, x, v, most))
    return steps


@kernel
def plan_leap(par, s, wb, cb, watch, x, v, most):
    """Decide how far the bit may leap next, at most `most` steps.

    s.leap_end says where to, or -1.
    """
    steps = 0
    looked = False
    s.v_b = mean_velocity(wb, cb, par.n_b, 2 * s.parity, par.mass_b)
    if s.mode == FF:
        s.leap_kind = FLIGHT
        if par.rock == NO_ROCK or par.rock == BILINEAR or s.p < s.p_u:
            steps = plan_flight(par, s, wb, cb, watch, x, v, most)
            looked = par.rock == BILINEAR
    elif par.rock == BILINEAR and can_watch(par, s):
        s.leap_kind = CONTACT
        if s.mode == SS:
            energy = standstill_energy(par, s, wb, cb)
            if not drills_not(par, s, energy):
                most = 0
            elif lifts_not(par, s, energy):
                s.leap_kind = STANDSTILL
                steps = most
        if s.leap_kind == CONTACT and most >= FEWEST_STEPS:
            steps = watch_contact(par, s, wb, cb, watch, x, v, most)
            looked = True
    if steps >= FEWEST_STEPS:
        s.leap_end = s.step + steps - steps % GRAIN
    elif looked:
        s.no_plan = s.step + steps + 1  # just past the event
    else:
        s.no_plan = s.step + FEWEST_STEPS


@kernel
def leap_free_bar(par, s, w, c, n, mass, v0, v1, steps, powers, size, x, y):
    """Carry the vibration of a free bar over `steps` steps."""
    r = 2 * s.parity
    load(x, w, c, n, r, v0, 0.0)
    pad(x, 2 * n, size)
    before = deviation_energy(w, c, n, r, v0, 0.0)
    carry(powers, steps, x, y, size)
    remove_mean(x, c, n, mass)
    store(x, w, c, n, r, v1, 0.0)
    if par.loss > 0:
        s.e_loss += before - deviation_energy(w, c, n, r, v1, 0.0)


@merged
def leap_flight(par, s, wb, cb, powers, steps, x, y):
    """Carry the bit over `steps` steps of free flight."""
    r = 2 * s.parity
    a = par.gravity + s.feed / par.mass_b
    time = steps * par.dt
    offset = strain_offset(wb, cb, par.n_b, r, BOTTOM)
    unloading = recoverable(s)
    v0 = s.v_b
    s.v_b = v0 + a * time
    path = (v0 + 0.5 * a * time) * time
    leap_free_bar(par, s, wb, cb, par.n_b, par.mass_b, v0, s.v_b, steps, powers, par.size_r, x, y)
    s.p += path - (strain_offset(wb, cb, par.n_b, r, BOTTOM) - offset)
    s.e_standstill += unloading - recoverable(s)
    return path


@merged
def leap_standstill(par, s, wb, cb, powers, sums, forms, steps, x, y):
    """Carry the bit over `steps` steps of standstill.

    Returns
    -------
    path : float
        Path of the bit's mean motion as its body forces see it [m].
    """
    r = 2 * s.parity
    n, size = par.n_b, par.size_r
    a = par.gravity + s.feed / par.mass_b
    K = s.gamma * s.k_r
    still = s.p_u + par.mass_b * a / K
    v0 = s.v_b
    spring = 0.5 * K * (s.p - s.p_u) * (s.p - s.p_u)
    load(x, wb, cb, n, r, 0.0, a)
    x[2 * n] = s.p - still
    pad(x, 2 * n + 1, size)
    before = standstill_energy(par, s, wb, cb)
    path = dot(sums[SS], x, size)
    damped = 0.0
    lost = 0.0
    if before > NEGLIGIBLE:
        damped += quadratic(forms[DASHPOT_FORM], x, y, size)
        lost += quadratic(forms[NUMERICAL_FORM], x, y, size)
    carry(powers[SS], steps, x, y, size)
    path -= dot(sums[SS], x, size)
    if before > NEGLIGIBLE:
        damped -= quadratic(forms[DASHPOT_FORM], x, y, size)
        lost -= quadratic(forms[NUMERICAL_FORM], x, y, size)
    store(x, wb, cb, n, r, 0.0, a)
    s.p = still + x[2 * n]
    s.e_standstill += damped
    s.e_numerical += lost
    if par.loss > 0:
        s.e_loss += before - standstill_energy(par, s, wb, cb) - damped - lost
    s.v_b = mean_velocity(wb, cb, n, r, par.mass_b)
    s.i_bit += par.mass_b * (a * steps * par.dt - (s.v_b - v0))
    s.rock_work += 0.5 * K * (s.p - s.p_u) * (s.p - s.p_u) - spring + damped
    return path


@kernel
def leap(par, s, wb, cb, ops, x, v, y, watched):
    """Carry the bit to s.leap_end in one go.

    Parameters
    ----------
    watched : bool
        Whether `v` still holds what the plan of this leap saw.
    ops : tuple of float arrays
        (piston, bit, watch, sums, top, bottom, forms), see `LeapOperators`.
    x, v, y : float array
        Scratch.
    """
    steps = s.leap_end - s.step
    if s.mode == SS:
        push_checkpoint(s, now(par, s))
    if s.leap_kind == FLIGHT:
        path = leap_flight(par, s, wb, cb, ops[1][FF], steps, x, y)
    elif s.leap_kind == STANDSTILL:
        if now(par, s) + steps * par.dt > s.peak_from:
            watch_standstill(par, s, wb, cb, ops[1], ops[2], steps, x, v, y)
        path = leap_standstill(par, s, wb, cb, ops[1], ops[3], ops[6], steps, x, y)
    else:
        if not watched:
            watch_contact(par, s, wb, cb, ops[2], x, v, steps)
        path = leap_contact(par, s, wb, cb, ops[1], ops[3], steps, x, v, y)
    s.e_feed += s.feed * path
    s.e_gravity += par.mass_b * par.gravity * path
    s.step = s.leap_end
    s.leap_end = -1
    s.count_leaps += 1
    s.count_leap_steps += steps
    if s.mode == SS:
        push_checkpoint(s, now(par, s))
