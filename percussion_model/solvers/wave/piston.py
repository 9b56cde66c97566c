"""The piston within a step: its contact where it is rigid, and its mean motion."""

from __future__ import annotations

from percussion_model.physics.elementary import expm1
from percussion_model.physics.kernel import inlined, merged
from percussion_model.physics.loads import (
    drive_force,
    move_to_components,
    piston_acceleration,
    switch_drive,
)


@inlined
def mass_contact(v_p, v_t, mass, z_t, tau):
    """Contact of a rigid piston with an elastic end over `tau`.

    The mass obeys M v' = -z_t (v - v_t), so that v tends to v_t exponentially and the force
    z_t (v - v_t) never changes its sign.

    Parameters
    ----------
    v_p : float
        Velocity of the mass at the start of the step [m/s].
    v_t : float
        That of the end if it were free [m/s].
    mass : float
        Of the piston [kg].
    z_t : float
        Impedance of the end [N s/m].

    Returns
    -------
    d_t, q_t : float
        Integrals of the velocity of the end [m] and of its square [m2/s].
    impulse : float
        Integral of the force [N s].
    """
    approach, rate = v_p - v_t, z_t / mass
    fade = -expm1(-rate * tau)  # 1 - exp(-rate tau)
    moved = approach * fade / rate  # integral of v - v_t
    square = 0.5 * approach * approach * fade * (2.0 - fade) / rate
    return v_t * tau + moved, v_t * v_t * tau + 2.0 * v_t * moved + square, z_t * moved


@merged
def move_piston(par, s, push, impulse, u_before, time, tau, events):
    """Mean motion of the piston, with a switch of the drive inside the step.

    The second half of the body force makes up for what the first half, given
    before the switch was known, had too much.
    """
    half = 0.5 * tau
    later = push
    share = switch_drive(par, s, u_before, time, tau, events)
    if share >= 0.0:
        mean = share * push + (1.0 - share) * drive_force(par, s)
        later = 2.0 * mean - push
    v0 = s.v_p
    v1 = v0 + piston_acceleration(par, push) * half
    v2 = v1 - impulse / par.mass_p
    v3 = v2 + piston_acceleration(par, later) * half
    first = 0.5 * half * (v0 + v1)
    second = 0.5 * half * (v2 + v3)
    s.v_p = v3
    s.e_drive += push * first + later * second
    s.e_gravity += par.mass_p * par.gravity * (first + second)
    s.i_drive += (push + later) * half
    move_to_components(par, s, first + second)
    if -s.u_r > s.b_stroke:
        s.b_stroke = -s.u_r
