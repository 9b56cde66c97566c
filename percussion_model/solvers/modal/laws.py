"""Tables of the laws by which a bit alone moves (docs/modal.md, section 4)."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.kernel import kernel
from percussion_model.solvers.modal.damped import Pairs, damped_pairs
from percussion_model.solvers.modal.records import (
    JOINED,
    LEVELS,
    SCAN,
    STEP,
    VIEWS,
    End,
    Forms,
    Go,
    Laws,
    Shape,
    View,
)

# Factors of a move below this are zero: what they leave would only slow down arithmetic.
NOTHING = 1e-40
# A bit with more modes is stepped: tables would take hundreds of megabytes.
MOST_PAIRS = 400


@kernel
def _times(matrix, row, out):
    for i in range(matrix.shape[0]):
        total = 0.0
        for k in range(len(row)):
            total += matrix[i, k] * row[k]
        out[i] = total


def _product(matrix: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Product in an order of its own: BLAS sums otherwise on other processors."""
    out = np.zeros(len(matrix))
    _times(np.ascontiguousarray(matrix), np.ascontiguousarray(row), out)
    return out


def _ends_of(shape: np.ndarray, pairs: Pairs) -> np.ndarray:
    """Rows of `End` by those of `Shape`."""
    n = shape.shape[1]
    rows = np.zeros((End.ROWS, n))
    offsets, velocities = pairs.out[:, :n], pairs.out[:, n:]
    for end, part, row in (
        (End.LOW, offsets, Shape.LOW),
        (End.SPEED, velocities, Shape.LOW),
        (End.TOP, offsets, Shape.TOP),
        (End.BIT, offsets, Shape.BIT),
        (End.BIT_SPEED, velocities, Shape.BIT),
    ):
        by = _product(part, shape[row])
        rows[end], rows[end + 1] = by[:n], by[n:]
    shift = _product(pairs.into[:n].T, shape[Shape.BIT])
    rows[End.SHIFT], rows[End.SHIFT + 1] = shift[:n], shift[n:]
    rows[End.SQUARE] = pairs.square
    return rows


@kernel
def _go(square, decay, h):
    """Offset and velocity of a pair after `h`, by those before."""
    delta = 0.5 * decay
    rest = square - delta * delta
    root = math.sqrt(abs(rest))
    if rest > 0.0:
        fade = math.exp(-delta * h)
        c, s = fade * math.cos(root * h), fade * math.sin(root * h) / root
    else:
        slow, fast = math.exp((root - delta) * h), math.exp(-(root + delta) * h)
        c = 0.5 * (slow + fast)
        s = h * slow if root == 0.0 else 0.5 * (slow - fast) / root
    a, b, v, d = c + delta * s, s, -square * s, c - delta * s
    if square > 0.0 and abs(a) + abs(b) * math.sqrt(square) + abs(d) < NOTHING:
        a = b = v = d = 0.0
    return a, b, v, d


@kernel
def _fill_goes(square, decay, tick, ends, move, views):
    """Fill the tables of moves and views of a law."""
    for k in range(len(square)):
        for level in range(move.shape[0]):
            h = tick * 2.0**level
            go = _go(square[k], decay[k], h)
            for row in range(4):
                move[level, row, k] = go[row]
            if square[k] == 0.0:
                move[level, Go.YIELD, k] = 0.5 * h * h
        for i in range(views.shape[0]):
            h = tick * 2.0**i
            if i >= STEP:
                h = tick * 2.0 ** (STEP + (i - STEP) // SCAN) * ((i - STEP) % SCAN + 1)
            qq, qv, vq, vv = _go(square[k], decay[k], h)
            for row, end in ((View.LOW_Q, End.LOW), (View.SPEED_Q, End.SPEED)):
                views[i, row, k] = ends[end, k] * qq + ends[end + 1, k] * vq
                views[i, row + 1, k] = ends[end, k] * qv + ends[end + 1, k] * vv


def laws_of(forms: Forms, dashpot: float, eta: float, tick: float) -> Laws:
    """Tables of all laws; the pairs of a free bit are its own modes.

    Parameters
    ----------
    forms : Forms
    dashpot : float
        Of the rock [N s/m].
    eta, tick : float
        Kelvin-Voigt time and unit of time [s].
    """
    n = int(forms.sizes[0])
    count = 2 * JOINED
    sizes, dashpots = np.zeros(count, np.int64), np.zeros(count)
    move, ends = np.zeros((count, LEVELS, len(Go), n)), np.zeros((count, End.ROWS, n))
    views = np.zeros((count, VIEWS, len(View), n))
    out, into, taken = (np.zeros((count, 2 * n, 2 * n)) for _ in range(3))
    for law in range(count):
        form, damped = law // 2, law % 2 == 1
        held = float(forms.stiff[form])
        if not forms.sizes[form] or n > MOST_PAIRS or (damped and (form == 0 or dashpot == 0.0)):
            continue
        shape = forms.shape[form, :, :n]
        stiff = np.ascontiguousarray(shape[Shape.STIFF])
        if form == 0:
            unit = np.eye(2 * n)
            pairs = Pairs(stiff, eta * stiff, unit, unit, 0.0 * unit)
        else:
            c = (dashpot if damped else 0.0) - eta * held
            low = np.ascontiguousarray(shape[Shape.LOW])
            found = damped_pairs(np.sqrt(stiff), low, eta, c)
            if found is None:
                continue
            pairs = found
            out[law], into[law], taken[law] = pairs.out, pairs.into, pairs.taken
        sizes[law], dashpots[law] = n, dashpot if damped else 0.0
        ends[law] = _ends_of(shape, pairs)
        _fill_goes(pairs.square, pairs.decay, tick, ends[law], move[law], views[law])
    return Laws(sizes, dashpots, move, ends, views, out, into, taken)
