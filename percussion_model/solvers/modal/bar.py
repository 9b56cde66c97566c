"""Bars by their modes: moves under constant forces, ends, energies."""

from __future__ import annotations

from typing import NamedTuple

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.physics.rock import stiffness
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, store, total
from percussion_model.solvers.modal.records import JOINED, LEVELS, Move, Shape

LOW, TOP, SOFT, STIFF, BIT, PISTON = (int(row) for row in Shape)
QQ, QV, VQ, VV, YIELD, L_QQ, L_QV, L_VV = (int(row) for row in Move)
# Rows of the modes that change: offsets, velocities, forces of the body loads.
Q, V, LOAD = range(3)

# Numbers below this are set to zero: denormal ones are slow.
TINY = 1e-200


class Ends(NamedTuple):
    """What a move leads to."""

    lost: float  # [J]
    low: float  # offsets of rock end and top of the bit [m]
    speed: float  # of the rock end [m/s]
    top: float
    bit: float  # integrals over the mass of the bit, of offset and velocity [kg m, kg m/s]
    bit_speed: float
    piston: float
    piston_speed: float
    pull: float  # what accelerates the piston's mass besides its body load, at the end [N]


@inlined
def row_sum(shape, row, w, which, n):
    """Sum of a row of shapes times offsets or velocities."""
    value = spread(0.0)
    for k in range(0, n, WIDTH):
        value = value + load(shape, row, k) * load(w, which, k)
    return total(value)


@inlined
def low_after(w, shape, m, n):
    """Offset of the low end after a move under the loads alone [m]."""
    low = spread(0.0)
    for k in range(0, n, WIDTH):
        q = load(m, QQ, k) * load(w, Q, k) + load(m, QV, k) * load(w, V, k)
        low = low + load(shape, LOW, k) * (q + load(m, YIELD, k) * load(w, LOAD, k))
    return total(low)


@inlined
def try_move(w, rows, shape, m, n, force, eta, joined):
    """Move modes under their loads and a force at the low end, into `rows`."""
    lost = low = speed = top = bit = bit_speed = spread(0.0)
    piston = piston_speed = pull = spread(0.0)
    for k in range(0, n, WIDTH):
        q0, v0, end = load(w, Q, k), load(w, V, k), load(shape, LOW, k)
        f = load(w, LOAD, k) - end * force
        q = load(m, QQ, k) * q0 + load(m, QV, k) * v0 + load(m, YIELD, k) * f
        v = load(m, VQ, k) * q0 + load(m, VV, k) * v0 + load(m, QV, k) * f
        store(rows, Q, k, q)
        store(rows, V, k, v)
        # about where the forces would hold the mode still
        y = q0 - load(shape, SOFT, k) * f
        lost = lost + (load(m, L_QQ, k) * y + load(m, L_QV, k) * v0) * y
        lost = lost + load(m, L_VV, k) * (v0 * v0)
        low = low + end * q
        speed = speed + end * v
        top = top + load(shape, TOP, k) * q
        share = load(shape, BIT, k)
        bit = bit + share * q
        bit_speed = bit_speed + share * v
        if joined:
            share = load(shape, PISTON, k)
            piston = piston + share * q
            piston_speed = piston_speed + share * v
            pull = pull + share * (load(w, LOAD, k) - load(shape, STIFF, k) * (q + v * eta))
    return Ends(
        total(lost),
        total(low),
        total(speed),
        total(top),
        total(bit),
        total(bit_speed),
        total(piston),
        total(piston_speed),
        total(pull),
    )


@inlined
def take(w, rows, n):
    """Make the move that was tried."""
    for k in range(0, n, WIDTH):
        store(w, Q, k, load(rows, Q, k))
        store(w, V, k, load(rows, V, k))


@inlined
def move_free(w, m, n):
    """Move modes without forces; the loss [J]."""
    lost = spread(0.0)
    for k in range(0, n, WIDTH):
        q, v = load(w, Q, k), load(w, V, k)
        store(w, Q, k, load(m, QQ, k) * q + load(m, QV, k) * v)
        store(w, V, k, load(m, VQ, k) * q + load(m, VV, k) * v)
        lost = lost + (load(m, L_QQ, k) * q + load(m, L_QV, k) * v) * q
        lost = lost + load(m, L_VV, k) * (v * v)
    return total(lost)


