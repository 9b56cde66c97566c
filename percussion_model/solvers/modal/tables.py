"""What does not change of the bars: moves of their modes, and changes from one form to another.

A form says which bars move as one and what the rock end stands on: the bit by itself, or joined
to the piston that it touches; free, or on the rock's spring K_R or gamma K_R
(docs/modal.md, section 2).
"""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.elementary import cos_and_sin, exp, power_of_two
from percussion_model.physics.kernel import kernel, plain
from percussion_model.scene.bars import AREA, LENGTH, YOUNGS_MODULUS, bar_mass, section_mass
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.modal.modes import (
    Modes,
    bar_modes,
    count_below,
    enough_nodes,
    products,
    products_both,
    quadrature,
    shape_above,
    shape_low,
    totals,
    with_residual,
)
from percussion_model.solvers.modal.records import JOINED, LEVELS, Forms, Move, Shape

# Factors of a move below this are zero: what they leave would only slow down arithmetic.
NOTHING = 1e-40
# Squares of frequencies are 0 or above this [1/s2].
LEAST_SQUARE = 1e-300
# Nodes by which the loss over a tick is integrated.
NODES = 8
FORMS, SHAPES, MOVES = 2 * JOINED, len(Shape), len(Move)


@kernel
def _move(w, delta, h):
    """Offset and velocity after `h` by those before: x'' + 2 delta x' + w^2 x = 0."""
    square = w * w - delta * delta
    if square > 0.0:
        root = math.sqrt(square)
        decay = exp(-delta * h)
        c, s = cos_and_sin(root * h)
        c, s = decay * c, decay * s / root
    else:
        root = math.sqrt(-square)
        slow, fast = exp((root - delta) * h), exp(-(root + delta) * h)
        c = 0.5 * (slow + fast)
        s = h * slow if root == 0.0 else 0.5 * (slow - fast) / root
    return c + delta * s, s, -w * w * s, c - delta * s


@kernel
def _fill_moves(w, eta, tick, nodes, weights, out):
    """Fill the table of moves, shape (LEVELS, MOVES, n)."""
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
            h = tick * power_of_two(level)
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


@plain
def moves_of(frequency, eta, tick):
    """Table of moves over 2^level ticks, shape (LEVELS, MOVES, n)."""
    nodes, weights = quadrature(NODES)
    out = np.zeros((LEVELS, MOVES, len(frequency)))
    _fill_moves(frequency, eta, tick, nodes, weights, out)
    return out


