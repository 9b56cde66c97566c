"""Events of rigid bodies: impact and release of the piston, drive, modes of the rock law."""

from __future__ import annotations

import math

from percussion_model.physics.blows import (
    close_gap,
    open_gap,
    push_event,
    start_blow,
    starts_blow,
)
from percussion_model.physics.kernel import kernel
from percussion_model.physics.loads import bend_of, room_to_turn, turn_drive
from percussion_model.physics.records import EventKind, Mode
from percussion_model.physics.rock import (
    close_interface,
    end_loading,
    end_unloading,
    is_curved,
    is_elastic_rock,
    is_rigid_rock,
    resume_cycle,
    take_line,
)
from percussion_model.solvers.rigid.forces import (
    acceleration,
    acceleration_doubt,
    begin_standstill,
    bit_force,
    contact_force,
    in_storm,
    lift_off,
    mark_standstill,
    note_standstill_force,
    storm_persists,
)
from percussion_model.solvers.rigid.records import Next

# Pressed together, a rebound slower than this ends the bouncing: what is left of a blow
# of 10 m/s is 1e-10 of its energy, and the rest would be endless ever shorter bounces.
HELD_REBOUND = 1e-4

# Impacts at one instant after which a resting contact is not left to rounding.
RESTING_EVENTS = 8


@kernel
def give_impulse(par, s, impulse, on_rest):
    """Pass an impulse from piston to bit; a wall under the bit passes it on."""
    s.v_p -= impulse / par.mass_p
    s.i_contact += impulse
    if on_rest:
        s.i_bit += impulse
    else:
        s.v_b += impulse / par.mass_b


@kernel
def release_piston(s, events):
    """The gap opens: the piston is free again."""
    s.held = 0
    open_gap(s, events, s.time, s.v_p - s.v_b)


@kernel
def impact(par, s, blows, events):
    """The gap closes: an impact (docs/model.md, eq. 22), or the piston stays on the bit."""
    note_standstill_force(par, s)
    if starts_blow(par, s, s.time):
        start_blow(par, s, blows, s.time, s.v_p, s.x_r + s.p, s.ss_force)
        s.b_peak_contact = math.nan  # an impact of rigid bodies has an impulse, no force
        s.ss_force = math.nan
    s.gap = 0.0
    w = max(s.v_p - s.v_b, 0.0)
    close_gap(s, events, s.time, w)
    if room_to_turn(par, s, 0.0) <= 0.0:
        turn_drive(s, events, s.time, 0.0)
    # A bit at the wall stays there, even if its feed pulls and it is about to leave.
    rests = is_rigid_rock(par) and s.p >= s.p_u and s.v_b == 0.0
    mass = par.mass_p if rests else par.mass_p * par.mass_b / (par.mass_p + par.mass_b)
    # In a storm they do not rebound; in the worst they stay together, pressed or not.
    e = 0.0 if in_storm(par, s) else par.restitution
    v_p = s.v_p
    v_b = s.v_b
    if e * w < HELD_REBOUND:
        # Would the two stay together? Try with the common velocity.
        s.held = 1
        common = 0.0 if rests else (par.mass_p * v_p + par.mass_b * v_b) / (par.mass_p + par.mass_b)
        s.v_b = common
        s.v_p = common
        acc = acceleration(par, s)
        pressed = contact_force(par, s, acc) > par.mass_p * acceleration_doubt(par, s, acc)
        s.v_p = v_p
        s.v_b = v_b
        if pressed or s.standing_events > RESTING_EVENTS or storm_persists(par, s):
            give_impulse(par, s, mass * w, rests)
            s.v_b = common
            s.v_p = common
            s.e_contact += 0.5 * mass * w * w
            mark_standstill(s)
            return
        s.held = 0
    give_impulse(par, s, (1.0 + e) * mass * w, rests)
    s.e_contact += 0.5 * mass * (1.0 - e * e) * w * w
    mark_standstill(s)
    release_piston(s, events)


@kernel
def touch_rock(par, s, events, inside):
    """The bit meets the rock."""
    if not inside:
        s.p = s.p_u
    if is_rigid_rock(par):
        # The wall stops the bit; a piston that rode on it goes on and hits it.
        impulse = par.mass_b * s.v_b
        s.i_bit += impulse
        s.e_contact += 0.5 * impulse * s.v_b
        s.v_b = 0.0
        if s.held == 1 and s.v_p > 0.0:
            release_piston(s, events)
    close_interface(par, s, 0.5 * par.mass_b * s.v_b * s.v_b)
    if s.mode == Mode.SS:
        begin_standstill(s)


@kernel
def change_mode(par, s, events, kind, moved):
    """Leave the present drilling mode for the reason `kind`."""
    if (kind == Next.PEAK or kind == Next.TURN) and moved:
        s.v_b = 0.0
        if s.held == 1:
            s.v_p = 0.0
    if s.mode == Mode.SS:
        note_standstill_force(par, s)
    if kind == Next.TOUCH or kind == Next.TOUCH_INSIDE:
        touch_rock(par, s, events, kind == Next.TOUCH_INSIDE)
    elif kind == Next.BARRIER:
        s.mode = Mode.FC
    elif kind == Next.PEAK:
        end_loading(par, s)
    elif kind == Next.LIFT:
        if moved and (s.mode == Mode.BC or is_elastic_rock(par)):
            s.p = s.p_u  # exactly unloaded; else it already was in tension
        lift_off(par, s)
    elif kind == Next.TURN:
        end_unloading(par, s, 0.5 * par.mass_b * s.v_b * s.v_b)
        if s.mode == Mode.SS:
            begin_standstill(s)
    elif kind == Next.LEAVE_DOWN:
        resume_cycle(par, s)
    else:
        s.mode = Mode.BC
    if kind != Next.BARRIER and is_curved(par, s):
        take_line(par, s)
    force = bit_force(par, s, s.p, s.v_b)
    s.b_peak_bit = max(s.b_peak_bit, force)
    push_event(s, events, s.time, EventKind.MODE_FF + s.mode, force)


@kernel
def process_event(par, s, blows, events):
    """Process the scheduled event; the state has been carried to it."""
    kind = s.next_kind
    if kind == Next.CLOSE:
        impact(par, s, blows, events)
    elif kind == Next.RELEASE:
        note_standstill_force(par, s)
        release_piston(s, events)
        mark_standstill(s)
    elif kind == Next.SWITCH:
        turn_drive(s, events, s.time, -s.gap)
    elif kind == Next.LINE:
        s.p = s.line_end
        take_line(par, s)
    elif kind == Next.HOLD:
        if s.held == 0:
            s.gap -= bend_of(par, s, s.next_tau)
            s.u_r = -s.gap
        note_standstill_force(par, s)
        mark_standstill(s)
    else:
        change_mode(par, s, events, kind, s.next_tau > 0.0 and s.late == 0)
