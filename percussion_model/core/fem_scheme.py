"""A step of the third-order scheme: one complex tridiagonal solution.

Two-stage collocation with the spectral radius at infinity as a parameter
(docs/numerics.md, section 10). With mu the complex eigenvalue of its matrix,
the stage accelerations are one complex vector x that solves
[M + h mu C + (h mu)^2 K] x = f - K (u + h mu v) - C v.
"""

from __future__ import annotations

from percussion_model.core.drive import drive_force
from percussion_model.core.fem_records import Factor, Mesh, Node, Trial
from percussion_model.core.kernel import fused, inlined, kernel, merged
from percussion_model.core.records import Mode
from percussion_model.core.rock_law import origin, stiffness

DFC, SS = int(Mode.DFC), int(Mode.SS)
U, V = int(Node.U), int(Node.V)
MASS, COUPLING, SHARE = int(Mesh.MASS), int(Mesh.COUPLING), int(Mesh.SHARE)
STIFFNESS, SPRINGS = int(Mesh.STIFFNESS), int(Mesh.SPRINGS)
RE, IM = int(Trial.RE), int(Trial.IM)
TARGET_RE, TARGET_IM = int(Trial.TARGET_RE), int(Trial.TARGET_IM)
LOW_RE, LOW_IM = int(Factor.LOW_RE), int(Factor.LOW_IM)
PIVOT_RE, PIVOT_IM = int(Factor.PIVOT_RE), int(Factor.PIVOT_IM)
ROWS = len(Factor)

# Factorisations: of the whole step with open and closed gap, of any other.
OPEN, CLOSED, OTHER = 0, 1, 2


@inlined
def damping(s):
    """C of the present mode [N s/m], table 1 of docs/model.md."""
    if s.mode == DFC or s.mode == SS:
        return s.c_r
    return 0.0


@kernel
def factorise(par, c, f, slot, h, closed):
    """Factorise the stage matrix without the rock, top to bottom, into a slot of `f`."""
    at = slot * ROWS
    h_re = h * par.mu_re
    h_im = h * par.mu_im
    # h mu (eta + h mu) goes with the stiffness of the bars, (h mu)^2 with the contact
    square_re = h_re * h_re - h_im * h_im
    square_im = 2.0 * h_re * h_im
    bars_re = h_re * par.eta + square_re
    bars_im = h_im * par.eta + square_im
    n = par.n_p + par.n_b
    inverse_re = 0.0
    inverse_im = 0.0
    side_re = 0.0
    side_im = 0.0
    for i in range(n):
        low_re = side_re * inverse_re - side_im * inverse_im
        low_im = side_re * inverse_im + side_im * inverse_re
        re = c[MASS, i] + bars_re * c[SPRINGS, i] - (low_re * side_re - low_im * side_im)
        im = bars_im * c[SPRINGS, i] - (low_re * side_im + low_im * side_re)
        side_re = c[COUPLING, i] - bars_re * c[STIFFNESS, i]
        side_im = -bars_im * c[STIFFNESS, i]
        if closed == 1 and (i == par.n_p - 1 or i == par.n_p):
            re += square_re * par.k_c
            im += square_im * par.k_c
            if i == par.n_p - 1:
                side_re = -square_re * par.k_c
                side_im = -square_im * par.k_c
        size = re * re + im * im
        inverse_re = re / size
        inverse_im = -im / size
        f[at + LOW_RE, i] = low_re
        f[at + LOW_IM, i] = low_im
        f[at + PIVOT_RE, i] = inverse_re
        f[at + PIVOT_IM, i] = inverse_im
    f[at + PIVOT_RE, n - 1] = re
    f[at + PIVOT_IM, n - 1] = im


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


@fused
def substitute(par, s, f, slot, x, h):
    """Solve with a factorisation, rock included; the solution replaces rows RE, IM."""
    at = slot * ROWS
    n = par.n_p + par.n_b
    h_re = h * par.mu_re
    h_im = h * par.mu_im
    re = x[RE, 0]
    im = x[IM, 0]
    for i in range(n - 1):
        low_re = f[at + LOW_RE, i + 1]
        low_im = f[at + LOW_IM, i + 1]
        next_re = x[RE, i + 1] - low_re * re + low_im * im
        im = x[IM, i + 1] - low_re * im - low_im * re
        re = next_re
        x[RE, i + 1] = re
        x[IM, i + 1] = im
    K = stiffness(s)
    C = damping(s)
    pivot_re = f[at + PIVOT_RE, n - 1] + h_re * C + (h_re * h_re - h_im * h_im) * K
    pivot_im = f[at + PIVOT_IM, n - 1] + h_im * C + 2.0 * h_re * h_im * K
    size = pivot_re * pivot_re + pivot_im * pivot_im
    next_re = (re * pivot_re + im * pivot_im) / size
    im = (im * pivot_re - re * pivot_im) / size
    re = next_re
    x[RE, n - 1] = re
    x[IM, n - 1] = im
    for k in range(n - 1):
        i = n - 2 - k
        scaled_re = x[RE, i] * f[at + PIVOT_RE, i] - x[IM, i] * f[at + PIVOT_IM, i]
        scaled_im = x[RE, i] * f[at + PIVOT_IM, i] + x[IM, i] * f[at + PIVOT_RE, i]
        low_re = f[at + LOW_RE, i + 1]
        low_im = f[at + LOW_IM, i + 1]
        next_re = scaled_re - low_re * re + low_im * im
        im = scaled_im - low_re * im - low_im * re
        re = next_re
        x[RE, i] = re
        x[IM, i] = im


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
    slot = s.closed
    if h != par.dt:
        slot = OTHER
        factorise(par, c, f, slot, h, s.closed)
    load(par, s, w, c, x, h)
    substitute(par, s, f, slot, x, h)
    tilt = (0.5 - par.mu_re) / par.mu_im
    by_re = h * h * (par.mu_re + tilt * par.mu_im)
    by_im = h * h * (tilt * par.mu_re - par.mu_im)
    for i in range(par.n_p + par.n_b):
        x[U, i] = w[U, i] + (h * w[V, i] + (by_re * x[RE, i] + by_im * x[IM, i]))
        x[V, i] = w[V, i] + h * (x[RE, i] + tilt * x[IM, i])
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