@inlined
def end_after(w, shape, m, n):
    """Offset of the low end after a free move [m]."""
    low = spread(0.0)
    for k in range(0, n, WIDTH):
        q = load(m, QQ, k) * load(w, Q, k) + load(m, QV, k) * load(w, V, k)
        low = low + load(shape, LOW, k) * q
    return total(low)


@kernel
def carry(w, move, first, n, ticks):
    """Move free modes from `first` on over any number of ticks; the loss [J]."""
    rigid_q, rigid_v = w[Q, 0], w[V, 0]
    lost = 0.0
    rest = ticks
    level = LEVELS - 1
    while rest > 0:
        while rest >> level == 0:
            level -= 1
        lost += move_free(w, move[level], n)
        rest -= 1 << level
    if first == 1:
        w[Q, 0], w[V, 0] = rigid_q, rigid_v
    for k in range(first, n):
        if abs(w[Q, k]) + abs(w[V, k]) < TINY:
            w[Q, k] = w[V, k] = 0.0
    return lost


@inlined
def kinetic_of(w, n):
    """Kinetic energy of modes [J]."""
    squares = spread(0.0)
    for k in range(0, n, WIDTH):
        v = load(w, V, k)
        squares = squares + v * v
    return 0.5 * total(squares)


@inlined
def elastic_of(w, shape, n):
    """Strain energy of modes, with that of a spring under the low end [J]."""
    squares = spread(0.0)
    for k in range(0, n, WIDTH):
        q = load(w, Q, k)
        squares = squares + load(shape, STIFF, k) * (q * q)
    return 0.5 * total(squares)


@kernel
def bit_kinetic(s, bars, w):
    """Kinetic energy of the bit, by the velocities in `w` [J]."""
    if s.form < JOINED:
        return kinetic_of(w, s.active)
    change = bars.forms.change[s.form, s.form % JOINED]
    n = bars.forms.sizes[s.form - JOINED]
    squares = 0.0
    for i in range(0, n, WIDTH):
        v = spread(0.0)
        for k in range(s.active):
            v = v + load(change, k, i) * w[V, k]
        squares += total(v * v)
    return 0.5 * squares


@kernel
def sag(s, bars):
    """Offset of the rock end by which the spring holds the loads, of the modes that move [m]."""
    shape, low = bars.forms.shape[s.form], spread(0.0)
    for k in range(0, s.active, WIDTH):
        still = load(shape, SOFT, k) * load(bars.w, LOAD, k)
        low = low + load(shape, LOW, k) * still
    return total(low)


@kernel
def bar_energy(s, bars):
    """Kinetic and strain energy of what the present form has, without the rock's [J]."""
    n, stiff = s.active, bars.forms.stiff[s.form]
    energy = kinetic_of(bars.w, n) + elastic_of(bars.w, bars.forms.shape[s.form], n)
    return energy - 0.5 * stiff * s.low * s.low


@kernel
def standing_energy(par, s, bars):
    """Energy of a standing bit about its rest, with that of the rock's spring [J]."""
    shape, energy = bars.forms.shape[s.form], spread(0.0)
    held, load_b = bars.forms.stiff[s.form], par.mass_b * s.a_b
    more = stiffness(s) - held if held > 0.0 else 0.0
    # what holds the bit at rest besides the spring of the form
    rest = more * load_b / (held + more) if more != 0.0 else 0.0
    for k in range(0, s.active, WIDTH):
        f = load(bars.w, LOAD, k) - load(shape, LOW, k) * rest
        off, v = load(bars.w, Q, k) - load(shape, SOFT, k) * f, load(bars.w, V, k)
        energy = energy + v * v + load(shape, STIFF, k) * (off * off)
    off = s.low - load_b / (held + more) if more != 0.0 else 0.0
    return 0.5 * (total(energy) + more * off * off)


@kernel
def piston_vibration(bars):
    """Energy of the free piston's modes [J]."""
    n = bars.wp.shape[1]
    return kinetic_of(bars.wp, n) + elastic_of(bars.wp, bars.shape_p, n)