@plain
def _lanes(count):
    """So many modes, in whole lanes."""
    return max(1, -(-count // WIDTH)) * WIDTH


@plain
def mode_counts(bit, piston, piston_mass, highest):
    """Modes of the bit by itself, of an elastic piston, and of both where they are joined.

    Parameters
    ----------
    bit, piston : ndarray, shape (sections, 4)
        Without sections the piston is not elastic.
    piston_mass : float
        0 where there is none [kg].
    highest : float
        Angular frequency up to which there are modes, and some more [rad/s].
    """
    n_bit = _lanes(count_below(bit, highest) + 1)
    n_piston = _lanes(count_below(piston, highest)) if len(piston) else 0
    return n_bit, n_piston, n_bit + n_piston if piston_mass > 0.0 else n_bit


@plain
def _shapes(modes, above):
    """Rows of `Shape` of a bar whose first sections, so many, are the piston's."""
    n = len(modes.frequency)
    row = np.zeros((SHAPES, n))
    row[Shape.LOW], row[Shape.TOP] = shape_low(modes), shape_above(modes, above)
    for k in range(n):
        w = modes.frequency[k]
        row[Shape.STIFF, k] = w * w
        # never divided by 0: compiled code divides before it asks, and some hosts trap that
        row[Shape.SOFT, k] = 1.0 / max(w * w, LEAST_SQUARE) if w > 0.0 else 0.0
    row[Shape.BIT] = totals(modes, above, len(modes.mass) - above)
    row[Shape.PISTON] = modes.top_mass * shape_above(modes, 0)
    if above > 0:
        row[Shape.PISTON] = totals(modes, 0, above)
    return row


@plain
def _modes_of_form(form, bit, both, piston_mass, counts, stiff, rules):
    """Modes of one form, the last of which yields what those left out do."""
    n_bit, n_piston, n = counts
    joined = form >= JOINED
    rigid = piston_mass if joined and n_piston == 0 else 0.0
    bar, count = (both, n) if joined else (bit, n_bit)
    modes = bar_modes(bar, count, stiff[form], rigid)
    nodes, weights = rules[1] if joined else rules[0]
    return with_residual(modes, stiff[form], nodes, weights) if stiff[form] > 0.0 else modes


@plain
def _fill_changes(found, above, sections, sizes, change):
    """Fill what the modes of one form become in another."""
    for one in range(FORMS):
        for other in range(one + 1, FORMS):
            if sizes[one] == 0 or sizes[other] == 0:
                continue
            if one % JOINED != other % JOINED and one // JOINED != other // JOINED:
                continue
            a, b = found[one], found[other]
            if one // JOINED == other // JOINED:
                there, back = products_both(b, 0, a, 0, len(a.mass))
            else:
                there, back = products_both(b, above, a, 0, sections)
            change[one, other % JOINED, : there.shape[1], : there.shape[0]] = there.T
            change[other, one % JOINED, : back.shape[1], : back.shape[0]] = back.T


@kernel
def _fill_yields(shape, move, yields):
    """Fill how far the rock end goes with the modes of so many lanes."""
    for form in range(yields.shape[0]):
        for level in range(yields.shape[1]):
            total = 0.0
            for k in range(shape.shape[2]):
                low = shape[form, Shape.LOW, k]
                total += low * low * move[form, level, Move.YIELD, k]
                if k % WIDTH == WIDTH - 1:
                    yields[form, level, k // WIDTH] = total


@plain
def forms_of(bit, piston, piston_mass, springs, highest, eta, tick):
    """Tables of all forms, their modes, and those of the free piston.

    Parameters
    ----------
    bit, piston : ndarray, shape (sections, 4)
        From top to bottom; without sections the piston is not elastic.
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

    Returns
    -------
    forms : Forms
    found : six Modes
    free : Modes
        None in it where the piston is not elastic.
    """
    counts = mode_counts(bit, piston, piston_mass, highest)
    n_bit, n_piston, n = counts
    above = len(piston)
    both = np.concatenate((piston, bit))
    stiff = np.zeros(FORMS)
    stiff[1] = stiff[JOINED + 1] = springs[0]
    stiff[2] = stiff[JOINED + 2] = springs[1]
    sizes = np.zeros(FORMS, np.int64)
    shape, move = np.zeros((FORMS, SHAPES, n)), np.zeros((FORMS, LEVELS, MOVES, n))
    change = np.zeros((FORMS, JOINED, n, n))
    join = np.zeros((JOINED, max(n_piston, 1), n))
    rules = quadrature(enough_nodes(n_bit)), quadrature(enough_nodes(n))
    found = (
        _modes_of_form(0, bit, both, piston_mass, counts, stiff, rules),
        _modes_of_form(1, bit, both, piston_mass, counts, stiff, rules),
        _modes_of_form(2, bit, both, piston_mass, counts, stiff, rules),
        _modes_of_form(3, bit, both, piston_mass, counts, stiff, rules),
        _modes_of_form(4, bit, both, piston_mass, counts, stiff, rules),
        _modes_of_form(5, bit, both, piston_mass, counts, stiff, rules),
    )
    for form in range(FORMS):
        joined = form >= JOINED
        if (joined and piston_mass == 0.0) or (form % JOINED > 0 and stiff[form] == 0.0):
            continue
        modes = found[form]
        count = sizes[form] = n if joined else n_bit
        shape[form, :, :count] = _shapes(modes, above if joined else 0)
        move[form, :, :, :count] = moves_of(modes.frequency, eta, tick)
    _fill_changes(found, above, len(bit), sizes, change)
    free = bar_modes(both[:above], n_piston + 1 if above else 0)
    for form in range(JOINED):
        if above and sizes[JOINED + form]:
            part = products(found[JOINED + form], 0, free, 0, above)
            join[form, :n_piston, : len(part)] = part[:, 1:].T
    yields = np.zeros((FORMS, LEVELS, n // WIDTH))
    _fill_yields(shape, move, yields)
    return Forms(sizes, stiff, shape, move, yields, change, join), found, free


@plain
def piston_tables(free, eta, tick):
    """Shapes and moves of the elastic modes of a free piston."""
    if len(free.frequency) == 0:
        return np.zeros((SHAPES, 0)), np.zeros((LEVELS, MOVES, 0))
    # copies, whose types are those of other modes: kernels are compiled for each type
    elastic = Modes(
        free.frequency[1:].copy(), free.wave[1:].copy(), free.size[1:].copy(),
        free.phase[1:].copy(), free.last[1:].copy(),
        free.impedance, free.transit, free.mass, free.top_mass,
    )  # fmt: skip
    return _shapes(elastic, 0), moves_of(elastic.frequency, eta, tick)


@plain
def end_compliance(sections, from_below):
    """Offset of an end from the mean of a free bar, by a constant force there [m/N].

    The sum of shape^2 / frequency^2 over all modes. The bar's own inertia balances the force,
    so that a section carries the share of it that the mass beyond is of all.

    Parameters
    ----------
    sections : ndarray, shape (sections, 4)
    from_below : bool
        Whether it is the top, so that sections count from below.
    """
    whole, above, total = bar_mass(sections), 0.0, 0.0
    for k in range(len(sections)):
        section = sections[len(sections) - 1 - k] if from_below else sections[k]
        first = above / whole
        above += section_mass(section)
        last = above / whole
        flexible = section[LENGTH] / (section[YOUNGS_MODULUS] * section[AREA])
        total += flexible * (first * first + first * last + last * last) / 3.0
    return total
