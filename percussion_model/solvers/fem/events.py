"""First event of a step: Hermite interpolation, driven just past it.

Every event function is positive until its event. Values at both ends of a bracket, and slopes
from the stages, make a cubic; a step to its first root is tried, and the bracket shrinks until
its end lies past the event by no more than the tolerance, or is narrower than that of time.
Cubics are lowered by half the tolerance, so the new mode never sees its own threshold.
"""

from __future__ import annotations

import math

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import room_to_turn
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import (
    REST_VELOCITY,
    barrier_level,
    damping,
    has_rock,
    is_elastic_rock,
    is_loading,
    origin,
    stiffness,
)
from percussion_model.solvers.fem.bars import relative_motion
from percussion_model.solvers.fem.records import Column, Mesh, Node, Probe
from percussion_model.solvers.fem.scheme import acceleration, try_step
from percussion_model.solvers.fem.step import dashpot_work

PROBES = len(Probe)

# Steps tried for one event; bisection takes over half-way.
MOST_TRIALS = 60
HERMITE_TRIALS = 12
# Halvings that find a root to rounding.
HALVINGS = 50
# A function that is not watched has this value: never an event.
NEVER = 1.0


@inlined
def contact_value(par, s, a):
    """Gap, or its negative while it is closed [m]."""
    gap = a[Node.U, par.n_p] - a[Node.U, par.n_p - 1]
    return -gap if s.closed == 1 else gap


@inlined
def drive_value(par, s, u_r):
    """Distance of u_r to the threshold that is watched [m]."""
    room = room_to_turn(par, s, u_r)
    return room if room < math.inf else NEVER


@inlined
def rock_value(par, s, p, v, work):
    """What ends the present mode by position, work or force."""
    if s.mode == Mode.FF:
        if not has_rock(par):
            return NEVER
        return -v if s.rebounding == 1 else s.p_u - p
    if is_elastic_rock(par):
        return p
    if s.mode == Mode.DFC:
        return s.w_r - s.w - work
    if s.mode == Mode.BC:
        return p - s.p_u
    if s.mode == Mode.SS and par.release == 1:
        return stiffness(s) * (p - origin(s)) + damping(s) * v
    return NEVER


@inlined
def turn_value(par, s, v, energy):
    """What ends the present mode by the sign of the velocity or the bit's energy."""
    if s.mode == Mode.FF or is_elastic_rock(par):
        return NEVER
    if s.mode == Mode.SS:
        return barrier_level(par, s) - energy
    if s.mode == Mode.BC:
        return REST_VELOCITY - v
    return v + REST_VELOCITY


@inlined
def power(par, c, a, x, end):
    """Rate of the bit's kinetic energy at an end of a tried step [W]."""
    n_p = par.n_p
    last = n_p + par.n_b - 1
    total = c[Mesh.MASS, last] * a[Node.V, last] * acceleration(par, x, last, end)
    for i in range(n_p, last):
        here = acceleration(par, x, i, end)
        there = acceleration(par, x, i + 1, end)
        total += c[Mesh.MASS, i] * (a[Node.V, i] * here)
        total += c[Mesh.COUPLING, i] * (a[Node.V, i] * there + a[Node.V, i + 1] * here)
    return total


@inlined
def fill_low(par, s, q):
    """Values at the start of the step, from what the state knows."""
    q[Probe.CONTACT, Column.LOW] = NEVER
    q[Probe.DRIVE, Column.LOW] = NEVER
    if par.n_p > 0:
        q[Probe.CONTACT, Column.LOW] = -s.gap if s.closed == 1 else s.gap
        q[Probe.DRIVE, Column.LOW] = drive_value(par, s, s.u_r)
    q[Probe.ROCK, Column.LOW] = rock_value(par, s, s.p, s.v_end, 0.0)
    q[Probe.TURN, Column.LOW] = turn_value(par, s, s.v_end, s.kinetic)


