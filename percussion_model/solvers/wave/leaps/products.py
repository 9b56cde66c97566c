"""Products of matrices and systems of equations, each sum in an order of its own.

Libraries of linear algebra sum otherwise on other processors. Here a number is the sum
over the rows of the second matrix in their order, whatever is computed beside it.
"""

from __future__ import annotations

import numpy as np

from percussion_model.physics.kernel import kernel, preparing
from percussion_model.solvers.wave.leaps.lanes import (
    WIDTH,
    add_scaled,
    no_lanes,
    store_sum,
)


@kernel
def multiply_matrices(a, b, out, rows, lower):
    """out = a b, as far as wanted.

    Two rows at a time, so that half as many numbers of `b` are read: its columns by `WIDTH`
    stay in a processor's nearest cache.

    Parameters
    ----------
    a : float array, shape (at least rows, n)
    b : float array, shape (n, m)
        m a multiple of `WIDTH`.
    out : float array, shape (at least rows, m)
        None of `a` and `b`.
    rows : int
        Rows of `a` that are looked at.
    lower : bool
        Only what stands on and below the diagonal is wanted; some more is filled.
    """
    for i in range(0, b.shape[1], WIDTH):
        r = i if lower else 0
        while r < rows:
            pair = r + 1 if r + 1 < rows else r
            one, other = no_lanes(), no_lanes()
            for k in range(b.shape[0]):
                one = add_scaled(one, b, k, i, a[r, k])
                other = add_scaled(other, b, k, i, a[pair, k])
            store_sum(out[r], i, one, no_lanes())
            store_sum(out[pair], i, other, no_lanes())
            r += 2


@kernel
def multiply_narrow(a, b, out, first, last):
    """Columns of out = a b from `first` on; as many as `last` allows, of any number.

    Parameters
    ----------
    a : float array, shape (n, n)
    b : float array, shape (n, at least last - first)
        Its first columns are taken.
    out : float array, shape (n, at least last)
        May be `b`: other columns are written than are read.
    """
    n, count = a.shape[0], last - first
    for i in range(n):
        for j in range(count):
            out[i, first + j] = 0.0
        for k in range(n):
            share = a[i, k]
            for j in range(count):
                out[i, first + j] += share * b[k, j]


@kernel
def transpose(a, out):
    """Put the columns of a square matrix into the rows of another."""
    n = a.shape[0]
    for i in range(n):
        for j in range(n):
            out[j, i] = a[i, j]


@preparing
def of_pairs(one, other):
    """Sums over the last axis of the products of all rows of `one` with all rows of `other`.

    Parameters
    ----------
    one, other : float array, shape (m, n)

    Returns
    -------
    ndarray, shape (m, m)
    """
    m, n = one.shape
    width = (m + WIDTH - 1) // WIDTH * WIDTH
    across, out, found = np.zeros((n, width)), np.zeros((m, width)), np.zeros((m, m))
    for k in range(n):
        for j in range(m):
            across[k, j] = other[j, k]
    multiply_matrices(one, across, out, m, False)
    for i in range(m):
        for j in range(m):
            found[i, j] = out[i, j]
    return found


@kernel
def _eliminate(a, x, k):
    """Take the k-th unknown out of the equations below, with the largest factor as pivot."""
    n, best = len(a), k
    for i in range(k + 1, n):
        if abs(a[i, k]) > abs(a[best, k]):
            best = i
    if best != k:
        for j in range(k, n):
            a[k, j], a[best, j] = a[best, j], a[k, j]
        x[k], x[best] = x[best], x[k]
    for i in range(k + 1, n):
        share = a[i, k] / a[k, k]
        if share != 0.0:
            for j in range(k + 1, n):
                a[i, j] -= share * a[k, j]
            x[i] -= share * x[k]


@kernel
def solve(a, x):
    """Solve a system of equations by elimination.

    Parameters
    ----------
    a : float array, shape (n, n)
        Spoilt.
    x : float array, shape (at least n,)
        The right-hand side becomes the solution.

    Returns
    -------
    bool
        Whether there is one, to the digits of a number.
    """
    n = len(a)
    for k in range(n):
        _eliminate(a, x, k)
        if not abs(a[k, k]) > 0.0:
            return False
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            x[k] -= a[k, j] * x[j]
        x[k] /= a[k, k]
    return True
