"""One step of the modal solver, up to the next event.

Between events the modes of the present form move exactly but for the dashpots at the rock end,
whose force is constant over a step and meets their law there (docs/modal.md, section 3).
"""

from __future__ import annotations

from typing import NamedTuple

from percussion_model.physics.blows import push_checkpoint
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import (
    bit_acceleration,
    book_bit_load,
    book_piston_load,
    drive_force,
    hold_components,
    pass_time,
    piston_acceleration,
    switch_drive,
)
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import (
    Line,
    Place,
    book_crushed,
    book_dashpot,
    crush,
    crushed_on_line,
    damping,
    is_crushable,
    is_curved,
    is_rigid_rock,
    line_between,
    origin,
    overcomes_barrier,
    place_at,
    recoverable,
    recoverable_at,
    stiffness,
)
from percussion_model.solvers.modal.bars import (
    Ends,
    bit_kinetic,
    flight_of,
    follows_form,
    low_after,
    move_free,
    refresh_loads,
    take,
    try_move,
)
from percussion_model.solvers.modal.ends import (
    CHECKPOINT,
    End,
    beyond,
    book_contact,
    change_mode,
    end_standstill,
    flip_contact,
    has_piston,
    late_force,
    level_below,
    look,
    park,
    passed,
    push_of,
    switches,
    time_of,
    turns_between,
    unpark,
)
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.modal.records import STEP

# Lines that are taken for the way of a step on a curve, until they change it by no more than this.
MOST_TRIES, SETTLED = 8, 1e-6
# Loading on a curve may bend a step by so many times as much as unloading; and by so many times
# that where its stiffness has risen since the step before, which told the length of this one.
LOADING, RISES = 10.0, 2.0
# Openings and closures of one instant; more would be a loop.
MOST_FLIPS = 2


class Answer(NamedTuple):
    """What the rock does in a step."""

    rest: float  # force at the rock end besides the spring of the form [N]
    line: Line  # of its spring
    begin: Place  # of loading along a curve


class TriedStep(NamedTuple):
    """A step that may be made."""

    h: float  # [s]
    ends: Ends
    speed: float  # of the rock end at the end [m/s]
    force: float  # mean force of the rock [N]
    first: float  # the same at the begin
    last: float  # and at the end
    path: float  # of the penetration [m]
    work: float  # of the rock's dashpot [J]
    rock: Answer
    contact: float  # mean force of piston on bit [N]
    touch: float  # the same at the end [N]
    way_b: float  # of the mean motion of bit and piston [m]
    way_p: float
    low_p: float  # offset of the free piston's low end [m]
    gap: float  # [m]


@inlined
def rest_on_line(s, line, held, lag, free, yields):
    """Mean force over a step besides a spring `held`, of the rock on a line [N].

    Parameters
    ----------
    lag : float
        Force by the path of the rock end, of dashpots [N/m].
    free, yields : float
        Path of the rock end without that force [m], and what it goes back by 1 N [m/N].
    """
    first, slope = 0.0, lag
    if line.stiffness != held:
        first = line.stiffness * (s.p - line.origin) - held * s.low
        slope += 0.5 * (line.stiffness - held)
    return (first + slope * free) / (1.0 + slope * yields)


@inlined
def present_place(par, s):
    """Where loading along a curve is, by the step before or anew."""
    if s.has_place == 1 and s.place_p == s.p:
        return Place(s.place_p, s.place_force, s.place_work)
    return place_at(par, s, s.p)


@inlined
def answer_on_curve(par, s, held, lag, free, yields, h):
    """`Answer` of rock that loads along a curve."""
    path, begin = s.v_low * h, present_place(par, s)
    for _ in range(MOST_TRIES):
        line = line_between(par, s, begin, place_at(par, s, s.p + path))
        rest = rest_on_line(s, line, held, lag, free, yields)
        before, path = path, free - yields * rest
        if abs(path - before) <= SETTLED * abs(path):
            break
    return Answer(rest, line, begin)


