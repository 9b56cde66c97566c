"""A bit beside a piston that is near or touches it: looks at both ends, up to the next event.

What the bodies did is booked once for all looks, and for leaps alike (docs/modal.md, section 4).
"""

from __future__ import annotations

from typing import NamedTuple

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import (
    book_bit_load,
    book_piston_load,
    drive_force,
    pass_time,
    room_to_turn,
    switch_drive,
)
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import crush, damping, origin, recoverable, stiffness
from percussion_model.physics.state import CHECKPOINTS
from percussion_model.solvers.modal.bars import flight_of, move_free, way_alone
from percussion_model.solvers.modal.ends import (
    CHECKPOINT,
    End,
    at_rest,
    beyond,
    book_contact,
    end_mode,
    flip_contact,
    has_piston,
    late_peak,
    level_below,
    passed,
    push_of,
    squared_between,
    switches,
    time_of,
    top_between,
    turns_between,
    unpark,
)
from percussion_model.solvers.modal.next_event import SAME_SIDE, UNSURE
from percussion_model.solvers.modal.pairs import (
    BIT_SPEED,
    FIRST_STRIDE,
    PISTON,
    PLOAD,
    PQ,
    TOP,
    Sums,
    ahead_of,
    drop_pairs,
    keep_ahead,
    moving,
    present_sums,
    sum_of,
    taken_so_far,
    touch_of,
)
from percussion_model.solvers.modal.records import LONGEST_STRIDE, STEP

# What a look may pass: piston and bit meet or part, the drive turns, the mode of the rock ends, so
# also by the work of its dashpot; or nothing at the look, but the rock end turned back before.
MEETS, TURNS, ENDS, WORK, BACK = range(5)


class Beside(NamedTuple):
    """What does not change of a piston that touches the bit, or waits near it.

    Attributes
    ----------
    near, touches : bool
        Whether it is near, and whether it touches.
    room : float
        Of one that waits: gap to a top of the bit without offset, and bounded vibration [m]. Of
        one that touches: force on the bit but for what pairs tell [N].
    pull : float
        Acceleration of the top by the load on a free bit [m/s2]; of one that touches, of its
        mass as a whole [N].
    """

    near: bool
    touches: bool
    room: float
    pull: float


@inlined
def beside_of(par, s, bars, near):
    """What a search beside a piston goes by."""
    ends, load_ = bars.laws.ends[s.law], bars.w[PLOAD, 0]
    if s.closed == 1:
        return Beside(True, True, par.mass_p * s.a_p - s.rest_pull, ends[PISTON, 0] * load_)
    room = s.u_b - s.at_b / par.mass_b + s.rest_top + s.offset - (s.u_p + s.spread_p)
    return Beside(near, False, room, ends[TOP, 0] * load_)


class Look(NamedTuple):
    """Where bit and piston are after some time, and what that means."""

    sums: Sums
    p: float  # penetration [m]
    force: float  # of the rock [N]
    u_r: float  # relative displacement [m]
    low_p: float  # offset of the free piston's low end [m]
    gap: float  # between the ends, or as far as a waiting piston's may be apart [m]; of
    # a piston that touches: force between them [N]
    at_p: float  # of a piston that touches: integral of its offset over its mass [kg m]
    v_p: float  # mean velocity [m/s]
    contact: float  # mean force on the bit since the look before [N]
    flips: bool  # whether piston and bit have met, or have parted


@inlined
def end_of(look):
    """The rock end at a look."""
    return End(look.p, look.sums.speed, look.force)


@inlined
def first_look(s):
    """The present state."""
    sums = Sums(s.low, s.v_low, s.top, s.at_b)
    return Look(
        sums, s.p, s.f_rock, s.u_r, s.low_p, s.gap, s.at_p, s.v_p, s.f_contact, False
    )  # fmt: skip


@inlined
def touching(par, s, bars, ticks, h, v_p):
    """What a piston that touches the bit does at a look, `h` after one at which it had `v_p`.

    Returns
    -------
    at_p, v_p, contact, touch : float
        As in `Look`, and the force at that time [N].
    parts : bool
        Whether the bit would have to pull it.
    """
    found = touch_of(s, bars, bars.rows, 0)
    then = found.speed / par.mass_p
    age = s.time + ticks - s.closed_at
    contact, touch = push_of(par, s, h, v_p, then, age, found.pull)
    # by the mean as well, since the force may have dipped between looks; not at once
    parts = (touch < 0.0 or contact < 0.0) and (age > 0 or h > par.tick)
    return found.piston, then, contact, touch, parts


