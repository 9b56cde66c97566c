"""Structural loss: Kelvin-Voigt forces, stress = E (strain + eta strain rate).

Velocities are smoothed, never stresses, so nothing creeps under a static load.
Half of the loss acts between interfaces in the middle of a step, half between
cells at its end: two lattices half a cell apart, so that a sharp front leaves
no saw-tooth behind (docs/numerics.md, section 3).
"""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.solvers.wave.records import Coef, Row

FACE, LOSS, SCRATCH = int(Row.FACE), int(Row.LOSS), int(Row.SCRATCH)
INV_Z, VISCOUS = int(Coef.INV_Z), int(Coef.VISCOUS)
BETWEEN, INV_CELL_Z = int(Coef.BETWEEN), int(Coef.INV_CELL_Z)
FROM_TOP, FROM_BOTTOM = int(Coef.FROM_TOP), int(Coef.FROM_BOTTOM)


@kernel
def loss_substeps(w, c, n, m):
    """Diffuse the interface velocities in `m` sub-steps, end cells left out.

    Used where kappa is too large for one explicit step. The result stays in
    the SCRATCH row until `finish_loss` adds what the end cells do.

    Returns
    -------
    top, bottom : float
        Mean velocity over the sub-steps of the first and the last inner
        interface, against which the end cells work [m/s].
    """
    for i in range(1, n):
        w[SCRATCH, i] = w[FACE, i]
    top = 0.0
    bottom = 0.0
    for _ in range(m):
        top += w[SCRATCH, 1]
        bottom += w[SCRATCH, n - 1]
        above = 0.0
        for i in range(1, n):
            v = w[SCRATCH, i]
            below = 0.0
            if i < n - 1:
                below = c[VISCOUS, i] * (w[SCRATCH, i + 1] - v)
            w[SCRATCH, i] = v + 2.0 * c[INV_Z, i] * (below - above)
            above = below
    return top / m, bottom / m


@kernel
def finish_loss(w, c, n, force_top, force_bottom):
    """Add the end cells' viscous forces and settle the interface velocities.

    Parameters
    ----------
    force_top, force_bottom : float
        Mean viscous force of the first and the last cell, compression
        positive [N].
    """
    for i in range(1, n):
        before = w[FACE, i]
        after = w[SCRATCH, i] + force_top * c[FROM_TOP, i] - force_bottom * c[FROM_BOTTOM, i]
        v = 0.5 * (before + after)
        w[LOSS, i] -= 0.5 * (after - before) / c[INV_Z, i] * v
        w[FACE, i] = v


@kernel
def smooth_cells(w, c, n, q, parts):
    """Half of a step's loss: viscous forces between neighbouring cells.

    Parameters
    ----------
    q : int
        Row of the down-going wave.
    parts : int
        Explicit sub-steps.
    """
    for _ in range(parts):
        for i in range(n):
            w[SCRATCH, i] = w[q, i] + w[q + 1, i]
        push_cell(w, c, q, 0, c[BETWEEN, 0] * (w[SCRATCH, 1] - w[SCRATCH, 0]))
        for i in range(1, n - 1):
            v = w[SCRATCH, i]
            force = c[BETWEEN, i] * (w[SCRATCH, i + 1] - v)
            force -= c[BETWEEN, i - 1] * (v - w[SCRATCH, i - 1])
            half = 0.5 * force * c[INV_CELL_Z, i]
            w[LOSS, i] -= force * (v + half)
            w[q, i] += half
            w[q + 1, i] += half
        last = c[BETWEEN, n - 2] * (w[SCRATCH, n - 2] - w[SCRATCH, n - 1])
        push_cell(w, c, q, n - 1, last)


@inlined
def push_cell(w, c, q, i, force):
    """Let a viscous force [N] act on a cell over the step."""
    half = 0.5 * force * c[INV_CELL_Z, i]
    w[LOSS, i] -= force * (w[SCRATCH, i] + half)
    w[q, i] += half
    w[q + 1, i] += half
