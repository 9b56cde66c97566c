"""Where in a step the first event lies: Hermite interpolation, driven just past it.

Every event function is positive until its event. Values and slopes at both ends
of a bracket make a cubic; a step to its root is tried, and the bracket shrinks
until its end lies past the event by no more than the tolerance.
"""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import DriveKind, Mode, RockKind
from percussion_model.physics.rock import REST_VELOCITY, origin, stiffness
from percussion_model.solvers.fem.bars import relative_motion
from percussion_model.solvers.fem.hermite import first_root
from percussion_model.solvers.fem.records import Column, Look, Mesh, Node, Trial
from percussion_model.solvers.fem.scheme import acceleration, try_step
from percussion_model.solvers.fem.solve import damping
from percussion_model.solvers.fem.step import dashpot_work

FF, DFC, FC, BC, SS = (int(m) for m in Mode)
NO_ROCK, SPRING = int(RockKind.NONE), int(RockKind.SPRING)
PRESSURE = int(DriveKind.PRESSURE)
U, V = int(Node.U), int(Node.V)
RE, IM = int(Trial.RE), int(Trial.IM)
MASS, COUPLING = int(Mesh.MASS), int(Mesh.COUPLING)
CONTACT, DRIVE, ROCK, TURN = (int(look) for look in Look)
LOW, LOW_SLOPE, HIGH, HIGH_SLOPE, TRIED, TRIED_SLOPE, SCALE = (int(k) for k in Column)
LOOKS = len(Look)

# Steps tried for one event; bisection takes over half-way.
MOST_TRIALS = 60
HERMITE_TRIALS = 12
# A function that is not watched has this value: never an event.
NEVER = 1.0


@inlined
def contact_value(par, s, a):
    """Gap, or its negative while it is closed [m]."""
    gap = a[U, par.n_p] - a[U, par.n_p - 1]
    return -gap if s.closed == 1 else gap


@inlined
def drive_value(par, s, u_r):
    """Distance of u_r to the threshold that is watched [m]."""
    if par.drive != PRESSURE:
        return NEVER
    return -u_r if s.alpha > 0 else u_r + s.reversal


@inlined
def rock_value(par, s, p, v, work):
    """What ends the present mode by position, work or force."""
    if s.mode == FF:
        if par.rock == NO_ROCK:
            return NEVER
        return -v if s.springing == 1 else s.p_u - p
    if par.rock == SPRING:
        return p
    if s.mode == DFC:
        return s.w_r - s.w - work
    if s.mode == BC:
        return p - s.p_u
    if s.mode == SS and par.release == 1:
        return stiffness(s) * (p - origin(s)) + damping(s) * v
    return NEVER


@inlined
def turn_value(par, s, v, energy):
    """What ends the present mode by the sign of the velocity or the bit's energy."""
    if s.mode == FF or par.rock == SPRING:
        return NEVER
    if s.mode == SS:
        return s.w_r - energy
    if s.mode == BC:
        return REST_VELOCITY - v
    return v + REST_VELOCITY


@inlined
def power(par, c, a, x, end):
    """Rate of the bit's kinetic energy at an end of a tried step [W]."""
    n_p = par.n_p
    last = n_p + par.n_b - 1
    total = c[MASS, last] * a[V, last] * acceleration(par, x, last, end)
    for i in range(n_p, last):
        here = acceleration(par, x, i, end)
        there = acceleration(par, x, i + 1, end)
        total += c[MASS, i] * (a[V, i] * here)
        total += c[COUPLING, i] * (a[V, i] * there + a[V, i + 1] * here)
    return total


@inlined
def fill_low(par, s, q):
    """Values at the start of the step, from what the state knows."""
    q[CONTACT, LOW] = NEVER
    q[DRIVE, LOW] = NEVER
    if par.n_p > 0:
        q[CONTACT, LOW] = -s.gap if s.closed == 1 else s.gap
        q[DRIVE, LOW] = drive_value(par, s, s.u_r)
    q[ROCK, LOW] = rock_value(par, s, s.p, s.v_end, 0.0)
    q[TURN, LOW] = turn_value(par, s, s.v_end, s.kinetic)


@inlined
def fill_values(par, s, w, c, x, h, q, column):
    """Values at the end of a tried step of length `h`."""
    last = par.n_p + par.n_b - 1
    q[CONTACT, column] = NEVER
    q[DRIVE, column] = NEVER
    if par.n_p > 0:
        q[CONTACT, column] = contact_value(par, s, x)
        q[DRIVE, column] = drive_value(par, s, s.next_p - s.next_b)
    work = dashpot_work(par, s, x, w, h) if s.mode == DFC else 0.0
    q[ROCK, column] = rock_value(par, s, x[U, last], x[V, last], work)
    q[TURN, column] = turn_value(par, s, x[V, last], s.next_kinetic)


