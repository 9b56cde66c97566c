"""Waves in one bar: shift, reflection and transmission, sums over its cells.

Each cell carries a down-going and an up-going velocity wave, d and u, so that
v = d + u and F = Z (d - u) (docs/model.md, eqs 5-6). A wave moves one cell a step.
"""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.solvers.wave.records import Coef, Row


@inlined
def face_velocities(w, c, n, r, kick):
    """Velocity of each inner interface over the step, without loss.

    v = (2 Z1 d + 2 Z2 u) / (Z1 + Z2) (docs/model.md, eq. 8) plus the body
    force's share.

    Parameters
    ----------
    w, c : float array (rows, n + 1)
        State and coefficients of the bar.
    n : int
        Number of cells.
    r : int
        Row of the present down-going wave; the up-going one follows it.
    kick : float
        Velocity that the body force gives in half a step [m/s].
    """
    for i in range(1, n):
        w[Row.FACE, i] = c[Coef.ALPHA, i] * w[r, i - 1] + c[Coef.BETA, i] * w[r + 1, i] + kick


@inlined
def send_waves(w, n, r):
    """Write the waves after the step from the interface velocities (docs/model.md, eq. 7).

    What leaves an interface is its velocity less the wave that came in from
    the other side; the rows 2 - r and 3 - r receive the result.
    """
    q = 2 - r
    for i in range(n):
        w[q, i] = w[Row.FACE, i] - w[r + 1, i]
        w[q + 1, i] = w[Row.FACE, i + 1] - w[r, i]


@inlined
def send_waves_with_loss(w, c, n, r):
    """As `send_waves`, with the viscous force of one explicit sub-step.

    A cell resists its strain rate with kappa Z (v_below - v_above)
    (docs/numerics.md, eq. 4); the end velocities in the FACE row are final.
    """
    q = 2 - r
    w[q, 0] = w[Row.FACE, 0] - w[r + 1, 0]
    w[q + 1, n - 1] = w[Row.FACE, n] - w[r, n - 1]
    for i in range(1, n):
        v = w[Row.FACE, i]
        force = c[Coef.VISCOUS, i] * (w[Row.FACE, i + 1] - v) - c[Coef.VISCOUS, i - 1] * (
            v - w[Row.FACE, i - 1]
        )
        v += force * c[Coef.INV_Z, i]
        w[Row.LOSS, i] -= force * v
        w[q + 1, i - 1] = v - w[r, i - 1]
        w[q, i] = v - w[r + 1, i]


@kernel
def add_velocity(w, n, r, dv):
    """Add a uniform velocity `dv` [m/s] to the bar."""
    half = 0.5 * dv
    for i in range(n):
        w[r, i] += half
        w[r + 1, i] += half


@inlined
def mean_velocity(w, c, n, r, mass):
    """Mean velocity of the bar, weighted by mass [m/s]."""
    a = 0.0
    b = 0.0
    for i in range(n):
        a += c[Coef.MASS, i] * w[r, i]
        b += c[Coef.MASS, i] * w[r + 1, i]
    return (a + b) / mass


@inlined
def strain_offset(w, c, n, r, row):
    """Displacement between the mean and an end of the bar.

    Parameters
    ----------
    row : int
        Coef.TOP for (top end - mean), Coef.BOTTOM for (mean - bottom end), both
        positive where the bar is compressed.

    Returns
    -------
    float
        Offset [m].
    """
    a = 0.0
    for i in range(n):
        a += c[row, i] * (w[r, i] - w[r + 1, i])
    return a


@inlined
def kinetic_energy(w, c, n, r):
    """Kinetic energy of the whole bar, eq. 52 of the paper [J]."""
    a = 0.0
    b = 0.0
    half = n // 2
    for i in range(half):
        x = w[r, i] + w[r + 1, i]
        y = w[r, half + i] + w[r + 1, half + i]
        a += c[Coef.MASS, i] * (x * x)
        b += c[Coef.MASS, half + i] * (y * y)
    if 2 * half < n:
        x = w[r, n - 1] + w[r + 1, n - 1]
        a += c[Coef.MASS, n - 1] * (x * x)
    return 0.5 * (a + b)


@kernel
def elastic_energy(w, c, n, r):
    """Strain energy of the whole bar [J]."""
    a = 0.0
    for i in range(n):
        x = w[r, i] - w[r + 1, i]
        a += c[Coef.MASS, i] * (x * x)
    return 0.5 * a


@kernel
def deviation_energy(w, c, n, r, velocity, acceleration):
    """Energy of the bar about a uniform velocity and a static load [J].

    Parameters
    ----------
    velocity : float
        Mean velocity taken out [m/s].
    acceleration : float
        Body acceleration whose static stress is taken out [m/s2]; 0 for a
        bar in free flight, which a body force leaves free of stress.
    """
    half = 0.5 * velocity
    a = 0.0
    for i in range(n):
        rest = acceleration * c[Coef.STATIC, i]
        x = w[r, i] - half - rest
        y = w[r + 1, i] - half + rest
        a += c[Coef.MASS, i] * (x * x + y * y)
    return a
