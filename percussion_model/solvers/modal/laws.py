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


def _ends_of(shape: np.ndarray, pairs: Pairs, eta: float) -> np.ndarray:
    """Rows of `End` by those of `Shape`."""
    n = shape.shape[1]
    rows = np.zeros((End.ROWS, n))
    offsets, velocities = pairs.out[:, :n], pairs.out[:, n:]
    bent = offsets + eta * velocities
    for end, part, row in (
        (End.LOW, offsets, Shape.LOW),
        (End.SPEED, velocities, Shape.LOW),
        (End.TOP, offsets, Shape.TOP),
        (End.BIT, offsets, Shape.BIT),
        (End.BIT_SPEED, velocities, Shape.BIT),
        (End.PISTON, offsets, Shape.PISTON),
        (End.PISTON_SPEED, velocities, Shape.PISTON),
        (End.PULL, -bent * shape[Shape.STIFF], Shape.PISTON),
    ):
        by = _product(part, shape[row])
        rows[end], rows[end + 1] = by[:n], by[n:]
    shift = _product(pairs.into[:n].T, shape[Shape.BIT] + shape[Shape.PISTON])
    rows[End.SHIFT], rows[End.SHIFT + 1] = shift[:n], shift[n:]
    alone = pairs.into[n - 1] / shape[Shape.LOW, n - 1]
    rows[End.YIELD], rows[End.YIELD + 1] = alone[:n], alone[n:]
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
def _view(square, decay, one, other, h):
    """What a pair tells after `h`, by Q and V, of what two rows tell now by Q and V."""
    qq, qv, vq, vv = _go(square, decay, h)
    return (
        one[0] * qq + one[1] * vq,
        one[0] * qv + one[1] * vv,
        other[0] * qq + other[1] * vq,
        other[0] * qv + other[1] * vv,
    )


@kernel
def _fill_goes(square, decay, tick, move):
    """Fill the table of moves of a law."""
    for k in range(len(square)):
        for level in range(move.shape[0]):
            h = tick * 2.0**level
            go = _go(square[k], decay[k], h)
            for row in range(4):
                move[level, row, k] = go[row]
            if square[k] == 0.0:
                move[level, Go.YIELD, k] = 0.5 * h * h


@kernel
def _fill_views(square, decay, tick, ends, views):
    """Fill the table of what a law's pairs tell of the rock end later."""
    for k in range(len(square)):
        low, speed = ends[End.LOW : End.LOW + 2, k], ends[End.SPEED : End.SPEED + 2, k]
        for level in range(views.shape[0]):
            view = _view(square[k], decay[k], low, speed, tick * 2.0**level)
            for row in range(4):
                views[level, row, k] = view[row]


@kernel
def _fill_scans(square, decay, tick, ends, one, other, scans):
    """Fill a table of what two of a law's rows tell at the next looks."""
    for k in range(len(square)):
        first, second = ends[one : one + 2, k], ends[other : other + 2, k]
        for hop in range(scans.shape[0]):
            for look in range(SCAN):
                h = tick * 2.0 ** (STEP + hop) * (look + 1)
                view = _view(square[k], decay[k], first, second, h)
                for row in range(4):
                    scans[hop, 4 * k + row, look] = view[row]


def _rest(shape: np.ndarray) -> np.ndarray:
    """Offsets of the modes where loads hold them that accelerate a free bit by 1 m/s2 [m]."""
    return np.asarray(shape[Shape.SOFT] * shape[Shape.BIT])


def _put(room: np.ndarray, table: np.ndarray) -> None:
    """Put a table into room for as many numbers, or more, in each of its four quarters."""
    n, most = len(table) // 2, len(room) // 2
    for row in range(2):
        for column in range(2):
            quarter = table[row * n : (row + 1) * n, column * n : (column + 1) * n]
            room[row * most : row * most + n, column * most : column * most + n] = quarter


def _got(room: np.ndarray, n: int) -> np.ndarray:
    """A table as it was put there."""
    most = len(room) // 2
    return np.ascontiguousarray(room.reshape(2, most, 2, most)[:, :n, :, :n].reshape(2 * n, 2 * n))


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
            rows = _got(out[one], n) if form else np.eye(2 * n)
            table = np.hstack([_matrix(rows[:, :n], change), _matrix(rows[:, n:], change)])
            push = np.append(rest, np.zeros(n))
            if then:
                back = _got(into[other], n)
                table, push = _matrix(table, back), _product(back.T, push)
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
    alone, most = int(forms.sizes[0]), int(forms.sizes.max())
    most = most if most <= MOST_PAIRS else alone if alone <= MOST_PAIRS else 0
    count = 4 * JOINED
    sizes, dashpots = np.zeros(count, np.int64), np.zeros(count)
    move, ends = np.zeros((count, LEVELS, len(Go), most)), np.zeros((count, End.ROWS, most))
    out, into, taken = (np.zeros((count, 2 * most, 2 * most)) for _ in range(3))
    views = np.zeros((2 * JOINED, LONGEST_HOP + 1, len(View), alone))
    scans, sides = np.zeros((2, count, LONGEST_HOP - STEP + 1, most * len(View), SCAN))
    rest = np.zeros((2 * JOINED, len(Rest)))
    for law in range(count):
        form, damped = law // 2, law % 2 == 1
        n, held = int(forms.sizes[form]), float(forms.stiff[form])
        if not 0 < n <= most or (damped and (held == 0.0 or dashpot == 0.0)):
            continue
        shape = np.ascontiguousarray(forms.shape[form, :, :n])
        stiff = shape[Shape.STIFF]
        if held == 0.0:
            unit = np.eye(2 * n)
            pairs = Pairs(stiff, eta * stiff, unit, unit, 0.0 * unit)
        else:
            c = (dashpot if damped else 0.0) - eta * held
            found = damped_pairs(np.sqrt(stiff), shape[Shape.LOW], eta, c)
            if found is None:
                continue
            pairs = found
            _put(out[law], pairs.out)
            _put(into[law], pairs.into)
            _put(taken[law], _folded(pairs.taken))
        sizes[law], dashpots[law] = n, dashpot if damped else 0.0
        own = _ends_of(shape, pairs, eta)
        ends[law, :, :n] = own
        _fill_goes(pairs.square, pairs.decay, tick, move[law])
        if law < 2 * JOINED:
            rest[law] = _product(shape[[Shape.LOW, Shape.TOP, Shape.BIT]], _rest(shape))
            _fill_views(pairs.square, pairs.decay, tick, own, views[law])
        of_pairs = pairs.square, pairs.decay, tick, own
        _fill_scans(*of_pairs, int(End.LOW), int(End.SPEED), scans[law])
        other = End.TOP if law < 2 * JOINED else End.PULL
        _fill_scans(*of_pairs, int(other), int(End.PISTON_SPEED), sides[law])
    over = _over(forms, sizes, out, into)
    return Laws(sizes, dashpots, move, ends, out, into, taken, rest, views, scans, sides, *over)