@merged
def fill_slopes(par, s, c, a, x, end, h, q, column):
    """Slopes at an end of a tried step; `a` holds displacements and velocities there."""
    n_p = par.n_p
    last = n_p + par.n_b - 1
    v = a[V, last]
    for k in range(LOOKS):
        q[k, column] = 0.0
    if n_p > 0:
        rate = a[V, n_p] - a[V, n_p - 1]
        q[CONTACT, column] = h * (-rate if s.closed == 1 else rate)
        rate = relative_motion(par, c, a, V)
        q[DRIVE, column] = h * (-rate if s.alpha > 0 else rate)
    turn = acceleration(par, x, last, end)
    if s.mode == FF:
        q[ROCK, column] = -h * (turn if s.springing == 1 else v)
    elif par.rock == SPRING or s.mode == BC:
        q[ROCK, column] = h * v
    elif s.mode == DFC:
        q[ROCK, column] = -h * s.c_r * v * v
    elif s.mode == SS:
        q[ROCK, column] = h * (stiffness(s) * v + damping(s) * turn)
    if s.mode == SS:
        q[TURN, column] = -h * power(par, c, a, x, end)
    elif s.mode == BC:
        q[TURN, column] = -h * turn
    else:
        q[TURN, column] = h * turn


@merged
def next_guess(par, q, width):
    """First root of all functions in the bracket, 2 where there is none.

    The root is that of a value a little below zero, so that what is found
    lies past the event.
    """
    first = 2.0
    for k in range(LOOKS):
        if q[k, LOW] < 0.0 or (q[k, HIGH] >= 0.0 and k != CONTACT and k != ROCK):
            continue
        past = 0.5 * par.q_tol * q[k, SCALE]
        first = min(
            first,
            first_root(
                q[k, LOW] + past,
                width * q[k, LOW_SLOPE],
                q[k, HIGH] + past,
                width * q[k, HIGH_SLOPE],
            ),
        )
    return first


@merged
def past_by(q, column):
    """How far the functions are past their events, by their scales; -1 where none is."""
    most = -1.0
    for k in range(LOOKS):
        if q[k, LOW] >= 0.0 and q[k, column] < 0.0:
            most = max(most, -q[k, column] / q[k, SCALE])
    return most


@inlined
def worth_a_look(par, s, x, q):
    """Whether a function may have crossed zero within the step."""
    for k in range(LOOKS):
        if q[k, HIGH] < 0.0 and q[k, LOW] >= 0.0:
            return True
    if par.n_p > 0:
        rate = x[V, par.n_p] - x[V, par.n_p - 1]
        if s.closed == 0 and s.gap_rate < 0.0 and rate > 0.0:
            return True
        if s.closed == 1 and s.gap_rate > 0.0 and rate < 0.0:
            return True
    v = x[V, par.n_p + par.n_b - 1]
    if s.mode == FF and par.rock != NO_ROCK:
        return s.v_end > 0.0 and v < 0.0
    return False


@kernel
def end_of_step(par, s, w, c, f, x, q, h):
    """Try a step of length `h`, or up to just past the first event within it.

    Parameters
    ----------
    par, s : record
    w, c, f, x : float array
        Nodes, mesh, factorisations, scratch.
    q : float array, shape (len(Look), len(Column))
        Scratch.
    h : float
        Longest step [s].

    Returns
    -------
    float
        Length of the step that `x` holds [s].
    """
    try_step(par, s, w, c, f, x, h)
    if s.stuck == 1:
        s.stuck = 0
        return h
    fill_low(par, s, q)
    fill_values(par, s, w, c, x, h, q, HIGH)
    if not worth_a_look(par, s, x, q):
        return h
    return locate(par, s, w, c, f, x, q, h)


@kernel
def locate(par, s, w, c, f, x, q, h):
    """Shrink a bracket around the first event of a step; see `end_of_step`."""
    for k in range(LOOKS):
        q[k, SCALE] = abs(q[k, LOW]) + abs(q[k, HIGH])
    fill_slopes(par, s, c, w, x, 0, h, q, LOW_SLOPE)
    fill_slopes(par, s, c, x, x, 1, h, q, HIGH_SLOPE)
    low = 0.0
    high = 1.0
    tried = 1.0
    for trial in range(MOST_TRIALS):
        width = high - low
        past = past_by(q, HIGH)
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
        fill_values(par, s, w, c, x, tried * h, q, TRIED)
        fill_slopes(par, s, c, x, x, 1, h, q, TRIED_SLOPE)
        column = LOW
        if past_by(q, TRIED) >= 0.0:
            column = HIGH
            high = tried
        else:
            low = tried
        for k in range(LOOKS):
            q[k, column] = q[k, TRIED]
            q[k, column + 1] = q[k, TRIED_SLOPE]
    if tried != high:
        try_step(par, s, w, c, f, x, high * h)
    return high * h
