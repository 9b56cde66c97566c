"""Taking a step that was tried, with every entry of its ledger.

The stages' velocities are linear in the stage, so each integral of the scheme
is one of a mean and a bend (docs/numerics.md, section 10).
"""

from __future__ import annotations

from percussion_model.physics.drive import drive_force
from percussion_model.physics.kernel import fused, inlined, kernel, merged
from percussion_model.physics.records import Mode, RockKind
from percussion_model.physics.rock import crush, origin, recoverable, stiffness
from percussion_model.solvers.fem.bars import read_nodes
from percussion_model.solvers.fem.records import Mesh, Node, Trial
from percussion_model.solvers.fem.scheme import rate_bend
from percussion_model.solvers.fem.solve import damping

FF, DFC, FC, BC, SS = (int(m) for m in Mode)
BILINEAR = int(RockKind.BILINEAR)
U, V = int(Node.U), int(Node.V)
LOSS, NUMERICAL = int(Node.LOSS), int(Node.NUMERICAL)
RE, IM = int(Trial.RE), int(Trial.IM)
MASS, COUPLING, STIFFNESS = int(Mesh.MASS), int(Mesh.COUPLING), int(Mesh.STIFFNESS)
TARGET_RE, TARGET_IM = int(Trial.TARGET_RE), int(Trial.TARGET_IM)

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
    mean = (x[U, i] - w[U, i]) / h
    return C * h * (mean * mean + TWELFTH * bend * bend)


@fused
def book_bars(par, w, c, x, h):
    """Structural loss and dissipation of the scheme in each element."""
    n = par.n_p + par.n_b
    viscous = h * par.eta
    defect = 0.5 * h * h * par.dissipation
    by = 1.0 / h
    turn = 1.0 / par.mu_im
    for i in range(n):
        x[TARGET_RE, i] = (x[U, i] - w[U, i]) * by
        x[TARGET_IM, i] = h * turn * (par.mu_re * x[IM, i] + par.mu_im * x[RE, i])
        x[IM, i] = x[IM, i] * turn
    for i in range(n - 1):
        mean = x[TARGET_RE, i + 1] - x[TARGET_RE, i]
        bend = x[TARGET_IM, i + 1] - x[TARGET_IM, i]
        stiff = c[STIFFNESS, i] * (bend * bend)
        w[LOSS, i] += viscous * (c[STIFFNESS, i] * (mean * mean) + TWELFTH * stiff)
        a = x[IM, i]
        inert = c[MASS, i] * (a * a) + 2.0 * c[COUPLING, i] * (a * x[IM, i + 1])
        w[NUMERICAL, i] += defect * (stiff + inert)
    a = x[IM, n - 1]
    w[NUMERICAL, n - 1] += defect * (c[MASS, n - 1] * (a * a))


@inlined
def book_contact(par, s, x, w, h):
    """Impulse of the contact, and what the scheme dissipates in its spring."""
    lower = par.n_p
    upper = par.n_p - 1
    bend = rate_bend(par, x, lower, h) - rate_bend(par, x, upper, h)
    closing = (x[U, lower] - w[U, lower]) - (x[U, upper] - w[U, upper])
    # the mean of a parabola whose slope rises by `bend`
    mean = s.gap + 0.5 * closing - TWELFTH * bend * h
    s.i_contact -= par.k_c * mean * h
    s.e_numerical += 0.5 * h * h * par.dissipation * par.k_c * bend * bend


@merged
def book_rock(par, s, x, w, h):
    """Impulse and works of the rock, by the quadrature of the scheme."""
    i = par.n_p + par.n_b - 1
    K = stiffness(s)
    C = damping(s)
    bend = rate_bend(par, x, i, h)
    path = x[U, i] - w[U, i]
    y = s.p - origin(s)
    after = y + path
    defect = 0.5 * h * h * par.dissipation * K * bend * bend
    dashpot = dashpot_work(par, s, x, w, h)
    s.i_bit += K * h * (y + 0.5 * path - TWELFTH * bend * h) + C * path
    s.rock_work += 0.5 * K * (after - y) * (after + y) + defect + dashpot
    s.e_numerical += defect
    if s.mode == DFC:
        s.w += dashpot
        s.e_barrier += dashpot
    elif s.mode == SS:
        s.e_standstill += dashpot


@inlined
def bit_force(s):
    """Force of the bit on the rock, compression positive [N]."""
    if s.mode == FF:
        return 0.0
    return stiffness(s) * (s.p - origin(s)) + damping(s) * s.v_end


@inlined
def contact_force(par, s):
    """Force of the piston on the bit, compression positive [N]."""
    if s.closed == 1:
        return -par.k_c * s.gap
    return 0.0


@inlined
def note_forces(par, s):
    """Keep the greatest forces at the ends of steps: of the blow, and of an observer."""
    bit = bit_force(s)
    contact = contact_force(par, s)
    s.b_peak_bit = max(s.b_peak_bit, bit)
    s.b_peak_contact = max(s.b_peak_contact, contact)
    if s.time >= s.peak_from:
        s.peak_bit = max(s.peak_bit, bit)
        s.peak_contact = max(s.peak_contact, contact)


@kernel
def take_step(par, s, w, c, x, h):
    """Make the tried step the state, and book it."""
    n_p = par.n_p
    before = recoverable(s)
    p_before = s.p
    if s.mode != FF:
        book_rock(par, s, x, w, h)
    if s.closed == 1:
        book_contact(par, s, x, w, h)
    book_bars(par, w, c, x, h)
    path = s.next_b - s.mean_b
    s.e_gravity += par.mass_b * par.gravity * path
    s.e_feed += s.feed * path
    if n_p > 0:
        push = drive_force(par, s)
        path = s.next_p - s.mean_p
        s.e_gravity += par.mass_p * par.gravity * path
        s.e_drive += push * path
        s.i_drive += push * h
    for i in range(n_p + par.n_b):
        w[U, i] = x[U, i]
        w[V, i] = x[V, i]
    read_nodes(par, s, w, c)
    if s.mode == FF:
        # a rock that was still springing back relaxes without doing work
        s.e_standstill += before - recoverable(s)
    elif (s.mode == DFC or s.mode == FC) and par.rock == BILINEAR:
        crush(s, p_before)
    if -s.u_r > s.b_stroke and n_p > 0:
        s.b_stroke = -s.u_r
    s.time += h
    s.count_steps += 1
    note_forces(par, s)
