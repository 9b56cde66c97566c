"""Flight of the piston between two blows: a parabola above a bit that settles.

The bit moves from where it stood to where it comes to rest, on straight lines
between the times of the table; so each crossing is the root of a quadratic.
"""

from __future__ import annotations

import math

from percussion_model.physics.body import bit_load, book_piston_load, piston_acceleration
from percussion_model.physics.drive import drive_force
from percussion_model.physics.kernel import inlined, kernel
from percussion_model.physics.readings import fill_ledger
from percussion_model.physics.records import Mode
from percussion_model.solvers.blow_map.records import PATH_TIMES, Next

PIECES = len(PATH_TIMES)
# As numbers, since a reading has no others.
FLYING, STANDING = float(Mode.FF), float(Mode.SS)


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


@kernel
def hole_depth_at(s, t):
    """Depth of the hole at `t`: as far as the bit has come, at most where it will rest [m].

    The table does not have how far the rock is crushed within a blow.
    """
    deepest = max(bit_at(s, t)[0], 0.0)
    for k in range(PIECES):
        if s.t_blow + PATH_TIMES[k] <= t:
            deepest = max(deepest, s.path[k])
    return s.x_r - s.hole_start + min(deepest, s.penetration)


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
    a = piston_acceleration(par, drive_force(par, s))
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
            off = s.y + since * (s.v_p + 0.5 * a * since) - x - slope * (tau - begin) - level
            root = first_root(sign * off, sign * (s.v_p + a * since - slope), sign * a, end - tau)
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
    if s.alpha > 0:
        s.t_next = crossing(par, s, 0.0, -1.0)
        if s.t_next < math.inf:
            s.next = Next.IMPACT
        return
    s.t_next = crossing(par, s, -s.reversal, 1.0)
    s.next = Next.TURN
    back = math.inf
    if piston_acceleration(par, drive_force(par, s)) >= 0.0 or s.v_p > 0.0:
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
    push = drive_force(par, s)
    a = piston_acceleration(par, push)
    way = since * (s.v_p + 0.5 * a * since)
    book_piston_load(par, s, push, way, push * since)
    s.i_bit += bit_load(par, s) * since
    if s.v_p < 0.0:
        top = t
        if a > 0.0 and s.v_p + a * since > 0.0:
            top = s.t - s.v_p / a
        height = top - s.t
        x, _ = bit_at(s, top)
        s.b_stroke = max(s.b_stroke, x - s.y - height * (s.v_p + 0.5 * a * height))
    s.y += way
    s.v_p += a * since
    s.t = t


@kernel
def commit(pars, states, t):
    """Start a new piece of flight at `t`, for arrays of one record."""
    move(pars[0], states[0], t)


@kernel
def plan_next(pars, states):
    """Plan the present piece of flight, for arrays of one record."""
    plan(pars[0], states[0])


@kernel
def read(pars, states, t, readings):
    """Tell what it is like at `t`; nothing is moved.

    The bit is a rigid body on the path of the table. Its force is the static one, and
    what a blow gives to bodies and ledger is theirs from the start of the blow on.

    Parameters
    ----------
    pars, states, readings : arrays of MAP_PAR, MAP_STATE and READING of length 1
        A record by itself takes Python longer to pass than all of this.
    """
    par = pars[0]
    s = states[0]
    row = readings[0]
    since = t - s.t
    push = drive_force(par, s)
    a = piston_acceleration(par, push)
    static = bit_load(par, s)
    x, v_b = bit_at(s, t)
    way = since * (s.v_p + 0.5 * a * since)
    y = s.y + way
    v_p = s.v_p + a * since
    u_r = y - x
    if u_r > 0.0:
        # within the contacts of a blow there is no flight yet: the piston is at the bit
        u_r = 0.0
        y = x
    here = s.x_r + x
    recoverable = static * static / (2.0 * par.gamma * s.next_k_r)
    fill_ledger(s, row, 0.5 * par.mass_p * v_p * v_p, 0.0, recoverable)
    row.e_drive += push * way
    row.e_gravity += par.mass_p * par.gravity * way
    row.peak_bit_force = max(s.peak_bit_force, static)
    row.time = t
    row.piston_position = s.x_r + y + par.start_gap
    row.piston_velocity = v_p
    row.bit_position = here
    row.bit_velocity = v_b
    row.bit_end_position = here
    row.bit_end_velocity = v_b
    row.gap = -u_r
    row.relative_displacement = u_r
    row.penetration = static / s.next_k_r
    row.hole_depth = hole_depth_at(s, t)
    row.bit_force = static
    row.contact_force = 0.0
    row.drive_force = push
    row.drilling_mode = STANDING if t - s.t_blow >= s.rest else FLYING
    row.bit_kinetic_energy = 0.5 * par.mass_b * v_b * v_b
    row.bit_impulse = s.i_bit + static * since
    row.contact_impulse = s.i_contact
    row.drive_impulse = s.i_drive + push * since
