"""Parameters and first state of the finite elements, from the numbers of a scene."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import Piston
from percussion_model.physics.rock import is_rigid_rock, yield_like_a_spring
from percussion_model.scene.rock_law import is_wall
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.fem.bars import read_all, stored_energy
from percussion_model.solvers.fem.mesh import critical_frequency, shortest_transit
from percussion_model.solvers.fem.modes import keep_near
from percussion_model.solvers.fem.records import Node
from percussion_model.solvers.setup import (
    MOST_CHANGES,
    PISTONS,
    fill_parameters,
    fill_start,
    kelvin_voigt_time,
)

# Steps cut short by events within the length of a whole one; more are a storm. The
# reference has no more than 5.
MOST_EVENTS = 64


@preparing
def loss_time(numbers, bit):
    """Kelvin-Voigt time [s]: that of the scene, or 2 zeta_K / omega_cr (eq. 55 of the paper)."""
    values = numbers.values
    if not values.effects_loss or math.isnan(values.fem_damping_ratio):
        return kelvin_voigt_time(numbers)
    return 2.0 * values.fem_damping_ratio / critical_frequency(bit)


@preparing
def fill_scheme(p, spectral_radius):
    """Fill in eigenvalue and defect of the scheme's matrix (docs/numerics.md, section 10)."""
    sum_of_both = (2.0 + spectral_radius) / (3.0 * (1.0 + spectral_radius))
    product = 1.0 / (6.0 * (1.0 + spectral_radius))
    p.mu_re = 0.5 * sum_of_both
    p.mu_im = math.sqrt(product - 0.25 * sum_of_both * sum_of_both)
    p.dissipation = (1.0 - spectral_radius) / (36.0 * (1.0 + spectral_radius))


@preparing
def fill_fem_parameters(p, numbers, bars):
    """Fill a FEM_PAR record of a scene on its mesh.

    Parameters
    ----------
    p : FEM_PAR record
    numbers : Numbers
    bars : BarMeshes
    """
    values = numbers.values
    fill_parameters(p, numbers, PISTONS[values.piston_model] == Piston.ELASTIC)
    p.dt = values.fem_courant * min(shortest_transit(bars.piston), shortest_transit(bars.bit))
    fill_scheme(p, values.fem_spectral_radius)
    p.k_c = values.fem_contact_stiffness
    p.eta = loss_time(numbers, bars.bit)
    p.q_tol, p.t_tol = values.fem_event_tolerance, values.fem_time_tolerance
    p.start_gap = values.start_gap
    p.n_p, p.n_b = bars.piston.nodes, bars.bit.nodes
    if is_rigid_rock(p):
        yield_like_a_spring(p)  # it is met like the piston: by a penalty
    p.most_changes, p.most_events = MOST_CHANGES, MOST_EVENTS


@preparing
def refresh(p, s, w, c):
    """Derive everything from the nodes, as at the start of a run."""
    read_all(p, s, w, c)
    kinetic, elastic, rock = stored_energy(p, s, w, c)
    s.e_start = kinetic + elastic + rock


@preparing
def begin(p, s, w, c, numbers):
    """Fill record and nodes at time zero.

    Parameters
    ----------
    p, s : FEM_PAR, FEM_STATE record
    w : float array, shape (len(Node), n)
        Of zeros.
    c : float array, shape (len(Mesh), n)
    numbers : Numbers
    """
    values = numbers.values
    fill_start(s, numbers)
    if is_wall(values):
        s.k_r = s.next_k_r = values.fem_contact_stiffness
    s.inputs_changed = 1
    for i in range(p.n_p + p.n_b):
        w[Node.U, i] = -values.start_rock_gap
        w[Node.V, i] = values.start_bit_velocity
    for i in range(p.n_p):
        w[Node.U, i] -= values.start_gap
        w[Node.V, i] = values.start_piston_velocity
    refresh(p, s, w, c)
    keep_near(p, s, w)
