"""Changes of mode of a bit alone: from the pairs of one law to those of the next in one product."""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import barrier_level, origin
from percussion_model.solvers.modal.bar import BIT
from percussion_model.solvers.modal.forms import change_spring, form_wanted
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, store, total
from percussion_model.solvers.modal.pairs import (
    BIT_SPEED,
    FIRST_STRIDE,
    PLOAD,
    PQ,
    PV,
    SHIFT,
    YIELDS,
    book_losses,
    book_work,
    drop_pairs,
    enough_pairs,
    hold_low,
    keep,
    law_in,
    leave_out_pairs,
    shift_pairs,
    sum_of,
    take_modes,
    to_be_taken,
    turn_into,
)
from percussion_model.solvers.modal.records import Rest
from percussion_model.solvers.modal.rock_end import QUIET_SHARE, change_mode, next_mode, note_mode

REST_LOW, REST_TOP, REST_BIT = (int(row) for row in Rest)


@inlined
def besides(s, bars):
    """Energy of the bar that is not of vibration about rest, without the rock's [J]."""
    if s.form == 0:
        return 0.5 * bars.w[PV, 0] * bars.w[PV, 0]
    return s.a_b * (s.at_b - 0.5 * s.rest_b) - 0.5 * bars.forms.stiff[s.form] * s.low * s.low


@kernel
def pass_over(par, s, bars, law, over):
    """Go on by the pairs of another law, with the penetration that the mode has.

    What they have no room for is booked with the losses of the law.

    Parameters
    ----------
    over : int
        Place of the table in `Laws.over`.
    """
    w, low, v_b = bars.w, s.p - origin(s), s.v_b
    tip, energy = s.top - s.at_b / par.mass_b, s.vibrates + besides(s, bars)
    s.pairs = turn_into(par, s, bars, law, over, bars.laws.over[over], PQ, s.pairs)
    keep(bars.rows, 0, w, PQ, s.pairs)
    for k in range(0, s.pairs, WIDTH):
        store(w, PLOAD, k, spread(0.0))
    s.law, s.form, s.active, s.stride = law, law // 2, s.pairs, FIRST_STRIDE
    if s.form == 0:
        w[PLOAD, 0] = bars.forms.shape[0, BIT, 0] * s.a_b
    rest = bars.laws.rest[law]
    s.rest_low, s.rest_top = rest[REST_LOW] * s.a_b, rest[REST_TOP] * s.a_b
    s.rest_b = rest[REST_BIT] * s.a_b
    s.pairs = enough_pairs(par, s, bars)
    shift_pairs(s, bars, low - s.low)
    hold_low(s, bars, low, YIELDS if s.form > 0 else SHIFT)
    ends = bars.laws.ends[law]
    s.v_b = sum_of(ends, BIT_SPEED, w, s.pairs) / par.mass_b
    s.i_bit -= par.mass_b * (s.v_b - v_b)
    s.offset += tip - (s.top - s.at_b / par.mass_b)
    s.vibrates = energy - besides(s, bars)
    s.takes = 0.0
    if law % 2 == 1:
        s.takes = to_be_taken(bars.laws.taken[law], w, PQ, s.pairs)


@inlined
def by_energy(s):
    """Whether the energy of the bit decides which mode follows."""
    return s.mode == Mode.FF or (s.mode == Mode.BC and s.p >= s.p_u)


@kernel
def end_mode(par, s, bars, events):
    """Make the change of mode that the present pairs ask for."""
    if s.closed == 1:
        drop_pairs(par, s, bars)
        change_mode(par, s, bars, events)
        return
    leave_out_pairs(par, s, bars)
    n, squares = -1, spread(0.0)
    if by_energy(s):
        n = book_losses(s, bars)
        for k in range(0, n, WIDTH):
            v = load(bars.rows, 1, k)
            squares = squares + v * v
    else:
        book_work(s, bars)
    if not next_mode(par, s, 0.5 * total(squares)):
        return
    form = form_wanted(par, s)
    law = law_in(par, s, bars.laws, form)
    over = bars.laws.way[s.law, law] if law >= 0 else -1
    if over >= 0:
        pass_over(par, s, bars, law, over)
    else:
        if n < 0:
            n = book_losses(s, bars)
        take_modes(par, s, bars, n)
        change_spring(par, s, bars)
    s.alert = 1
    quiet = QUIET_SHARE * barrier_level(par, s)
    if s.mode == Mode.SS and over >= 0 and s.vibrates <= quiet:
        s.alert = 0
    note_mode(par, s, events)
