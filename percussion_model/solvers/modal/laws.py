"""Tables of the laws by which a bit alone moves (docs/modal.md, section 4)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from percussion_model.physics.kernel import kernel
from percussion_model.solvers.modal.damped import Pairs, damped_pairs
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.modal.records import (
    JOINED,
    LEVELS,
    LONGEST_HOP,
    SCAN,
    STEP,
    End,
    Forms,
    Go,
    Laws,
    Rest,
    Shape,
    View,
)

# Factors of a move below this are zero: what they leave would only slow down arithmetic.
NOTHING = 1e-40
# Laws of which one may follow another: FF 0, FC 2, DFC 3, BC 4, SS 5.
FOLLOWERS = {0: (2, 3, 5), 2: (4,), 3: (2, 4), 4: (0, 2, 3, 5), 5: (0, 2, 3, 4)}
# Tables from law to law cost cubes of the modes to make: with more pairs go by way of the modes.
MOST_TO_PASS = 200
# A bit with more modes is stepped: tables would take hundreds of megabytes.
MOST_PAIRS = 400


@kernel
def _times(matrix, row, out):
    for i in range(matrix.shape[0]):
        total = 0.0
        for k in range(len(row)):
            total += matrix[i, k] * row[k]
        out[i] = total


@kernel
def _multiply(a, b, out):
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            for j in range(b.shape[1]):
                out[i, j] += a[i, k] * b[k, j]


def _matrix(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Product of matrices in an order of its own."""
    out = np.zeros((a.shape[0], b.shape[1]))
    _multiply(np.ascontiguousarray(a), np.ascontiguousarray(b), out)
    return out


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


def _folded(form: np.ndarray) -> np.ndarray:
    """A symmetric form of numbers Q and V with what lies below its blocks of lanes added above."""
    n = len(form) // 2
    lane = np.tile(np.arange(n) // WIDTH, 2)
    twice = 1.0 + np.sign(lane[None, :] - lane[:, None])
    return np.asarray(form * twice)


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
def _view(square, decay, ends, h):
    """What a pair tells of the rock end after `h`: offset by Q and V, velocity by both."""
    qq, qv, vq, vv = _go(square, decay, h)
    low, low_v, speed, speed_v = (
        ends[End.LOW],
        ends[End.LOW + 1],
        ends[End.SPEED],
        ends[End.SPEED + 1],
    )
    return (
        low * qq + low_v * vq,
        low * qv + low_v * vv,
        speed * qq + speed_v * vq,
        speed * qv + speed_v * vv,
    )


@kernel
def _fill_goes(square, decay, tick, ends, move, views, scans):
    """Fill the tables of moves and of what is seen ahead of a law."""
    for k in range(len(square)):
        for level in range(move.shape[0]):
            h = tick * 2.0**level
            go = _go(square[k], decay[k], h)
            for row in range(4):
                move[level, row, k] = go[row]
            if square[k] == 0.0:
                move[level, Go.YIELD, k] = 0.5 * h * h
        for level in range(views.shape[0]):
            view = _view(square[k], decay[k], ends[:, k], tick * 2.0**level)
            for row in range(4):
                views[level, row, k] = view[row]
        for hop in range(scans.shape[0]):
            for look in range(SCAN):
                h = tick * 2.0 ** (STEP + hop) * (look + 1)
                view = _view(square[k], decay[k], ends[:, k], h)
                for row in range(4):
                    scans[hop, 4 * k + row, look] = view[row]


def _rest(shape: np.ndarray) -> np.ndarray:
    """Offsets of the modes where loads hold them that accelerate a free bit by 1 m/s2 [m]."""
    return np.asarray(shape[Shape.SOFT] * shape[Shape.BIT])


class _Over(NamedTuple):
    """Tables from law to law, as `Laws` has them."""

    way: np.ndarray
    over: np.ndarray
    pushed: np.ndarray


def _over(forms: Forms, sizes: np.ndarray, out: np.ndarray, into: np.ndarray) -> _Over:
    """Tables from the pairs of a law to those that may follow."""
    n = int(forms.sizes[0])
    way = np.full((2 * JOINED, 2 * JOINED), -1)
    found: list[np.ndarray] = []
    pushed: list[np.ndarray] = []
    for one, followers in FOLLOWERS.items():
        for other in followers:
            if not sizes[one] or not sizes[other] or n > MOST_TO_PASS:
                continue
            form, then = one // 2, other // 2
            change = forms.change[form, then, :n, :n] if form != then else np.eye(n)
            rest = _product(change.T, _rest(forms.shape[form, :, :n]))
            rest -= _rest(forms.shape[then, :, :n])
            rows = out[one] if form else np.eye(2 * n)
            table = np.hstack([_matrix(rows[:, :n], change), _matrix(rows[:, n:], change)])
            push = np.append(rest, np.zeros(n))
            if then:
                table, push = _matrix(table, into[other]), _product(into[other].T, push)
            way[one, other] = len(found)
            found.append(table)
            pushed.append(push.reshape(2, n))
    return _Over(
        way,
        np.array(found) if found else np.zeros((1, 2 * n, 2 * n)),
        np.array(pushed) if pushed else np.zeros((1, 2, n)),
    )


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
    views = np.zeros((count, LONGEST_HOP + 1, len(View), n))
    scans = np.zeros((count, LONGEST_HOP - STEP + 1, n * len(View), SCAN))
    rest = np.zeros((count, len(Rest)))
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
            out[law], into[law], taken[law] = pairs.out, pairs.into, _folded(pairs.taken)
        sizes[law], dashpots[law] = n, dashpot if damped else 0.0
        ends[law] = _ends_of(shape, pairs)
        rest[law] = _product(shape[[Shape.LOW, Shape.TOP, Shape.BIT]], _rest(shape))
        _fill_goes(pairs.square, pairs.decay, tick, ends[law], move[law], views[law], scans[law])
    over = _over(forms, sizes, out, into)
    return Laws(sizes, dashpots, rest, move, ends, views, scans, out, into, taken, *over)
