"""Bars by the modes of their forms: moves under constant forces, ends, energies, other forms.

What the modes of a new form have no room for is vibration that the bars' loss would take within a
microsecond: it is booked as loss.
"""

from __future__ import annotations

from typing import NamedTuple

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import (
    has_rock,
    is_crushable,
    is_curved,
    is_elastic_rock,
    is_loading,
    is_rigid_rock,
    origin,
    stiffness,
)
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, store, total
from percussion_model.solvers.modal.records import JOINED, LEVELS, Move, Shape

LOW, TOP, SOFT, STIFF, BIT, PISTON = (int(row) for row in Shape)
QQ, QV, VQ, VV, YIELD, L_QQ, L_QV, L_VV = (int(row) for row in Move)
# Rows of the modes that change: offsets, velocities, forces of the body loads.
Q, V, LOAD = range(3)
# Numbers below this are set to zero: denormal ones are slow.
TINY = 1e-200
# Of bars that are stepped, modes that have less than this share of the energy of vibration together
# are left out: a hundred millionth of its motion. The rock end moves by what goes, each time.
LEAST_SHARE = 1e-16
# Or where what they could hold of force is below this share of the load.
LEAST_FORCE = 1e-7


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
def free_low_after(w, shape, m, n):
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


@inlined
def form_wanted(par, s):
    """Form of the present mode: free, or on the spring that comes closest to the rock's."""
    form = JOINED if s.closed == 1 else 0
    if s.mode == Mode.FF or not has_rock(par) or is_rigid_rock(par):
        return form
    if is_loading(s):
        return form + 1
    return form + (1 if s.gamma * s.k_r < 0.5 * (1.0 + par.gamma) * par.k_r else 2)


@inlined
def follows_form(par, s):
    """Whether the rock is the spring of the form that its mode wants; else its rest is stepped."""
    if s.mode == Mode.FF:
        return True
    if is_elastic_rock(par):
        return s.k_r == par.k_r
    if not is_crushable(par) or s.k_r != par.k_r:
        return False
    return s.gamma == par.gamma and not is_curved(par, s)


@kernel
def refresh_sums(s, bars):
    """Take the sums over modes that steps begin with."""
    shape, n = bars.forms.shape[s.form], s.active
    s.low = row_sum(shape, LOW, bars.w, Q, n)
    s.top = row_sum(shape, TOP, bars.w, Q, n)
    s.at_b = row_sum(shape, BIT, bars.w, Q, n)
    s.at_p = row_sum(shape, PISTON, bars.w, Q, n)


@kernel
def refresh_loads(s, bars, a_b, a_p):
    """Take the forces of body loads on the modes."""
    shape = bars.forms.shape[s.form]
    for k in range(0, bars.forms.sizes[s.form], WIDTH):
        f = load(shape, BIT, k) * a_b + load(shape, PISTON, k) * a_p
        store(bars.w, LOAD, k, f)
    s.a_b, s.a_p = a_b, a_p


@kernel
def shift(s, bars, way):
    """Move everything by the same way, as far as the modes have it, the rock end by `way` [m]."""
    shape = bars.forms.shape[s.form]
    moved = spread(0.0)
    for k in range(0, s.active, WIDTH):
        both = load(shape, BIT, k) + load(shape, PISTON, k)
        moved = moved + load(shape, LOW, k) * both
    way /= total(moved)
    for k in range(0, s.active, WIDTH):
        both = load(shape, BIT, k) + load(shape, PISTON, k)
        store(bars.w, Q, k, load(bars.w, Q, k) + both * way)


@inlined
def energies_of(bars, shape, k):
    """Twice the energies of modes from `k` on about where the loads would hold them [J]."""
    v = load(bars.w, V, k)
    y = load(bars.w, Q, k) - load(shape, SOFT, k) * load(bars.w, LOAD, k)
    return v * v + load(shape, STIFF, k) * (y * y)


@kernel
def trim(par, s, bars):
    """Leave out the highest modes where they have next to no energy."""
    shape, held = bars.forms.shape[s.form], bars.forms.stiff[s.form]
    whole = spread(0.0)
    for k in range(0, s.active, WIDTH):
        whole = whole + energies_of(bars, shape, k)
    least = total(whole)
    if shape[STIFF, 0] == 0.0:
        least -= bars.w[V, 0] * bars.w[V, 0]
    force = LEAST_FORCE * s.a_b * par.mass_b
    enough = LEAST_SHARE * least
    if held > 0.0:
        enough = max(enough, force * force / held)
    above = 0.0
    while s.active > WIDTH:
        n = s.active - WIDTH
        above += total(energies_of(bars, shape, n))
        if above > enough:
            break
        store(bars.w, V, n, spread(0.0))
        store(bars.w, Q, n, spread(0.0))
        s.active = n


