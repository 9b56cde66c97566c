"""Leaps of the bit: any time of free flight or quiet standstill in one move."""

from __future__ import annotations

import math

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.body import bit_acceleration, time_to_cover
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.records import Mode, RockKind
from percussion_model.physics.rock import barrier_off, damping, origin, stiffness
from percussion_model.solvers.modal.bar import Q, V
from percussion_model.solvers.modal.pairs import (
    PQ,
    PV,
    ahead_of,
    carry_pairs,
    energy_about_rest,
    energy_of_pairs,
    keep_ahead,
    spell_out,
)
from percussion_model.solvers.modal.phase import book_way, present_look, ready
from percussion_model.solvers.modal.piston import WHOLE, has_piston, quiet_time, time_of
from percussion_model.solvers.modal.records import LOOK, STEP

# Most steps of a leap.
LONGEST = (1 << 16) - 1
# A leap of fewer is not worth planning.
FEWEST = LOOK
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


@kernel
def plan_flight(par, s, energy):
    """Time of free flight, with an energy of vibration [J], before anything can happen [s]."""
    spread = math.sqrt(2.0 * energy)
    a = bit_acceleration(par, s)
    limit = quiet_time(par, s, s.v_b, a, par.bound_t * spread + abs(s.offset), 0.0)
    if par.rock != RockKind.NONE:
        now = s.low - s.at_b / par.mass_b
        room = s.p_u - s.p + now - par.bound_b * spread
        limit = min(limit, time_to_cover(room, s.v_b, a))
    return limit


@kernel
def plan_standstill(par, s, energy):
    """Time of a quiet standstill before anything can happen [s]."""
    if not keeps_contact(par, s, energy):
        return 0.0
    K = s.gamma * s.k_r
    size = math.sqrt(2.0 * energy)
    mean = size * (1.0 / math.sqrt(K) + par.bound_b)
    off = s.p_u + par.mass_b * bit_acceleration(par, s) / K - s.p
    spread = par.bound_t * size + abs(s.offset)
    return quiet_time(par, s, 0.0, 0.0, spread, 2.0 * mean + abs(off))


@kernel
def plan(par, s, bars, law):
    """Decide whether the bit leaps next; s.leap_end says where to, or -1."""
    s.no_plan = s.time + FEWEST * WHOLE
    if s.closed == 1 or (has_piston(par) and s.parked == 0):
        return
    flies = s.mode == Mode.FF and (par.rock == RockKind.NONE or s.p < s.p_u)
    stands = s.mode == Mode.SS and s.alert == 0 and not barrier_off(par, s)
    if not flies and not (stands and par.rock == RockKind.BILINEAR):
        return
    ready(par, s, bars, law)
    energy = 0.5 * energy_of_pairs(s, bars)
    limit = plan_flight(par, s, energy) if flies else plan_standstill(par, s, energy)
    if limit < FEWEST * par.dt:
        return
    energy = energy_about_rest(s, bars, spell_out(s, bars))
    limit = plan_flight(par, s, energy) if flies else plan_standstill(par, s, energy)
    steps = min(limit / par.dt - 1.0, LONGEST)
    if steps >= FEWEST:
        s.leap_end = s.time + int(steps) * WHOLE


@kernel
def note_peak(par, s, bars, ticks):
    """Note the greatest bit force of a standstill leap about to be made."""
    if time_of(par, s) + ticks * par.tick <= s.peak_from:
        return
    still, w = par.mass_b * bit_acceleration(par, s), bars.w
    for k in range(s.pairs):
        w[Q, k], w[V, k] = w[PQ, k], w[PV, k]
    C, K, steps = damping(s), stiffness(s), ticks >> STEP
    for step in range(steps):
        sums = ahead_of(s, bars, STEP)
        keep_ahead(s, bars)
        force = K * (s.p + (sums.low - s.low) - origin(s)) + C * sums.speed
        if time_of(par, s) + (step + 1) * par.dt > s.peak_from:
            s.peak_bit_force = max(s.peak_bit_force, force)
        if step % LOOK == 0:
            energy = energy_about_rest(s, bars, spell_out(s, bars))
            if 2.0 * K * energy < (STILL_SHARE * still) ** 2:
                s.peak_bit_force = max(s.peak_bit_force, still)
                break
    for k in range(s.pairs):
        w[PQ, k], w[PV, k] = w[Q, k], w[V, k]


@kernel
def leap(par, s, bars):
    """Carry bit and mean motion of the piston to s.leap_end in one go."""
    ticks = s.leap_end - s.time
    if s.mode == Mode.SS:
        push_checkpoint(s, time_of(par, s))
        note_peak(par, s, bars, ticks)
    carry_pairs(s, bars, ticks)
    book_way(par, s, bars, ticks, present_look(par, s, bars))
    s.leap_end = -1
    s.no_plan = s.time
    s.count_leaps += 1
    if s.mode == Mode.SS:
        push_checkpoint(s, time_of(par, s))
