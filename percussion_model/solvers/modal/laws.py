"""Tables of the laws by which a bit alone moves (docs/modal.md, section 4)."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.elementary import cos_and_sin, exp, power_of_two
from percussion_model.physics.kernel import inlined, kernel, plain
from percussion_model.solvers.modal.damped import Pairs, damped_pairs
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.modal.records import (
    JOINED,
    LEVELS,
    LONGEST_HOP,
    SCAN,
    STEP,
    End,
    Go,
    Laws,
    Rest,
    Shape,
    View,
)

# Factors of a move below this are zero: what they leave would only slow down arithmetic.
NOTHING = 1e-40
# Laws of which the second may follow the first: FF 0, FC 2, DFC 3, BC 4, SS 5.
FOLLOWERS = (
    (0, 2), (0, 3), (0, 5), (2, 4), (3, 2), (3, 4), (4, 0), (4, 2), (4, 3), (4, 5),
    (5, 0), (5, 2), (5, 3), (5, 4),
)  # fmt: skip
# Tables from law to law cost cubes of the modes to make: with more pairs go by way of the modes.
MOST_TO_PASS = 200
# A bit with more modes is stepped: tables would take hundreds of megabytes.
MOST_PAIRS = 400
GOES, VIEWS, RESTS = len(Go), len(View), len(Rest)


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


@plain
def _matrix(a, b):
    """Product of matrices in an order of its own."""
    out = np.zeros((a.shape[0], b.shape[1]))
    _multiply(a, b, out)
    return out


@plain
def _product(matrix, row):
    """Product in an order of its own: BLAS sums otherwise on other processors."""
    out = np.zeros(len(matrix))
    _times(matrix, row, out)
    return out


@plain
def _fill_end(rows, end, part, row):
    """Fill a row of `End`, and the one after it, by offsets or velocities of the modes."""
    n = rows.shape[1]
    by = _product(part, row)
    rows[end], rows[end + 1] = by[:n], by[n:]


@plain
def _ends_of(shape, pairs, eta):
    """Rows of `End` by those of `Shape`."""
    n = shape.shape[1]
    rows = np.zeros((End.ROWS, n))
    offsets = np.ascontiguousarray(pairs.out[:, :n])
    velocities = np.ascontiguousarray(pairs.out[:, n:])
    low, bit, piston = shape[Shape.LOW], shape[Shape.BIT], shape[Shape.PISTON]
    _fill_end(rows, End.LOW, offsets, low)
    _fill_end(rows, End.SPEED, velocities, low)
    _fill_end(rows, End.TOP, offsets, shape[Shape.TOP])
    _fill_end(rows, End.BIT, offsets, bit)
    _fill_end(rows, End.BIT_SPEED, velocities, bit)
    _fill_end(rows, End.PISTON, offsets, piston)
    _fill_end(rows, End.PISTON_SPEED, velocities, piston)
    _fill_end(rows, End.PULL, -(offsets + eta * velocities) * shape[Shape.STIFF], piston)
    _fill_end(rows, End.SHIFT, np.ascontiguousarray(pairs.into[:n].T), bit + piston)
    alone = pairs.into[n - 1] / low[n - 1]
    rows[End.YIELD], rows[End.YIELD + 1] = alone[:n], alone[n:]
    rows[End.SQUARE] = pairs.square
    return rows


@kernel
def _fold(form):
    n = len(form) // 2
    for i in range(2 * n):
        for j in range(2 * n):
            mine, other = (i % n) // WIDTH, (j % n) // WIDTH
            if other > mine:
                form[i, j] *= 2.0
            elif other < mine:
                form[i, j] *= 0.0


@plain
def _folded(form):
    """A symmetric form of numbers Q and V with what lies below its blocks of lanes added above."""
    out = form.copy()
    _fold(out)
    return out


@kernel
def _go(square, decay, h):
    """Offset and velocity of a pair after `h`, by those before."""
    delta = 0.5 * decay
    rest = square - delta * delta
    root = math.sqrt(abs(rest))
    if rest > 0.0:
        fade = exp(-delta * h)
        c, s = cos_and_sin(root * h)
        c, s = fade * c, fade * s / root
    else:
        slow, fast = exp((root - delta) * h), exp(-(root + delta) * h)
        c = 0.5 * (slow + fast)
        s = h * slow if root == 0.0 else 0.5 * (slow - fast) / root
    a, b, v, d = c + delta * s, s, -square * s, c - delta * s
    if square > 0.0 and abs(a) + abs(b) * math.sqrt(square) + abs(d) < NOTHING:
        a = b = v = d = 0.0
    return a, b, v, d


@inlined
def _view(go, one, other):
    """What a pair tells after a move, by Q and V, of what two rows tell now by Q and V."""
    qq, qv, vq, vv = go[0], go[1], go[2], go[3]
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
            h = tick * power_of_two(level)
            go = _go(square[k], decay[k], h)
            for row in range(4):
                move[level, row, k] = go[row]
            if square[k] == 0.0:
                move[level, Go.YIELD, k] = 0.5 * h * h


@kernel
def _fill_views(move, ends, views):
    """Fill the table of what a law's pairs tell of the rock end later."""
    for k in range(ends.shape[1]):
        low, speed = ends[End.LOW : End.LOW + 2, k], ends[End.SPEED : End.SPEED + 2, k]
        for level in range(views.shape[0]):
            view = _view(move[level, :, k], low, speed)
            for row in range(4):
                views[level, row, k] = view[row]


