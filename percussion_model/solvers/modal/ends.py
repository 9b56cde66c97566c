"""What the ends of the bit meet: rock, between looks and where its mode ends, and the piston.

Between two looks the velocity of the rock end goes like the parabola that has its values there
and the way between them (docs/modal.md, section 5).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.physics.blows import (
    close_gap,
    open_gap,
    push_checkpoint,
    push_event,
    standstill_force,
    start_blow,
    starts_blow,
)
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import room_to_turn
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import (
    REST_VELOCITY,
    barrier_level,
    close_interface,
    damping,
    ends_standstill,
    enter_standstill,
    has_rock,
    is_crushable,
    is_elastic_rock,
    is_rigid_rock,
    leave_by_velocity,
    leave_standstill,
    origin,
    recoverable,
    spring_force,
    stiffness,
)
from percussion_model.solvers.modal.bars import (
    BIT,
    LOW,
    Q,
    bit_kinetic,
    carry,
    change_spring,
    form_wanted,
    gap_of,
    join,
    leave_out,
    part,
    piston_vibration,
    row_sum,
    standing_energy,
    tip_of,
)
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
from percussion_model.solvers.modal.records import JOINED, LOOK, STEP, Rest

WHOLE = 1 << STEP
# Of a contact, so many steps of the modes asked for end by their mean force: fronts ring.
RINGING = 2
# Steps after which it is tried again to let the piston wait.
PATIENCE = 8
# A bit stands still with less than this share of W_R: it moves slower than modes ring ahead of
# the front of a blow.
AT_REST = 1e-5
# Steps after which the running force of a standstill is noted.
CHECKPOINT = 64
# A standstill with less than this share of W_R stays one if nothing comes from outside.
QUIET_SHARE = 0.9
REST_LOW, REST_TOP, REST_BIT, REST_TAKEN = (int(row) for row in Rest)


@inlined
def time_of(par, s):
    """Time of a state [s]."""
    return s.time * par.tick


@inlined
def at_rest(s, most):
    """So many ticks, `most` at most, as the rock end of a bit is at rest if it is."""
    return min(most, s.rest_until - s.time) if s.time < s.rest_until else most


@inlined
def has_piston(par):
    """Whether there is a piston."""
    return par.piston != Piston.ABSENT


class End(NamedTuple):
    """The rock end at some time."""

    p: float  # penetration [m]
    speed: float  # [m/s]
    force: float  # of the rock [N]


class Parabola(NamedTuple):
    """first + slope x + bend x^2: a growth in each time between looks, at a share x of that."""

    first: float
    slope: float
    bend: float


@inlined
def parabola(first, last, mean):
    """The one with these values at two looks and this mean between them."""
    bend = 3.0 * (first + last - 2.0 * mean)
    return Parabola(first, last - first - bend, bend)


@inlined
def value_at(x, before, rate):
    """What grows at a rate between two looks, at a share of the time between them."""
    return before + x * (rate.first + x * (0.5 * rate.slope + x * rate.bend / 3.0))


@inlined
def least_at(rate):
    """Share of the time between two looks at which what falls, then rises is least.

    Parameters
    ----------
    rate : Parabola
        How fast it grows, below zero first and above it last.
    """
    root = math.sqrt(max(0.0, rate.slope * rate.slope - 4.0 * rate.bend * rate.first))
    if rate.slope < 0.0:
        return 0.5 * (root - rate.slope) / rate.bend
    return -2.0 * rate.first / (rate.slope + root)


@inlined
def falls_below(before, slope, then, slope_then):
    """Where between two looks something falls below zero that is not at either.

    Parameters
    ----------
    before, then : float
        What it is at the looks.
    slope, slope_then : float
        How much it grows there in the time between them; in between like a parabola.

    Returns
    -------
    float
        Share of the time between them at which it is least, or shortly before; 0 where it stays
        above zero.
    """
    if not slope < 0.0 < slope_then:
        return 0.0
    rate = parabola(slope, slope_then, then - before)
    at = least_at(rate)
    least = value_at(at, before, rate)
    if not least < 0.0:
        return 0.0
    # about half way from where it passes zero
    return at * (1.0 - 0.5 * math.sqrt(least / (least - before)))


@inlined
def force_rates(s, one, other, h):
    """How much the force of the rock grows in `h` at two looks so far apart [N]."""
    way = parabola(h * one.speed, h * other.speed, other.p - one.p)
    K, lag = stiffness(s), damping(s) / h
    return K * way.first + lag * way.slope, K * h * other.speed + lag * (way.slope + 2.0 * way.bend)


class Top(NamedTuple):
    """Force of the rock between two looks."""

    first: float  # at the one [N]
    last: float  # at the other
    rate: Parabola  # of its growth in between [N]
    at: float  # share of the time between them at which it is greatest
    peak: float  # then [N]


@inlined
def top_between(s, one, other, h):
    """Make out the greatest force of the rock between two looks `h` apart."""
    slope, then = force_rates(s, one, other, h)
    rate = parabola(slope, then, other.force - one.force)
    at, peak = 1.0, other.force
    if slope > 0.0 > then:
        at = least_at(Parabola(-rate.first, -rate.slope, -rate.bend))
        peak = max(peak, value_at(at, one.force, rate))
    return Top(one.force, other.force, rate, at, peak)


@inlined
def late_peak(s, end, h, top):
    """Greatest force after s.peak_from between two looks, the later at `end`, `h` apart [N]."""
    after = end - s.peak_from
    if not after > 0.0:
        return 0.0
    begin = 1.0 - min(after / h, 1.0)
    late = max(top.last, value_at(begin, top.first, top.rate))
    return max(late, top.peak) if begin <= top.at else late


@inlined
def turns_between(s, one, other, h):
    """Where between two looks the mode of the rock ends though it goes on at both.

    Parameters
    ----------
    one, other : End
        The rock end at looks that are `h` apart.

    Returns
    -------
    float
        Share of the time between them; 0 where the mode does not end.
    """
    if s.time < s.rest_until:
        return 0.0
    if s.mode == Mode.FF:
        return falls_below(s.p_u - one.p, -h * one.speed, s.p_u - other.p, -h * other.speed)
    if s.mode == Mode.SS:
        slope, then = force_rates(s, one, other, h)
        return falls_below(one.force, slope, other.force, then)
    way = parabola(h * one.speed, h * other.speed, other.p - one.p)
    sign = -1.0 if s.mode == Mode.BC else 1.0
    slope, bend = sign * way.slope, sign * way.bend
    if not 0.0 < -slope < 2.0 * bend:
        return 0.0
    if sign * way.first - slope * slope / (4.0 * bend) >= -REST_VELOCITY * h:
        return 0.0
    return -0.5 * slope / bend


@inlined
def squared_between(one, other, h):
    """Integral of the squared velocity of the rock end between two looks `h` apart [m2/s]."""
    first, slope, bend = parabola(one.speed, other.speed, (other.p - one.p) / h)
    even = first * first + (slope * slope + 2.0 * first * bend) / 3.0 + 0.2 * bend * bend
    return h * (even + slope * (first + 0.5 * bend))


@inlined
def late_force(s, end, h, first, last):
    """Greatest force after s.peak_from of one that goes straight for `h` until a time [N]."""
    after = end - s.peak_from
    if not after > 0.0:
        return 0.0
    return max(last, last + (first - last) * min(after / h, 1.0))


@inlined
def passed(par, s, p, v, work, force):
    """Whether a state lies beyond the end of the present mode; energy apart.

    Parameters
    ----------
    p, v : float
        Penetration [m] and velocity of the rock end [m/s].
    work : float
        Of the rock's dashpot in the step [J].
    force : float
        Of the rock on the bit at that time [N].
    """
    if not has_rock(par):
        return False
    if s.mode == Mode.FF:
        return p > s.p_u and v > 0.0
    if is_elastic_rock(par):
        return p < 0.0
    if is_rigid_rock(par):
        return force < 0.0
    if s.mode == Mode.DFC and s.w + work >= s.w_r:
        return True
    if s.mode == Mode.DFC or s.mode == Mode.FC:
        return v < -REST_VELOCITY and s.time >= s.rest_until
    if s.mode == Mode.BC:
        return p < s.p_u or v > REST_VELOCITY
    return par.release == 1 and force < 0.0


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


@kernel
def unpark(par, s, bars):
    """Bring the vibration of the parked piston to the present."""
    if par.piston == Piston.ELASTIC:
        n = bars.wp.shape[1]
        s.e_loss += carry(bars.wp, bars.move_p, 0, n, s.time - s.piston_time)
        s.low_p = row_sum(bars.shape_p, LOW, bars.wp, Q, n)
    s.parked = 0
    s.no_park = s.time + LOOK * WHOLE
    s.gap = gap_of(par, s)


@kernel
def park(par, s, bars):
    """Leave the vibration of the piston behind while it can touch nothing."""
    s.spread_p = 0.0
    if par.piston == Piston.ELASTIC:
        s.spread_p = par.bound_p * math.sqrt(2.0 * piston_vibration(bars))
    if s.u_p + s.spread_p < s.u_b - s.spread_p:
        s.parked = 1
        s.piston_time = s.time
    else:
        s.no_park = s.time + PATIENCE * WHOLE


@kernel
def flip_contact(par, s, bars, approach, blows, events):
    """Open or close the contact of piston and bit."""
    time = time_of(par, s)
    if s.closed == 1:
        s.closed = 0
        s.peak_time = s.peak_impulse = 0.0
        s.f_contact = 0.0
        part(par, s, bars)
        s.no_park = s.time + PATIENCE * WHOLE
        open_gap(s, events, time, approach)
    else:
        if starts_blow(par, s, time):
            still = standstill_force(s, time, s.i_bit)
            start_blow(par, s, blows, time, s.v_p, s.u_b, still)
        s.closed = 1
        s.closed_at = s.time
        if s.mode == Mode.SS and standing_energy(par, s, bars) < AT_REST * s.w_r:
            s.rest_until = s.time + par.transit
        close_gap(s, events, time, approach)
        join(par, s, bars)
    s.alert = 1
    s.held_from = s.held_until = s.time
    s.look = s.time + LOOK * WHOLE


@inlined
def push_of(par, s, h, v_p, then, age, pull):
    """Force of a piston that touches the bit: its mean over `h`, and that at the end [N].

    Parameters
    ----------
    v_p, then : float
        Mean velocities of the piston at the begin and at the end [m/s].
    age : int
        Of the contact at the end [ticks]; a young one has but its mean.
    pull : float
        What accelerates the piston besides its load, at the end [N].
    """
    mean = par.mass_p * (s.a_p + (v_p - then) / h)
    return mean, mean if age < par.ringing else par.mass_p * s.a_p - pull


@inlined
def book_contact(par, s, contact, h, time):
    """Book what piston and bit did to each other for `h` until a time, by a mean force."""
    s.i_contact += contact * h
    # a bar with loss resists the first instants of a contact without bound: means, and
    # without the first
    s.peak_time += h
    s.peak_impulse += contact * h
    if s.peak_time >= 0.999 * par.window:
        # (a rigid piston pushes hardest at once)
        first = time - s.peak_time - s.closed_at * par.tick < 0.5 * par.window
        mean = 0.0 if first and par.piston == Piston.ELASTIC else s.peak_impulse / s.peak_time
        s.b_peak_contact = max(s.b_peak_contact, mean)
        if time > s.peak_from:
            s.peak_contact_force = max(s.peak_contact_force, mean)
        s.peak_time = s.peak_impulse = 0.0


@merged
def switches(par, s, u_r):
    """Whether the drive turns at a relative displacement."""
    return room_to_turn(par, s, u_r) <= 0.0


@kernel
def watch_energy(par, s, bars):
    """Note whether a standstill may end by the energy that the bit has now."""
    s.alert = 1
    if s.mode == Mode.SS and 0 < s.form < JOINED:
        s.alert = 1 if standing_energy(par, s, bars) > QUIET_SHARE * barrier_level(par, s) else 0


@kernel
def look(par, s, bars):
    """Look which modes are needed, and whether a standstill may end by itself."""
    s.look = s.time + LOOK * WHOLE
    leave_out(par, s, bars)
    watch_energy(par, s, bars)


@kernel
def end_standstill(par, s, bars, events):
    """Leave standstill where the bit's energy passes the barrier."""
    if ends_standstill(par, s, bit_kinetic(s, bars, bars.w)):
        s.has_place = 0
        # before a front can be there, modes ring
        leave_standstill(par, s, s.v_low if s.time >= s.rest_until else 0.0)
        change_spring(par, s, bars)
        push_event(s, events, time_of(par, s), s.mode, spring_force(par, s))


