"""What does not change of the bars: moves of their modes, and changes from one form to another.

A form says which bars move as one and what the rock end stands on: the bit by itself, or joined
to the piston that it touches; free, or on the rock's spring K_R or gamma K_R
(docs/modal.md, section 2).
"""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.kernel import kernel
from percussion_model.scene.bars import AREA, LENGTH, YOUNGS_MODULUS, bar_mass, section_mass
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.modal.modes import (
    Modes,
    bar_modes,
    count_below,
    products,
    totals,
    with_residual,
)
from percussion_model.solvers.modal.records import JOINED, LEVELS, Forms, Move, Shape
from percussion_model.solvers.modal.resolution import MOST_MODES
from percussion_model.solvers.setup import refuse_many

# Factors of a move below this are zero: what they leave would only slow down arithmetic.
NOTHING = 1e-40
# Nodes and weights by which the loss over a tick is integrated.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


@kernel
def _move(w, delta, h):
    """Offset and velocity after `h` by those before: x'' + 2 delta x' + w^2 x = 0."""
    square = w * w - delta * delta
    if square > 0.0:
        root = math.sqrt(square)
        decay = math.exp(-delta * h)
        c, s = decay * math.cos(root * h), decay * math.sin(root * h) / root
    else:
        root = math.sqrt(-square)
        slow, fast = math.exp((root - delta) * h), math.exp(-(root + delta) * h)
        c = 0.5 * (slow + fast)
        s = h * slow if root == 0.0 else 0.5 * (slow - fast) / root
    return c + delta * s, s, -w * w * s, c - delta * s


@kernel
def _fill_moves(w, eta, tick, nodes, weights, out):
    """Fill the table of moves, shape (LEVELS, len(Move), n)."""
    for k in range(len(w)):
        delta = 0.5 * eta * w[k] * w[k]
        qq = qv = vv = 0.0
        for i in range(len(nodes)):
            _, _, vq, v = _move(w[k], delta, 0.5 * tick * (1.0 + nodes[i]))
            share = tick * delta * weights[i]
            qq += share * vq * vq
            qv += share * 2.0 * vq * v
            vv += share * v * v
        for level in range(out.shape[0]):
            h = tick * 2.0**level
            a, b, c, d = _move(w[k], delta, h)
            row = out[level]
            row[Move.LOSS_QQ, k], row[Move.LOSS_QV, k], row[Move.LOSS_VV, k] = qq, qv, vv
            # twice as long: the first half, and what is left after it
            qq, qv, vv = (
                qq + a * a * qq + a * c * qv + c * c * vv,
                qv + 2.0 * a * b * qq + (a * d + b * c) * qv + 2.0 * c * d * vv,
                vv + b * b * qq + b * d * qv + d * d * vv,
            )
            if w[k] == 0.0:
                row[Move.YIELD, k] = 0.5 * h * h
            elif abs(a) + abs(b) * w[k] + abs(c) / w[k] + abs(d) < NOTHING:
                a = b = c = d = 0.0
            if w[k] > 0.0:
                row[Move.YIELD, k] = (1.0 - a) / (w[k] * w[k])
            row[Move.Q_BY_Q, k], row[Move.Q_BY_V, k] = a, b
            row[Move.V_BY_Q, k], row[Move.V_BY_V, k] = c, d


def moves_of(frequency: np.ndarray, eta: float, tick: float) -> np.ndarray:
    """Table of moves over 2^level ticks, shape (LEVELS, len(Move), n)."""
    out = np.zeros((LEVELS, len(Move), len(frequency)))
    _fill_moves(frequency, eta, tick, _NODES, _WEIGHTS, out)
    return out


