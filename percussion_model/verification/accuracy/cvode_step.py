"""Right-hand side and event functions of the semi-discrete bars for a general integrator.

y holds displacement and velocity node by node, so that the Jacobian is nearly a narrow
band, and in the end the work of the rock's dashpot.
"""

from __future__ import annotations

from percussion_model.physics.drive import drive_force
from percussion_model.physics.kernel import kernel
from percussion_model.physics.records import DriveKind, Mode, RockKind
from percussion_model.physics.rock import (
    REST_VELOCITY,
    barrier_level,
    book_dashpot,
    damping,
    origin,
    stiffness,
)
from percussion_model.verification.accuracy.exact_flow_step import accept, kinetic_energy, weigh


@kernel
def slope(par, s, f, bars, y, out):
    """Fill `out` with y'.

    Parameters
    ----------
    bars : float array, shape (3, n)
        Stiffness below each node [N/m]; of the mass matrix, pivots and what is next to them [kg].
    """
    n, m = par.n_p, par.n_p + par.n_b
    above = 0.0
    carried = 0.0
    for i in range(m):
        below = 0.0
        if bars[0, i] > 0.0:
            stretch = y[2 * i + 2] - y[2 * i]
            below = bars[0, i] * (stretch + par.eta * (y[2 * i + 3] - y[2 * i + 1]))
        force = below - above
        if i == m - 1:
            force -= stiffness(s) * y[2 * i] + damping(s) * y[2 * i + 1]
        carried = force - carried
        out[2 * i] = y[2 * i + 1]
        out[2 * i + 1] = carried
        carried *= bars[2, i] / bars[1, i]
        above = below
    push = par.gravity + drive_force(par, s) / par.mass_p if n > 0 else 0.0
    load = par.gravity + s.feed / par.mass_b
    last = 0.0
    for back in range(m):
        i = m - 1 - back
        last = (out[2 * i + 1] - bars[2, i] * last) / bars[1, i]
        out[2 * i + 1] = last
    for i in range(m):
        out[2 * i + 1] += push if i < n else load
    v = y[2 * m - 1]
    out[2 * m] = damping(s) * v * v
    if s.closed == 1:
        force = (out[2 * n - 1] - out[2 * n + 1]) / par.soft
        for i in range(n):
            out[2 * i + 1] += force * f.kick[n + i]
        for i in range(n, m):
            out[2 * i + 1] += force * f.kick[m + i]


@kernel
def spread(par, y, x):
    """Order a state by bars, as the exact flow has it."""
    n, m = par.n_p, par.n_b
    for i in range(n):
        x[i] = y[2 * i]
        x[n + i] = y[2 * i + 1]
    for i in range(m):
        x[2 * n + i] = y[2 * (n + i)]
        x[2 * n + m + i] = y[2 * (n + i) + 1]


@kernel
def gather(par, x, y):
    """Order a state node by node, and count the dashpot's work anew."""
    n, m = par.n_p, par.n_b
    for i in range(n):
        y[2 * i] = x[i]
        y[2 * i + 1] = x[n + i]
    for i in range(m):
        y[2 * (n + i)] = x[2 * n + i]
        y[2 * (n + i) + 1] = x[2 * n + m + i]
    y[2 * (n + m)] = 0.0


@kernel
def fill_events(par, s, f, x, work, out):
    """Event functions of contact, drive, and rock (two); positive until their event."""
    n = par.n_p
    end = 2 * n + par.n_b - 1
    out[0] = 1.0
    out[1] = 1.0
    if n > 0:
        out[0] = x[2 * n] - x[n - 1]
        if s.closed == 1:
            out[0] = weigh(f.force[s.mode], x, 0, x.shape[0], 0)
        if par.drive == DriveKind.PRESSURE:
            u_r = weigh(f.share, x, 0, n, 0) / par.mass_p
            u_r -= weigh(f.share, x, n, par.n_b, 2 * n) / par.mass_b
            out[1] = -u_r if s.alpha > 0 else u_r + s.reversal
    p, v = x[end] + origin(s), x[end + par.n_b]
    out[2] = 1.0
    out[3] = 1.0
    if par.rock == RockKind.NONE:
        return
    if s.mode == Mode.FF:
        out[2] = max(s.p_u - p, -v)
    elif par.rock == RockKind.SPRING:
        out[2] = p
    elif s.mode == Mode.DFC:
        out[2] = s.w_r - s.w - work
        out[3] = v + REST_VELOCITY
    elif s.mode == Mode.FC:
        out[3] = v + REST_VELOCITY
    elif s.mode == Mode.BC:
        out[2] = p - s.p_u
        out[3] = REST_VELOCITY - v
    else:
        if par.release == 1:
            out[2] = stiffness(s) * x[end] + damping(s) * v
        if par.barrier == 1:
            out[3] = barrier_level(par, s) - kinetic_energy(par, f, x)


@kernel
def arrive(par, s, f, x, y, time, work):
    """Make `y`, ordered by bars, the state at `time`; `work` of the dashpot led there [J]."""
    accept(par, s, f, x, y, 0.0)
    s.time = time
    s.rock_work += work
    book_dashpot(s, work)


@kernel
def right_hand_side(pars, states, f, bars, y, out):
    """Fill `out` with y' of the first of `states`."""
    slope(pars[0], states[0], f, bars, y, out)


@kernel
def event_functions(pars, states, f, x, y, out):
    """Fill `out` with the event functions; `x` is scratch."""
    spread(pars[0], y, x)
    fill_events(pars[0], states[0], f, x, y[y.shape[0] - 1], out)
