"""Contact between piston and bit: unilateral, without a penalty (Signorini).

All velocities that come in are constant over the step. `v_p` and `v_t` are the
velocities the two ends would have if they were free, `z_p` and `z_t` their
impedances (docs/model.md, eqs 9-11).
"""

from __future__ import annotations

from percussion_model.physics.elementary import expm1
from percussion_model.physics.kernel import inlined


@inlined
def bar_contact(closed, gap, v_p, v_t, z_p, z_t, tau):
    """Contact of two elastic ends over `tau`.

    While closed both ends share the velocity (z_p v_p + z_t v_t)/(z_p + z_t)
    and the force z_p z_t/(z_p + z_t) (v_p - v_t); contact opens where that
    would pull, which with constant incoming waves is only at the step's start.

    Returns
    -------
    closed : int
    gap : float
        At the end of the step [m].
    d_p, q_p, d_t, q_t : float
        Integrals of velocity [m] and of its square [m2/s], piston and bit.
    impulse : float
        Integral of the force [N s].
    t_close : float
        When the gap closed within the step [s], or -1.
    opened : int
        1 where the contact opened at the start of the step.
    """
    approach = v_p - v_t
    opened = 0
    t_close = -1.0
    free = tau
    if closed == 1:
        if approach > 0.0:
            free = 0.0
        else:
            closed = 0
            opened = 1
    if closed == 0 and approach > 0.0 and gap < approach * tau:
        free = gap / approach
        t_close = free
        closed = 1
    if closed == 1:
        gap = 0.0
        rest = tau - free
        v = (z_p * v_p + z_t * v_t) / (z_p + z_t)
        force = z_p * z_t / (z_p + z_t) * approach
        return (
            closed,
            gap,
            v_p * free + v * rest,
            v_p * v_p * free + v * v * rest,
            v_t * free + v * rest,
            v_t * v_t * free + v * v * rest,
            force * rest,
            t_close,
            opened,
        )
    gap -= approach * tau
    return (
        closed,
        gap,
        v_p * tau,
        v_p * v_p * tau,
        v_t * tau,
        v_t * v_t * tau,
        0.0,
        t_close,
        opened,
    )


@inlined
def mass_contact(closed, gap, v_p, v_t, mass, z_t, tau):
    """Contact of a rigid piston with an elastic bit over `tau`.

    While closed the mass obeys M v' = -z_t (v - v_t), so that v tends to v_t
    exponentially and the force z_t (v - v_t) never changes its sign.

    Parameters
    ----------
    v_p : float
        Velocity of the mass at the start of the step [m/s].
    mass : float
        Mass of the piston [kg].

    Returns
    -------
    tuple
        As `bar_contact`; q_p is the piston's velocity at the end [m/s].
    """
    approach = v_p - v_t
    opened = 0
    t_close = -1.0
    free = tau
    if closed == 1:
        if approach > 0.0:
            free = 0.0
        else:
            closed = 0
            opened = 1
    if closed == 0 and approach > 0.0 and gap < approach * tau:
        free = gap / approach
        t_close = free
        closed = 1
    if closed == 0:
        return (
            closed,
            gap - approach * tau,
            v_p * tau,
            v_p,
            v_t * tau,
            v_t * v_t * tau,
            0.0,
            t_close,
            opened,
        )
    rest = tau - free
    rate = z_t / mass
    fade = -expm1(-rate * rest)  # 1 - exp(-rate rest)
    moved = approach * fade / rate  # integral of v - v_t
    square = 0.5 * approach * approach * fade * (2.0 - fade) / rate
    end = v_t + approach * (1.0 - fade)
    return (
        closed,
        0.0,
        v_p * free + v_t * rest + moved,
        end,
        v_t * tau + moved,
        v_t * v_t * tau + 2.0 * v_t * moved + square,
        z_t * moved,
        t_close,
        opened,
    )
