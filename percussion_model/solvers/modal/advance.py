"""Loop of the modal solver by leaps, looks and steps, and reading a state without touching it."""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.physics.blows import FASTEST, end_with_blow, push_checkpoint
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import (
    bend_of,
    bit_acceleration,
    drive_force,
    hold_components,
    lasting,
    pass_time,
    piston_acceleration,
    room_to_turn,
    time_to_cover,
)
from percussion_model.physics.readings import fill_ledger, fill_motion
from percussion_model.physics.records import Mode, Piston, Status
from percussion_model.physics.reference import refer
from percussion_model.physics.rock import (
    barrier_level,
    ends_standstill,
    is_crushable,
    keep_margin,
    overcomes_barrier,
    recoverable,
)
from percussion_model.solvers.modal.bars import (
    bit_kinetic,
    elastic_of,
    follows_form,
    kinetic_of,
    piston_vibration,
    refresh_loads,
    sag,
)
from percussion_model.solvers.modal.beside_piston import beside_of, book_way, go_near, present_look
from percussion_model.solvers.modal.ends import (
    QUIET_SHARE,
    REST_BIT,
    REST_LOW,
    REST_TAKEN,
    REST_TOP,
    RINGING,
    WHOLE,
    at_rest,
    besides,
    end_mode,
    end_standstill,
    has_piston,
    level_below,
    park,
    time_of,
    unpark,
)
from percussion_model.solvers.modal.lanes import WIDTH, load, spread, store, total
from percussion_model.solvers.modal.next_event import search
from percussion_model.solvers.modal.pairs import (
    AT,
    FIRST_STRIDE,
    PLOAD,
    PQ,
    PV,
    SHAPE_BIT,
    book_losses,
    drop_pairs,
    drop_tiny,
    energy_about_rest,
    enough_pairs,
    hold_ends,
    keep,
    law_wanted,
    leave_out_pairs,
    move_pairs,
    spell_out,
    spell_speeds,
    take_pairs,
)
from percussion_model.solvers.modal.records import KEPT, STEP, Known, Task
from percussion_model.solvers.modal.step import level_of_step, step

# Steps after which kinetic energy that still rises is high enough.
LONGEST_RISE = 64
# Ticks for which a bit at a standstill is looked at in one go.
WATCHED = 32 * WHOLE
# Most ticks of a leap.
LONGEST = 65535 * WHOLE
# In a longer one modes may die away altogether.
LONG = 512 * WHOLE
# One that may not be longer because of the piston is not worth a search.
FEWEST = 4 * WHOLE
# Events that one step can make: of the barrier, two of the contact, of the drive, of the rock.
MOST_EVENTS = 6
# A time this close below a tick is that tick [ticks].
TICK_ROUNDING = 1e-3


@merged
def until_drive(par, s, v, a, spread):
    """Time before which the drive cannot turn, for a relative mean motion [s]."""
    return time_to_cover(room_to_turn(par, s, s.u_r) - spread, s.alpha * v, s.alpha * a)


@kernel
def quiet_time(par, s, v_b, a_b, spread_top, spread_mean):
    """Times before which the piston can neither meet the bit nor turn the drive [s].

    Parameters
    ----------
    v_b, a_b : float
        Mean motion of the bit [m/s, m/s2].
    spread_top, spread_mean : float
        How far its top end and its mean may be from that [m].
    """
    if not has_piston(par):
        return math.inf, math.inf
    a = piston_acceleration(par, drive_force(par, s)) - a_b
    v = s.v_p - v_b
    room = s.u_b - s.u_p - s.spread_p - spread_top - spread_mean
    return time_to_cover(room, v, a), until_drive(par, s, v, a, spread_mean)


@inlined
def in_few_moves(ticks):
    """Ticks, a sixteenth less or so, that are whole steps where they may be, and few moves."""
    drop = max(level_below(ticks) - 4, STEP if ticks >= 4 * WHOLE else 0)
    return ticks >> drop << drop


