"""What an event changes: impact and release of the piston, drive, modes of the rock law."""

from __future__ import annotations

import math

from numba import njit

from percussion_model.physics.records import DriveKind, EventKind, Mode, RockKind
from percussion_model.solvers.rigid.law import (
    acceleration,
    acceleration_doubt,
    bit_force,
    contact_force,
    end_loading,
    in_storm,
    in_worst_storm,
    lift_off,
    note_standstill_force,
    overcomes_barrier,
    resume_cycle,
    set_down,
    start_cycle,
    watch_standstill,
)
from percussion_model.solvers.rigid.records import Next

# Pressed together, a rebound slower than this ends the bouncing: what is left of a blow
# of 10 m/s is 1e-10 of its energy, and the rest would be endless ever shorter bounces.
HELD_REBOUND = 1e-4

# Impacts at one instant after which a resting contact is not left to rounding.
RESTING_EVENTS = 8


@njit(cache=True, error_model="numpy")
def push_event(s, kind, value):
    """Note a row for the event list; time and position are those of the state."""
    s.row_kind[s.n_rows] = kind
    s.row_value[s.n_rows] = value
    s.n_rows += 1
    s.count_events += 1


@njit(cache=True, error_model="numpy")
def starts_blow(par, s, time):
    """Whether a closure of the gap at `time` starts a blow; no two start at one instant."""
    if s.in_blow == 1 and time <= s.blow.time:
        return False
    if par.drive == DriveKind.PRESSURE:
        return s.armed == 1
    return time - s.opened >= par.blow_gap_time


@njit(cache=True, error_model="numpy")
def start_blow(par, s):
    """Start the next blow; the caller has read out the one under way."""
    b = s.blow
    s.in_blow = 1
    s.armed = 0
    s.count_blows += 1
    b.time = s.time
    b.period = math.nan
    b.impact_velocity = s.v_p
    b.rebound_velocity = math.nan
    b.stroke = 0.0
    b.blow_energy = 0.5 * par.M_p * s.v_p * s.v_p
    b.rock_energy = 0.0
    b.penetration = 0.0
    b.bit_position = s.bit_position
    b.peak_contact_force = math.nan  # an impact of rigid bodies has an impulse, no force
    b.peak_bit_force = 0.0
    b.standstill_force = s.ss_force
    b.contact_impulse = 0.0
    b.bit_impulse = 0.0
    b.drive_impulse = 0.0
    b.contacts = 0
    b.drilling_cycles = 0
    s.ss_force = math.nan


@njit(cache=True, error_model="numpy")
def give_impulse(par, s, impulse, on_rest):
    """Pass an impulse from piston to bit; a wall under the bit passes it on."""
    s.v_p -= impulse / par.M_p
    s.contact_impulse += impulse
    s.blow.contact_impulse += impulse
    if on_rest:
        s.bit_impulse += impulse
        s.blow.bit_impulse += impulse
    else:
        s.v_b += impulse / par.M_b


@njit(cache=True, error_model="numpy")
def part(par, s):
    """The gap opens: the piston is free again."""
    s.held = 0
    s.opened = s.time
    s.blow.rebound_velocity = s.v_p
    push_event(s, EventKind.CONTACT_OPENED, s.v_p - s.v_b)


