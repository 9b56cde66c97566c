"""Forces on rigid piston and bit, and the guard against storms of their events."""

from __future__ import annotations

import math

from percussion_model.physics.blows import LAST_SHARE
from percussion_model.physics.kernel import kernel
from percussion_model.physics.loads import bit_load, drive_force, piston_acceleration
from percussion_model.physics.power_law import loading_force
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import (
    damping,
    enter_standstill,
    is_curved,
    is_rigid_rock,
    present_line,
    recoverable,
)
from percussion_model.solvers.rigid.motion import oscillate

# Relative rounding of an acceleration, and of a force that is the difference of two lengths.
ROUNDING = 1e-12
LAST_PLACES = 1e-15

# So many times the events of a storm, and no way of moving is left to end it.
WORST_STORM = 10


@kernel
def loads(par, s):
    """Constant force on the body that meets the rock, and its mass.

    Returns
    -------
    F, M : float
        Force [N] and mass [kg] of the bit, with the piston where it is held.
    """
    F = bit_load(par, s)
    if s.held == 1:
        return F + drive_force(par, s) + par.mass_p * par.gravity, par.mass_b + par.mass_p
    return F, par.mass_b


@kernel
def rock_terms(par, s):
    """Stiffness K, damping C and origin P_R of the present mode; K = 0 off the rock."""
    if s.mode == Mode.FF or is_rigid_rock(par):
        return 0.0, 0.0, 0.0
    line = present_line(par, s)
    return line.stiffness, damping(s), line.origin


@kernel
def on_wall(par, s):
    """Whether the bit rests on a rigid wall."""
    return is_rigid_rock(par) and s.mode == Mode.SS


@kernel
def acceleration(par, s):
    """Acceleration of the bit [m/s^2]."""
    if on_wall(par, s):
        return 0.0
    F, M = loads(par, s)
    K, C, P = rock_terms(par, s)
    return (F - K * (s.p - P) - C * s.v_b) / M


@kernel
def acceleration_doubt(par, s, acc):
    """Rounding that an acceleration relative to the free piston may carry [m/s^2].

    That of the two terms, and that of the rock's force, which they may hide.
    """
    K, _, P = rock_terms(par, s)
    hidden = K * (abs(s.p) + abs(P)) / par.mass_b
    free = piston_acceleration(par, drive_force(par, s))
    return ROUNDING * (abs(acc) + abs(free)) + LAST_PLACES * hidden


@kernel
def contact_force(par, s, acc):
    """Force of the piston on the bit while both move with `acc` [N]."""
    return par.mass_p * (piston_acceleration(par, drive_force(par, s)) - acc)


@kernel
def bit_force(par, s, p, v):
    """Force on the rock at penetration p and velocity v in the present mode [N]."""
    if on_wall(par, s):
        F, _ = loads(par, s)
        return F
    if is_curved(par, s):
        return loading_force(par, s, p) + damping(s) * v
    K, C, P = rock_terms(par, s)
    return K * (p - P) + C * v


@kernel
def lift_off(par, s):
    """Free flight begins; a rock in tension gives its energy up."""
    before = recoverable(par, s)
    s.mode = Mode.FF
    s.e_standstill += before - recoverable(par, s)


@kernel
def mark_standstill(s):
    """Note where an undisturbed stretch of standstill begins."""
    s.ss_from = s.time
    s.ss_p = s.p
    s.ss_v = s.v_b


@kernel
def note_standstill_force(par, s):
    """Mean bit force over the last tenth of the standstill up to now.

    From momentum, F_tot - M dv/dt; a disturbance within the last tenth shortens it.
    """
    if s.mode != Mode.SS or s.time <= s.ss_from:
        return
    begin = s.time - LAST_SHARE * (s.time - s.t_standstill)
    F, M = loads(par, s)
    v = s.ss_v
    K, C, P = rock_terms(par, s)
    if begin <= s.ss_from or K == 0.0:
        begin = max(begin, s.ss_from)
    else:
        _, v = oscillate(s.ss_p - P - F / K, v, 0.5 * C / M, K / M, begin - s.ss_from)
    s.ss_force = F - M * (s.v_b - v) / (s.time - begin)


@kernel
def begin_standstill(s):
    """Standstill begins."""
    s.mode = Mode.SS
    enter_standstill(s, s.time)
    mark_standstill(s)


@kernel
def kinetic_energy(par, v_p, v_b):
    """Kinetic energy of piston and bit [J]."""
    energy = 0.5 * par.mass_b * v_b * v_b
    if par.piston != Piston.ABSENT:
        energy += 0.5 * par.mass_p * v_p * v_p
    return energy


@kernel
def in_storm(par, s):
    """Whether more events came within a window than rigid bodies can resolve."""
    return s.window_events >= par.most_events


@kernel
def storm_persists(par, s):
    """Whether the storm went on although impacts no longer rebound."""
    return s.window_events >= WORST_STORM * par.most_events


@kernel
def is_finite(s):
    """Whether the state still is numbers."""
    return math.isfinite(s.p + s.v_b + s.v_p + s.gap + s.time)