@merged
def hold_on(par, s):
    """Hold mean forces of components where that is over; ticks for which they hold from now on."""
    if par.effects == 0:
        return LONGEST
    if s.time >= s.held_until:
        if s.held_until > s.held_from and s.closed == 0:
            whole = par.tick * (s.held_until - s.held_from)
            way = bend_of(par, s, whole)
            s.u_p += way
            s.u_r += way
            s.gap -= way
        ticks = in_few_moves(max(int(lasting(par, s) / par.tick), 1))
        hold_components(par, s, ticks * par.tick)
        s.held_from, s.held_until = s.time, s.time + ticks
    return s.held_until - s.time


@kernel
def change_load(par, s, bars, a_b):
    """Go on by the pairs of a bit alone about where another load would hold it."""
    laws, w, n = bars.laws, bars.w, bars.laws.sizes[s.law]
    quiet, change = QUIET_SHARE * barrier_level(par, s), a_b - s.a_b
    if s.mode == Mode.SS and s.vibrates > quiet:
        book_losses(s, bars)  # which tells what is left
    energy = s.vibrates + besides(s, bars)
    s.a_b = a_b
    if s.form == 0:
        w[PLOAD, 0] = bars.forms.shape[0, SHAPE_BIT, 0] * a_b
    else:
        held, rest, taken = laws.held[s.law], laws.rest[s.law], spread(0.0)
        for k in range(s.pairs, n, WIDTH):
            store(w, PQ, k, spread(0.0))
            store(w, PV, k, spread(0.0))
        for k in range(0, n, WIDTH):
            q, v = load(w, PQ, k), load(w, PV, k)
            taken = taken + load(held, 2, k) * q + load(held, 3, k) * v
            store(w, PQ, k, q - load(held, 0, k) * change)
            store(w, PV, k, v - load(held, 1, k) * change)
        s.takes += change * (change * rest[REST_TAKEN] - total(taken))
        s.rest_low, s.rest_top = rest[REST_LOW] * a_b, rest[REST_TOP] * a_b
        s.rest_b = rest[REST_BIT] * a_b
        s.vibrates = energy - besides(s, bars)
        s.pairs = n
        s.pairs = enough_pairs(par, s, bars)
        hold_ends(par, s, bars)
    s.stride = FIRST_STRIDE
    s.alert = 1 if s.vibrates > quiet else 0


@merged
def take_loads(par, s, bars):
    """Take the forces on the bodies; pairs of bars that touch are given up under others."""
    push = drive_force(par, s)
    a_p = piston_acceleration(par, push) if has_piston(par) else 0.0
    a_b = bit_acceleration(par, s)
    if s.law >= 0 and s.closed == 0:
        if a_b != s.a_b:
            change_load(par, s, bars, a_b)
    elif s.law >= 0 and (a_b != s.a_b or a_p != s.a_p):
        drop_pairs(par, s, bars)
        s.alert = 1
    if s.law < 0:
        refresh_loads(s, bars, a_b, a_p)
    s.a_b, s.a_p = a_b, a_p


@merged
def ready(par, s, bars, law):
    """Take the pairs that the next looks need."""
    take_loads(par, s, bars)
    if s.law < 0:
        take_pairs(par, s, bars, law)
    elif s.stride > FIRST_STRIDE:
        leave_out_pairs(par, s, bars)


@kernel
def kinetic_at(s, bars, x, first):
    """Kinetic energy of a bit alone, by pairs in two rows of `x` [J]."""
    return kinetic_of(bars.rows, spell_speeds(s, bars, x, first))


@kernel
def highest_kinetic(s, bars):
    """Kinetic energy of a bit at the end of its present rise, if its mode went on [J]."""
    keep(bars.w, PQ, bars.w, AT, s.pairs)
    highest = 0.0
    for _ in range(LONGEST_RISE):
        move_pairs(s, bars, bars.w, AT, STEP)
        energy = kinetic_at(s, bars, bars.w, AT)
        if energy <= highest:
            break
        highest = energy
    return highest


