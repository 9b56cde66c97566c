"""A step of the third-order scheme: one complex tridiagonal solution.

Two-stage collocation with the spectral radius at infinity as a parameter
(docs/numerics.md, section 10). With mu the complex eigenvalue of its matrix,
the stage accelerations are one complex vector x that solves
[M + h mu C + (h mu)^2 K] x = f - K (u + h mu v) - C v.
"""

from __future__ import annotations

from percussion_model.physics.drive import drive_force
from percussion_model.physics.kernel import fused, inlined, kernel, merged
from percussion_model.physics.rock import origin, stiffness
from percussion_model.solvers.fem.bars import read_ahead
from percussion_model.solvers.fem.records import Mesh, Node, Trial
from percussion_model.solvers.fem.solve import damping, factors, substitute

U, V = int(Node.U), int(Node.V)
STIFFNESS, SHARE = int(Mesh.STIFFNESS), int(Mesh.SHARE)
RE, IM = int(Trial.RE), int(Trial.IM)
TARGET_RE, TARGET_IM = int(Trial.TARGET_RE), int(Trial.TARGET_IM)


@fused
def load(par, s, w, c, x, h):
    """Right-hand side of the stage equation into rows RE, IM."""
    n_p = par.n_p
    n = n_p + par.n_b
    h_re = h * par.mu_re
    h_im = h * par.mu_im
    late = par.eta + h_re
    for i in range(n):
        x[TARGET_RE, i] = w[U, i] + late * w[V, i]
        x[TARGET_IM, i] = h_im * w[V, i]
    a_b = par.gravity + s.feed / par.mass_b
    a_p = 0.0
    if n_p > 0:
        a_p = par.gravity + drive_force(par, s) / par.mass_p
    # elements pull their upper node down
    x[RE, 0] = c[STIFFNESS, 0] * (x[TARGET_RE, 1] - x[TARGET_RE, 0])
    x[IM, 0] = c[STIFFNESS, 0] * (x[TARGET_IM, 1] - x[TARGET_IM, 0])
    for i in range(n - 2):
        here = x[TARGET_RE, i + 1]
        x[RE, i + 1] = c[STIFFNESS, i + 1] * (x[TARGET_RE, i + 2] - here) - c[STIFFNESS, i] * (
            here - x[TARGET_RE, i]
        )
        there = x[TARGET_IM, i + 1]
        x[IM, i + 1] = c[STIFFNESS, i + 1] * (x[TARGET_IM, i + 2] - there) - c[STIFFNESS, i] * (
            there - x[TARGET_IM, i]
        )
    x[RE, n - 1] = c[STIFFNESS, n - 2] * (x[TARGET_RE, n - 2] - x[TARGET_RE, n - 1])
    x[IM, n - 1] = c[STIFFNESS, n - 2] * (x[TARGET_IM, n - 2] - x[TARGET_IM, n - 1])
    for i in range(n_p):
        x[RE, i] += a_p * c[SHARE, i]
    for i in range(par.n_b):
        x[RE, n_p + i] += a_b * c[SHARE, n_p + i]
    if s.closed == 1:
        push_re = -par.k_c * (s.gap + h_re * s.gap_rate)
        push_im = -par.k_c * h_im * s.gap_rate
        x[RE, n_p - 1] -= push_re
        x[IM, n_p - 1] -= push_im
        x[RE, n_p] += push_re
        x[IM, n_p] += push_im
    K = stiffness(s)
    x[RE, n - 1] -= K * (s.p - origin(s) + h_re * s.v_end) + damping(s) * s.v_end
    x[IM, n - 1] -= K * h_im * s.v_end


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
        Scratch (`Trial`).
    h : float
        Length of the step [s].
    """
    slot = factors(par, s, c, f, h)
    load(par, s, w, c, x, h)
    substitute(par, s, f, slot, x, h)
    tilt = (0.5 - par.mu_re) / par.mu_im
    by_re = h * h * (par.mu_re + tilt * par.mu_im)
    by_im = h * h * (tilt * par.mu_re - par.mu_im)
    for i in range(par.n_p + par.n_b):
        x[U, i] = w[U, i] + (h * w[V, i] + (by_re * x[RE, i] + by_im * x[IM, i]))
        x[V, i] = w[V, i] + h * (x[RE, i] + tilt * x[IM, i])
    read_ahead(par, s, x, c)
    s.count_trials += 1


@inlined
def rate_bend(par, x, i, h):
    """Slope of a node's velocity over the stages, by the step [m/s]."""
    return h * (par.mu_re * x[IM, i] + par.mu_im * x[RE, i]) / par.mu_im


@merged
def acceleration(par, x, i, end):
    """Acceleration of a node at the start (`end` 0) or the end (1) of a tried step [m/s2]."""
    bend = x[IM, i] / par.mu_im
    return x[RE, i] + (end - par.mu_re) * bend
