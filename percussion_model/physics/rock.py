"""The five-mode bit/rock law: its numbers and its changes of mode.

Table 1 of docs/model.md, with the readings given there.
"""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import Mode, RockKind

FF, DFC, FC, BC, SS = (int(m) for m in Mode)
BILINEAR, SPRING, WALL = int(RockKind.BILINEAR), int(RockKind.SPRING), int(RockKind.WALL)

# A velocity below this counts as zero: the ringing left after a long
# standstill is of this size, its sign means nothing [m/s].
REST_VELOCITY = 1e-9

# A drilling cycle counts when it crushed more than this share of W_R.
COUNTED_CYCLE = 0.01


@inlined
def stiffness(s):
    """K of the present mode [N/m], table 1 of docs/model.md."""
    if s.mode == DFC or s.mode == FC:
        return s.k_r
    if s.mode == FF:
        return 0.0
    return s.gamma * s.k_r


@inlined
def origin(s):
    """P_R of the present mode [m], table 1 of docs/model.md."""
    if s.mode == BC or s.mode == SS:
        return s.p_u
    return 0.0


@inlined
def recoverable(s):
    """Energy that the rock would give back on unloading [J]."""
    if s.mode == DFC or s.mode == FC:
        return 0.5 * s.k_r * s.p * s.p / s.gamma
    if s.mode == FF and s.p <= s.p_u:
        return 0.0
    y = s.p - s.p_u
    return 0.5 * s.gamma * s.k_r * y * y


@inlined
def barrier_off(par, s):
    """Whether a blow of any energy starts a drilling cycle."""
    return par.barrier == 0 or s.next_c_r == 0.0 or s.next_w_r == 0.0


@kernel
def start_cycle(s, barrier, p):
    """Begin a drilling cycle whose penetration starts at `p` (eqs 18-19 of the paper)."""
    s.x_r += s.p - p
    s.p = p
    s.w = 0.0
    s.crushed = 0.0
    s.cycle_counted = 0
    s.k_r = s.next_k_r
    s.gamma = s.next_gamma
    s.c_r = s.next_c_r
    s.w_r = s.next_w_r
    if barrier == 1 and s.c_r > 0.0 and s.w_r > 0.0:
        s.mode = DFC
    else:
        s.mode = FC


@kernel
def resume_cycle(s, barrier):
    """Begin a cycle from contact: the elastic part of the force stays the same."""
    force = s.gamma * s.k_r * (s.p - s.p_u)
    before = recoverable(s)
    start_cycle(s, barrier, force / s.next_k_r)
    # With other rock than before, what can be recovered changes at once.
    s.e_crushing += before - recoverable(s)


@merged
def leave_by_velocity(par, s, v, energy):
    """Change of mode that the sign of the end velocity asks for.

    Parameters
    ----------
    v : float
        Velocity of the bit end [m/s].
    energy : float
        Kinetic energy of the bit [J].

    Returns
    -------
    int
        1 where the mode changed.
    """
    if par.rock != BILINEAR:
        return 0
    if s.mode == DFC or s.mode == FC:
        if v < -REST_VELOCITY:
            s.p_u = s.p * (s.gamma - 1.0) / s.gamma
            s.mode = BC
            return 1
    elif s.mode == BC and v > REST_VELOCITY:
        if barrier_off(par, s) or energy > s.w_r:
            resume_cycle(s, par.barrier)
        else:
            s.mode = SS
        return 1
    return 0


@merged
def close_interface(par, s, energy):
    """Contact with the rock begins: a new cycle, standstill, spring or wall."""
    if par.rock == SPRING:
        s.mode = FC
    elif par.rock == WALL:
        s.mode = SS
    elif barrier_off(par, s) or energy > s.w_r:
        s.e_standstill += recoverable(s)
        start_cycle(s, par.barrier, 0.0)
    else:
        s.mode = SS


@merged
def leave_standstill(par, s, v):
    """Standstill ends because KE_b > W_R: a new cycle, or unloading."""
    if v < -REST_VELOCITY:
        s.mode = BC
    else:
        resume_cycle(s, par.barrier)


@inlined
def enter_standstill(s, time):
    """Start the record of the bit force in standstill."""
    s.t_standstill = time
    s.n_check = 0


@inlined
def crush(s, p_before):
    """Book the irrecoverable part of loading from `p_before` to s.p."""
    work = 0.5 * s.k_r * (s.p - p_before) * (s.p + p_before) * (1.0 - 1.0 / s.gamma)
    s.e_crushing += work
    s.crushed += work
    if s.cycle_counted == 0 and s.crushed > COUNTED_CYCLE * s.w_r:
        s.cycle_counted = 1
        s.b_cycles += 1