def _lanes(count: int) -> int:
    """So many modes, in whole lanes."""
    return max(1, -(-count // WIDTH)) * WIDTH


def _shapes(modes: Modes, parts: tuple[int, int]) -> np.ndarray:
    """Rows of `Shape` of a bar whose first sections, so many, are the piston's."""
    above, whole = parts
    row = np.zeros((len(Shape), len(modes.frequency)))
    w = modes.frequency
    row[Shape.LOW], row[Shape.TOP] = modes.low, modes.above(above)
    row[Shape.STIFF] = w * w
    row[Shape.SOFT, w > 0.0] = 1.0 / w[w > 0.0] ** 2
    row[Shape.BIT] = totals(modes, above, whole - above)
    row[Shape.PISTON] = modes.top_mass * modes.above(0)
    if above:
        row[Shape.PISTON] = totals(modes, 0, above)
    return row


def forms_of(
    bit: np.ndarray,
    piston: np.ndarray | None,
    piston_mass: float,
    springs: tuple[float, float],
    highest: float,
    eta: float,
    tick: float,
) -> tuple[Forms, list[Modes], Modes | None]:
    """Tables of all forms, their modes, and those of the free piston.

    Parameters
    ----------
    bit : ndarray, shape (sections, 4)
        From top to bottom.
    piston : ndarray or None
        Sections of an elastic one.
    piston_mass : float
        0 where there is none [kg].
    springs : (float, float)
        K_R and gamma K_R [N/m]; a form of 0 is left empty.
    highest : float
        Angular frequency up to which there are modes, and some more [rad/s].
    eta : float
        Kelvin-Voigt time [s].
    tick : float
        Unit of time [s].
    """
    n_bit = _lanes(count_below(bit, highest) + 1)
    above = n_piston = 0
    if piston is not None:
        above, n_piston = len(piston), _lanes(count_below(piston, highest))
    both = bit if piston is None else np.vstack([piston, bit])
    n = n_bit + n_piston if piston_mass else n_bit
    refuse_many("modes", n, MOST_MODES, ', or take waves (solver.name = "wave")')
    free = None if piston is None else bar_modes(piston, n_piston + 1)
    sizes, stiff = np.zeros(6, np.int64), np.array([0.0, *springs] * 2)
    shape, move = np.zeros((6, len(Shape), n)), np.zeros((6, LEVELS, len(Move), n))
    change, join = np.zeros((6, JOINED, n, n)), np.zeros((JOINED, max(n_piston, 1), n))
    found: list[Modes] = []
    for form in range(6):
        joined = form >= JOINED
        rigid = piston_mass if joined and piston is None else 0.0
        count = n if joined else n_bit
        modes = bar_modes(both if joined else bit, count, stiff[form], rigid)
        if stiff[form] > 0.0:
            modes = with_residual(modes, stiff[form])
        found.append(modes)
        if (joined and not piston_mass) or (form % JOINED and stiff[form] == 0.0):
            continue
        sizes[form] = count
        first = above if joined else 0
        shape[form, :, :count] = _shapes(modes, (first, len(modes.mass)))
        move[form, :, :, :count] = moves_of(modes.frequency, eta, tick)
    for one in range(6):
        for other in range(6):
            if one == other or not sizes[one] or not sizes[other]:
                continue
            if one % JOINED != other % JOINED and one // JOINED != other // JOINED:
                continue
            a, b = found[one], found[other]
            if one // JOINED == other // JOINED:
                part = products(b, 0, a, 0, len(a.mass))
            elif one < JOINED:
                part = products(b, above, a, 0, len(bit))
            else:
                part = products(b, 0, a, above, len(bit))
            change[one, other % JOINED, : part.shape[1], : part.shape[0]] = part.T
    if free is not None:
        for form in range(JOINED):
            if sizes[JOINED + form]:
                part = products(found[JOINED + form], 0, free, 0, above)[:, 1:]
                join[form, :n_piston, : len(part)] = part.T
    ends = shape[:, None, Shape.LOW] ** 2 * move[:, :, Move.YIELD]
    yields = np.ascontiguousarray(np.cumsum(ends, axis=2)[:, :, WIDTH - 1 :: WIDTH])
    return Forms(sizes, stiff, shape, move, yields, change, join), found, free


def piston_tables(free: Modes | None, eta: float, tick: float) -> tuple[np.ndarray, np.ndarray]:
    """Shapes and moves of the elastic modes of a free piston."""
    if free is None:
        return np.zeros((len(Shape), 0)), np.zeros((LEVELS, len(Move), 0))
    elastic = free._replace(
        **{name: getattr(free, name)[1:] for name in ("frequency", "wave", "size", "phase", "last")}
    )
    shape = _shapes(elastic, (0, len(free.mass)))
    return shape, moves_of(elastic.frequency, eta, tick)


def end_compliance(sections: np.ndarray) -> float:
    """Offset of the low end from the mean of a free bar, by a constant force there [m/N].

    The sum of shape^2 / frequency^2 over all modes. The bar's own inertia balances the force,
    so that a section carries the share of it that the mass above is of all.
    """
    whole, above, total = bar_mass(sections), 0.0, 0.0
    for section in sections:
        first = above / whole
        above += section_mass(section)
        last = above / whole
        flexible = float(section[LENGTH]) / float(section[YOUNGS_MODULUS] * section[AREA])
        total += flexible * (first * first + first * last + last * last) / 3.0
    return total