@kernel
def watch_barrier(par, s, bars, most, alone, events):
    """Leave standstill where the kinetic energy of the bit passes the barrier.

    Parameters
    ----------
    alone : int
        Ticks in which nothing can come from the piston.

    Returns
    -------
    int
        Ticks that the bit may go, `most` at most, before it is to be watched again; within a step
        up to the tick in which the barrier is passed.
    """
    energy = energy_about_rest(s, bars, spell_out(s, bars, bars.w, PQ))
    s.alert = 1 if energy > QUIET_SHARE * barrier_level(par, s) else 0
    if s.alert == 0:
        return most
    now = kinetic_of(bars.rows, bars.laws.sizes[s.law])
    if ends_standstill(par, s, now):
        drop_pairs(par, s, bars)
        end_standstill(par, s, bars, events)
        return min(most, WHOLE)
    if not overcomes_barrier(par, s, energy):
        return min(most, WHOLE)
    stands = min(most, alone, WATCHED)
    if stands > WHOLE:
        stands = search(par, s, bars, stands, beside_of(par, s, bars, False)).ticks
    most = min(most, max(stands, WHOLE))
    ticks, level, passes = 0, min(level_below(most), STEP), False
    keep(bars.w, PQ, bars.w, AT, s.pairs)
    while level >= 0:
        go = 1 << level
        if ticks + go <= most:
            keep(bars.w, AT, bars.rows, KEPT, s.pairs)
            move_pairs(s, bars, bars.w, AT, level)
            if ends_standstill(par, s, kinetic_at(s, bars, bars.w, AT)):
                most, passes = ticks + go, True
                keep(bars.rows, KEPT, bars.w, AT, s.pairs)
            else:
                ticks += go
                if ticks == most:
                    break
                if level == STEP:
                    continue
        level -= 1
    if passes:
        keep_margin(par, s, highest_kinetic(s, bars))
    return most


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
    most = min(most, hold_on(par, s))
    ready(par, s, bars, law)
    most, far = at_rest(s, most), far_ticks(par, s, bars)
    if s.mode == Mode.SS and s.alert == 1 and is_crushable(par):
        most = watch_barrier(par, s, bars, most, min(far.meet, far.turn), events)
        if s.law < 0:
            return most
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


@merged
def tick_at(par, time):
    """Last tick up to a time."""
    return math.floor(time / par.tick + TICK_ROUNDING)


@merged
def full(s, blows, events):
    """Which list has no room for the rows of another step; `Status.DONE`: none."""
    if s.n_blows >= blows.shape[0]:
        return Status.BLOWS_FULL
    if s.events_on == 1 and s.n_events + MOST_EVENTS > events.shape[0]:
        return Status.EVENTS_FULL
    return Status.DONE


@inlined
def portion(s, law):
    """Ticks that bars go by pairs beside a piston before it is looked again which they need."""
    return (s.stride if s.law == law else FIRST_STRIDE) * WHOLE


@kernel
def time_of_blow(par_, state, bars_):
    """Time by which what is pending is over, if a blow may start in it [s]; 0 if none may.

    A portion is made when all of it is past, some tenths of a millisecond after a closure in it.
    """
    par, s = par_[0], state[0]
    if s.leap_end >= 0:
        return 0.0
    bars = refer(bars_)
    law = law_wanted(par, s, bars.laws)
    ticks = portion(s, law) if law >= 0 else 1 << level_of_step(par, s, bars)
    if s.gap > FASTEST * (ticks * par.tick):
        return 0.0
    return end_with_blow(par, s, (s.time + ticks) * par.tick)


@merged
def advance_to(par, s, bars, end, blows, events):
    """Advance to a tick, unless a leap, or what is done in one go, passes it; a `Status`."""
    s.n_blows = 0
    s.n_events = 0
    while True:
        status = full(s, blows, events)
        if status != Status.DONE:
            return status
        if not math.isfinite(s.p + s.v_b + s.v_p + s.u_r):
            return Status.NOT_FINITE
        law = law_wanted(par, s, bars.laws)
        if law < 0:
            if s.law >= 0:
                drop_pairs(par, s, bars)
            level = level_of_step(par, s, bars)
            if s.time + (1 << level) > end:
                return Status.DONE
            step(par, s, bars, level, blows, events)
            continue
        if s.leap_end < 0:
            most = portion(s, law)
            if s.time + most > end:
                return Status.DONE
            far = plan(par, s, bars, law, LONGEST, events)
            if s.leap_end < 0 and s.law >= 0:
                go_near(par, s, bars, min(most, far), blows, events)
        if s.leap_end > end:
            return Status.DONE
        if s.leap_end >= 0:
            leap(par, s, bars, events)


