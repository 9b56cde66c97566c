"""Pairs of numbers by which the bars move between two events (docs/modal.md, section 4)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import book_dashpot, damping, is_rigid_rock
from percussion_model.solvers.modal.bars import (
    LOAD,
    SOFT,
    STIFF,
    TINY,
    Q,
    V,
    follows_form,
    form_wanted,
    refresh_loads,
    refresh_sums,
    tip_of,
)
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, store, total
from percussion_model.solvers.modal.records import JOINED, LONGEST_HOP, STEP, End, Go, Shape

# Rows of the pairs in `Bars.w`: about rest, and the load of a rigid one; where a search is, or the
# pending leap ends. As numbers, not as constants for each of which kernels would be compiled.
PQ, PV, PLOAD, AT = (np.int64(row) for row in (3, 4, 5, 6))
QQ, QV, VQ, VV, YIELD = (int(row) for row in Go)
LOW, SPEED, TOP, BIT, BIT_SPEED, SHIFT, YIELDS, PISTON, PISTON_SPEED, PULL, SQUARE, _ = (
    int(row) for row in End
)
SHAPE_LOW, SHAPE_TOP, SHAPE_BIT, SHAPE_PISTON = (
    int(row) for row in (Shape.LOW, Shape.TOP, Shape.BIT, Shape.PISTON)
)
# Modes that have less than this share of the energy of vibration make no pairs, and pairs are left
# out that have less than the second together, or could hold less than such a share of the load.
NO_SHARE, LEAST_SHARE, LEAST_FORCE = 1e-12, 1e-10, 1e-5
# Steps between two looks at which pairs are needed: the highest die soon.
FIRST_STRIDE = 4
# Modes that have less than this share of the energy of vibration together are not looked at; at
# least so many are. With 1e-6 cycles were missed where the bit just touches the rock.
SLIGHT_SHARE, FEWEST_MODES = 1e-9, 4


class Sums(NamedTuple):
    """What pairs tell of the ends, as the fields of the state of these names."""

    low: float
    speed: float
    top: float
    bit: float


@merged
def law_in(par, s, laws, form):
    """Law by which the present mode moves in a form; -1 where it has to be stepped."""
    if par.steps == 1 or not follows_form(par, s):
        return -1
    if s.closed == 1 and s.mode == Mode.SS and s.alert == 1:
        return -1  # the bit's own energy is known by its modes
    law = 2 * form
    dashpot = damping(s)
    if dashpot > 0.0:
        law += 1
        if laws.dashpot[law] != dashpot:
            return -1
    return law if laws.sizes[law] > 0 else -1


@merged
def law_wanted(par, s, laws):
    """Law by which the present mode moves; -1 where it has to be stepped."""
    form = form_wanted(par, s)
    return law_in(par, s, laws, form) if form == s.form else -1


@inlined
def part_of(ends, end, k, q, v):
    """Part of pairs from `k` on in what a row tells."""
    return load(ends, end, k) * q + load(ends, end + 1, k) * v


@inlined
def sum_of(ends, end, w, n):
    """What a row tells of the present pairs, about rest."""
    value = spread(0.0)
    for k in range(0, n, WIDTH):
        value = value + part_of(ends, end, k, load(w, PQ, k), load(w, PV, k))
    return total(value)


class Touch(NamedTuple):
    """What pairs tell of a piston that touches the bit."""

    piston: float  # integrals over its mass, of offset and velocity [kg m, kg m/s]
    speed: float
    pull: float  # what the bit accelerates it with [N]


@inlined
def touch_of(s, bars, x, first):
    """What pairs in two rows of `x` tell of a piston that touches the bit."""
    ends, piston, speed, pull = bars.laws.ends[s.law], spread(0.0), spread(0.0), spread(0.0)
    for k in range(0, s.pairs, WIDTH):
        q, v = load(x, first, k), load(x, first + 1, k)
        piston = piston + part_of(ends, PISTON, k, q, v)
        speed = speed + part_of(ends, PISTON_SPEED, k, q, v)
        pull = pull + part_of(ends, PULL, k, q, v)
    return Touch(s.rest_p + total(piston), total(speed), s.rest_pull + total(pull))


@inlined
def ahead_of(s, bars, level):
    """Move the pairs of a bit alone over 2^level ticks, into `bars.rows`; their sums."""
    m, ends, w = bars.laws.move[s.law, level], bars.laws.ends[s.law], bars.w
    low = speed = top = bit = spread(0.0)
    for k in range(0, s.pairs, WIDTH):
        q0, v0 = load(w, PQ, k), load(w, PV, k)
        f = load(w, PLOAD, k)
        q = load(m, QQ, k) * q0 + load(m, QV, k) * v0 + load(m, YIELD, k) * f
        v = load(m, VQ, k) * q0 + load(m, VV, k) * v0 + load(m, QV, k) * f
        store(bars.rows, 0, k, q)
        store(bars.rows, 1, k, v)
        low = low + part_of(ends, LOW, k, q, v)
        speed = speed + part_of(ends, SPEED, k, q, v)
        top = top + part_of(ends, TOP, k, q, v)
        bit = bit + part_of(ends, BIT, k, q, v)
    return Sums(
        s.rest_low + total(low),
        total(speed),
        s.rest_top + total(top),
        s.rest_b + total(bit),
    )


@inlined
def keep_ahead(s, bars):
    """Make the move that was looked at."""
    for k in range(0, s.pairs, WIDTH):
        store(bars.w, PQ, k, load(bars.rows, 0, k))
        store(bars.w, PV, k, load(bars.rows, 1, k))


@inlined
def keep(x, first, y, second, n):
    """Keep pairs in two rows of `x` in two of `y`."""
    for k in range(0, n, WIDTH):
        store(y, second, k, load(x, first, k))
        store(y, second + 1, k, load(x, first + 1, k))


@inlined
def move_pairs(s, bars, x, first, level):
    """Move pairs in two rows of `x` from `first` on over 2^level ticks."""
    m, w = bars.laws.move[s.law, level], bars.w
    for k in range(0, s.pairs, WIDTH):
        q, v, f = load(x, first, k), load(x, first + 1, k), load(w, PLOAD, k)
        ahead = load(m, QQ, k) * q + load(m, QV, k) * v
        store(x, first, k, ahead + load(m, YIELD, k) * f)
        ahead = load(m, VQ, k) * q + load(m, VV, k) * v
        store(x, first + 1, k, ahead + load(m, QV, k) * f)


@kernel
def carry_pairs(s, bars, x, first, ticks):
    """Move pairs in two rows of `x` from `first` on over any number of ticks."""
    moves, w = bars.laws.move[s.law], bars.w
    for k in range(0, s.pairs, WIDTH):
        q, v, f = load(x, first, k), load(x, first + 1, k), load(w, PLOAD, k)
        level, rest = 0, ticks
        while rest > 0:
            if rest & 1 == 1:
                m = moves[level]
                ahead = load(m, QQ, k) * q + load(m, QV, k) * v + load(m, YIELD, k) * f
                v = load(m, VQ, k) * q + load(m, VV, k) * v + load(m, QV, k) * f
                q = ahead
            level, rest = level + 1, rest >> 1
        store(x, first, k, q)
        store(x, first + 1, k, v)


@inlined
def drop_tiny(s, bars):
    """Set to zero what would only slow down arithmetic."""
    for k in range(s.pairs):
        if abs(bars.w[PQ, k]) + abs(bars.w[PV, k]) < TINY:
            bars.w[PQ, k] = bars.w[PV, k] = 0.0


@inlined
def present_sums(s, bars):
    """Sums of a bit alone."""
    ends, w = bars.laws.ends[s.law], bars.w
    low = speed = top = bit = spread(0.0)
    for k in range(0, s.pairs, WIDTH):
        q, v = load(w, PQ, k), load(w, PV, k)
        low = low + part_of(ends, LOW, k, q, v)
        speed = speed + part_of(ends, SPEED, k, q, v)
        top = top + part_of(ends, TOP, k, q, v)
        bit = bit + part_of(ends, BIT, k, q, v)
    return Sums(
        s.rest_low + total(low),
        total(speed),
        s.rest_top + total(top),
        s.rest_b + total(bit),
    )


@kernel
def hold_low(s, bars, low, row):
    """Move other pairs as a row says until the rock end is where it was, and take their sums."""
    ends, w, n = bars.laws.ends[s.law], bars.w, s.pairs
    common = now = spread(0.0)
    for k in range(0, n, WIDTH):
        now = now + part_of(ends, LOW, k, load(w, PQ, k), load(w, PV, k))
        common = common + part_of(ends, LOW, k, load(ends, row, k), load(ends, row + 1, k))
    way = (low - s.rest_low - total(now)) / total(common)
    for k in range(0, n, WIDTH):
        store(w, PQ, k, load(w, PQ, k) + load(ends, row, k) * way)
        store(w, PV, k, load(w, PV, k) + load(ends, row + 1, k) * way)
    sums = present_sums(s, bars)
    s.low, s.v_low, s.top, s.at_b = sums.low, sums.speed, sums.top, sums.bit


@kernel
def shift_pairs(s, bars, way):
    """Move all pairs as one."""
    ends, w = bars.laws.ends[s.law], bars.w
    for k in range(0, s.pairs, WIDTH):
        store(w, PQ, k, load(w, PQ, k) + load(ends, SHIFT, k) * way)
        store(w, PV, k, load(w, PV, k) + load(ends, SHIFT + 1, k) * way)


@kernel
def hold_ends(par, s, bars):
    """Take the sums of fewer pairs, with the rock end and the top of the bit where they were."""
    at_b, at_p, rigid = s.at_b, s.at_p, bars.w[PQ, 0]
    tip = tip_of(par, s)
    hold_low(s, bars, s.low, SHIFT)
    s.offset += tip - tip_of(par, s)
    # the bars did not go this way, so that their loads did no work
    s.vibrates -= s.a_b * (s.at_b - at_b) - bars.w[PLOAD, 0] * (bars.w[PQ, 0] - rigid)
    if s.form >= JOINED:
        s.at_p = touch_of(s, bars, bars.w, PQ).piston
        s.vibrates -= s.a_p * (s.at_p - at_p)


@inlined
def least_size(par, s, bars, form, energy):
    """Twice the energy from which on pairs count, of some vibration in a form [J]."""
    least, held = 2.0 * LEAST_SHARE * energy, bars.forms.stiff[form]
    if held == 0.0:
        return least
    force = LEAST_FORCE * s.a_b * par.mass_b
    return max(least, force * force / held)


@kernel
def enough_pairs(par, s, bars):
    """How many pairs hold next to all of the energy of vibration."""
    ends = bars.laws.ends[s.law]
    least = least_size(par, s, bars, s.form, energy_of_pairs(s, bars, bars.w, PQ))
    above, n = 0.0, s.pairs
    while n > WIDTH:
        above += total(size_of(ends, bars.w, PQ, n - WIDTH))
        if above > least:
            break
        n -= WIDTH
    return n


@inlined
def size_of(ends, x, first, k):
    """Twice the energies of pairs from `k` on, in two rows of `x`, as if they were orthogonal."""
    q, v = load(x, first, k), load(x, first + 1, k)
    return v * v + load(ends, SQUARE, k) * (q * q)


@inlined
def energy_of_pairs(s, bars, x, first):
    """Energy of vibration of pairs in two rows of `x`, as if orthogonal, as nearly they are [J]."""
    ends, whole = bars.laws.ends[s.law], spread(0.0)
    for k in range(0, s.pairs, WIDTH):
        whole = whole + size_of(ends, x, first, k)
    energy = total(whole)
    if bars.forms.stiff[s.form] == 0.0:
        energy -= x[first + 1, 0] * x[first + 1, 0]
    return 0.5 * energy


@kernel
def leave_out_pairs(par, s, bars):
    """Leave out pairs that have died away."""
    n = enough_pairs(par, s, bars)
    if n < s.pairs:
        s.pairs = n
        hold_ends(par, s, bars)


@inlined
def times_table(table, x, first, count, i):
    """Numbers from `i` on of the product of a table with two rows of `x`, of either half.

    Sums of their own for every other number: additions take longer than they need to begin.
    """
    n = table.shape[0] // 2
    q = q_odd = q_v = q_v_odd = v = v_odd = v_v = v_v_odd = spread(0.0)
    for k in range(0, count, 2):
        one, other = x[first, k], x[first, k + 1]
        q = q + load(table, k, i) * one
        q_odd = q_odd + load(table, k + 1, i) * other
        v = v + load(table, k, n + i) * one
        v_odd = v_odd + load(table, k + 1, n + i) * other
        one, other = x[first + 1, k], x[first + 1, k + 1]
        q_v = q_v + load(table, n + k, i) * one
        q_v_odd = q_v_odd + load(table, n + k + 1, i) * other
        v_v = v_v + load(table, n + k, n + i) * one
        v_v_odd = v_v_odd + load(table, n + k + 1, n + i) * other
    return (q + q_odd) + (q_v + q_v_odd), (v + v_odd) + (v_v + v_v_odd)


@kernel
def multiply(table, x, first, active, rows, start, count):
    """Product of a table with two rows of `x` from `first` on, into two of `rows` from `start`."""
    for i in range(start, count, WIDTH):
        q, v = times_table(table, x, first, active, i)
        store(rows, 0, i, q)
        store(rows, 1, i, v)


@kernel
def to_be_taken(table, x, first, count):
    """What a dashpot of 1 N s/m would take of pairs in two rows of `x` from now on [J]."""
    whole = spread(0.0)
    for i in range(0, count, WIDTH):
        q, v = times_table(table, x, first, i + WIDTH, i)
        whole = whole + q * load(x, first, i) + v * load(x, first + 1, i)
    return total(whole)


@kernel
def taken_so_far(s, bars, first):
    """What the dashpot has taken of the pairs until where they are in two rows of `Bars.w` [J]."""
    left = to_be_taken(bars.laws.taken[s.law], bars.w, first, s.pairs)
    return damping(s) * (s.takes - left)


@kernel
def spell_out(s, bars, x, first):
    """Offsets about rest and velocities of the form's modes, into `bars.rows`; how many.

    Of the pairs in two rows of `x`, from `first` on.
    """
    if s.form % JOINED == 0:
        for k in range(0, s.pairs, WIDTH):
            store(bars.rows, 0, k, load(x, first, k))
            store(bars.rows, 1, k, load(x, first + 1, k))
        return s.pairs
    n = bars.laws.sizes[s.law]
    multiply(bars.laws.out[s.law], x, first, s.pairs, bars.rows, 0, n)
    return n


@kernel
def spell_speeds(s, bars, x, first):
    """Spell out only the velocities, as `spell_out` does; how many."""
    if s.form % JOINED == 0:
        for k in range(0, s.pairs, WIDTH):
            store(bars.rows, 1, k, load(x, first + 1, k))
        return s.pairs
    n, table = bars.laws.sizes[s.law], bars.laws.out[s.law]
    for i in range(0, n, WIDTH):
        _, v = times_table(table, x, first, s.pairs, i)
        store(bars.rows, 1, i, v)
    return n


@kernel
def energy_about_rest(s, bars, n):
    """Energy of the modes in `bars.rows`, a rigid one apart [J]."""
    shape, energy = bars.forms.shape[s.form], spread(0.0)
    for k in range(0, n, WIDTH):
        q, v = load(bars.rows, 0, k), load(bars.rows, 1, k)
        energy = energy + v * v + load(shape, STIFF, k) * (q * q)
    whole = total(energy)
    if shape[STIFF, 0] == 0.0:
        whole -= bars.rows[1, 0] * bars.rows[1, 0]
    return 0.5 * whole


@kernel
def take_rest(s, bars, n):
    """Take where the loads would hold the modes still: its sums, and offsets from it."""
    shape, w = bars.forms.shape[s.form], bars.w
    low = top = bit = piston = spread(0.0)
    for k in range(0, n, WIDTH):
        soft, f = load(shape, SOFT, k), load(w, LOAD, k)
        rest = soft * f
        store(bars.rows, 0, k, load(w, Q, k) - rest)
        store(bars.rows, 1, k, load(w, V, k))
        store(w, PLOAD, k, spread(0.0))
        low = low + load(shape, SHAPE_LOW, k) * rest
        top = top + load(shape, SHAPE_TOP, k) * rest
        bit = bit + load(shape, SHAPE_BIT, k) * rest
        piston = piston + load(shape, SHAPE_PISTON, k) * rest
    s.rest_low, s.rest_top, s.rest_b, s.rest_p = total(low), total(top), total(bit), total(piston)
    s.rest_pull = 0.0
    if s.form % JOINED == 0:
        w[PLOAD, 0] = w[LOAD, 0]
        # every mode but the rigid one is held by what bends it
        s.rest_pull = shape[SHAPE_PISTON, 0] * w[LOAD, 0]


@kernel
def enough_modes(s, bars, n):
    """How many of the modes in `bars.rows` have energy that counts."""
    shape, above = bars.forms.shape[s.form], 0.0
    while n > WIDTH:
        q, v = load(bars.rows, 0, n - WIDTH), load(bars.rows, 1, n - WIDTH)
        above += total(v * v + load(shape, STIFF, n - WIDTH) * (q * q))
        if above > NO_SHARE * s.vibrates:
            break
        n -= WIDTH
    return n


@inlined
def push_to_rest(s, bars, over, start, count):
    """Move the pairs of a product in `bars.rows` to where the load holds them."""
    pushed = bars.laws.pushed[over]
    for k in range(start, count, WIDTH):
        store(bars.rows, 0, k, load(bars.rows, 0, k) + load(pushed, 0, k) * s.a_b)
        store(bars.rows, 1, k, load(bars.rows, 1, k) + load(pushed, 1, k) * s.a_b)


@inlined
def turn_into(par, s, bars, law, over, table, first, inputs):
    """Turn two rows of `Bars.w` into the pairs of a law, in `bars.rows`, as far as they count.

    First somewhat more than there were; the rest where the last of them count.

    Parameters
    ----------
    over : int
        Place in `Laws.pushed` of what the load adds; -1 for nothing.
    table : ndarray
        What they are multiplied with.
    first, inputs : int
        The first row, and how many numbers of it.

    Returns
    -------
    int
        Pairs that count.
    """
    n = bars.laws.sizes[law]
    count = min(s.pairs + WIDTH, n)
    multiply(table, bars.w, first, inputs, bars.rows, 0, count)
    if over >= 0:
        push_to_rest(s, bars, over, 0, count)
    if count < n:
        last = total(size_of(bars.laws.ends[law], bars.rows, 0, count - WIDTH))
        if last > least_size(par, s, bars, law // 2, s.vibrates):
            multiply(table, bars.w, first, inputs, bars.rows, count, n)
            if over >= 0:
                push_to_rest(s, bars, over, count, n)
            return n
    return count


@kernel
def take_pairs(par, s, bars, law):
    """Go on by the pairs of a law."""
    n, w = bars.laws.sizes[law], bars.w
    take_rest(s, bars, n)
    s.law = law
    s.vibrates = energy_about_rest(s, bars, n)
    if s.form % JOINED > 0:
        count = enough_modes(s, bars, n)
        for k in range(0, count, WIDTH):
            store(w, Q, k, load(bars.rows, 0, k))
        s.pairs = turn_into(par, s, bars, law, -1, bars.laws.into[law], Q, count)
    else:
        s.pairs = n
    keep(bars.rows, 0, w, PQ, s.pairs)
    s.stride = FIRST_STRIDE
    s.pairs = enough_pairs(par, s, bars)
    hold_ends(par, s, bars)
    s.takes = 0.0
    if law % 2 == 1:
        s.takes = to_be_taken(bars.laws.taken[law], w, PQ, s.pairs)


@kernel
def book_work(s, bars):
    """Book what the dashpot took since the pairs were taken; losses of the bars wait."""
    if s.law % 2 == 1:
        left = to_be_taken(bars.laws.taken[s.law], bars.w, PQ, s.pairs)
        work = bars.laws.dashpot[s.law] * (s.takes - left)
        s.takes = left
        s.vibrates -= work
        s.rock_work += work
        book_dashpot(s, work)


@kernel
def book_losses(s, bars):
    """Spell out the pairs, and book all that was taken or lost; how many modes."""
    book_work(s, bars)
    n = spell_out(s, bars, bars.w, PQ)
    energy = energy_about_rest(s, bars, n)
    s.e_loss += s.vibrates - energy
    s.vibrates = energy
    return n


@kernel
def take_modes(par, s, bars, n):
    """Go back from pairs to the offsets and velocities of the form's modes in `bars.rows`."""
    shape = bars.forms.shape[s.form]
    refresh_loads(s, bars, s.a_b, s.a_p)
    for k in range(0, n, WIDTH):
        rest = load(shape, SOFT, k) * load(bars.w, LOAD, k)
        store(bars.w, Q, k, load(bars.rows, 0, k) + rest)
        store(bars.w, V, k, load(bars.rows, 1, k))
    whole = bars.laws.sizes[s.law]
    for k in range(n, whole, WIDTH):
        store(bars.w, Q, k, load(shape, SOFT, k) * load(bars.w, LOAD, k))
        store(bars.w, V, k, spread(0.0))
    # loads bend a free bit without a piston by nothing; a wall excites all of its modes
    if s.form > 0 or is_rigid_rock(par):
        n = whole
    s.active, s.law = n, -1
    refresh_sums(s, bars)


