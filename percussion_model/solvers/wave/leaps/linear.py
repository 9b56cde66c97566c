"""Linear maps of a bar's waves: deviation from rest, product, quadratic form.

A map is stored column by column and padded with zeros to a multiple of
`PADDING`, so that its loops have no remainder.
"""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.solvers.wave.leaps.lanes import (
    WIDTH,
    add_scaled,
    load_lanes,
    no_lanes,
    store_sum,
)
from percussion_model.solvers.wave.records import Coef

# Sizes are padded to a multiple of this, which is what a product takes at a time.
PADDING = WIDTH
# Below this level each digit of a number of steps has a form of its own, which spares
# short leaps most of their forms; from it on each level has one, which spares memory.
SINGLE = 3


@merged
def load(x, w, c, n, r, velocity, acceleration):
    """Copy the deviation from mean motion and static load into `x`."""
    half = 0.5 * velocity
    for i in range(n):
        rest = acceleration * c[Coef.STATIC, i]
        x[i] = w[r, i] - half - rest
        x[n + i] = w[r + 1, i] - half + rest


@merged
def store(x, w, c, n, r, velocity, acceleration):
    """Copy `x` back about a new mean velocity and the static load."""
    half = 0.5 * velocity
    for i in range(n):
        rest = acceleration * c[Coef.STATIC, i]
        w[r, i] = x[i] + half + rest
        w[r + 1, i] = x[n + i] + half - rest


@merged
def remove_mean(x, c, n, mass):
    """Take rounding's share of mean motion out of a free bar's deviation."""
    a = 0.0
    for i in range(n):
        a += c[Coef.MASS, i] * (x[i] + x[n + i])
    half = 0.5 * a / mass
    for i in range(n):
        x[i] -= half
        x[n + i] -= half


@kernel
def multiply(operator, x, y, rows, columns, add):
    """y = A x, or y += A x, with A stored column by column.

    Parameters
    ----------
    operator : float array, shape (at least rows, at least columns)
        Row k is the k-th column of A.
    rows, columns : int
        An even number, a multiple of `PADDING`.
    """
    for i in range(0, columns, PADDING):
        even = load_lanes(y, i) if add else no_lanes()
        odd = no_lanes()
        for k in range(0, rows, 2):
            even = add_scaled(even, operator, k, i, x[k])
            odd = add_scaled(odd, operator, k + 1, i, x[k + 1])
        store_sum(y, i, even, odd)


@inlined
def apply(power, x, y, size):
    """x = P x, with P stored column by column."""
    multiply(power, x, y, size, size, False)
    for i in range(size):
        x[i] = y[i]


@kernel
def carry(powers, steps, x, y, size):
    """x = P^steps x from the powers 1, 4, 16, ... of a map.

    Four to a level, not two: fewer matrices, which stay in the cache.

    Parameters
    ----------
    powers : float array, shape (levels, size, size)
    y : float array
        Scratch.
    """
    level = 0
    while steps > 0:
        for _ in range(steps & 3):
            apply(powers[level], x, y, size)
        steps >>= 2
        level += 1


@kernel
def carry_and_sum(powers, loss, squares, lossy, squared, steps, x, y, size):
    """As `carry`, with the sums over all steps of up to two quadratic forms.

    Parameters
    ----------
    loss, squares : float array, shape (forms, size, size)
        Forms summed over 1, 2, 3, 4, 8, 12, 16, 32, 48 steps, then over 64, 256, ...
        (`SINGLE` and what follows), as upper triangles.
    lossy, squared : bool
        Which of them are wanted; the other is not looked at.

    Returns
    -------
    float, float
        Sums of `loss` and of `squares`, 0 where they are not wanted.
    """
    lost = 0.0
    square = 0.0
    level = 0
    while steps > 0:
        digit = steps & 3
        for k in range(digit):
            if level >= SINGLE or k == 0:
                form = level + 2 * SINGLE if level >= SINGLE else 3 * level + digit - 1
                if lossy:
                    lost += quadratic(loss[form], x, y, size)
                if squared:
                    square += quadratic(squares[form], x, y, size)
            apply(powers[level], x, y, size)
        steps >>= 2
        level += 1
    return lost, square


@inlined
def dot(row, x, size):
    """Sum of products of two rows, in four sums that need not wait for each other."""
    a = 0.0
    b = 0.0
    c = 0.0
    d = 0.0
    for i in range(0, size, 4):
        a += row[i] * x[i]
        b += row[i + 1] * x[i + 1]
        c += row[i + 2] * x[i + 2]
        d += row[i + 3] * x[i + 3]
    return (a + b) + (c + d)


@kernel
def quadratic(operator, x, y, size):
    """x' A x, with A stored as the upper triangle that gives the same."""
    for i in range(0, size, PADDING):
        even = no_lanes()
        odd = no_lanes()
        for k in range(i, size, 2):
            even = add_scaled(even, operator, k, i, x[k])
            odd = add_scaled(odd, operator, k + 1, i, x[k + 1])
        store_sum(y, i, even, odd)
    return dot(x, y, size)


@merged
def pad(x, used, size):
    """Set what lies beyond the `used` numbers of a deviation to zero."""
    for i in range(used, size):
        x[i] = 0.0
