"""What does not change of a modal bar: moves of its modes, and how its ends yield to a force."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.kernel import kernel
from percussion_model.scene.bars import bar_mass, section_impedance, section_transit_time
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.modal.modes import Modes, count_below, end_compliance, free_modes
from percussion_model.solvers.modal.records import LEVELS, STEP, ModalBar, Move, Reply

# Sizes of the sets of modes: once the others have died away, so few are moved, in steps twice
# as long.
SMALLER = (16, 8)
# A short section at an end: modes up to so many times the highest one tell how the end yields.
FURTHER = 40.0
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
            a, b, c, d = _move(w[k], delta, tick * 2.0**level)
            row = out[level]
            row[Move.LOSS_QQ, k], row[Move.LOSS_QV, k], row[Move.LOSS_VV, k] = qq, qv, vv
            # twice as long: the first half, and what is left after it
            qq, qv, vv = (
                qq + a * a * qq + a * c * qv + c * c * vv,
                qv + 2.0 * a * b * qq + (a * d + b * c) * qv + 2.0 * c * d * vv,
                vv + b * b * qq + b * d * qv + d * d * vv,
            )
            if abs(a) + abs(b) * w[k] + abs(c) / w[k] + abs(d) < NOTHING:
                a = b = c = d = 0.0
            row[Move.Q_BY_Q, k], row[Move.Q_BY_V, k] = a, b
            row[Move.V_BY_Q, k], row[Move.V_BY_V, k] = c, d


def end_offset(impedance: float, eta: float, h: float) -> float:
    """Offset of an end of a long Kelvin-Voigt bar by a force of 1 N over `h` [m].

    Its velocity is erf(sqrt(t / eta)) / Z (docs/modal.md, eqs 4-5).
    """
    if eta == 0.0:
        return h / impedance
    tau = h / eta
    root = math.sqrt(tau)
    inner = (tau - 0.5) * math.erf(root) + root * math.exp(-tau) / math.sqrt(math.pi)
    return eta / impedance * inner


def _yielding(
    sections: np.ndarray, shapes: np.ndarray, modes: Modes, beyond: float, eta: float, h: float
) -> float:
    """Offset of an end by a force of 1 N over `h`, of all modes and the mean motion [m].

    Parameters
    ----------
    sections : ndarray
        From this end on.
    shapes : ndarray
        Of the end in `modes`, which reach far.
    beyond : float
        Compliance beyond those [m/N].
    """
    there_and_back = 2.0 * section_transit_time(sections[0])
    if there_and_back >= h + 4.0 * math.sqrt(eta * h):
        return end_offset(section_impedance(sections[0]), eta, h)
    total = 0.5 * h * h / bar_mass(sections)
    for w, shape in zip(modes.frequency.tolist(), shapes.tolist(), strict=True):
        total += shape * shape / (w * w) * (1.0 - _move(w, 0.5 * eta * w * w, h)[0])
    return total + beyond * (1.0 - math.exp(-h / eta) if eta > 0.0 else 1.0)


def modal_bar(sections: np.ndarray, highest: float, eta: float, tick: float) -> ModalBar:
    """Tables of a bar.

    Parameters
    ----------
    sections : ndarray, shape (sections, 4)
        From top to bottom.
    highest : float
        Angular frequency up to which there are modes, and some more [rad/s].
    eta : float
        Kelvin-Voigt time [s].
    tick : float
        Unit of time [s].
    """
    many = free_modes(sections, max(2 * WIDTH, count_below(sections, FURTHER * highest)))
    n = len(many.below(highest).frequency)
    n = max(1, math.ceil(n / WIDTH)) * WIDTH
    modes = Modes(*(part[:n] for part in many))
    move = np.zeros((LEVELS, len(Move), n))
    _fill_moves(modes.frequency, eta, tick, _NODES, _WEIGHTS, move)
    sizes = np.array([n, *(size for size in SMALLER if size < n)])
    levels = np.where(sizes == n, STEP - 1, STEP)
    soft = 1.0 / modes.frequency**2
    reply = np.zeros((len(sizes), STEP + 1, len(Reply)))
    beyond = np.zeros((len(sizes), 2))
    ends = (
        (Reply.TOP, modes.top, many.top, sections[::-1], Reply.TOP_REST, Reply.TOP_KEPT),
        (Reply.LOW, modes.low, many.low, sections, Reply.LOW_REST, Reply.LOW_KEPT),
    )
    mass = bar_mass(sections)
    for level in range(STEP + 1):
        h = tick * 2.0**level
        row = move[level]
        yields = soft * (1.0 - row[Move.Q_BY_Q])
        speeds = row[Move.Q_BY_V]
        for j, (end, shape, far, seen, rest, kept) in enumerate(ends):
            # the low end's compliance is that of all that lies above it
            every = end_compliance(seen)
            whole = _yielding(
                seen[::-1], far, many, every - _sum(far * far / many.frequency**2), eta, h
            )
            for k, size in enumerate(sizes):
                by_modes = 0.5 * h * h / mass + _sum((shape * shape * yields)[:size])
                reply[k, level, end] = whole
                reply[k, level, rest] = whole - by_modes
                beyond[k, j] = every - _sum((shape * shape * soft)[:size])
                reply[k, level, kept] = 1.0 - reply[k, level, rest] / beyond[k, j]
        for k, size in enumerate(sizes):
            both = modes.top * modes.low
            reply[k, level, Reply.CROSS] = 0.5 * h * h / mass + _sum((both * yields)[:size])
            reply[k, level, Reply.CROSS_SPEED] = h / mass + _sum((both * speeds)[:size])
            own = modes.low * modes.low
            reply[k, level, Reply.LOW_SPEED] = h / mass + _sum((own * speeds)[:size])
    shape = np.stack([modes.top, modes.low, soft, modes.frequency**2])
    return ModalBar(shape, move, reply, sizes, beyond, levels)


def _sum(values: np.ndarray) -> float:
    """Sum in the order of the values, whatever the processor."""
    return sum(values.tolist())
