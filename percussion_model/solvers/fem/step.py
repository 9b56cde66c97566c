"""Accepted step of the scheme, with every entry of its ledger.

The stages' velocities are linear in the stage, so each integral of the scheme
is one of a mean and a bend (docs/numerics.md, section 10).
"""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import book_bit_load, book_piston_load, drive_force, pass_time
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import (
    book_dashpot,
    crush,
    damping,
    is_curved,
    line_work,
    present_line,
    recoverable,
    spring_force,
)
from percussion_model.solvers.fem.bars import read_nodes
from percussion_model.solvers.fem.records import Mesh, Node, Stage
from percussion_model.solvers.fem.scheme import rate_bend

# Mean square of a bend that rises by one over the step.
TWELFTH = 1.0 / 12.0


@inlined
def dashpot_work(par, s, x, w, h):
    """Work of the rock's dashpot over a tried step, eq. 53 of the paper [J]."""
    C = damping(s)
    if C == 0.0:
        return 0.0
    i = par.n_p + par.n_b - 1
    bend = rate_bend(par, x, i, h)
    mean = (x[Node.U, i] - w[Node.U, i]) / h
    return C * h * (mean * mean + TWELFTH * bend * bend)


@inlined
def book_bars(par, w, c, x, h):
    """Structural loss and dissipation of the scheme in each element."""
    n = par.n_p + par.n_b
    viscous = h * par.eta
    defect = 0.5 * h * h * par.dissipation
    by = 1.0 / h
    turn = 1.0 / par.mu_im
    for i in range(n):
        x[Stage.TARGET_RE, i] = (x[Node.U, i] - w[Node.U, i]) * by
        x[Stage.TARGET_IM, i] = h * turn * (par.mu_re * x[Stage.IM, i] + par.mu_im * x[Stage.RE, i])
        x[Stage.IM, i] = x[Stage.IM, i] * turn
    for i in range(n - 1):
        mean = x[Stage.TARGET_RE, i + 1] - x[Stage.TARGET_RE, i]
        bend = x[Stage.TARGET_IM, i + 1] - x[Stage.TARGET_IM, i]
        stiff = c[Mesh.STIFFNESS, i] * (bend * bend)
        w[Node.LOSS, i] += viscous * (c[Mesh.STIFFNESS, i] * (mean * mean) + TWELFTH * stiff)
        a = x[Stage.IM, i]
        inert = c[Mesh.MASS, i] * (a * a) + 2.0 * c[Mesh.COUPLING, i] * (a * x[Stage.IM, i + 1])
        w[Node.NUMERICAL, i] += defect * (stiff + inert)
    a = x[Stage.IM, n - 1]
    w[Node.NUMERICAL, n - 1] += defect * (c[Mesh.MASS, n - 1] * (a * a))


@inlined
def book_contact(par, s, x, w, h):
    """Impulse of the contact, and what the scheme dissipates in its spring."""
    lower = par.n_p
    upper = par.n_p - 1
    bend = rate_bend(par, x, lower, h) - rate_bend(par, x, upper, h)
    closing = (x[Node.U, lower] - w[Node.U, lower]) - (x[Node.U, upper] - w[Node.U, upper])
    # the mean of a parabola whose slope rises by `bend`
    mean = s.gap + 0.5 * closing - TWELFTH * bend * h
    s.i_contact -= par.k_c * mean * h
    s.e_numerical += 0.5 * h * h * par.dissipation * par.k_c * bend * bend


@merged
def book_rock(par, s, x, w, h):
    """Impulse and works of the rock, by the quadrature of the scheme."""
    i = par.n_p + par.n_b - 1
    K, P = present_line(par, s)
    C = damping(s)
    bend = rate_bend(par, x, i, h)
    path = x[Node.U, i] - w[Node.U, i]
    y = s.p - P
    after = y + path
    defect = 0.5 * h * h * par.dissipation * K * bend * bend
    dashpot = dashpot_work(par, s, x, w, h)
    s.i_bit += K * h * (y + 0.5 * path - TWELFTH * bend * h) + C * path
    s.rock_work += 0.5 * K * (after - y) * (after + y) + defect + dashpot
    s.e_numerical += defect
    book_dashpot(s, dashpot)


@inlined
def bit_force(par, s):
    """Force of the bit on the rock, compression positive [N]."""
    if s.mode == Mode.FF:
        return 0.0
    return spring_force(par, s) + damping(s) * s.v_end


@inlined
def contact_force(par, s):
    """Force of the piston on the bit, compression positive [N]."""
    if s.closed == 1:
        return -par.k_c * s.gap
    return 0.0


@inlined
def note_forces(par, s):
    """Keep the greatest forces at the ends of steps: of the blow, and of an observer."""
    bit = bit_force(par, s)
    contact = contact_force(par, s)
    s.b_peak_bit = max(s.b_peak_bit, bit)
    s.b_peak_contact = max(s.b_peak_contact, contact)
    if s.time >= s.peak_from:
        s.peak_bit_force = max(s.peak_bit_force, bit)
        s.peak_contact_force = max(s.peak_contact_force, contact)


@kernel
def take_step(par, s, w, c, x, h):
    """Make the tried step the state, and book it."""
    n_p = par.n_p
    before = recoverable(par, s)
    p_before = s.p
    if s.mode != Mode.FF:
        book_rock(par, s, x, w, h)
    if s.closed == 1:
        book_contact(par, s, x, w, h)
    book_bars(par, w, c, x, h)
    book_bit_load(par, s, s.next_b - s.mean_b)
    if n_p > 0:
        push = drive_force(par, s)
        book_piston_load(par, s, push, s.next_p - s.mean_p, push * h)
    for i in range(n_p + par.n_b):
        w[Node.U, i] = x[Node.U, i]
        w[Node.V, i] = x[Node.V, i]
    read_nodes(par, s, w)
    if s.mode == Mode.FF:
        # a rock that was still rebounding back relaxes without doing work
        s.e_standstill += before - recoverable(par, s)
    else:
        crushed = crush(par, s, p_before)
        if is_curved(par, s):
            work = line_work(present_line(par, s), p_before, s.p)
            s.e_numerical += work - (recoverable(par, s) - before) - crushed
    if -s.u_r > s.b_stroke and n_p > 0:
        s.b_stroke = -s.u_r
    s.time += h
    s.count_steps += 1
    pass_time(par, s, h)
    note_forces(par, s)
