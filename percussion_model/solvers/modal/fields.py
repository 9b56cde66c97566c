"""Force and velocity along the bars, from the modes of a state."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.kernel import kernel, preparing
from percussion_model.scene.bars import section_mass, section_transit_time
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.modal.records import JOINED, Shape


@kernel
def loads_of(par, s, stiff):
    """Accelerations by the body loads of piston and bit beyond that of the whole bar [m/s2]."""
    joined = s.form >= JOINED
    a_p, a_b = s.a_p if joined else 0.0, s.a_b
    if stiff == 0.0:
        pull, whole = par.mass_b * a_b, par.mass_b
        if joined:
            pull += par.mass_p * a_p
            whole += par.mass_p
            a_p -= pull / whole
        a_b -= pull / whole
    return a_p, a_b


@kernel
def take_rest(w, shape, active, out):
    """Offsets of the modes about rest, whose force is known in closed form, and velocities."""
    for k in range(w.shape[1]):
        out[0, k], out[1, k] = w[0, k], w[1, k]
        if k < active:
            out[0, k] -= shape[Shape.SOFT, k] * w[2, k]


@kernel
def total(rows, place, w, row):
    """Sum over the modes of what they have at a place, in their order."""
    found = 0.0
    for k in range(rows.shape[0]):
        found += rows[k, place] * w[row, k]
    return found


@preparing
def places_of(sections, size):
    """Cells of a bar with transit times of about `size` [s].

    Returns
    -------
    counts : int array, shape (sections,)
        Cells of each section.
    section, share, mass : ndarray
        Of each cell: its section, the share of that above its middle, its mass [kg].
    """
    counts = np.zeros(len(sections), np.int64)
    for i in range(len(sections)):
        counts[i] = max(1, math.floor(section_transit_time(sections[i]) / size + 0.5))
    n = counts.sum()
    section, share, mass = np.zeros(n, np.int64), np.zeros(n), np.zeros(n)
    cell = 0
    for i in range(len(sections)):
        for k in range(counts[i]):
            section[cell] = i
            share[cell] = (k + 0.5) / counts[i]
            mass[cell] = section_mass(sections[i]) / counts[i]
            cell += 1
    return counts, section, share, mass