@inlined
def answer_of(par, s, bars, level, h):
    """Make out what the rock does over a step of `h` [s]."""
    shape, n = bars.forms.shape[s.form], s.active
    held, yields = bars.forms.stiff[s.form], bars.forms.yields[s.form, level, n // WIDTH - 1]
    m = bars.forms.move[s.form, level]
    line, here = Line(stiffness(s), origin(s)), Place(s.p, 0.0, 0.0)
    if is_rigid_rock(par):
        if s.mode == Mode.FF:
            return Answer(0.0, line, here)
        rest = (low_after(bars.w, shape, m, n) - s.low) / yields
        return Answer(rest, line, here)
    # the loss of a form's modes takes its spring for a part of the bar
    lag = (damping(s) - par.eta * held) / h
    curved = is_curved(par, s)
    if s.mode == Mode.FF or (lag == 0.0 and line.stiffness == held and not curved):
        return Answer(0.0, line, here)
    free = low_after(bars.w, shape, m, n) - s.low
    if curved:
        return answer_on_curve(par, s, held, lag, free, yields, h)
    rest = rest_on_line(s, line, held, lag, free, yields)
    return Answer(rest, line, here)


@inlined
def try_step(par, s, bars, level):
    """Make out a step of 2^level ticks."""
    h = par.tick * (1 << level)
    m = bars.forms.move[s.form, level]
    joined = s.closed == 1
    rock = answer_of(par, s, bars, level, h)
    rest, line = rock.rest, rock.line
    shape = bars.forms.shape[s.form]
    ends = try_move(bars.w, bars.rows, shape, m, s.active, rest, par.eta, joined)
    path = ends.low - s.low
    C, spring = damping(s), line.stiffness * (s.p - line.origin)
    force = spring + 0.5 * line.stiffness * path + C * path / h
    yields = bars.forms.yields[s.form, level, s.active // WIDTH - 1]
    # a constant force turns an end back that a stiff dashpot but stops: there the mean counts
    stopped = C * yields > h and not follows_form(par, s)
    speed = path / h if stopped else ends.speed
    first, last = spring + C * s.v_low, spring + line.stiffness * path + C * speed
    if is_rigid_rock(par):
        force = first = last = rest
    way_b = (ends.bit - s.at_b) / par.mass_b
    way_p = contact = touch = low_p = gap = 0.0
    if joined:
        way_p = (ends.piston - s.at_p) / par.mass_p
        then = ends.piston_speed / par.mass_p
        contact, touch = push_of(par, s, h, s.v_p, then, s.time - s.closed_at, ends.pull)
    elif has_piston(par):
        flight = flight_of(par, s, bars, level, h, way_b, ends.top - ends.bit / par.mass_b)
        way_p, low_p, gap = flight.way, flight.low, flight.gap
    work = C * path * path / h
    return TriedStep(
        h,
        ends,
        speed,
        force,
        first,
        last,
        path,
        work,
        rock,
        contact,
        touch,
        way_b,
        way_p,
        low_p,
        gap,
    )


@merged
def book_rock(par, s, trial):
    """Book what the rock takes in a step."""
    p_before = s.p - trial.path
    if s.mode == Mode.FF:
        s.e_standstill += recoverable_at(par, s, p_before) - recoverable(par, s)
        return
    s.rock_work += trial.force * trial.path
    book_dashpot(s, trial.work)
    if is_curved(par, s):
        end = place_at(par, s, s.p)
        s.has_place, s.place_p, s.place_force, s.place_work = 1, end.p, end.force, end.work
        book_crushed(s, crushed_on_line(par, s, trial.rock.line, trial.rock.begin, end))
    else:
        crush(par, s, p_before)
    s.b_peak_bit = max(s.b_peak_bit, trial.last)
    late = late_force(s, time_of(par, s), trial.h, trial.first, trial.last)
    s.peak_bit_force = max(s.peak_bit_force, late)


@kernel
def make(par, s, bars, level, trial, push, events):
    """Make a step that was tried."""
    begin, h = time_of(par, s), trial.h
    ends = trial.ends
    s.time += 1 << level
    s.count_steps += 1
    take(bars.w, bars.rows, s.active)
    held = bars.forms.stiff[s.form]
    s.e_loss += ends.lost - par.eta * held * trial.path * trial.path / h
    if has_piston(par):
        v_p = s.v_p + h * s.a_p - h * trial.contact / par.mass_p
        if s.closed == 0 and s.parked == 0 and par.piston == Piston.ELASTIC:
            s.e_loss += move_free(bars.wp, bars.move_p[level], bars.wp.shape[1])
            s.low_p = trial.low_p
        book_piston_load(par, s, push, trial.way_p, push * h)
        s.u_p += trial.way_p
        s.v_p, s.gap = v_p, trial.gap
    v_b = ends.bit_speed / par.mass_b
    if s.mode != Mode.FF:
        s.i_bit += trial.contact * h + par.mass_b * (h * s.a_b - (v_b - s.v_b))
    book_bit_load(par, s, trial.way_b)
    s.u_b += trial.way_b
    s.v_b, s.v_low = v_b, trial.speed
    s.low, s.top, s.at_b, s.at_p = ends.low, ends.top, ends.bit, ends.piston
    s.f_contact, s.f_rock = trial.contact, trial.force
    s.p += trial.path
    book_rock(par, s, trial)
    if s.closed == 1:
        book_contact(par, s, trial.contact, h, time_of(par, s))
    if has_piston(par):
        u_before = s.u_r
        s.u_r = s.u_p - s.u_b
        s.b_stroke = max(s.b_stroke, -s.u_r)
        switch_drive(par, s, u_before, begin, h, events)
    pass_time(par, s, h)


@inlined
def load_bodies(par, s, bars, level):
    """Take the forces on the bodies over the next 2^level ticks."""
    hold_components(par, s, par.tick * (1 << level))
    s.held_from = s.held_until = s.time
    a_p = piston_acceleration(par, drive_force(par, s)) if has_piston(par) else 0.0
    a_b = bit_acceleration(par, s)
    if a_p != s.a_p or a_b != s.a_b:
        refresh_loads(s, bars, a_b, a_p)


@inlined
def bend(s, bars, level, K):
    """Share of its path by which rock of a stiffness bends a step besides the form's spring."""
    yields = bars.forms.yields[s.form, level, s.active // WIDTH - 1]
    return abs(K - bars.forms.stiff[s.form]) * yields


@merged
def level_of_step(par, s, bars):
    """Level of the next step of bars that are stepped.

    Steps on rock go with the modes asked for, so that runs with fewer tell what they do to a rate.
    """
    if is_rigid_rock(par) or follows_form(par, s):
        return STEP
    # the rock changes slower than a front passes, slowest where it unloads
    level, most = par.asked + 1, LOADING * par.most_bend
    if s.mode == Mode.BC:
        level, most = par.asked + 2, par.most_bend
    if s.closed == 1 or par.effects == 1:
        level = STEP
    K = s.line_stiffness if is_curved(par, s) else stiffness(s)
    while level > 0 and bend(s, bars, level, K) > most:
        level -= 1
    return level


@inlined
def ends_of(s, trial):
    """The rock end before a step and after it."""
    after = End(s.p + trial.path, trial.speed, trial.last)
    return End(s.p, s.v_low, trial.first), after


@merged
def level_before(s, trial, level):
    """Level of a step that is likely to end just before the mode does, within one of 2^level."""
    before, after = ends_of(s, trial)
    low, high = beyond(s, before), beyond(s, after)
    if low < 0.0 < high:
        return level_below(low / (low - high) * (1 << level))
    if s.mode == Mode.DFC and s.w + trial.work >= s.w_r > s.w:
        return level_below((s.w_r - s.w) / trial.work * (1 << level))
    return level


@kernel
def step(par, s, bars, most, blows, events):
    """Go on by a step, of 2^most ticks at most, or to the next event."""
    level, near = most, False
    while level >= 0:
        level = go_on(par, s, bars, level, near, blows, events)
        near = True


@merged
def go_on(par, s, bars, most, near, blows, events):
    """As `step`, or as far as is known to be before the event.

    Parameters
    ----------
    near : bool
        Whether it is known to come within twice 2^most ticks.

    Returns
    -------
    int
        The event comes within twice 2^level ticks; -1 where it was met, or none is near.
    """
    if s.time >= s.look:
        look(par, s, bars)
    piston = has_piston(par)
    if piston and s.parked == 0 and s.closed == 0 and s.time >= s.no_park:
        park(par, s, bars)
    if s.mode == Mode.SS and s.alert == 1 and is_crushable(par):
        end_standstill(par, s, bars, events)
    level, flips, longer = most, 0, level_of_step(par, s, bars) > STEP
    load_bodies(par, s, bars, level)
    while True:
        stands = s.mode == Mode.SS and s.alert == 1 and is_crushable(par)
        trial = try_step(par, s, bars, level)
        if piston and s.parked == 1 and trial.gap < 0.0:
            unpark(par, s, bars)
            continue
        if level > 0 and is_curved(par, s):
            s.line_stiffness = trial.rock.line.stiffness
            if bend(s, bars, level, s.line_stiffness) > RISES * LOADING * par.most_bend:
                most = level = level - 1
                load_bodies(par, s, bars, level)
                continue
        flip = False
        if piston and s.parked == 0:
            flip = trial.gap < 0.0
            if s.closed == 1:  # by the mean as well, since the force may have dipped within
                flip = trial.touch < 0.0 or trial.contact < 0.0
        # the barrier is passed within, and left at the next step
        bursts = stands and overcomes_barrier(par, s, bit_kinetic(s, bars, bars.rows))
        before, now = ends_of(s, trial)
        ends = passed(par, s, now.p, now.speed, trial.work, trial.last)
        if level > STEP:
            ends = ends or turns_between(s, before, now, trial.h) > 0.0
        elif level > 0 and is_curved(par, s) and s.time >= s.rest_until:
            # it goes on at both ends, yet has gone back
            ends = ends or trial.path < 0.0
        turns = piston and switches(par, s, s.u_r + trial.way_p - trial.way_b)
        if level > 0 and (flip or ends or turns or bursts):
            level -= 1
            if longer and not (flip or turns or bursts):
                level = min(level, level_before(s, trial, level + 1))
            if par.effects == 1:
                load_bodies(par, s, bars, level)
        elif flip and flips < MOST_FLIPS:
            flip_contact(par, s, bars, s.v_p - s.v_b, blows, events)
            level, flips = most, flips + 1
            load_bodies(par, s, bars, level)
        elif ends and s.mode != Mode.FF and is_rigid_rock(par):
            change_mode(par, s, bars, events)
        else:
            break
    make(par, s, bars, level, trial, drive_force(par, s), events)
    if ends:
        change_mode(par, s, bars, events)
    elif s.mode == Mode.SS and (s.n_check == 0 or s.count_steps % CHECKPOINT == 0):
        push_checkpoint(s, time_of(par, s))
    if ends or turns or flips > 0 or most == 0 or not (near or level < most):
        return -1
    return max(level - 1, 0)
