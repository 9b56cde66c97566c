"""Forces on rigid piston and bit, the rock law, and what it keeps and loses.

The rock law is table 1 of docs/model.md; the drive is its eq. 13.
"""

from __future__ import annotations

import math

from numba import njit

from percussion_model.physics.records import DriveKind, Mode, Piston, RockKind
from percussion_model.solvers.rigid.motion import oscillate

# Relative rounding of an acceleration, and of a force that is the difference of two lengths.
ROUNDING = 1e-12
LAST_PLACES = 1e-15

# A drilling cycle counts when it crushed more than this share of W_R.
COUNTED_CYCLE = 0.01

# So many times the events of a storm, and no way of moving is left to end it.
WORST_STORM = 10

# The standstill force is the mean over this last share of the standstill.
LAST_SHARE = 0.1


@njit(cache=True, error_model="numpy")
def drive_force(par, s):
    """Force of the drive on the piston, down positive [N]."""
    if par.drive == DriveKind.PRESSURE:
        return s.alpha * par.F_0
    if par.drive == DriveKind.EXTERNAL:
        return par.external
    return 0.0


@njit(cache=True, error_model="numpy")
def free_acceleration(par, s):
    """Acceleration of the piston when nothing but drive and weight acts on it [m/s^2]."""
    return par.G + drive_force(par, s) / par.M_p


@njit(cache=True, error_model="numpy")
def loads(par, s):
    """Constant force on the body that meets the rock, and its mass.

    Returns
    -------
    F, M : float
        Force [N] and mass [kg] of the bit, with the piston where it is held.
    """
    F = par.F_S + par.M_b * par.G
    if s.held == 1:
        return F + drive_force(par, s) + par.M_p * par.G, par.M_b + par.M_p
    return F, par.M_b


@njit(cache=True, error_model="numpy")
def rock_terms(par, s):
    """Stiffness K, damping C and origin P_R of the present mode; K = 0 off the rock."""
    if s.mode == Mode.FF or par.rock == RockKind.WALL:
        return 0.0, 0.0, 0.0
    if s.mode == Mode.DFC:
        return s.K_R, s.C_R, 0.0
    if s.mode == Mode.FC:
        return s.K_R, 0.0, 0.0
    if s.mode == Mode.BC:
        return s.gamma * s.K_R, 0.0, s.P_u
    return s.gamma * s.K_R, s.C_R, s.P_u


@njit(cache=True, error_model="numpy")
def on_wall(par, s):
    """Whether the bit rests on a rigid wall."""
    return par.rock == RockKind.WALL and s.mode == Mode.SS


@njit(cache=True, error_model="numpy")
def acceleration(par, s):
    """Acceleration of the bit [m/s^2]."""
    if on_wall(par, s):
        return 0.0
    F, M = loads(par, s)
    K, C, P = rock_terms(par, s)
    return (F - K * (s.p - P) - C * s.v_b) / M


@njit(cache=True, error_model="numpy")
def acceleration_doubt(par, s, acc):
    """Rounding that an acceleration relative to the free piston may carry [m/s^2].

    That of the two terms, and that of the rock's force, which they may hide.
    """
    K, _, P = rock_terms(par, s)
    hidden = K * (abs(s.p) + abs(P)) / par.M_b
    return ROUNDING * (abs(acc) + abs(free_acceleration(par, s))) + LAST_PLACES * hidden


@njit(cache=True, error_model="numpy")
def contact_force(par, s, acc):
    """Force of the piston on the bit while both move with `acc` [N]."""
    return par.M_p * (free_acceleration(par, s) - acc)


@njit(cache=True, error_model="numpy")
def bit_force(par, s, p, v):
    """Force on the rock at penetration p and velocity v in the present mode [N]."""
    if on_wall(par, s):
        F, _ = loads(par, s)
        return F
    K, C, P = rock_terms(par, s)
    return K * (p - P) + C * v


@njit(cache=True, error_model="numpy")
def recoverable(par, s, p):
    """Energy F_e**2 / (2 gamma K_R) that the rock would give back [J]."""
    if par.rock != RockKind.BILINEAR and par.rock != RockKind.SPRING:
        return 0.0
    if s.mode == Mode.DFC or s.mode == Mode.FC:
        return 0.5 * s.K_R * p * p / s.gamma
    if s.mode == Mode.FF and p <= s.P_u:
        return 0.0
    return 0.5 * s.gamma * s.K_R * (p - s.P_u) * (p - s.P_u)


