"""Leaps of a bit alone: from one event to the next in one move."""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.loads import room_to_turn
from percussion_model.physics.records import Mode, RockKind
from percussion_model.solvers.modal.change import end_mode
from percussion_model.solvers.modal.near import book_way, present_look, ready, watch_barrier
from percussion_model.solvers.modal.pairs import AT, PQ, drop_tiny, keep
from percussion_model.solvers.modal.piston import (
    RINGING,
    WHOLE,
    at_rest,
    has_piston,
    park,
    quiet_time,
    time_of,
)
from percussion_model.solvers.modal.records import KEPT, Known
from percussion_model.solvers.modal.search import beside_of, search

# Most ticks of a leap.
LONGEST = 65535 * WHOLE
# In a longer one modes may die away altogether.
LONG = 512 * WHOLE
# One that may not be longer because of the piston is not worth a search.
FEWEST = 4 * WHOLE


class Far(NamedTuple):
    """Ticks in which nothing can come from the piston."""

    meet: int  # before it can meet the bit
    turn: int  # before the drive can turn


@merged
def far_touching(par, s):
    """As `far_ticks` of a piston that touches the bit."""
    age = s.time - s.closed_at
    if age < par.ringing or age * par.tick < RINGING * par.window:
        return Far(0, 0)
    speed = 1.0 / math.sqrt(par.mass_p) + 1.0 / math.sqrt(par.mass_b)
    speed *= math.sqrt(max(0.0, 2.0 * s.vibrates))
    room = room_to_turn(par, s, s.u_r)
    return Far(0, int(min(max(room, 0.0) / (speed * par.tick + 1e-300), LONGEST)))


@merged
def far_ticks(par, s, bars):
    """Ticks for which the piston can neither meet the bit nor turn the drive."""
    if not has_piston(par):
        return Far(LONGEST, LONGEST)
    if s.closed == 1:
        return far_touching(par, s)
    if s.parked == 0:
        return Far(0, 0)
    size, held = math.sqrt(max(0.0, 2.0 * s.vibrates)), bars.forms.stiff[s.form]
    spread = par.bound_t * size + abs(s.offset)
    if held == 0.0:
        meet, turn = quiet_time(par, s, s.v_b, s.a_b, spread, 0.0)
    else:
        mean = size * (1.0 / math.sqrt(held) + par.bound_b)
        off = 2.0 * mean + abs(s.low - s.rest_low)
        meet, turn = quiet_time(par, s, 0.0, 0.0, spread, off)
    return Far(
        int(min(meet / par.tick - 1.0, LONGEST)), int(min(turn / par.tick - 1.0, LONGEST))
    )  # fmt: skip


@kernel
def plan(par, s, bars, law, most, events):
    """Decide where the bit leaps to next: s.leap_end, or -1 where the piston is near.

    Returns
    -------
    int
        Ticks that it may go at most.

    Parameters
    ----------
    law : int
        By which it moves.
    most : int
        Ticks that it may go at most.
    """
    if has_piston(par) and s.parked == 0 and s.closed == 0 and s.time >= s.no_park:
        park(par, s, bars)
    ready(par, s, bars, law)
    if s.mode == Mode.SS and s.alert == 1 and par.rock == RockKind.BILINEAR:
        most = watch_barrier(par, s, bars, most, events)
        if s.law < 0:
            return most
    most = at_rest(s, most)
    far = far_ticks(par, s, bars)
    ahead = min(most, far.turn)
    if far.meet >= FEWEST:
        ahead = min(ahead, far.meet)
    elif ahead < FEWEST or (s.parked == 0 and s.closed == 0):
        return most
    # of a copy that is read, all is sought at once
    s.leap_known = Known.NOT if s.live == 1 else Known.SOUGHT
    found = search(par, s, bars, ahead, beside_of(par, s, bars, far.meet < FEWEST))
    s.leap_known = Known.YES if found.known else Known.NOT
    s.count_steps += found.looks
    if found.ticks == 0:
        return min(most, FEWEST)
    s.leap_end = s.time + found.ticks
    s.leap_ends = 1 if found.ends else 0
    s.leap_peak, s.leap_contact = found.peak, found.contact
    s.late_from, s.late_peak, s.late_contact = s.peak_from, found.late, found.late_contact
    s.leap_time, s.leap_impulse = found.window, found.impulse
    s.count_leaps += found.leaps
    return most


@kernel
def late_peaks(par, s, bars, ticks):
    """Find the greatest forces of a leap about to be made after s.peak_from."""
    keep(bars.w, AT, bars.rows, KEPT, s.pairs)
    far = far_ticks(par, s, bars)
    s.leap_known = Known.SOUGHT
    found = search(par, s, bars, ticks, beside_of(par, s, bars, far.meet < FEWEST))
    keep(bars.rows, KEPT, bars.w, AT, s.pairs)
    s.late_peak, s.late_contact = found.late, found.late_contact


@merged
def note_peaks(par, s, bars, ticks):
    """Note the greatest forces of a leap about to be made."""
    if s.mode == Mode.FF:
        s.leap_peak = 0.0
    s.b_peak_bit = max(s.b_peak_bit, s.leap_peak)
    s.b_peak_contact = max(s.b_peak_contact, s.leap_contact)
    if not time_of(par, s) + ticks * par.tick > s.peak_from:
        return
    if s.leap_known != Known.YES or s.late_from != s.peak_from:
        late_peaks(par, s, bars, ticks)
    if s.mode != Mode.FF:
        s.peak_bit_force = max(s.peak_bit_force, s.late_peak)
    s.peak_contact_force = max(s.peak_contact_force, s.late_contact)


@kernel
def leap(par, s, bars, events):
    """Carry bit and mean motion of the piston to s.leap_end in one go."""
    ticks, ends = s.leap_end - s.time, s.leap_ends == 1
    s.leap_end = -1
    if s.mode != Mode.FF or s.closed == 1:
        note_peaks(par, s, bars, ticks)
    if s.mode == Mode.SS:
        push_checkpoint(s, time_of(par, s))
    keep(bars.w, AT, bars.w, PQ, s.pairs)
    if ticks > LONG:
        drop_tiny(s, bars)
    v_p = s.v_p
    book_way(par, s, bars, ticks, present_look(par, s, bars))
    if s.closed == 1:
        s.i_contact += par.mass_p * (ticks * par.tick * s.a_p - (s.v_p - v_p))
        s.peak_time, s.peak_impulse = s.leap_time, s.leap_impulse
    if s.mode == Mode.SS:
        push_checkpoint(s, time_of(par, s))
    if ends:
        end_mode(par, s, bars, events)
