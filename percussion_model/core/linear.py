"""Linear maps of a bar's waves: deviation from rest, product, quadratic form.

A map is stored column by column and padded with zeros to a multiple of
`PADDING`, so that its loops have no remainder.
"""

from __future__ import annotations

from percussion_model.core.kernel import kernel, merged
from percussion_model.core.wave_records import Coef

MASS, STATIC = int(Coef.MASS), int(Coef.STATIC)

# Sizes are padded to a multiple of this: four vectors of four numbers, which
# is what a loop takes at a time.
PADDING = 16


@merged
def load(x, w, c, n, r, velocity, acceleration):
    """Copy the deviation from mean motion and static load into `x`."""
    half = 0.5 * velocity
    for i in range(n):
        rest = acceleration * c[STATIC, i]
        x[i] = w[r, i] - half - rest
        x[n + i] = w[r + 1, i] - half + rest


@merged
def store(x, w, c, n, r, velocity, acceleration):
    """Copy `x` back about a new mean velocity and the static load."""
    half = 0.5 * velocity
    for i in range(n):
        rest = acceleration * c[STATIC, i]
        w[r, i] = x[i] + half + rest
        w[r + 1, i] = x[n + i] + half - rest


@merged
def remove_mean(x, c, n, mass):
    """Take rounding's share of mean motion out of a free bar's deviation."""
    a = 0.0
    for i in range(n):
        a += c[MASS, i] * (x[i] + x[n + i])
    half = 0.5 * a / mass
    for i in range(n):
        x[i] -= half
        x[n + i] -= half


@kernel
def multiply(operator, level, form, x, y, size):
    """y = A x, with A stored column by column."""
    for i in range(size):
        y[i] = 0.0
    for k in range(0, size, 4):
        a, b, c, d = x[k], x[k + 1], x[k + 2], x[k + 3]
        for i in range(size):
            y[i] += (operator[level, form, k, i] * a + operator[level, form, k + 1, i] * b) + (
                operator[level, form, k + 2, i] * c + operator[level, form, k + 3, i] * d
            )


@kernel
def quadratic(operator, level, form, x, y, size):
    """x' A x [J], with A stored as the upper triangle that gives the same."""
    for i in range(size):
        y[i] = 0.0
    for k in range(0, size, 4):
        a, b, c, d = x[k], x[k + 1], x[k + 2], x[k + 3]
        for i in range((k // PADDING + 1) * PADDING):
            y[i] += (operator[level, form, k, i] * a + operator[level, form, k + 1, i] * b) + (
                operator[level, form, k + 2, i] * c + operator[level, form, k + 3, i] * d
            )
    a = 0.0
    b = 0.0
    c = 0.0
    d = 0.0
    for i in range(0, size, 4):
        a += x[i] * y[i]
        b += x[i + 1] * y[i + 1]
        c += x[i + 2] * y[i + 2]
        d += x[i + 3] * y[i + 3]
    return (a + b) + (c + d)


@merged
def pad(x, used, size):
    """Set what lies beyond the `used` numbers of a deviation to zero."""
    for i in range(used, size):
        x[i] = 0.0