@kernel
def drop_pairs(par, s, bars):
    """Go back to offsets and velocities of the form's modes; book what was lost."""
    take_modes(par, s, bars, book_losses(s, bars))


class Moving(NamedTuple):
    """What moves of some pairs."""

    energy: float  # of vibration [J]
    modes: int  # that hold next to all of it
    level: int  # of a look: two for each period of the highest of them


@kernel
def moving(s, bars, x, first):
    """Look which of the pairs in two rows of `x` move."""
    ends, energy = bars.laws.ends[s.law], energy_of_pairs(s, bars, x, first)
    least, above, modes = 2.0 * SLIGHT_SHARE * energy, 0.0, s.pairs
    while modes > FEWEST_MODES:
        if modes % WIDTH == 0 and modes > WIDTH:
            both = above + total(size_of(ends, x, first, modes - WIDTH))
            if both <= least:
                modes, above = modes - WIDTH, both
                continue
        q, v = x[first, modes - 1], x[first + 1, modes - 1]
        above += v * v + ends[SQUARE, modes - 1] * q * q
        if above > least:
            break
        modes -= 1
    level, n = STEP + 1, bars.laws.sizes[s.law]
    while level < LONGEST_HOP and 2 * modes <= n:
        n //= 2
        level += 1
    return Moving(energy, modes, level)
