"""Modes of a bar with a dashpot under its rock end, from those without one.

The modes of a form obey y'' + eta w^2 y' + w^2 y = -b c (b . y'), with c the dashpot that eq. 4 of
docs/modal.md does not have. Its solutions are sums of motions exp(lambda t), each close to one of
a mode alone; lambda is a root of

    lambda^2 + eta w_k^2 lambda + w_k^2 + c lambda b_k^2 / (1 + c lambda S_k) = 0,
    S_k = sum over j != k of b_j^2 / (lambda^2 + eta w_j^2 lambda + w_j^2),

which Newton's method finds from that mode. The two of a mode make a pair of real numbers Q and
V = dQ/dt, which moves as an oscillator of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from percussion_model.physics.kernel import kernel, plain

# A dashpot grows to its full size in so many stages, each with Newton steps at most; what eq. 4 has
# too much is small.
STAGES, MOST_STEPS = 4, 30
# Relative size of the last step, and how far apart two roots are at least.
CLOSE_ENOUGH, APART = 1e-13, 1e-9


class Pairs(NamedTuple):
    """Damped modes as pairs of numbers; arrays without any where they cannot be told apart.

    Attributes
    ----------
    square, decay : ndarray, shape (n,)
        Q'' + decay Q' + square Q = 0 [1/s2, 1/s].
    out, into : ndarray, shape (2 n, 2 n)
        Row j: offsets and velocities of the plain modes by the j-th number (all Q, then all V);
        and the reverse.
    taken : ndarray, shape (2 n, 2 n)
        Form: integral of the end's squared velocity from now on [m2/s].
    """

    square: np.ndarray
    decay: np.ndarray
    out: np.ndarray
    into: np.ndarray
    taken: np.ndarray


@kernel
def _start(w, eta, first):
    """Root of a mode alone: the one of positive frequency, or the slow or fast one."""
    half = 0.5 * eta * w * w
    square = half * half - w * w
    if square < 0.0:
        return complex(-half, np.sqrt(-square))
    root = np.sqrt(square)
    return complex(-w * w / (half + root) if first else -half - root, 0.0)


@kernel
def _square(z):
    """Square of the size of a complex number."""
    return z.real * z.real + z.imag * z.imag


@kernel
def _newton(w, b, eta, c, k, root):
    """Root near another; NaN where none is found."""
    own, share = w[k] * w[k], b[k] * b[k]
    for _ in range(MOST_STEPS):
        total = slope = 0.0j
        for j in range(len(w)):
            if j != k:
                square = w[j] * w[j]
                below = 1.0 / (root * (root + eta * square) + square)
                total += b[j] * b[j] * below
                slope -= b[j] * b[j] * below * below * (2.0 * root + eta * square)
        rest = 1.0 / (1.0 + c * root * total)
        value = root * (root + eta * own) + own + c * share * root * rest
        change = 2.0 * root + eta * own
        change += c * share * rest * (1.0 - root * rest * c * (total + root * slope))
        step = value / change
        root -= step
        if _square(step) < CLOSE_ENOUGH * CLOSE_ENOUGH * _square(root):
            return root
    return complex(np.nan, np.nan)


@kernel
def _find_roots(w, b, eta, c, roots):
    """Fill the two roots of each mode; whether all were found, and apart from each other."""
    n, stages = len(w), STAGES if c > 0.0 else 1
    for k in range(n):
        roots[k, 0], roots[k, 1] = _start(w[k], eta, True), _start(w[k], eta, False)
        for stage in range(1, stages + 1):
            for i in range(2):
                roots[k, i] = _newton(w, b, eta, c * stage / stages, k, roots[k, i])
                # the other of a pair is its conjugate
                if roots[k, 0].imag != 0.0:
                    roots[k, 1] = roots[k, 0].conjugate()
                    break
        if roots[k, 0].imag != 0.0:
            if roots[k, 0].imag < 0.0:
                return False
            roots[k, 1] = roots[k, 0].conjugate()
        if not (roots[k, 0].real < 0.0 and roots[k, 1].real < 0.0):
            return False
    for k in range(n):
        for i in range(2):
            for j in range(n):
                for m in range(2):
                    apart = _square(roots[j, m] - roots[k, i])
                    if (j != k or m != i) and apart < APART * APART * _square(roots[k, i]):
                        return False
    return True


@kernel
def _fill_pairs(w, b, eta, c, roots, shapes, ends, square, decay, out, into, taken):
    """Fill what belongs to the roots."""
    n = len(w)
    for i in range(n):
        one, two = roots[i, 0], roots[i, 1]
        square[i], decay[i] = (one * two).real, -(one + two).real
        scale = 1.0 / (one - two)
        for which in range(2):
            root, other = roots[i, which], roots[i, 1 - which]
            total = 0.0j
            for j in range(n):
                if j != i:
                    total += b[j] * b[j] / (root * (root + eta * w[j] * w[j]) + w[j] * w[j])
            lead = -c * root * b[i] / (1.0 + c * root * total)
            end = norm = 0.0j
            for j in range(n):
                shape = 1.0 + 0.0j
                if j != i:
                    below = root * (root + eta * w[j] * w[j]) + w[j] * w[j]
                    shape = lead * b[j] / below
                shapes[j] = shape
                end += b[j] * shape
                norm += shape * shape * (2.0 * root + eta * w[j] * w[j])
            norm += c * end * end
            ends[i, which] = root * end
            # a = by_q Q + by_v V, of the part a exp(root t) of Q
            by_v = scale if which == 0 else -scale
            by_q = -by_v * other
            for j in range(n):
                shape = shapes[j]
                out[i, j] += (by_q * shape).real
                out[i, n + j] += (by_q * root * shape).real
                out[n + i, j] += (by_v * shape).real
                out[n + i, n + j] += (by_v * root * shape).real
                # and a of offsets and velocities, since shapes are orthogonal
                of_q = ((eta * w[j] * w[j] + root) * shape + c * b[j] * end) / norm
                of_v = shape / norm
                into[j, i] += of_q.real
                into[j, n + i] += (root * of_q).real
                into[n + j, i] += of_v.real
                into[n + j, n + i] += (root * of_v).real
    for i in range(n):
        for j in range(n):
            for which in range(2):
                mine = 1.0 / (roots[i, which] - roots[i, 1 - which])
                for other in range(2):
                    theirs = 1.0 / (roots[j, other] - roots[j, 1 - other])
                    both = -ends[i, which] * ends[j, other] * mine * theirs
                    both /= roots[i, which] + roots[j, other]
                    left, right = -roots[i, 1 - which], -roots[j, 1 - other]
                    taken[i, j] += (both * left * right).real
                    taken[i, n + j] += (both * left).real
                    taken[n + i, j] += (both * right).real
                    taken[n + i, n + j] += both.real


@plain
def damped_pairs(frequency, ends, eta, c):
    """Return the modes of a bar with a dashpot more; none where they cannot be told apart.

    Parameters
    ----------
    frequency : ndarray, shape (n,)
        Of the plain modes, none rigid [rad/s].
    ends : ndarray, shape (n,)
        Their offsets at the rock end [1/kg^0.5].
    eta : float
        Kelvin-Voigt time [s].
    c : float
        Of the dashpot, negative where eq. 4 has too much [N s/m].

    Returns
    -------
    Pairs
    """
    n = len(frequency)
    roots, at_end = np.zeros((n, 2), np.complex128), np.zeros((n, 2), np.complex128)
    if not _find_roots(frequency, ends, eta, c, roots):
        n = 0
    shapes = np.zeros(n, np.complex128)
    square, decay = np.zeros(n), np.zeros(n)
    out, into, taken = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
    if n > 0:
        _fill_pairs(frequency, ends, eta, c, roots, shapes, at_end, square, decay, out, into, taken)
    return Pairs(square, decay, out, into, taken)
