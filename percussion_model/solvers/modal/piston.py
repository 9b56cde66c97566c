"""Contact of piston and bit, and the piston that waits while it can touch nothing."""

from __future__ import annotations

import math

from percussion_model.physics.blows import (
    close_gap,
    open_gap,
    standstill_force,
    start_blow,
    starts_blow,
)
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import (
    drive_force,
    piston_acceleration,
    room_to_turn,
    time_to_cover,
)
from percussion_model.physics.records import Mode, Piston
from percussion_model.solvers.modal.bar import (
    LOW,
    Q,
    carry,
    piston_vibration,
    row_sum,
    standing_energy,
)
from percussion_model.solvers.modal.forms import gap_of, join, part
from percussion_model.solvers.modal.records import LOOK, STEP

WHOLE = 1 << STEP
# Of a contact, so many steps of the modes asked for end by their mean force: fronts ring.
RINGING = 2
# Steps after which it is tried again to let the piston wait.
PATIENCE = 8
# A bit stands still with less than this share of W_R: it moves slower than modes ring ahead of
# the front of a blow.
AT_REST = 1e-5


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
    s.look = s.time + LOOK * WHOLE


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
