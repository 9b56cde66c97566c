"""A step of the third-order scheme: one complex tridiagonal solution.

Two-stage collocation with the spectral radius at infinity as a parameter
(docs/numerics.md, section 10). With mu the complex eigenvalue of its matrix,
the stage accelerations are one complex vector x that solves
[M + h mu C + (h mu)^2 K] x = f - K (u + h mu v) - C v.
"""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import bit_acceleration, drive_force, piston_acceleration
from percussion_model.physics.rock import damping, present_line, take_step_line
from percussion_model.solvers.fem.bars import read_ahead
from percussion_model.solvers.fem.records import Mesh, Node, Stage
from percussion_model.solvers.fem.solve import factors, substitute


@inlined
def load(par, s, w, c, x, h):
    """Right-hand side of the stage equation into rows RE, IM (docs/model.md, eqs 1-2)."""
    n_p = par.n_p
    n = n_p + par.n_b
    h_re = h * par.mu_re
    h_im = h * par.mu_im
    late = par.eta + h_re
    for i in range(n):
        x[Stage.TARGET_RE, i] = w[Node.U, i] + late * w[Node.V, i]
        x[Stage.TARGET_IM, i] = h_im * w[Node.V, i]
    a_b = bit_acceleration(par, s)
    a_p = 0.0
    if n_p > 0:
        a_p = piston_acceleration(par, drive_force(par, s))
    # elements pull their upper node down
    x[Stage.RE, 0] = c[Mesh.STIFFNESS, 0] * (x[Stage.TARGET_RE, 1] - x[Stage.TARGET_RE, 0])
    x[Stage.IM, 0] = c[Mesh.STIFFNESS, 0] * (x[Stage.TARGET_IM, 1] - x[Stage.TARGET_IM, 0])
    for i in range(n - 2):
        here = x[Stage.TARGET_RE, i + 1]
        x[Stage.RE, i + 1] = c[Mesh.STIFFNESS, i + 1] * (x[Stage.TARGET_RE, i + 2] - here) - c[
            Mesh.STIFFNESS, i
        ] * (here - x[Stage.TARGET_RE, i])
        there = x[Stage.TARGET_IM, i + 1]
        x[Stage.IM, i + 1] = c[Mesh.STIFFNESS, i + 1] * (x[Stage.TARGET_IM, i + 2] - there) - c[
            Mesh.STIFFNESS, i
        ] * (there - x[Stage.TARGET_IM, i])
    x[Stage.RE, n - 1] = c[Mesh.STIFFNESS, n - 2] * (
        x[Stage.TARGET_RE, n - 2] - x[Stage.TARGET_RE, n - 1]
    )
    x[Stage.IM, n - 1] = c[Mesh.STIFFNESS, n - 2] * (
        x[Stage.TARGET_IM, n - 2] - x[Stage.TARGET_IM, n - 1]
    )
    for i in range(n_p):
        x[Stage.RE, i] += a_p * c[Mesh.SHARE, i]
    for i in range(par.n_b):
        x[Stage.RE, n_p + i] += a_b * c[Mesh.SHARE, n_p + i]
    if s.closed == 1:
        push_re = -par.k_c * (s.gap + h_re * s.gap_rate)
        push_im = -par.k_c * h_im * s.gap_rate
        x[Stage.RE, n_p - 1] -= push_re
        x[Stage.IM, n_p - 1] -= push_im
        x[Stage.RE, n_p] += push_re
        x[Stage.IM, n_p] += push_im
    K, P = present_line(par, s)
    x[Stage.RE, n - 1] -= K * (s.p - P + h_re * s.v_end) + damping(s) * s.v_end
    x[Stage.IM, n - 1] -= K * h_im * s.v_end


@kernel
def try_step(par, s, w, c, f, x, h):
    """Compute the end of a step of length `h` without taking it.

    Rows U, V of `x` become displacement and velocity at its end, RE and IM the
    complex stage acceleration.

    Parameters
    ----------
    par, s : record
    w, c : float array
        Nodes, mesh.
    f : float array
        Factorisations.
    x : float array
        Scratch (`Stage`).
    h : float
        Length of the step [s].
    """
    take_step_line(par, s, s.v_end * h)
    slot = factors(par, s, c, f, h)
    load(par, s, w, c, x, h)
    substitute(par, s, f, slot, x, h)
    tilt = (0.5 - par.mu_re) / par.mu_im
    by_re = h * h * (par.mu_re + tilt * par.mu_im)
    by_im = h * h * (tilt * par.mu_re - par.mu_im)
    for i in range(par.n_p + par.n_b):
        x[Node.U, i] = w[Node.U, i] + (
            h * w[Node.V, i] + (by_re * x[Stage.RE, i] + by_im * x[Stage.IM, i])
        )
        x[Node.V, i] = w[Node.V, i] + h * (x[Stage.RE, i] + tilt * x[Stage.IM, i])
    read_ahead(par, s, x, c)
    s.count_trials += 1


@inlined
def rate_bend(par, x, i, h):
    """Slope of a node's velocity over the stages, by the step [m/s]."""
    return h * (par.mu_re * x[Stage.IM, i] + par.mu_im * x[Stage.RE, i]) / par.mu_im


@merged
def acceleration(par, x, i, end):
    """Acceleration of a node at the start (`end` 0) or the end (1) of a tried step [m/s2]."""
    bend = x[Stage.IM, i] / par.mu_im
    return x[Stage.RE, i] + (end - par.mu_re) * bend
