"""When the next event of bit and rock comes: found by looks ahead, down to its tick.

Pairs move in `Bars.w`, in the rows from `AT` on, and looks are kept in `Bars.rows`; the state
stays as it is (docs/modal.md, section 4).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import bit_acceleration, time_to_cover
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import (
    barrier_off,
    damping,
    has_rock,
    is_crushable,
    origin,
    stiffness,
)
from percussion_model.solvers.modal.bars import way_alone
from percussion_model.solvers.modal.ends import (
    WHOLE,
    End,
    beyond,
    late_peak,
    level_below,
    passed,
    squared_between,
    time_of,
    top_between,
    turns_between,
)
from percussion_model.solvers.modal.lanes import (
    WIDTH,
    load,
    root,
    spread,
    store,
    total,
)
from percussion_model.solvers.modal.pairs import (
    AT,
    BIT,
    FIRST_STRIDE,
    LOW,
    PLOAD,
    PQ,
    SPEED,
    SQUARE,
    carry_pairs,
    keep,
    move_pairs,
    moving,
    part_of,
    taken_so_far,
)
from percussion_model.solvers.modal.plain_looks import SEEN, SIDE, plainly_kept
from percussion_model.solvers.modal.records import SCAN, STEP, Known, View

LOW_Q, LOW_V, SPEED_Q, SPEED_V = (int(row) for row in View)
# Looks within an interval whose work of the dashpot is summed up.
PIECES = 3
# Ticks in which the rock end goes straight.
STRAIGHT = 256
# An interval is halved where a straight line told so often to stay on one side.
SAME_SIDE = 4
# 2^SCAN_LEVEL looks at once.
SCAN_LEVEL = SCAN.bit_length() - 1
# Flight shorter than this is looked through.
FEWEST = 8 * WHOLE
# What the dashpot takes is computed once this many times its sum over looks may be enough.
UNSURE = 2.0
# A standstill is not quiet yet where its energy could move the force by so many times that at
# rest: by far not all of it ever lies in the rock at once.
UNLIKELY = 2.0
# What pairs that were left out could add, as a share of the force at rest.
LEFT_OUT = 1e-3
# A standstill is searched for peaks until its vibration is below this share of the load.
STILL_SHARE = 1e-3
# Looks for peaks until it is asked again what still moves, and by how many levels they are finer
# than looks for the end of a mode.
LOOK_AGAIN, FINER = 16, 1
# A standstill that is not quiet yet is cut into pieces, at whose ends its mean force is noted.
LONGEST_GLANCE = 128 * WHOLE
# So is one that is quiet, until its force stays within this share of that at rest.
LONGEST_LEAP, CALM = 16 * LONGEST_GLANCE, 0.5


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


class Found(NamedTuple):
    """What a search found."""

    ticks: int  # so far it came
    ends: bool  # whether the mode ends then
    known: bool  # whether the peaks are
    peak: float  # greatest force of the rock on the way [N]
    late: float  # the same after s.peak_from [N]
    contact: float  # greatest force of contact, as a mean, and after s.peak_from [N]
    late_contact: float
    window: float  # `peak_time` and `peak_impulse` of contact at the end [s, N s]
    impulse: float
    looks: int
    leaps: int  # times that nothing could happen for a while


@inlined
def scan(bars, view, modes, row):
    """See what two rows tell at the next looks, into two rows of `bars.rows`.

    Parameters
    ----------
    view : ndarray, shape (4 n, SCAN)
        As `Laws.scans` and `Laws.sides` have it.
    modes : int
        Pairs that count.
    row : int
        The first of the two.
    """
    one = one_v = other = other_v = spread(0.0)
    for k in range(modes):
        q, v = bars.w[AT, k], bars.w[AT + 1, k]
        one = one + load(view, 4 * k, 0) * q
        one_v = one_v + load(view, 4 * k + 1, 0) * v
        other = other + load(view, 4 * k + 2, 0) * q
        other_v = other_v + load(view, 4 * k + 3, 0) * v
    store(bars.rows, row, 0, one + one_v)
    store(bars.rows, row + 1, 0, other + other_v)


@kernel
def quiet_flight(par, s, bars, energy):
    """Time of free flight, with an energy of vibration [J], before the rock may be met [s]."""
    if not has_rock(par):
        return math.inf
    ends = bars.laws.ends[s.law]
    # elastic modes of a free bit leave its mean where it is
    mean = (s.rest_b + ends[BIT, 0] * bars.w[AT, 0]) / par.mass_b
    v = ends[BIT, 0] * bars.w[AT + 1, 0] / par.mass_b
    room = s.p_u - (s.p - s.low) - mean - par.bound_b * math.sqrt(2.0 * energy)
    return time_to_cover(room, v, bit_acceleration(par, s))


@kernel
def most_swing(s, bars, law):
    """Bound of how far the force of a standstill may come from that at rest, now or later [N].

    Each pair is an oscillator of its own, so that its V^2 + square Q^2 never grows.
    """
    ends, K, C, most = bars.laws.ends[s.law], law.stiffness, law.damping, spread(0.0)
    for k in range(0, s.pairs, WIDTH):
        q, v, square = load(bars.w, AT, k), load(bars.w, AT + 1, k), load(ends, SQUARE, k)
        by_q = load(ends, LOW, k) * K + load(ends, SPEED, k) * C
        by_v = load(ends, LOW + 1, k) * K + load(ends, SPEED + 1, k) * C
        most = most + root((by_q * by_q + square * by_v * by_v) * (q * q + v * v / square))
    return total(most)


class Quiet(NamedTuple):
    """Time in which nothing can happen."""

    ticks: int  # 0 where looks are better
    swing: float  # `most_swing` of a standstill [N]


@kernel
def quiet_standstill(par, s, bars, law, energy, most):
    """Make out how long a standstill goes on by itself, up to `most` ticks; `Quiet`."""
    if s.alert == 1 or not is_crushable(par) or barrier_off(par, s):
        return Quiet(0, 0.0)
    rest, free = par.mass_b * bit_acceleration(par, s), par.release == 1
    if free and 2.0 * energy * law.stiffness >= (UNLIKELY * rest) ** 2:
        return Quiet(0, 0.0)
    swing = most_swing(s, bars, law)
    if free and swing >= (1.0 - LEFT_OUT) * rest:
        return Quiet(0, 0.0)
    return Quiet(most if not free or swing < CALM * rest else min(most, LONGEST_LEAP), swing)


@kernel
def quiet_peaks(par, s, bars, law, ticks, swing):
    """Greatest forces of a quiet standstill; as `Found` has them, and whether they are known.

    They are not sought where no force can be the greatest of the blow, but for those of an
    observer, and for these when the leap is made: most of it has passed then unobserved.
    """
    rest, K = par.mass_b * bit_acceleration(par, s), stiffness(s)
    begin, peak, late, done = time_of(par, s), 0.0, 0.0, 0
    watched = begin + ticks * par.tick > s.peak_from
    if rest + swing <= s.b_peak_bit:
        if not watched:
            return peak, late, True
        if s.leap_known != Known.SOUGHT:
            return peak, late, False
        # whole steps before the observer looks
        done = max(0, int((s.peak_from - begin) / par.tick) - WHOLE) >> STEP << STEP
        carry_pairs(s, bars, bars.w, AT, done)
    before, looks, hop = present_end(s, bars, law), 0, WHOLE
    while done < ticks:
        if looks % LOOK_AGAIN == 0:
            now = moving(s, bars, bars.w, AT)
            hop = 1 << max(now.level - FINER, STEP)
            if 4.0 * K * now.energy < (STILL_SHARE * rest) ** 2:
                return max(peak, rest), max(late, rest) if watched else 0.0, True
            most = rest + most_swing(s, bars, law)
            if most <= max(peak, s.b_peak_bit) and (most <= late or not watched):
                return peak, late, True  # whatever follows is smaller
        go = min(hop, ticks - done)
        carry_pairs(s, bars, bars.w, AT, go)
        here, done, looks = present_end(s, bars, law), done + go, looks + 1
        top = top_between(s, before, here, par.tick * go)
        peak = max(peak, top.peak)
        late = max(late, late_peak(s, begin + done * par.tick, par.tick * go, top))
        before = here
    return peak, late, True


@inlined
def may_be_enough(s, work):
    """Whether the barrier may be overcome by so much work of the dashpot since pairs were taken."""
    return s.mode == Mode.DFC and s.w + work >= s.w_r


class Touching(NamedTuple):
    """Contact of bars that touch, as far as a search has come."""

    speed: float  # mean velocity of the piston [m/s]
    window: float  # `peak_time` and `peak_impulse` [s, N s]
    impulse: float
    contact: float  # as in `Found`
    late: float


class Seen(NamedTuple):
    """What looks side by side tell."""

    kept: int  # looks before the mode may end
    near: bool  # whether it may end by the next
    blocked: bool  # whether piston and bit may meet or part by the next
    sampled: float  # by the looks, what the dashpot took since it was known [J]
    last: End  # at the last that was kept
    then: End  # at the next
    peak: float  # as in `Found`
    late: float
    touch: Touching


@inlined
def touches_on(par, s, touch, speed, h, time):
    """Go on by the mean force of contact between two looks.

    Parameters
    ----------
    speed : float
        Mean velocity of the piston at the later one [m/s].
    h, time : float
        Between the looks, and of the later one [s].
    """
    window, contact, late = touch.window + h, touch.contact, touch.late
    impulse = touch.impulse + par.mass_p * (s.a_p * h - (speed - touch.speed))
    if window >= 0.999 * par.window:
        mean = impulse / window
        contact = max(contact, mean)
        late = max(late, mean) if time > s.peak_from else late
        window = impulse = 0.0
    return Touching(speed, window, impulse, contact, late)


@inlined
def look_through(par, s, bars, law, beside, ticks, level, count, taken, sampled, last, touch):
    """Go through the looks of a scan.

    Parameters
    ----------
    ticks : int
        From the state to where the search is.
    level, count : int
        So many looks, 2^level ticks apart.
    taken, sampled : float
        What the dashpot had taken when that was known, and what it took by the looks since [J].
    last : End
        The rock end where the search is.
    touch : Touching
        The contact there.
    """
    h, kept, near, then, peak, late = par.tick * (1 << level), 0, False, last, 0.0, 0.0
    since, blocked, speed_p = par.tick * ticks, False, 0.0
    begin = time_of(par, s) + since
    if count == SCAN and not beside.near and (s.mode == Mode.FF or is_crushable(par)):
        most = s.b_peak_bit
        if begin + SCAN * h > s.peak_from:
            most = min(most, s.peak_bit_force)
        spare = (s.w_r - s.w - taken) / UNSURE - sampled
        kept, work = plainly_kept(s, bars, law, h, last, most, spare)
        sampled += work
        if kept > 0:
            low, speed = bars.rows[SEEN, kept - 1], bars.rows[SEEN + 1, kept - 1]
            last = then = end_at(s, law, low, speed, h * kept)
    while kept < count:
        if beside.near:
            t, apart = h * (kept + 1), beside.room
            if beside.touches:
                apart -= bars.rows[SIDE, kept]
                speed_p = (bars.rows[SIDE + 1, kept] + beside.pull * t) / par.mass_p
                # by the mean since the look before as well
                apart = min(apart, par.mass_p * (s.a_p - (speed_p - touch.speed) / h))
            else:
                apart += bars.rows[SIDE, kept] + 0.5 * beside.pull * t * t
                apart -= way_alone(s, since + t)
            if apart < 0.0:
                blocked = True
                break
        low, speed = bars.rows[SEEN, kept], bars.rows[SEEN + 1, kept]
        then, share = end_at(s, law, low, speed, h * (kept + 1)), 0.0
        if s.mode == Mode.DFC:
            share = 0.5 * law.damping * h * (last.speed * last.speed + then.speed * then.speed)
        near = may_be_enough(s, taken + UNSURE * (sampled + share))
        near = near or passed(par, s, then.p, then.speed, 0.0, then.force)
        near = near or turns_between(s, last, then, h) > 0.0
        if near:
            break
        kept += 1
        sampled += share
        if s.mode != Mode.FF:
            top = top_between(s, last, then, h)
            peak, late = max(peak, top.peak), max(late, late_peak(s, begin + h * kept, h, top))
        last = then
        if beside.touches:
            touch = touches_on(par, s, touch, speed_p, h, begin + h * kept)
    return Seen(kept, near, blocked, sampled, last, then, peak, late, touch)


@merged
def quiet_ahead(par, s, bars, law, energy, most):
    """Make out for how long nothing can happen, up to `most` ticks; `Quiet`."""
    if par.leaps == 0:
        return Quiet(0, 0.0)
    if s.mode == Mode.FF:
        ticks = min(quiet_flight(par, s, bars, energy) / par.tick - WHOLE, most)
        return Quiet(int(ticks) if ticks >= FEWEST else 0, 0.0)
    if s.mode == Mode.SS:
        return quiet_standstill(par, s, bars, law, energy, most)
    return Quiet(0, 0.0)


@kernel
def search(par, s, bars, most, beside):
    """Look for the end of the present mode, `most` ticks ahead at most; `Found`.

    Beside a piston that is near it ends where the two may meet or part; where one touches, also
    where the mode may end.
    """
    keep(bars.w, PQ, bars.w, AT, s.pairs)
    law, stands = present_law(s, bars), s.mode == Mode.SS
    ticks, looks, leaps, peak, late, ends, known = 0, 0, 0, 0.0, 0.0, False, True
    taken, sampled, last = 0.0, 0.0, End(s.p, s.v_low, s.f_rock)
    touch = Touching(s.v_p, s.peak_time, s.peak_impulse, 0.0, 0.0)
    if s.mode == Mode.DFC and s.stride > FIRST_STRIDE:
        taken = taken_so_far(s, bars, AT)
    now, stale = moving(s, bars, bars.w, AT), False
    while ticks < most and not ends and not (stands and ticks >= LONGEST_GLANCE):
        rest = most - ticks
        if stale:  # what moved before is a bound of what does
            now = moving(s, bars, bars.w, AT)
        stale = not stale
        quiet = Quiet(0, 0.0)
        if not beside.near:
            quiet = quiet_ahead(par, s, bars, law, now.energy, rest)
        if quiet.ticks > 0 and stands and ticks > 0:
            break  # its mean force is noted where it begins
        if quiet.ticks > 0:
            if stands:
                peak, late, known = quiet_peaks(par, s, bars, law, quiet.ticks, quiet.swing)
                keep(bars.w, PQ, bars.w, AT, s.pairs)
            carry_pairs(s, bars, bars.w, AT, quiet.ticks)
            ticks += quiet.ticks
            leaps += 1
            continue
        level = min(now.level, STEP + 2) if beside.near else now.level
        while level > STEP and rest < 1 << level:
            level -= 1
        count = min(SCAN, rest >> level)
        if beside.near and count == 0:
            break
        if count > 0:
            scan(bars, bars.laws.scans[s.law, level - STEP], now.modes, SEEN)
        if beside.near:
            scan(bars, bars.laws.sides[s.law, level - STEP], now.modes, SIDE)
        seen = look_through(
            par, s, bars, law, beside, ticks, level, count, taken, sampled, last, touch
        )
        sampled, last, touch = seen.sampled, seen.last, seen.touch
        peak, late = max(peak, seen.peak), max(late, seen.late)
        if seen.kept == SCAN:
            move_pairs(s, bars, bars.w, AT, level + SCAN_LEVEL)
        else:
            carry_pairs(s, bars, bars.w, AT, seen.kept << level)
        ticks += seen.kept << level
        looks += seen.kept
        if seen.blocked:
            break
        if seen.near and sampled > 0.0:
            taken, sampled = taken_so_far(s, bars, AT), 0.0
        elif seen.near and beside.touches:
            break
        elif seen.near or count == 0:
            within, first = min(1 << level, rest), last
            fresh = ticks == 0 and s.stride == FIRST_STRIDE
            more, ends, work, last = narrow(
                par, s, bars, law, within, taken, last, seen.then, fresh
            )
            ticks += more
            looks += 1
            sampled = max(work - taken, 0.0)
            if s.mode != Mode.FF and more > 0:
                top = top_between(s, first, last, par.tick * more)
                end = time_of(par, s) + par.tick * ticks
                peak = max(peak, top.peak)
                late = max(late, late_peak(s, end, par.tick * more, top))
    contact = touch.contact, touch.late, touch.window, touch.impulse
    return Found(ticks, ends, known, peak, late, *contact, looks, leaps)