@kernel
def _fill_looks(square, decay, tick, move, looks):
    """Fill moves to the next looks, shape (hops, SCAN, 4), of one pair.

    Those after 2^level looks are in the table of moves, and each other one is a few times that of
    a finer hop: the same bits, since such a factor is exact.
    """
    for hop in range(looks.shape[0]):
        for look in range(SCAN):
            ticks, level = look + 1, STEP + hop
            while ticks % 2 == 0:
                ticks, level = ticks // 2, level + 1
            if ticks == 1:
                for row in range(4):
                    looks[hop, look, row] = move[level, row]
            elif hop > 0 and 2 * (look + 1) <= SCAN:
                for row in range(4):
                    looks[hop, look, row] = looks[hop - 1, 2 * look + 1, row]
            else:
                go = _go(square, decay, tick * power_of_two(STEP + hop) * (look + 1))
                for row in range(4):
                    looks[hop, look, row] = go[row]


@kernel
def _fill_scans(square, decay, tick, move, ends, other, looks, scans, sides):
    """Fill the tables of what a law's rows tell at the next looks, of the rock end and beside it.

    Parameters
    ----------
    other : int
        Row of `End` that is beside the piston's velocity.
    looks : ndarray
        Room for `_fill_looks`.
    """
    for k in range(len(square)):
        low, speed = ends[End.LOW : End.LOW + 2, k], ends[End.SPEED : End.SPEED + 2, k]
        second = ends[End.PISTON_SPEED : End.PISTON_SPEED + 2, k]
        first = ends[other : other + 2, k]
        _fill_looks(square[k], decay[k], tick, move[:, :, k], looks)
        for hop in range(scans.shape[0]):
            for look in range(SCAN):
                scan = _view(looks[hop, look], low, speed)
                side = _view(looks[hop, look], first, second)
                for row in range(4):
                    scans[hop, 4 * k + row, look] = scan[row]
                    sides[hop, 4 * k + row, look] = side[row]


@plain
def _rest(shape):
    """Offsets of the modes where loads hold them that accelerate a free bit by 1 m/s2 [m]."""
    return shape[Shape.SOFT] * shape[Shape.BIT]


@plain
def _put(room, table):
    """Put a table into room for as many numbers, or more, in each of its four quarters."""
    n, most = len(table) // 2, len(room) // 2
    for row in range(2):
        for column in range(2):
            quarter = table[row * n : (row + 1) * n, column * n : (column + 1) * n]
            room[row * most : row * most + n, column * most : column * most + n] = quarter


@plain
def _got(room, n):
    """A table as it was put there."""
    most = len(room) // 2
    table = np.zeros((2 * n, 2 * n))
    for row in range(2):
        for column in range(2):
            quarter = room[row * most : row * most + n, column * most : column * most + n]
            table[row * n : (row + 1) * n, column * n : (column + 1) * n] = quarter
    return table


@plain
def _pass(forms, one, other, out, into):
    """Table from the pairs of a law to those of another, and what an acceleration adds."""
    n = forms.sizes[0]
    form, then = one // 2, other // 2
    change = np.eye(n)
    if form != then:
        change = np.ascontiguousarray(forms.change[form, then, :n, :n])
    rest = _product(np.ascontiguousarray(change.T), _rest(forms.shape[form, :, :n]))
    rest -= _rest(forms.shape[then, :, :n])
    rows = _got(out[one], n) if form else np.eye(2 * n)
    table, push = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
    table[:, :n] = _matrix(np.ascontiguousarray(rows[:, :n]), change)
    table[:, n:] = _matrix(np.ascontiguousarray(rows[:, n:]), change)
    push[:n] = rest
    if then:
        back = _got(into[other], n)
        table, push = _matrix(table, back), _product(np.ascontiguousarray(back.T), push)
    return table, push