@inlined
def fill_values(par, s, w, x, h, q, column):
    """Values at the end of a tried step of length `h`."""
    last = par.n_p + par.n_b - 1
    q[Probe.CONTACT, column] = NEVER
    q[Probe.DRIVE, column] = NEVER
    if par.n_p > 0:
        q[Probe.CONTACT, column] = contact_value(par, s, x)
        q[Probe.DRIVE, column] = drive_value(par, s, s.next_p - s.next_b)
    work = dashpot_work(par, s, x, w, h) if s.mode == Mode.DFC else 0.0
    p, v = x[Node.U, last] + s.far, x[Node.V, last]
    q[Probe.ROCK, column] = rock_value(par, s, p, v, work)
    # an end that came back has turned within the step, however it moves at its end: that is far
    # past the event, not within its tolerance
    if is_loading(s) and p < s.p and v > 0.0:
        v = -(abs(s.v_end) + v)
    q[Probe.TURN, column] = turn_value(par, s, v, s.next_kinetic)


@merged
def fill_slopes(par, s, c, a, x, end, h, q, column):
    """Slopes at an end of a tried step; `a` holds displacements and velocities there."""
    n_p = par.n_p
    last = n_p + par.n_b - 1
    v = a[Node.V, last]
    for k in range(PROBES):
        q[k, column] = 0.0
    if n_p > 0:
        rate = a[Node.V, n_p] - a[Node.V, n_p - 1]
        q[Probe.CONTACT, column] = h * (-rate if s.closed == 1 else rate)
        rate = relative_motion(par, c, a, Node.V)
        q[Probe.DRIVE, column] = -h * (s.alpha * rate)
    turn = acceleration(par, x, last, end)
    if s.mode == Mode.FF:
        q[Probe.ROCK, column] = -h * (turn if s.rebounding == 1 else v)
    elif is_elastic_rock(par) or s.mode == Mode.BC:
        q[Probe.ROCK, column] = h * v
    elif s.mode == Mode.DFC:
        q[Probe.ROCK, column] = -h * s.c_r * v * v
    elif s.mode == Mode.SS:
        q[Probe.ROCK, column] = h * (stiffness(s) * v + damping(s) * turn)
    if s.mode == Mode.SS:
        q[Probe.TURN, column] = -h * power(par, c, a, x, end)
    elif s.mode == Mode.BC:
        q[Probe.TURN, column] = -h * turn
    else:
        q[Probe.TURN, column] = h * turn


@inlined
def cubic(q0, d0, q1, d1, t):
    """Hermite's cubic at `t` between 0 and 1."""
    rise = q1 - q0
    b = 3.0 * rise - 2.0 * d0 - d1
    a = d0 + d1 - 2.0 * rise
    return q0 + t * (d0 + t * (b + t * a))


@merged
def lowest_inside(q0, d0, q1, d1):
    """Where a cubic that falls at 0 and rises at 1 turns between."""
    low = 0.0
    high = 1.0
    rise = q1 - q0
    b = 3.0 * rise - 2.0 * d0 - d1
    a = d0 + d1 - 2.0 * rise
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        if d0 + t * (2.0 * b + 3.0 * a * t) < 0.0:
            low = t
        else:
            high = t
    return low


@merged
def first_root(q0, d0, q1, d1):
    """First place between 0 and 1 where a cubic goes below zero, 2 where it does not."""
    high = 1.0
    if q1 >= 0.0:
        if d0 >= 0.0 or d1 <= 0.0:
            return 2.0
        high = lowest_inside(q0, d0, q1, d1)
        if cubic(q0, d0, q1, d1, high) >= 0.0:
            return 2.0
    low = 0.0
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        if cubic(q0, d0, q1, d1, t) < 0.0:
            high = t
        else:
            low = t
    return high


