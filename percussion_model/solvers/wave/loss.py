"""Structural loss: Kelvin-Voigt forces, docs/model.md, eq. 2.

Velocities are smoothed, never stresses, so nothing creeps under a static load.
Half of the loss acts between interfaces in the middle of a step, half between
cells at its end: two lattices half a cell apart, so that a sharp front leaves
no saw-tooth behind (docs/numerics.md, section 3).
"""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.solvers.wave.records import Coef, Row


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
        w[Row.SCRATCH, i] = w[Row.FACE, i]
    top = 0.0
    bottom = 0.0
    for _ in range(m):
        top += w[Row.SCRATCH, 1]
        bottom += w[Row.SCRATCH, n - 1]
        above = 0.0
        for i in range(1, n):
            v = w[Row.SCRATCH, i]
            below = 0.0
            if i < n - 1:
                below = c[Coef.VISCOUS, i] * (w[Row.SCRATCH, i + 1] - v)
            w[Row.SCRATCH, i] = v + 2.0 * c[Coef.INV_Z, i] * (below - above)
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
        before = w[Row.FACE, i]
        after = (
            w[Row.SCRATCH, i]
            + force_top * c[Coef.FROM_TOP, i]
            - force_bottom * c[Coef.FROM_BOTTOM, i]
        )
        v = 0.5 * (before + after)
        w[Row.LOSS, i] -= 0.5 * (after - before) / c[Coef.INV_Z, i] * v
        w[Row.FACE, i] = v


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
            w[Row.SCRATCH, i] = w[q, i] + w[q + 1, i]
        push_cell(w, c, q, 0, c[Coef.BETWEEN, 0] * (w[Row.SCRATCH, 1] - w[Row.SCRATCH, 0]))
        for i in range(1, n - 1):
            v = w[Row.SCRATCH, i]
            force = c[Coef.BETWEEN, i] * (w[Row.SCRATCH, i + 1] - v)
            force -= c[Coef.BETWEEN, i - 1] * (v - w[Row.SCRATCH, i - 1])
            half = 0.5 * force * c[Coef.INV_CELL_Z, i]
            w[Row.LOSS, i] -= force * (v + half)
            w[q, i] += half
            w[q + 1, i] += half
        last = c[Coef.BETWEEN, n - 2] * (w[Row.SCRATCH, n - 2] - w[Row.SCRATCH, n - 1])
        push_cell(w, c, q, n - 1, last)


@inlined
def push_cell(w, c, q, i, force):
    """Let a viscous force [N] act on a cell over the step."""
    half = 0.5 * force * c[Coef.INV_CELL_Z, i]
    w[Row.LOSS, i] -= force * (w[Row.SCRATCH, i] + half)
    w[q, i] += half
    w[q + 1, i] += half