@njit(cache=True, error_model="numpy")
def barrier_on(par, s):
    """Whether a drilling cycle needs more than W_R to start."""
    return par.barrier == 1 and s.W_R > 0.0 and s.C_R > 0.0


@njit(cache=True, error_model="numpy")
def overcomes_barrier(par, s):
    """Whether the bit is fast enough to start a drilling cycle."""
    return not barrier_on(par, s) or 0.5 * par.M_b * s.v_b * s.v_b > s.W_R


@njit(cache=True, error_model="numpy")
def start_cycle(par, s, p):
    """Begin a drilling cycle at penetration p, with the rock law now in force.

    What the rock could have given back and no longer can is booked: after free flight
    it has relaxed (standstill), else the law has changed (crushing).
    """
    from_flight = s.mode == Mode.FF
    before = recoverable(par, s, s.p)
    s.p = p
    s.W = 0.0
    s.crushed = 0.0
    s.counted = 0
    s.K_R = par.K_R
    s.gamma = par.gamma
    s.C_R = par.C_R
    s.W_R = par.W_R
    s.mode = Mode.DFC if barrier_on(par, s) else Mode.FC
    lost = before - recoverable(par, s, p)
    if from_flight:
        s.standstill += lost
    else:
        s.crushing += lost


@njit(cache=True, error_model="numpy")
def resume_cycle(par, s):
    """Begin a drilling cycle from contact; the elastic force stays continuous (eq. 19)."""
    start_cycle(par, s, s.gamma * s.K_R * (s.p - s.P_u) / par.K_R)


@njit(cache=True, error_model="numpy")
def end_loading(s):
    """Loading ends at the peak: P_u = p (gamma - 1)/gamma (eq. 22)."""
    s.P_u = s.p * (s.gamma - 1.0) / s.gamma
    s.mode = Mode.BC


@njit(cache=True, error_model="numpy")
def lift_off(par, s):
    """Free flight begins; a rock in tension gives its energy up."""
    before = recoverable(par, s, s.p)
    s.mode = Mode.FF
    s.standstill += before - recoverable(par, s, s.p)


@njit(cache=True, error_model="numpy")
def watch_standstill(s):
    """Note where an undisturbed stretch of standstill begins."""
    s.ss_from = s.time
    s.ss_p = s.p
    s.ss_v = s.v_b


@njit(cache=True, error_model="numpy")
def note_standstill_force(par, s):
    """Mean bit force over the last tenth of the standstill up to now.

    From momentum, F_tot - M dv/dt; a disturbance within the last tenth shortens it.
    """
    if s.mode != Mode.SS or s.time <= s.ss_from:
        return
    begin = s.time - LAST_SHARE * (s.time - s.ss_time)
    F, M = loads(par, s)
    v = s.ss_v
    K, C, P = rock_terms(par, s)
    if begin <= s.ss_from or K == 0.0:
        begin = max(begin, s.ss_from)
    else:
        _, v = oscillate(s.ss_p - P - F / K, v, 0.5 * C / M, K / M, begin - s.ss_from)
    s.ss_force = F - M * (s.v_b - v) / (s.time - begin)


@njit(cache=True, error_model="numpy")
def set_down(par, s):
    """Standstill begins."""
    s.mode = Mode.SS
    s.ss_time = s.time
    watch_standstill(s)


@njit(cache=True, error_model="numpy")
def kinetic_energy(par, v_p, v_b):
    """Kinetic energy of piston and bit [J]."""
    energy = 0.5 * par.M_b * v_b * v_b
    if par.piston != Piston.ABSENT:
        energy += 0.5 * par.M_p * v_p * v_p
    return energy


@njit(cache=True, error_model="numpy")
def in_storm(par, s):
    """Whether more events came within a window than rigid bodies can tell."""
    return s.window_events >= par.most_events


@njit(cache=True, error_model="numpy")
def in_worst_storm(par, s):
    """Whether the storm went on although impacts no longer rebound."""
    return s.window_events >= WORST_STORM * par.most_events


@njit(cache=True, error_model="numpy")
def is_finite(s):
    """Whether the state still is numbers."""
    return math.isfinite(s.p + s.v_b + s.v_p + s.gap + s.time)