@njit(cache=True, error_model="numpy")
def impact(par, s):
    """The gap closes: an impact with restitution, or the piston stays on the bit."""
    note_standstill_force(par, s)
    if starts_blow(par, s, s.time):
        start_blow(par, s)
    s.gap = 0.0
    w = max(s.v_p - s.v_b, 0.0)
    s.blow.contacts += 1
    s.count_contacts += 1
    push_event(s, EventKind.CONTACT_CLOSED, w)
    if par.drive == DriveKind.PRESSURE and s.alpha > 0:
        s.alpha = -1
        push_event(s, EventKind.DRIVE_UP, 0.0)
    # A bit at the wall stays there, even if its feed pulls and it is about to leave.
    rests = par.rock == RockKind.WALL and s.p >= s.P_u and s.v_b == 0.0
    mass = par.M_p if rests else par.M_p * par.M_b / (par.M_p + par.M_b)
    # In a storm they do not rebound; in the worst they stay together, pressed or not.
    e = 0.0 if in_storm(par, s) else par.e
    v_p = s.v_p
    v_b = s.v_b
    if e * w < HELD_REBOUND:
        # Would the two stay together? Try with the common velocity.
        s.held = 1
        common = 0.0 if rests else (par.M_p * v_p + par.M_b * v_b) / (par.M_p + par.M_b)
        s.v_b = common
        s.v_p = common
        acc = acceleration(par, s)
        pressed = contact_force(par, s, acc) > par.M_p * acceleration_doubt(par, s, acc)
        s.v_p = v_p
        s.v_b = v_b
        if pressed or s.standing_events > RESTING_EVENTS or in_worst_storm(par, s):
            give_impulse(par, s, mass * w, rests)
            s.v_b = common
            s.v_p = common
            s.contact += 0.5 * mass * w * w
            watch_standstill(s)
            return
        s.held = 0
    give_impulse(par, s, (1.0 + e) * mass * w, rests)
    s.contact += 0.5 * mass * (1.0 - e * e) * w * w
    watch_standstill(s)
    part(par, s)


@njit(cache=True, error_model="numpy")
def touch_rock(par, s, inside):
    """The bit meets the rock."""
    if not inside:
        s.p = s.P_u
    if par.rock == RockKind.BILINEAR:
        if overcomes_barrier(par, s):
            start_cycle(par, s, 0.0)
        else:
            set_down(par, s)
    elif par.rock == RockKind.SPRING:
        s.K_R = par.K_R
        s.mode = Mode.FC
    else:
        # The wall stops the bit; a piston that rode on it goes on and hits it.
        impulse = par.M_b * s.v_b
        s.bit_impulse += impulse
        s.blow.bit_impulse += impulse
        s.contact += 0.5 * impulse * s.v_b
        s.v_b = 0.0
        if s.held == 1 and s.v_p > 0.0:
            part(par, s)
        set_down(par, s)


@njit(cache=True, error_model="numpy")
def change_mode(par, s, kind, moved):
    """Leave the present drilling mode for the reason `kind`."""
    if (kind == Next.PEAK or kind == Next.TURN) and moved:
        s.v_b = 0.0
        if s.held == 1:
            s.v_p = 0.0
    if s.mode == Mode.SS:
        note_standstill_force(par, s)
    if kind == Next.TOUCH or kind == Next.TOUCH_INSIDE:
        touch_rock(par, s, kind == Next.TOUCH_INSIDE)
    elif kind == Next.BARRIER:
        s.mode = Mode.FC
    elif kind == Next.PEAK:
        end_loading(s)
    elif kind == Next.LIFT:
        if moved and (s.mode == Mode.BC or par.rock == RockKind.SPRING):
            s.p = s.P_u  # exactly unloaded; else it already was in tension
        lift_off(par, s)
    elif kind == Next.TURN:
        if overcomes_barrier(par, s):
            resume_cycle(par, s)
        else:
            set_down(par, s)
    elif kind == Next.LEAVE_DOWN:
        resume_cycle(par, s)
    else:
        s.mode = Mode.BC
    force = bit_force(par, s, s.p, s.v_b)
    s.blow.peak_bit_force = max(s.blow.peak_bit_force, force)
    push_event(s, EventKind.MODE_FF + s.mode, force)


@njit(cache=True, error_model="numpy")
def happen(par, s):
    """Let the scheduled event happen; the state has been carried to it."""
    kind = s.next_kind
    s.n_rows = 0
    if kind == Next.CLOSE:
        impact(par, s)
    elif kind == Next.RELEASE:
        note_standstill_force(par, s)
        part(par, s)
        watch_standstill(s)
    elif kind == Next.SWITCH:
        s.alpha = -s.alpha
        if s.alpha > 0:
            s.armed = 1
        push_event(s, EventKind.DRIVE_DOWN if s.alpha > 0 else EventKind.DRIVE_UP, -s.gap)
    else:
        change_mode(par, s, kind, s.next_tau > 0.0 and s.late == 0)
