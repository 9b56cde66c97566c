"""A bar by its modes: free motion of its ends, moves, energies and bounds."""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, store, total
from percussion_model.solvers.modal.records import LEVELS, Move, Shape

TOP, LOW, SOFT, STIFF = (int(row) for row in Shape)
QQ, QV, VQ, VV, L_QQ, L_QV, L_VV = (int(row) for row in Move)

# Numbers below this are set to zero: denormal ones are slow.
TINY = 1e-200


@inlined
def end_offset(w, c, n, end):
    """Offset of an end (a row of `Shape`) from the mean, by the modes [m]."""
    offset = spread(0.0)
    for k in range(0, n, WIDTH):
        offset = offset + load(c.shape, end, k) * load(w, 0, k)
    return total(offset)


@inlined
def low_after(w, c, n, level):
    """Offset of the low end after a free move [m]."""
    m = c.move[level]
    low = spread(0.0)
    for k in range(0, n, WIDTH):
        q = load(m, QQ, k) * load(w, 0, k) + load(m, QV, k) * load(w, 1, k)
        low = low + load(c.shape, LOW, k) * q
    return total(low)


@inlined
def ends_after(w, c, n, level):
    """Offsets of top and low end [m] and velocity of the low end [m/s] after a free move."""
    m = c.move[level]
    top = low = speed = spread(0.0)
    for k in range(0, n, WIDTH):
        q0, v0, end = load(w, 0, k), load(w, 1, k), load(c.shape, LOW, k)
        q = load(m, QQ, k) * q0 + load(m, QV, k) * v0
        v = load(m, VQ, k) * q0 + load(m, VV, k) * v0
        top = top + load(c.shape, TOP, k) * q
        low = low + end * q
        speed = speed + end * v
    return total(top), total(low), total(speed)


@inlined
def move_bar(w, c, n, level, top, low):
    """Move the modes over 2^level ticks under constant forces at both ends; the loss [J]."""
    m = c.move[level]
    lost = spread(0.0)
    for k in range(0, n, WIDTH):
        # about where the forces would hold the mode still
        still = load(c.shape, TOP, k) * top + load(c.shape, LOW, k) * low
        still = load(c.shape, SOFT, k) * still
        y, v = load(w, 0, k) - still, load(w, 1, k)
        store(w, 0, k, still + (load(m, QQ, k) * y + load(m, QV, k) * v))
        store(w, 1, k, load(m, VQ, k) * y + load(m, VV, k) * v)
        lost = lost + (load(m, L_QQ, k) * y + load(m, L_QV, k) * v) * y
        lost = lost + load(m, L_VV, k) * (v * v)
    return total(lost)


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
    squares = spread(0.0)
    for k in range(first, n, WIDTH):
        v = load(w, 1, k)
        squares = squares + v * v
    return 0.5 * total(squares)


@inlined
def elastic_of(w, c, first, n):
    """Strain energy of modes [J]."""
    squares = spread(0.0)
    for k in range(first, n, WIDTH):
        q = load(w, 0, k)
        squares = squares + load(c.shape, STIFF, k) * (q * q)
    return 0.5 * total(squares)


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
