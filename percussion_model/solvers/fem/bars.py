"""Sums over the nodes: mean motion, energies, and what a state shows of itself."""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import recoverable
from percussion_model.solvers.fem.records import Mesh, Node


@inlined
def moment(c, a, row, first, count):
    """Sum of mass times value over `count` nodes."""
    sum0 = 0.0
    sum1 = 0.0
    sum2 = 0.0
    sum3 = 0.0
    part = count // 4
    for i in range(first, first + part):
        # four sums, so that none waits for the last addition
        sum0 += c[Mesh.SHARE, i] * a[row, i]
        sum1 += c[Mesh.SHARE, i + part] * a[row, i + part]
        sum2 += c[Mesh.SHARE, i + 2 * part] * a[row, i + 2 * part]
        sum3 += c[Mesh.SHARE, i + 3 * part] * a[row, i + 3 * part]
    for i in range(first + 4 * part, first + count):
        sum0 += c[Mesh.SHARE, i] * a[row, i]
    return (sum0 + sum1) + (sum2 + sum3)


@inlined
def relative_motion(par, c, a, row):
    """Mean of the piston less mean of the bit, u_r of docs/model.md, eq. 12 or its rate."""
    bit = moment(c, a, row, par.n_p, par.n_b) / par.mass_b
    return moment(c, a, row, 0, par.n_p) / par.mass_p - bit


@inlined
def kinetic_energy(c, a, first, count):
    """Kinetic energy of `count` nodes that a bar has, eq. 52 of the paper [J]."""
    p = 0.0
    q = 0.0
    r = 0.0
    s = 0.0
    half = count // 2
    for i in range(first, first + half):
        v = a[Node.V, i]
        p += c[Mesh.MASS, i] * (v * v)
        q += c[Mesh.COUPLING, i] * (v * a[Node.V, i + 1])
        v = a[Node.V, i + half]
        r += c[Mesh.MASS, i + half] * (v * v)
        # the last node has no coupling: what follows it does not matter
        if i + half < first + count - 1:
            s += c[Mesh.COUPLING, i + half] * (v * a[Node.V, i + half + 1])
    if 2 * half < count:
        v = a[Node.V, first + count - 1]
        p += c[Mesh.MASS, first + count - 1] * (v * v)
    return 0.5 * (p + r) + (q + s)


@inlined
def elastic_energy(c, a, n):
    """Strain energy of all elements [J]."""
    total = 0.0
    for i in range(n - 1):
        stretch = a[Node.U, i + 1] - a[Node.U, i]
        total += c[Mesh.STIFFNESS, i] * (stretch * stretch)
    return 0.5 * total


@kernel
def force_in(c, a, first, element):
    """Force in an element of the bar whose nodes begin at `first`, compression positive [N]."""
    i = first + element
    return -c[Mesh.STIFFNESS, i] * (a[Node.U, i + 1] - a[Node.U, i])


@inlined
def contact_energy(par, s):
    """Energy in the penalty spring between piston and bit [J]."""
    if s.closed == 1:
        return 0.5 * par.k_c * s.gap * s.gap
    return 0.0


@kernel
def stored_energy(par, s, w, c):
    """Energy stored in bars, contact and rock.

    Returns
    -------
    kinetic, elastic, rock : float
        [J]
    """
    kinetic = kinetic_energy(c, w, par.n_p, par.n_b)
    if par.n_p > 0:
        kinetic += kinetic_energy(c, w, 0, par.n_p)
    elastic = elastic_energy(c, w, par.n_p + par.n_b) + contact_energy(par, s)
    return kinetic, elastic, recoverable(par, s)


@kernel
def dissipated_in_nodes(par, w):
    """Structural loss and dissipation of the scheme, booked node by node [J]."""
    loss = 0.0
    numerical = 0.0
    for i in range(par.n_p + par.n_b):
        loss += w[Node.LOSS, i]
        numerical += w[Node.NUMERICAL, i]
    return loss, numerical


@kernel
def read_nodes(par, s, w):
    """Derive from nodes and sums what the modes look at: gap, penetration, mean motion."""
    last = par.n_p + par.n_b - 1
    s.p = w[Node.U, last] + s.far
    s.v_end = w[Node.V, last]
    if par.n_p > 0:
        s.gap = w[Node.U, par.n_p] - w[Node.U, par.n_p - 1]
        s.gap_rate = w[Node.V, par.n_p] - w[Node.V, par.n_p - 1]
    s.mean_b = s.next_b
    s.mean_p = s.next_p
    s.u_r = s.mean_p - s.mean_b
    s.kinetic = s.next_kinetic


@inlined
def read_ahead(par, s, a, c):
    """Derive sums over the nodes of `a` that are the state's to come."""
    s.next_b = moment(c, a, Node.U, par.n_p, par.n_b) / par.mass_b + s.far
    if par.n_p > 0:
        s.next_p = moment(c, a, Node.U, 0, par.n_p) / par.mass_p + s.far
    if s.mode == Mode.SS:
        s.next_kinetic = kinetic_energy(c, a, par.n_p, par.n_b)


@kernel
def read_all(par, s, w, c):
    """Derive from the nodes all that modes and ledger look at."""
    read_ahead(par, s, w, c)
    read_nodes(par, s, w)


@kernel
def read_means(par, s, w, c):
    """Derive the mean velocities."""
    s.v_b = moment(c, w, Node.V, par.n_p, par.n_b) / par.mass_b
    if par.n_p > 0:
        s.v_p = moment(c, w, Node.V, 0, par.n_p) / par.mass_p


@inlined
def bit_position(s):
    """Mean displacement of the bit since the start [m]."""
    return s.x_r + s.mean_b
