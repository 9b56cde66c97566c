"""The piston between two blows of the blow map: a parabola above a bit that settles.

The bit moves from where it stood to where it comes to rest, on straight lines
between the times of the table; so each crossing is the root of a quadratic.
"""

from __future__ import annotations

import math

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.solvers.blow_map.records import PATH_TIMES, Next

PIECES = len(PATH_TIMES)


@inlined
def acceleration(par, s):
    """Of the piston in flight, docs/model.md eq. 3 [m/s2]."""
    return par.gravity + s.alpha * s.drive_force / par.mass_p


@kernel
def bit_at(s, t):
    """Where the bit is, from where it stood before the blow.

    Returns
    -------
    position, velocity : float
        [m, m/s]
    """
    tau = t - s.t_blow
    begin = 0.0
    x = 0.0
    for k in range(PIECES):
        end = PATH_TIMES[k]
        if tau < end:
            slope = (s.path[k] - x) / (end - begin)
            return x + slope * (tau - begin), slope
        begin = end
        x = s.path[k]
    return s.penetration, 0.0


@inlined
def first_root(c, b, a, length):
    """First time in [0, length] at which c + b t + a t^2/2 is not above zero, or -1.

    Parameters
    ----------
    c, b, a : float
        The value may be above zero at the start.
    """
    if c <= 0.0:
        return 0.0
    root = -1.0
    square = b * b - 2.0 * a * c
    if square >= 0.0:
        # the smaller positive root, without a difference of like numbers
        if b < 0.0:
            root = 2.0 * c / (-b + math.sqrt(square))
        elif a < 0.0:
            root = (b + math.sqrt(square)) / -a
    if root > length:
        root = -1.0
    return root


@kernel
def crossing(par, s, level, sign):
    """When sign (y - x_b - level) first falls to zero, from the start of the piece on.

    Parameters
    ----------
    level : float
        Relative displacement [m].
    sign : float
        1: from above, -1: from below.

    Returns
    -------
    float
        Time [s]; infinite if never.
    """
    a = acceleration(par, s)
    tau = s.t - s.t_blow
    begin = 0.0
    x = 0.0
    for k in range(PIECES + 1):
        end = math.inf
        slope = 0.0
        if k < PIECES:
            end = PATH_TIMES[k]
            slope = (s.path[k] - x) / (end - begin)
        else:
            x = s.penetration
        if tau < end:
            since = tau + s.t_blow - s.t
            off = s.y + since * (s.v + 0.5 * a * since) - x - slope * (tau - begin) - level
            root = first_root(sign * off, sign * (s.v + a * since - slope), sign * a, end - tau)
            if root >= 0.0:
                return s.t_blow + tau + root
            tau = end
        begin = end
        if k < PIECES:
            x = s.path[k]
    return math.inf


@kernel
def plan(par, s):
    """Find what ends the present piece of flight, docs/model.md eq. 13."""
    s.next = Next.NOTHING
    if s.alpha > 0.0:
        s.t_next = crossing(par, s, 0.0, -1.0)
        if s.t_next < math.inf:
            s.next = Next.IMPACT
        return
    s.t_next = crossing(par, s, -s.reversal, 1.0)
    s.next = Next.TURN
    back = math.inf
    if acceleration(par, s) >= 0.0 or s.v > 0.0:
        # what the flight is carried back to is above the bit only once contacts are over
        back = s.t_blow + s.opened
        if s.t >= back:
            back = crossing(par, s, 0.0, -1.0)
    if back < s.t_next:
        s.t_next = back
        s.next = Next.FALL
    if s.t_next == math.inf:
        s.next = Next.NOTHING


@kernel
def move(par, s, t):
    """Carry the present piece of flight to `t`, with its impulses and works."""
    since = t - s.t
    a = acceleration(par, s)
    way = since * (s.v + 0.5 * a * since)
    force = s.alpha * s.drive_force
    s.i_drive += force * since
    s.i_bit += (s.feed + par.mass_b * par.gravity) * since
    s.e_drive += force * way
    s.e_gravity += par.mass_p * par.gravity * way
    if s.v < 0.0:
        top = t
        if a > 0.0 and s.v + a * since > 0.0:
            top = s.t - s.v / a
        height = top - s.t
        x, _ = bit_at(s, top)
        s.b_stroke = max(s.b_stroke, x - s.y - height * (s.v + 0.5 * a * height))
    s.y += way
    s.v += a * since
    s.t = t


@kernel
def commit(pars, states, t):
    """Start a new piece of flight at `t`, for arrays of one record."""
    move(pars[0], states[0], t)


@kernel
def plan_next(pars, states):
    """Plan the present piece of flight, for arrays of one record."""
    plan(pars[0], states[0])
