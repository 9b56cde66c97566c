"""Leaps of a bit alone: from one event to the next in one move."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.records import Mode, RockKind
from percussion_model.solvers.modal.change import end_mode
from percussion_model.solvers.modal.near import book_way, present_look, ready, watch_barrier
from percussion_model.solvers.modal.pairs import AT, PQ, drop_tiny, keep
from percussion_model.solvers.modal.piston import (
    WHOLE,
    at_rest,
    has_piston,
    park,
    quiet_time,
    time_of,
)
from percussion_model.solvers.modal.search import search

# Rows of `Bars.rows` that keep pairs.
KEPT = np.int64(4)
# Most ticks of a leap.
LONGEST = 65535 * WHOLE
# In a longer one modes may die away altogether.
LONG = 512 * WHOLE
# One that may not be longer because of the piston is not worth a search.
FEWEST = 4 * WHOLE


@merged
def far_ticks(par, s, bars):
    """Ticks for which the piston can neither meet the bit nor turn the drive."""
    if not has_piston(par):
        return LONGEST
    if s.parked == 0:
        return 0
    size, held = math.sqrt(max(0.0, 2.0 * s.vibrates)), bars.forms.stiff[s.form]
    spread = par.bound_t * size + abs(s.offset)
    if held == 0.0:
        time = quiet_time(par, s, s.v_b, s.a_b, spread, 0.0)
    else:
        mean = size * (1.0 / math.sqrt(held) + par.bound_b)
        off = 2.0 * mean + abs(s.low - s.rest_low)
        time = quiet_time(par, s, 0.0, 0.0, spread, off)
    return int(min(time / par.tick - 1.0, LONGEST))


@kernel
def plan(par, s, bars, law, most, events):
    """Decide where the bit leaps to next: s.leap_end, or -1 where the piston is near.

    Parameters
    ----------
    law : int
        By which it moves.
    most : int
        Ticks that it may go at most.
    """
    if has_piston(par) and s.parked == 0 and s.time >= s.no_park:
        park(par, s, bars)
    ready(par, s, bars, law)
    if s.mode == Mode.SS and s.alert == 1 and par.rock == RockKind.BILINEAR:
        watch_barrier(par, s, bars, law, events)
        if s.law < 0:
            return
        if s.alert == 1:
            most = min(most, WHOLE)
    most = at_rest(s, most)
    far = far_ticks(par, s, bars)
    if far < FEWEST:
        return
    found = search(par, s, bars, min(most, far))
    s.leap_end = s.time + found.ticks
    s.leap_ends = 1 if found.ends else 0
    s.leap_peak = found.peak
    s.count_steps += found.looks
    s.count_leaps += found.leaps


@kernel
def late_peak(par, s, bars, ticks):
    """Greatest force of a leap about to be made after s.peak_from, which lies within it [N]."""
    keep(bars.w, AT, bars.rows, KEPT, s.pairs)
    late = search(par, s, bars, ticks).late
    keep(bars.rows, KEPT, bars.w, AT, s.pairs)
    return late


@merged
def note_peaks(par, s, bars, ticks):
    """Note the greatest forces of a leap about to be made."""
    s.b_peak_bit = max(s.b_peak_bit, s.leap_peak)
    if time_of(par, s) >= s.peak_from:
        s.peak_bit_force = max(s.peak_bit_force, s.leap_peak)
    elif time_of(par, s) + ticks * par.tick > s.peak_from:
        s.peak_bit_force = max(s.peak_bit_force, late_peak(par, s, bars, ticks))


@kernel
def leap(par, s, bars, events):
    """Carry bit and mean motion of the piston to s.leap_end in one go."""
    ticks, ends = s.leap_end - s.time, s.leap_ends == 1
    s.leap_end = -1
    if s.mode != Mode.FF:
        note_peaks(par, s, bars, ticks)
    if s.mode == Mode.SS:
        push_checkpoint(s, time_of(par, s))
    keep(bars.w, AT, bars.w, PQ, s.pairs)
    if ticks > LONG:
        drop_tiny(s, bars)
    book_way(par, s, bars, ticks, present_look(par, s, bars))
    if s.mode == Mode.SS:
        push_checkpoint(s, time_of(par, s))
    if ends:
        end_mode(par, s, bars, events)