@inlined
def hold_end(s, bars, low):
    """Let the last shape take what the others lack of the rock end's offset (`low`) and speed."""
    n, shape = bars.forms.sizes[s.form], bars.forms.shape[s.form]
    if bars.forms.stiff[s.form] > 0.0 and s.active == n:
        bars.w[Q, n - 1] += (low - s.low) / shape[LOW, n - 1]
        bars.w[V, n - 1] += (s.v_low - row_sum(shape, LOW, bars.w, V, n)) / shape[LOW, n - 1]


@kernel
def settle(par, s, bars, low):
    """Complete a new form: few modes, and the rock end where it was (offset `low`)."""
    refresh_loads(s, bars, s.a_b, s.a_p)
    refresh_sums(s, bars)
    # where a curve loads, the last shape, out of place, would turn the end back at once; rock of
    # another stiffness pushes harder than the form can hold without it
    keeps = not is_curved(par, s) or s.k_r != par.k_r
    hold_end(s, bars, low if keeps else s.low)
    if bars.laws.sizes[2 * s.form] == 0 or not follows_form(par, s):
        trim(par, s, bars)
    refresh_sums(s, bars)
    shift(s, bars, low - s.low)
    refresh_sums(s, bars)
    shape, n = bars.forms.shape[s.form], s.active
    s.v_low = row_sum(shape, LOW, bars.w, V, n)
    v_b = row_sum(shape, BIT, bars.w, V, n) / par.mass_b
    push = 0.0
    if s.form >= JOINED:
        v_p = row_sum(shape, PISTON, bars.w, V, n) / par.mass_p
        push = par.mass_p * (s.v_p - v_p)
        s.v_p = v_p
    s.i_contact += push
    s.i_bit += push - par.mass_b * (v_b - s.v_b)
    s.v_b = v_b


@inlined
def tip_of(par, s):
    """Place of the bit's top from its mean [m]."""
    return s.top - s.at_b / par.mass_b


@kernel
def leave_out(par, s, bars):
    """Leave out modes that have died away."""
    before, n = bar_energy(s, bars), s.active
    low, tip = s.low, tip_of(par, s)
    trim(par, s, bars)
    if s.active < n:
        settle(par, s, bars, low)
        s.e_loss += before - bar_energy(s, bars)
        s.offset += tip - tip_of(par, s)


@kernel
def pass_on(change, w, rows, count, n):
    """Offsets and velocities of `count` modes in `n` others, into `rows`."""
    for i in range(0, n, WIDTH):
        q = q_odd = v = v_odd = spread(0.0)
        for k in range(0, count, 2):
            row, odd = load(change, k, i), load(change, k + 1, i)
            q = q + row * w[Q, k]
            v = v + row * w[V, k]
            q_odd = q_odd + odd * w[Q, k + 1]
            v_odd = v_odd + odd * w[V, k + 1]
        store(rows, Q, i, q + q_odd)
        store(rows, V, i, v + v_odd)


@kernel
def take_form(s, bars, form, n):
    """Take what `pass_on` found as the modes of a form."""
    s.form, s.active = form, n
    for i in range(0, n, WIDTH):
        store(bars.w, Q, i, load(bars.rows, Q, i))
        store(bars.w, V, i, load(bars.rows, V, i))


@kernel
def change_spring(par, s, bars):
    """Go to the form that the present mode wants, with the penetration that it has."""
    form, low = form_wanted(par, s), s.p - origin(s)
    if form == s.form and low == s.low:
        return
    before, tip = bar_energy(s, bars), tip_of(par, s)
    if form == s.form:
        shift(s, bars, low - s.low)
        refresh_sums(s, bars)
    else:
        n = bars.forms.sizes[form]
        uniform = low - s.low
        pass_on(bars.forms.change[s.form, form % JOINED], bars.w, bars.rows, s.active, n)
        take_form(s, bars, form, n)
        shift(s, bars, uniform)
        settle(par, s, bars, low)
    s.e_loss += before - bar_energy(s, bars)
    s.offset += tip - tip_of(par, s)