@kernel
def next_mode(par, s, energy):
    """Take the mode of the rock that follows where the present one ends; whether one does.

    Parameters
    ----------
    energy : float
        Kinetic energy of the bit [J].
    """
    left, before = s.mode, recoverable(par, s)
    s.has_place = 0
    if s.mode == Mode.FF:
        if is_rigid_rock(par):
            s.e_standstill += before
            s.p_u = s.p
        close_interface(par, s, energy)
    elif not is_crushable(par):
        if is_rigid_rock(par):
            s.p_u = s.p
        s.mode = Mode.FF
    elif s.mode == Mode.DFC and not (s.w < s.w_r and s.v_low < -REST_VELOCITY):
        s.mode = Mode.FC
    elif s.mode == Mode.SS:
        s.mode = Mode.FF
        s.e_standstill += before - recoverable(par, s)
    elif s.mode == Mode.BC and s.p < s.p_u:
        s.mode = Mode.FF
    else:
        leave_by_velocity(par, s, s.v_low, energy)
    if s.mode == Mode.FF:
        s.f_rock = 0.0  # not what it was just past the end of contact
        if is_elastic_rock(par) or left == Mode.BC:
            s.e_overshoot += before
    return s.mode != left


@kernel
def note_mode(par, s, events):
    """Note a mode that has just begun."""
    time = time_of(par, s)
    if s.mode == Mode.SS:
        enter_standstill(s, time)
        push_checkpoint(s, time)
    push_event(s, events, time, s.mode, spring_force(par, s))


@kernel
def change_mode(par, s, bars, events):
    """Make the change of mode that the present state asks for."""
    if next_mode(par, s, bit_kinetic(s, bars, bars.w)):
        change_spring(par, s, bars)
        watch_energy(par, s, bars)
        note_mode(par, s, events)


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
    tip, energy = tip_of(par, s), s.vibrates + besides(s, bars)
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
    s.offset += tip - tip_of(par, s)
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