@merged
def commit_to(par, s, bars, end, blows, events):
    """Carry bit and piston to a tick, within what is pending."""
    s.n_blows = 0
    s.n_events = 0
    s.leap_end = -1
    while s.time < end:
        status = full(s, blows, events)
        if status != Status.DONE:
            return status
        law = law_wanted(par, s, bars.laws)
        if law >= 0:
            most = portion(s, law)
            far = plan(par, s, bars, law, end - s.time, events)
            if s.leap_end >= 0:
                leap(par, s, bars, events)
            elif s.law >= 0:
                go_near(par, s, bars, min(most, far), blows, events)
            continue
        if s.law >= 0:
            drop_pairs(par, s, bars)
        level = level_of_step(par, s, bars)
        while s.time + (1 << level) > end:
            level -= 1
        step(par, s, bars, level, blows, events)
    if s.law >= 0:
        drop_pairs(par, s, bars)
    if has_piston(par) and s.parked == 1:
        unpark(par, s, bars)
    s.no_park = s.time
    return Status.DONE


@kernel
def read_at(par, s, bars, time, row):
    """Read a state, and its motion a fraction of a tick later."""
    row.bit_kinetic_energy = bit_kinetic(s, bars, bars.w)
    n, held = s.active, bars.forms.stiff[s.form]
    kinetic = kinetic_of(bars.w, n)
    elastic = elastic_of(bars.w, bars.forms.shape[s.form], n) - 0.5 * held * s.low * s.low
    if s.closed == 0 and has_piston(par):
        kinetic += 0.5 * par.mass_p * s.v_p * s.v_p
        if par.piston == Piston.ELASTIC:
            own = kinetic_of(bars.wp, bars.wp.shape[1])
            kinetic += own
            elastic += piston_vibration(bars) - own
    # within a tick forces stay, so that impulses and velocities agree
    rest = max(0.0, time - time_of(par, s))
    s.i_drive += rest * drive_force(par, s)  # a casing takes its recoil
    pass_time(par, s, rest)
    fill_ledger(s, row, kinetic, elastic, recoverable(par, s))
    fill_motion(par, s, row, time, s.u_p + par.start_gap, s.u_b)
    row.bit_end_velocity = s.v_low
    row.bit_force = s.f_rock
    row.bit_position += rest * s.v_b
    row.bit_end_position += rest * s.v_low
    row.bit_velocity += rest * (s.a_b + (s.f_contact - s.f_rock) / par.mass_b)
    if has_piston(par):
        row.piston_position += rest * s.v_p
        row.piston_velocity += rest * (s.a_p - s.f_contact / par.mass_p)
    if s.mode == Mode.SS and s.closed == 0 and held > 0.0 and follows_form(par, s):
        # what modes that are left out would hold of the load
        row.bit_force += par.mass_b * s.a_b - held * sag(s, bars)
    row.contact_force = s.f_contact
    row.bit_impulse += rest * s.f_rock
    row.contact_impulse += rest * s.f_contact


@kernel
def run(task, par_, state, bars_, time, blows, events, reading):
    """Do one `Task` with a state; the only entry into the modal kernels.

    Parameters
    ----------
    task : int
        ADVANCE: commit up to `time`, unless a pending leap or step passes it.
        COMMIT: cut it short at the last tick up to `time`.
        READ: as COMMIT, then evaluate; spoils the state, so give a copy.
    par_, state : MODAL_PAR, MODAL_STATE array of length 1
    bars_ : Bars
    time : float
        [s]
    blows, events : BLOW, EVENT array
        Filled from index 0; the state says how far.
    reading : READING array of length 1

    Returns
    -------
    int
        A `Status`.
    """
    par = par_[0]
    s = state[0]
    bars = refer(bars_)
    end = tick_at(par, time)
    if task == Task.ADVANCE:
        return advance_to(par, s, bars, end, blows, events)
    if task == Task.READ:
        s.live = s.events_on = 0
    status = commit_to(par, s, bars, end, blows, events)
    if task == Task.READ:
        read_at(par, s, bars, time, reading[0])
    return status