@inlined
def look_at(par, s, bars, level, ticks, before):
    """Look 2^level ticks ahead of pairs that are `ticks` after the state, and look `before`."""
    sums = ahead_of(s, bars, level)
    p = s.p + (sums.low - s.low)
    force = stiffness(s) * (p - origin(s)) + damping(s) * sums.speed
    way_b = (sums.bit - s.at_b) / par.mass_b
    u_r, low_p, gap, at_p, v_p, contact, flips = s.u_r - way_b, 0.0, 0.0, 0.0, 0.0, 0.0, False
    if s.closed == 1:
        h = par.tick * (1 << level)
        at_p, v_p, contact, gap, flips = touching(par, s, bars, ticks, h, before.v_p)
        u_r += (at_p - s.at_p) / par.mass_p
    elif has_piston(par):
        time = par.tick * (ticks + (1 << level))
        flight = flight_of(par, s, bars, level, time, way_b, sums.top - sums.bit / par.mass_b)
        u_r += flight.way
        low_p, gap = flight.low, flight.gap
        flips = gap < 0.0
    return Look(sums, p, force, u_r, low_p, gap, at_p, v_p, contact, flips)


@kernel
def book_touch(par, s, h, look):
    """Book what a piston that touches the bit does for `h`."""
    push, way = drive_force(par, s), (look.at_p - s.at_p) / par.mass_p
    book_piston_load(par, s, push, way, push * h)
    if s.mode != Mode.FF:
        s.i_bit += par.mass_p * (h * s.a_p - (look.v_p - s.v_p))
    s.u_p += way
    s.v_p, s.at_p, s.f_contact = look.v_p, look.at_p, look.contact
    s.u_r = s.u_p - s.u_b
    s.b_stroke = max(s.b_stroke, -s.u_r)


@kernel
def book_flight(par, s, h, v_b, look):
    """Book what the piston does alone for `h`, beside a bit that had a velocity."""
    push = drive_force(par, s)
    way, a = way_alone(s, h), s.a_p - (s.v_b - v_b) / h
    # the stroke's turning point may lie within
    turn = -(s.v_p - v_b) / a if a != 0.0 else -1.0
    if 0.0 < turn < h and s.v_p < v_b:
        s.b_stroke = max(s.b_stroke, -(s.u_r + 0.5 * (s.v_p - v_b) * turn))
    book_piston_load(par, s, push, way, push * h)
    s.u_p += way
    s.v_p += h * s.a_p
    s.u_r = s.u_p - s.u_b
    s.b_stroke = max(s.b_stroke, -s.u_r)
    s.low_p, s.gap = look.low_p, look.gap
    if s.parked == 1:
        s.low_p, s.gap = 0.0, s.u_b - s.u_p


@kernel
def book_way(par, s, bars, ticks, look):
    """Book what bit and piston did up to a look that is `ticks` after the state."""
    h, before, p, v_b, sums = ticks * par.tick, recoverable(par, s), s.p, s.v_b, look.sums
    s.v_b = sum_of(bars.laws.ends[s.law], BIT_SPEED, bars.w, s.pairs) / par.mass_b
    way_b = (sums.bit - s.at_b) / par.mass_b
    book_bit_load(par, s, way_b)
    s.u_b += way_b
    s.low, s.top, s.at_b, s.v_low = sums.low, sums.top, sums.bit, sums.speed
    s.p, s.f_rock, s.f_contact = look.p, look.force, 0.0
    if s.mode == Mode.FF:
        s.f_rock = 0.0
        s.e_standstill += before - recoverable(par, s)
    else:
        s.i_bit += par.mass_b * (h * s.a_b - (s.v_b - v_b))
        s.rock_work += 0.5 * stiffness(s) * (s.p - p) * (s.p + p - 2.0 * origin(s))
        crush(par, s, p)
    if s.closed == 1:
        book_touch(par, s, h, look)
    elif has_piston(par):
        book_flight(par, s, h, v_b, look)
    s.time += ticks
    pass_time(par, s, h)
    s.stride = min(2 * s.stride, LONGEST_STRIDE)
    if s.mode == Mode.SS:
        last = s.check_time[(s.n_check - 1) % CHECKPOINTS]
        if s.n_check == 0 or time_of(par, s) - last >= CHECKPOINT * par.dt:
            push_checkpoint(s, time_of(par, s))


@merged
def present_look(par, s, bars):
    """Where bars are now."""
    sums = present_sums(s, bars)
    p = s.p + (sums.low - s.low)
    force = stiffness(s) * (p - origin(s)) + damping(s) * sums.speed
    at_p = v_p = contact = 0.0
    if s.closed == 1:
        found = touch_of(s, bars, bars.w, PQ)
        at_p, v_p, contact = found.piston, found.speed / par.mass_p, -found.pull
        contact += par.mass_p * s.a_p
    return Look(sums, p, force, 0.0, 0.0, 0.0, at_p, v_p, contact, False)


@inlined
def kind_of(s, meets, turns, ends, work):
    """What a look has passed."""
    if meets:
        return MEETS
    if turns:
        return TURNS
    if not ends:
        return BACK
    return WORK if s.mode == Mode.DFC and s.w + work >= s.w_r else ENDS