@plain
def _over(forms, sizes, out, into):
    """Tables from the pairs of a law to those that may follow: `way`, `over`, `pushed`."""
    n = forms.sizes[0]
    way = np.full((2 * JOINED, 2 * JOINED), -1)
    count = 0
    for one, other in FOLLOWERS:
        if sizes[one] > 0 and sizes[other] > 0 and n <= MOST_TO_PASS:
            way[one, other] = count
            count += 1
    over, pushed = np.zeros((max(count, 1), 2 * n, 2 * n)), np.zeros((max(count, 1), 2, n))
    for one, other in FOLLOWERS:
        if way[one, other] >= 0:
            table, push = _pass(forms, one, other, out, into)
            over[way[one, other]] = table
            pushed[way[one, other], 0], pushed[way[one, other], 1] = push[:n], push[n:]
    return way, over, pushed


@plain
def _fill_held(pairs, loads, rows):
    """Fill a table of `Laws.held`, by what `_rest` tells; what is taken from there on."""
    n = rows.shape[1]
    at = _product(np.ascontiguousarray(pairs.into[: len(loads)].T), loads)
    twice = 2.0 * _product(pairs.taken, at)
    rows[0], rows[1], rows[2], rows[3] = at[:n], at[n:], twice[:n], twice[n:]
    whole = 0.0
    for k in range(len(at)):
        whole += 0.5 * at[k] * twice[k]
    return whole


@plain
def _pairs_of(shape, held, dashpot, eta):
    """Pairs of a law: of a free form its modes, else damped modes, none where there are none."""
    n, stiff = shape.shape[1], shape[Shape.STIFF]
    if held == 0.0:
        unit = np.eye(2 * n)
        return Pairs(stiff, eta * stiff, unit, unit, np.zeros((2 * n, 2 * n)))
    return damped_pairs(np.sqrt(stiff), shape[Shape.LOW], eta, dashpot - eta * held)


@plain
def laws_of(forms, dashpot, eta, tick):
    """Tables of all laws; the pairs of a free bit are its own modes.

    Parameters
    ----------
    forms : Forms
    dashpot : float
        Of the rock [N s/m].
    eta, tick : float
        Kelvin-Voigt time and unit of time [s].

    Returns
    -------
    Laws
    """
    alone, most = forms.sizes[0], 0
    for size in forms.sizes:
        most = max(most, size)
    most = most if most <= MOST_PAIRS else alone if alone <= MOST_PAIRS else 0
    count, hops = 4 * JOINED, LONGEST_HOP - STEP + 1
    sizes, dashpots = np.zeros(count, np.int64), np.zeros(count)
    move, ends = np.zeros((count, LEVELS, GOES, most)), np.zeros((count, End.ROWS, most))
    out = np.zeros((count, 2 * most, 2 * most))
    into, taken = np.zeros_like(out), np.zeros_like(out)
    views = np.zeros((2 * JOINED, LONGEST_HOP + 1, VIEWS, alone))
    scans = np.zeros((count, hops, most * VIEWS, SCAN))
    sides, rest = np.zeros_like(scans), np.zeros((2 * JOINED, RESTS))
    held_by, looks = np.zeros((2 * JOINED, 4, alone)), np.zeros((hops, SCAN, 4))
    for law in range(count):
        form, damped = law // 2, law % 2 == 1
        n, held = forms.sizes[form], forms.stiff[form]
        if not 0 < n <= most or (damped and (held == 0.0 or dashpot == 0.0)):
            continue
        shape = np.ascontiguousarray(forms.shape[form, :, :n])
        pairs = _pairs_of(shape, held, dashpot if damped else 0.0, eta)
        if len(pairs.square) == 0:
            continue
        if held > 0.0:
            _put(out[law], pairs.out)
            _put(into[law], pairs.into)
            _put(taken[law], _folded(pairs.taken))
        sizes[law], dashpots[law] = n, dashpot if damped else 0.0
        own = _ends_of(shape, pairs, eta)
        ends[law, :, :n] = own
        square, decay = pairs.square, pairs.decay
        _fill_goes(square, decay, tick, move[law])
        other = End.PULL.value
        if law < 2 * JOINED:
            other, loads = End.TOP.value, _rest(shape)
            for row, place in ((Rest.LOW, Shape.LOW), (Rest.TOP, Shape.TOP), (Rest.BIT, Shape.BIT)):
                rest[law, row] = _product(shape[place : place + 1], loads)[0]
            if held > 0.0:
                rest[law, Rest.TAKEN] = _fill_held(pairs, loads, held_by[law])
            _fill_views(move[law], own, views[law])
        _fill_scans(square, decay, tick, move[law], own, other, looks, scans[law], sides[law])
    way, over, pushed = _over(forms, sizes, out, into)
    return Laws(
        sizes, dashpots, move, ends, out, into, taken, rest, views, scans, sides, way, over, pushed,
        held_by,
    )  # fmt: skip