@merged
def next_guess(par, q, width):
    """First root of all functions in the bracket, 2 where there is none.

    The root is that of a value a little below zero, so that what is found
    lies past the event.
    """
    first = 2.0
    for k in range(PROBES):
        if q[k, Column.LOW] < 0.0 or (
            q[k, Column.HIGH] >= 0.0 and k != Probe.CONTACT and k != Probe.ROCK
        ):
            continue
        past = 0.5 * par.q_tol * q[k, Column.SCALE]
        first = min(
            first,
            first_root(
                q[k, Column.LOW] + past,
                width * q[k, Column.LOW_SLOPE],
                q[k, Column.HIGH] + past,
                width * q[k, Column.HIGH_SLOPE],
            ),
        )
    return first


@merged
def past_by(q, column):
    """How far the functions are past their events, by their scales; -1 where none is."""
    most = -1.0
    for k in range(PROBES):
        if q[k, Column.LOW] >= 0.0 and q[k, column] < 0.0:
            most = max(most, -q[k, column] / q[k, Column.SCALE])
    return most


@inlined
def may_cross(par, s, x, q):
    """Whether a function may have crossed zero within the step."""
    for k in range(PROBES):
        if q[k, Column.HIGH] < 0.0 and q[k, Column.LOW] >= 0.0:
            return True
    if par.n_p > 0:
        rate = x[Node.V, par.n_p] - x[Node.V, par.n_p - 1]
        if s.closed == 0 and s.gap_rate < 0.0 and rate > 0.0:
            return True
        if s.closed == 1 and s.gap_rate > 0.0 and rate < 0.0:
            return True
    v = x[Node.V, par.n_p + par.n_b - 1]
    if s.mode == Mode.FF and has_rock(par):
        return s.v_end > 0.0 and v < 0.0
    return False


@kernel
def end_of_step(par, s, elements, h):
    """Try a step of length `h`, or up to just past the first event within it.

    Parameters
    ----------
    par, s : record
    elements : Elements
    h : float
        Longest step [s].

    Returns
    -------
    float
        Length of the step that `x` holds [s].
    """
    w, c, f, x, q = elements
    try_step(par, s, w, c, f, x, h)
    if s.skip_events == 1:
        s.skip_events = 0
        return h
    fill_low(par, s, q)
    fill_values(par, s, w, x, h, q, Column.HIGH)
    if not may_cross(par, s, x, q):
        return h
    return locate(par, s, elements, h)


@kernel
def locate(par, s, elements, h):
    """Shrink a bracket around the first event of a step; see `end_of_step`."""
    w, c, f, x, q = elements
    for k in range(PROBES):
        q[k, Column.SCALE] = abs(q[k, Column.LOW]) + abs(q[k, Column.HIGH])
    fill_slopes(par, s, c, w, x, 0, h, q, Column.LOW_SLOPE)
    fill_slopes(par, s, c, x, x, 1, h, q, Column.HIGH_SLOPE)
    low = 0.0
    high = 1.0
    tried = 1.0
    for trial in range(MOST_TRIALS):
        width = high - low
        past = past_by(q, Column.HIGH)
        if past >= 0.0 and (past <= par.q_tol or width <= par.t_tol):
            break
        guess = next_guess(par, q, width)
        if guess > 1.0:
            break
        if trial >= HERMITE_TRIALS and past >= 0.0:
            guess = 0.5
        tried = low + guess * width
        if tried <= low or tried >= high:
            break
        try_step(par, s, w, c, f, x, tried * h)
        fill_values(par, s, w, x, tried * h, q, Column.TRIED)
        fill_slopes(par, s, c, x, x, 1, h, q, Column.TRIED_SLOPE)
        column = Column.LOW
        if past_by(q, Column.TRIED) >= 0.0:
            column = Column.HIGH
            high = tried
        else:
            low = tried
        for k in range(PROBES):
            q[k, column] = q[k, Column.TRIED]
            q[k, column + 1] = q[k, Column.TRIED_SLOPE]
    if tried != high:
        try_step(par, s, w, c, f, x, high * h)
    return high * h
