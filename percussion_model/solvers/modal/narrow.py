"""Looks at the rock end one at a time, down to the tick in which a mode ends.

Pairs move in `Bars.w`, in the rows from `AT` on; the state stays as it is.
"""

from __future__ import annotations

from typing import NamedTuple

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import damping, origin, stiffness
from percussion_model.solvers.modal.between import End, squared_between, turns_between
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, total
from percussion_model.solvers.modal.pairs import (
    AT,
    LOW,
    PLOAD,
    SPEED,
    carry_pairs,
    move_pairs,
    part_of,
)
from percussion_model.solvers.modal.records import STEP, View
from percussion_model.solvers.modal.rock_end import passed

LOW_Q, LOW_V, SPEED_Q, SPEED_V = (int(row) for row in View)
# Looks within an interval whose work of the dashpot is summed up.
PIECES = 3
# Ticks in which the rock end goes straight.
STRAIGHT = 256
# An interval is halved where a straight line told so often to stay on one side.
SAME_SIDE = 4


class Law(NamedTuple):
    """What does not change while a search goes on."""

    stiffness: float  # of the rock [N/m]
    damping: float  # [N s/m]
    origin: float  # [m]
    pull: float  # acceleration of the rock end by the load on a free bit [m/s2]


@inlined
def present_law(s, bars):
    """What a search goes by."""
    pull = bars.laws.ends[s.law][LOW, 0] * bars.w[PLOAD, 0]
    return Law(stiffness(s), damping(s), origin(s), pull)


@inlined
def end_at(s, law, low, speed, t):
    """Make out the rock end `t` after where the search is, by what pairs tell of it."""
    p = s.p + (s.rest_low + low + 0.5 * law.pull * t * t - s.low)
    speed += law.pull * t
    return End(p, speed, law.stiffness * (p - law.origin) + law.damping * speed)


@inlined
def present_end(s, bars, law):
    """Look at the rock end where the search is."""
    ends, low, speed = bars.laws.ends[s.law], spread(0.0), spread(0.0)
    for k in range(0, s.pairs, WIDTH):
        q, v = load(bars.w, AT, k), load(bars.w, AT + 1, k)
        low = low + part_of(ends, LOW, k, q, v)
        speed = speed + part_of(ends, SPEED, k, q, v)
    return end_at(s, law, total(low), total(speed), 0.0)


@inlined
def end_after(par, s, bars, law, level):
    """Look at the rock end 2^level ticks after where the search is."""
    view, low, speed = bars.laws.views[s.law, level], spread(0.0), spread(0.0)
    for k in range(0, s.pairs, WIDTH):
        q, v = load(bars.w, AT, k), load(bars.w, AT + 1, k)
        low = low + load(view, LOW_Q, k) * q
        low = low + load(view, LOW_V, k) * v
        speed = speed + load(view, SPEED_Q, k) * q
        speed = speed + load(view, SPEED_V, k) * v
    return end_at(s, law, total(low), total(speed), par.tick * (1 << level))


@inlined
def beyond(s, here):
    """How far the rock end is beyond where the mode ends, where that is likely; in any unit."""
    if s.mode == Mode.FF:
        return here.p - s.p_u
    if s.mode == Mode.SS:
        return -here.force
    if s.mode == Mode.BC:
        return s.p_u - here.p
    return -here.speed


@inlined
def level_below(ticks):
    """Greatest level with 2^level ticks at most, of one at least."""
    level = 0
    while ticks >= 2 << level:
        level += 1
    return level


@inlined
def squared_speed(par, s, bars, law, level, before, after, fresh):
    """Integral of the squared velocity of the rock end over 2^level ticks [m2/s].

    Pieces are short at first where a bit has just met the rock (`fresh`): its velocity drops
    within tenths of a microsecond.
    """
    total, ticks, begin = 0.0, 0, before
    if not fresh:
        return squared_between(before, after, par.tick * (1 << level))
    for part in range(STEP - PIECES, level):
        here = end_after(par, s, bars, law, part)
        total += squared_between(begin, here, par.tick * ((1 << part) - ticks))
        ticks, begin = 1 << part, here
    return total + squared_between(begin, after, par.tick * ((1 << level) - ticks))


@kernel
def narrow(par, s, bars, law, most, work, before, then, fresh):
    """Go on to the tick in which the mode ends, if it does so within `most`.

    Parameters
    ----------
    work : float
        What the dashpot has taken so far [J].
    before, then : End
        The rock end now, and after `most` ticks.
    fresh : bool
        Whether the mode has just begun.

    Returns
    -------
    ticks : int
    ends : bool
    work : float
        At the end.
    now : End
    """
    ticks, rest, low, high, same = 0, most, beyond(s, before), beyond(s, then), 0
    turn = most * turns_between(s, before, then, par.tick * most)
    while rest > 0:
        if rest <= STRAIGHT and low < 0.0 < high:
            # a straight line tells when
            go = min(1 + int(rest * low / (low - high)), rest)
            carry_pairs(s, bars, bars.w, AT, go)
            here = present_end(s, bars, law)
            if s.mode == Mode.DFC:
                work += law.damping * squared_between(before, here, par.tick * go)
            ticks, rest, before, low = ticks + go, rest - go, here, beyond(s, here)
            if passed(par, s, here.p, here.speed, work, here.force):
                return ticks, True, work, here
            continue
        guess = 0.5 * rest
        if ticks < turn:
            guess = turn - ticks
        elif low < 0.0 < high and abs(same) < SAME_SIDE:
            # so far by a straight line
            guess = rest * low / (low - high)
        level = level_below(min(max(guess, 1.0), rest - 1.0))
        if rest > 4 << level:
            level += 1  # likely beyond: the line is straighter in between
        go = 1 << level
        here, after = end_after(par, s, bars, law, level), work
        if s.mode == Mode.DFC:
            after += law.damping * squared_speed(
                par, s, bars, law, level, before, here, fresh and ticks == 0
            )
        passes = passed(par, s, here.p, here.speed, after, here.force)
        if passes and level > 0:
            rest, high, same = go, beyond(s, here), max(same, 0) + 1
            continue
        move_pairs(s, bars, bars.w, AT, level)
        ticks, rest = ticks + go, rest - go
        work, before, low, same = after, here, beyond(s, here), min(same, 0) - 1
        if passes:
            return ticks, True, work, before
    return ticks, False, work, before
