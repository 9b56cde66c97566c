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
from percussion_model.physics.records import DriveKind, Piston
from percussion_model.solvers.modal.bar import LOW, TOP, carry, end_offset, piston_vibration
from percussion_model.solvers.modal.records import STEP, Reply
from percussion_model.solvers.modal.sets import LOOK, take_all

WHOLE = 1 << STEP


@inlined
def time_of(par, s):
    """Time of a state [s]."""
    return s.time * par.tick


@inlined
def has_piston(par):
    """Whether there is a piston."""
    return par.piston != Piston.ABSENT


@inlined
def gap_of(s, bars):
    """Gap between piston and bit by the places of their ends [m]."""
    top = s.u_b + end_offset(bars.wb, bars.cb, bars.cb.sizes[s.set], TOP) + s.r_t
    return top - (s.u_p + end_offset(bars.wp, bars.cp, bars.wp.shape[1], LOW) + s.r_p)


@kernel
def unpark(par, s, bars):
    """Bring the vibration of the parked piston to the present."""
    ticks = s.time - s.piston_time
    s.e_loss += carry(bars.wp, bars.cp, bars.wp.shape[1], ticks)
    if s.r_p != 0.0:
        # what is beyond the modes dies away within a step or two
        compliance = bars.cp.beyond[0, 1]
        kept = bars.cp.reply[0, STEP, Reply.LOW_KEPT] ** (ticks // WHOLE)
        s.e_loss += 0.5 * s.r_p * s.r_p * (1.0 - kept * kept) / compliance
        s.r_p *= kept
    s.parked = 0
    s.no_park = s.time + LOOK * WHOLE
    s.gap = gap_of(s, bars)


@kernel
def park(par, s, bars):
    """Leave the vibration of the piston behind while it can touch nothing."""
    s.spread_p = par.bound_p * math.sqrt(2.0 * piston_vibration(s, bars)) + abs(s.r_p)
    if s.u_p + s.spread_p < s.u_b - s.spread_p:
        s.parked = 1
        s.piston_time = s.time
    else:
        s.no_park = s.time + LOOK * WHOLE


@kernel
def flip_contact(par, s, bars, approach, blows, events):
    """Open or close the contact of piston and bit."""
    time = time_of(par, s)
    if s.closed == 1:
        s.closed = 0
        s.offset = s.peak_time = s.peak_impulse = 0.0
        s.f_contact = 0.0
        s.no_park = s.time + LOOK * WHOLE
        open_gap(s, events, time, approach)
    else:
        if starts_blow(par, s, time):
            still = standstill_force(s, time, s.i_bit)
            start_blow(par, s, blows, time, s.v_p, s.u_b, still)
        s.closed = 1
        close_gap(s, events, time, approach)
        take_all(s, bars)
        # the ends touch here: a tick's way is left between them as long as they do
        s.offset = gap_of(s, bars)
    s.alert = 1
    s.look = s.time + LOOK * WHOLE


@merged
def switches(par, s, u_r):
    """Whether the drive turns at a relative displacement."""
    if par.drive != DriveKind.PRESSURE:
        return False
    return u_r >= 0.0 if s.alpha > 0 else u_r <= -s.reversal