@inlined
def room_at(par, s, kind, look, work):
    """How far a look is before what is passed, in any unit; 0 where that is not known."""
    if kind == MEETS:
        return look.gap
    if kind == TURNS:
        return room_to_turn(par, s, look.u_r)
    if kind == ENDS:
        return -beyond(s, end_of(look))
    return s.w_r - s.w - work if kind == WORK else 0.0


class Aim(NamedTuple):
    """What is known to be passed, and when."""

    kind: int
    known: int  # by so many ticks
    high: float  # room then, as `room_at` has it
    goal: float  # ticks by which it may be passed


@inlined
def aim_at(par, s, aim, last, work, ticks, halve):
    """Foretell by a straight line when that is passed, from a later look before it."""
    low, share = room_at(par, s, aim.kind, last, work), 0.5
    if low > 0.0 > aim.high and not halve:
        share = low / (low - aim.high)
    return Aim(aim.kind, aim.known, aim.high, ticks + share * (aim.known - ticks))


@kernel
def go_near(par, s, bars, most, blows, events):
    """Go on by looks at both ends of the bit, `most` ticks at most, or to the next event."""
    most = at_rest(s, most)
    usual = moving(s, bars, bars.w, PQ).level
    if has_piston(par) and s.parked == 0:
        # which vibrates as well
        usual = min(usual, STEP + 2)
    level, ticks = usual, 0
    last = first_look(s)
    C, taken, sampled, u_before = damping(s), 0.0, 0.0, s.u_r
    cutting, piston = s.mode == Mode.DFC, has_piston(par)
    if cutting and s.stride > FIRST_STRIDE:
        taken = taken_so_far(s, bars, PQ)
    meets = ends = turns = False
    aim, same = Aim(ENDS, -1, 0.0, 0.0), 0
    while ticks < most:
        while ticks + (1 << level) > most:
            level -= 1
        look = look_at(par, s, bars, level, ticks, last)
        work, share = 0.0, 0.0
        if cutting:
            share = C * squared_between(end_of(last), end_of(look), par.tick * (1 << level))
            if sampled > 0.0 and s.w + taken + UNSURE * (sampled + share) >= s.w_r:
                taken, sampled = taken_so_far(s, bars, PQ), 0.0
            work = taken + sampled + share
        meets = look.flips
        if meets and s.parked == 1:
            break
        ends = passed(par, s, look.p, look.sums.speed, work, look.force)
        turns = piston and switches(par, s, look.u_r)
        back = 0.0
        if level > 0 and not (meets or ends or turns):
            back = turns_between(s, end_of(last), end_of(look), par.tick * (1 << level))
        if level > 0 and (meets or ends or turns or back > 0.0):
            kind, known, same = kind_of(s, meets, turns, ends, work), ticks + (1 << level), 0
            aim = Aim(kind, known, room_at(par, s, kind, look, work), ticks + back * (1 << level))
            if kind != BACK:
                aim = aim_at(par, s, aim, last, taken + sampled, ticks, False)
            level = min(level - 1, level_below(max(aim.goal - ticks, 1.0)))
            continue
        if meets:
            break
        keep_ahead(s, bars)
        ticks += 1 << level
        s.count_steps += 1
        sampled += share
        note(par, s, bars, level, ticks, last, look)
        u_before, last = last.u_r, look
        if ends or turns:
            break
        if ticks >= aim.known or (aim.kind == BACK and ticks >= aim.goal):
            level, aim = usual, Aim(ENDS, -1, 0.0, 0.0)
            continue
        same += 1
        if aim.kind != BACK:
            aim = aim_at(par, s, aim, last, taken + sampled, ticks, same >= SAME_SIDE)
        rest = max(aim.known - ticks - 1.0, 1.0)
        level = level_below(min(max(aim.goal - ticks, 1.0), rest))
    if ticks > 0:
        book_way(par, s, bars, ticks, last)
    if meets and s.parked == 1:
        unpark(par, s, bars)
    elif meets:
        drop_pairs(par, s, bars)
        flip_contact(par, s, bars, s.v_p - s.v_b, blows, events)
    else:
        if turns:
            switch_drive(par, s, u_before, time_of(par, s) - par.tick, par.tick, events)
        if ends:
            end_mode(par, s, bars, events)


@inlined
def note(par, s, bars, level, ticks, before, look):
    """Book what every look counts for: peaks, and the loss of a piston in flight.

    Parameters
    ----------
    before : Look
        The look before.
    """
    if s.mode != Mode.FF:
        time, h = time_of(par, s) + ticks * par.tick, par.tick * (1 << level)
        most = top_between(s, end_of(before), end_of(look), h)
        s.b_peak_bit = max(s.b_peak_bit, most.peak)
        s.peak_bit_force = max(s.peak_bit_force, late_peak(s, time, h, most))
    if s.closed == 1:
        h = par.tick * (1 << level)
        book_contact(par, s, look.contact, h, time_of(par, s) + ticks * par.tick)
    elif has_piston(par) and s.parked == 0 and par.piston == Piston.ELASTIC:
        s.e_loss += move_free(bars.wp, bars.move_p[level], bars.wp.shape[1])