@kernel
def join(par, s, bars):
    """Join piston and bit, whose ends touch."""
    form, low = s.form + JOINED, s.low
    before = bar_energy(s, bars) + 0.5 * par.mass_p * s.v_p * s.v_p
    n, ends = bars.forms.sizes[form], s.top
    pass_on(bars.forms.change[s.form, form % JOINED], bars.w, bars.rows, s.active, n)
    if par.piston == Piston.ELASTIC:
        before += piston_vibration(bars)
        ends -= row_sum(bars.shape_p, LOW, bars.wp, Q, bars.wp.shape[1])
    rows, shape = bars.rows, bars.forms.shape[form]
    for i in range(0, n, WIDTH):
        # the piston as a whole, where its low end meets the bit
        q = load(rows, Q, i) + load(shape, PISTON, i) * ends
        v = load(rows, V, i) + load(shape, PISTON, i) * s.v_p
        for k in range(bars.wp.shape[1]):
            row = load(bars.forms.join[form - JOINED], k, i)
            q = q + row * bars.wp[Q, k]
            v = v + row * bars.wp[V, k]
        store(rows, Q, i, q)
        store(rows, V, i, v)
    take_form(s, bars, form, n)
    impulse = s.i_contact
    settle(par, s, bars, low)
    s.peak_impulse = s.i_contact - impulse
    s.e_loss += before - bar_energy(s, bars)
    # where both are follows from how they are bent: no rounding can add up
    s.u_r = s.at_p / par.mass_p - s.at_b / par.mass_b
    s.u_b = s.x_r + s.p - (s.low - s.at_b / par.mass_b)
    s.u_p = s.u_b + s.u_r
    s.offset = 0.0
    s.gap = 0.0


@kernel
def part(par, s, bars):
    """Part piston and bit where they are."""
    form, low = s.form - JOINED, s.low
    before = bar_energy(s, bars)
    n = bars.forms.sizes[form]
    for k in range(bars.wp.shape[1]):
        q = v = spread(0.0)
        for i in range(0, s.active, WIDTH):
            row = load(bars.forms.join[form], k, i)
            q = q + row * load(bars.w, Q, i)
            v = v + row * load(bars.w, V, i)
        bars.wp[Q, k], bars.wp[V, k] = total(q), total(v)
    pass_on(bars.forms.change[s.form, form % JOINED], bars.w, bars.rows, s.active, n)
    take_form(s, bars, form, n)
    v_p = s.v_p
    settle(par, s, bars, low)
    s.v_p = v_p
    after = bar_energy(s, bars) + 0.5 * par.mass_p * v_p * v_p
    s.low_p = 0.0
    if par.piston == Piston.ELASTIC:
        after += piston_vibration(bars)
        s.low_p = row_sum(bars.shape_p, LOW, bars.wp, Q, bars.wp.shape[1])
    s.e_loss += before - after
    s.offset = 0.0
    s.offset = -gap_of(par, s)
    s.gap = 0.0


@inlined
def gap_of(par, s):
    """Gap between piston and bit by the places of their ends [m]."""
    return s.u_b + tip_of(par, s) - (s.u_p + s.low_p) + s.offset


class Flight(NamedTuple):
    """Where a piston is that flies alone."""

    way: float  # of its mean [m]
    low: float  # offset of its low end, or the most that it may be where the piston waits [m]
    gap: float  # between that end and the bit's top [m]


@inlined
def way_alone(s, h):
    """How far the mean of a piston that touches nothing goes in `h` [m]."""
    return h * (s.v_p + 0.5 * h * s.a_p)


@inlined
def flight_of(par, s, bars, level, h, way_b, tip):
    """Where a piston that touches nothing is `h` later, after a move of 2^level ticks.

    Parameters
    ----------
    way_b, tip : float
        How far the bit's mean has gone, and where its top is from that then [m].
    """
    way, low = way_alone(s, h), 0.0
    top = s.u_b + way_b + tip + s.offset
    if s.parked == 1:
        low = s.spread_p
    elif par.piston == Piston.ELASTIC:
        low = free_low_after(bars.wp, bars.shape_p, bars.move_p[level], bars.wp.shape[1])
    return Flight(way, low, top - (s.u_p + way + low))
