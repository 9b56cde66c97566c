"""A bar by its modes: free motion of its ends, moves, energies and bounds."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.solvers.modal.records import LEVELS, Move, Reply

# Numbers below this are set to zero: denormal ones are slow.
TINY = 1e-200


@inlined
def low_offset(w, c, n):
    """Offset of the low end from the mean, by the modes [m]."""
    total = 0.0
    for k in range(n):
        total += c.low[k] * w[0, k]
    return total


@inlined
def top_offset(w, c, n):
    """Offset of the top end from the mean, by the modes [m]."""
    total = 0.0
    for k in range(n):
        total += c.top[k] * w[0, k]
    return total


@inlined
def low_after(w, c, n, level):
    """Offset of the low end after a free move [m]."""
    m = c.move[level]
    total = 0.0
    for k in range(n):
        total += c.low[k] * (m[Move.Q_BY_Q, k] * w[0, k] + m[Move.Q_BY_V, k] * w[1, k])
    return total


@inlined
def ends_after(w, c, n, level):
    """Offsets of top and low end [m] and velocity of the low end [m/s] after a free move."""
    m = c.move[level]
    top = low = speed = 0.0
    for k in range(n):
        q = m[Move.Q_BY_Q, k] * w[0, k] + m[Move.Q_BY_V, k] * w[1, k]
        v = m[Move.V_BY_Q, k] * w[0, k] + m[Move.V_BY_V, k] * w[1, k]
        top += c.top[k] * q
        low += c.low[k] * q
        speed += c.low[k] * v
    return top, low, speed


@inlined
def move_bar(w, c, n, level, top, low):
    """Move the modes over 2^level ticks under constant forces at both ends; the loss [J]."""
    m = c.move[level]
    lost = 0.0
    for k in range(n):
        # about where the forces would hold the mode still
        still = c.soft[k] * (c.top[k] * top + c.low[k] * low)
        y, v = w[0, k] - still, w[1, k]
        w[0, k] = still + (m[Move.Q_BY_Q, k] * y + m[Move.Q_BY_V, k] * v)
        w[1, k] = m[Move.V_BY_Q, k] * y + m[Move.V_BY_V, k] * v
        lost += (m[Move.LOSS_QQ, k] * y + m[Move.LOSS_QV, k] * v) * y
        lost += m[Move.LOSS_VV, k] * (v * v)
    return lost


@kernel
def carry(w, c, n, ticks):
    """Move free modes over any number of ticks; the loss [J]."""
    lost = 0.0
    rest = ticks
    level = LEVELS - 1
    while rest > 0:
        while rest >> level == 0:
            level -= 1
        lost += move_bar(w, c, n, level, 0.0, 0.0)
        rest -= 1 << level
    for k in range(n):
        if abs(w[0, k]) + abs(w[1, k]) < TINY:
            w[0, k] = w[1, k] = 0.0
    return lost


@inlined
def kinetic_of(w, first, n):
    """Kinetic energy of modes [J]."""
    total = 0.0
    for k in range(first, n):
        total += w[1, k] * w[1, k]
    return 0.5 * total


@inlined
def elastic_of(w, c, first, n):
    """Strain energy of modes [J]."""
    total = 0.0
    for k in range(first, n):
        total += w[0, k] * w[0, k] / c.soft[k]
    return 0.5 * total


@inlined
def kept_of(c, which, level, column):
    """What is left of an offset beyond the modes after 2^level ticks without a force."""
    return c.reply[which, level, column]


@inlined
def bit_kinetic(par, s, bars):
    """Kinetic energy of the whole bit [J]."""
    return 0.5 * par.mass_b * s.v_b * s.v_b + kinetic_of(bars.wb, 0, bars.cb.sizes[s.set])


@inlined
def bit_vibration(par, s, bars):
    """Energy of the bit's modes, and of what is beyond them [J]."""
    n = bars.cb.sizes[s.set]
    beyond = bars.cb.beyond[s.set]
    energy = kinetic_of(bars.wb, 0, n) + elastic_of(bars.wb, bars.cb, 0, n)
    return energy + 0.5 * (s.r_t * s.r_t / beyond[0] + s.r_b * s.r_b / beyond[1])


@kernel
def piston_vibration(s, bars):
    """Energy of the piston's modes, and of what is beyond them [J]."""
    n = bars.wp.shape[1]
    energy = kinetic_of(bars.wp, 0, n) + elastic_of(bars.wp, bars.cp, 0, n)
    return energy + 0.5 * s.r_p * s.r_p / bars.cp.beyond[0, 1]


@inlined
def time_to_cover(distance, velocity, acceleration):
    """First time at which v t + a t^2 / 2 reaches a positive distance; infinite: never [s]."""
    if distance <= 0.0:
        return 0.0
    if distance == math.inf:
        return math.inf
    disc = velocity * velocity + 2.0 * acceleration * distance
    if disc < 0.0:
        return math.inf
    bottom = velocity + math.sqrt(disc)
    if bottom <= 0.0:
        return math.inf
    return 2.0 * distance / bottom


KEPT_TOP, KEPT_LOW = int(Reply.TOP_KEPT), int(Reply.LOW_KEPT)
