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
# Powers of a map at each level: those of one, two and three times 4^level steps.
DIGITS = 3


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
    """x = P^steps x, a product for each digit of `steps` to the base four.

    Parameters
    ----------
    powers : float array, shape (powers, size, size)
        Powers 1, 2, 3, 4, 8, 12, 16, 32, 48, ... of a map P.
    y : float array
        Scratch.
    """
    first = -1
    while steps > 0:
        digit = steps & 3
        if digit:
            apply(powers[first + digit], x, y, size)
        steps >>= 2
        first += DIGITS


@kernel
def carry_and_sum(powers, loss, squares, lossy, squared, steps, x, y, size):
    """As `carry`, with the sums over all steps of up to two quadratic forms.

    Parameters
    ----------
    loss, squares : float array, shape (powers, size, size)
        Forms summed over as many steps as the powers are of, as upper triangles.
    lossy, squared : bool
        Which of them are wanted; the other is not looked at.

    Returns
    -------
    float, float
        Sums of `loss` and of `squares`, 0 where they are not wanted.
    """
    lost = 0.0
    square = 0.0
    first = -1
    while steps > 0:
        digit = steps & 3
        if digit:
            if lossy:
                lost += quadratic(loss[first + digit], x, y, size)
            if squared:
                square += quadratic(squares[first + digit], x, y, size)
            apply(powers[first + digit], x, y, size)
        steps >>= 2
        first += DIGITS
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
