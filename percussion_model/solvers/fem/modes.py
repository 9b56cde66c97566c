"""Changes of mode of a state that lies just past an event: contact, drive, rock.

What a spring holds there that it should not, or the reverse, is booked as
overshoot.
"""

from __future__ import annotations

from percussion_model.physics.blows import push_event, start_blow, starts_blow
from percussion_model.physics.drive import switch_drive
from percussion_model.physics.kernel import kernel, merged
from percussion_model.physics.records import EventKind, Mode, RockKind
from percussion_model.physics.rock import (
    barrier_off,
    close_interface,
    enter_standstill,
    leave_by_velocity,
    leave_standstill,
    origin,
    recoverable,
    stiffness,
)
from percussion_model.solvers.fem.bars import bit_position, kinetic_energy, read_means
from percussion_model.solvers.fem.records import Node
from percussion_model.solvers.fem.solve import damping

FF, DFC, FC, BC, SS = (int(m) for m in Mode)
NO_ROCK, BILINEAR, SPRING = int(RockKind.NONE), int(RockKind.BILINEAR), int(RockKind.SPRING)
CONTACT_CLOSED, CONTACT_OPENED = int(EventKind.CONTACT_CLOSED), int(EventKind.CONTACT_OPENED)
U = int(Node.U)


@merged
def change_contact(par, s, w, c, blows, events):
    """Close or open the gap where its sign asks for it; 1 where it changed."""
    if s.closed == 0:
        if s.gap >= 0.0:
            return 0
        read_means(par, s, w, c)
        if starts_blow(par, s, s.time):
            here = bit_position(s)
            start_blow(s, blows, s.time, s.v_p, here, s.i_bit, par.mass_p)
        s.b_contacts += 1
        s.closed = 1
        s.e_overshoot -= 0.5 * par.k_c * s.gap * s.gap
        push_event(s, events, s.time, CONTACT_CLOSED, -s.gap_rate)
        return 1
    if s.gap <= 0.0:
        return 0
    read_means(par, s, w, c)
    s.closed = 0
    s.b_rebound = s.v_p
    s.t_open = s.time
    s.e_overshoot += 0.5 * par.k_c * s.gap * s.gap
    push_event(s, events, s.time, CONTACT_OPENED, -s.gap_rate)
    return 1


@merged
def close_on_rock(par, s, energy):
    """The flying bit meets the rock."""
    springing = s.springing
    standstill = s.e_standstill + recoverable(s)
    close_interface(par, s, energy)
    s.springing = 0
    if springing == 0:
        # what flight and law take for rock still pressed in is overshoot
        s.e_standstill = standstill
        s.e_overshoot -= recoverable(s)


@merged
def fly(s):
    """The bit leaves the rock, which may still be pressed in."""
    left = recoverable(s)
    s.mode = FF
    if s.p > s.p_u:
        s.springing = 1
    else:
        s.e_overshoot += left


@merged
def change_rock(par, s, w, c):
    """Make the change that the present mode asks for; 1 where there is one."""
    v = s.v_end
    energy = 0.0
    if s.mode != SS and par.rock == BILINEAR:
        energy = kinetic_energy(c, w, par.n_p, par.n_b)
    if s.mode == FF:
        if s.springing == 1 and s.p <= s.p_u:
            s.springing = 0
        if s.springing == 1:
            if v <= 0.0:
                return 0
        elif s.p <= s.p_u:
            return 0
        close_on_rock(par, s, energy)
        return 1
    if par.rock == SPRING:
        if s.p >= 0.0:
            return 0
        fly(s)
        return 1
    if s.mode == DFC and s.w >= s.w_r:
        s.mode = FC
        return 1
    if s.mode == BC and s.p < s.p_u:
        fly(s)
        return 1
    if s.mode == SS:
        if barrier_off(par, s) or s.kinetic > s.w_r:
            leave_standstill(par, s, v)
            return 1
        if par.release == 1 and stiffness(s) * (s.p - origin(s)) + damping(s) * v < 0.0:
            fly(s)
            return 1
        return 0
    return leave_by_velocity(par, s, v, energy)


@merged
def move_datum(par, s, w):
    """Count the nodes from the datum of the drilling cycle that has begun."""
    last = par.n_p + par.n_b - 1
    shift = s.p - w[U, last]
    if shift != 0.0:
        for i in range(last):
            w[U, i] += shift
        w[U, last] = s.p
        s.mean_p += shift
        s.mean_b += shift


@kernel
def change_modes(par, s, w, c, blows, events):
    """Make all changes that the present state asks for."""
    for _ in range(par.most_changes):
        changed = 0
        if par.n_p > 0:
            changed = change_contact(par, s, w, c, blows, events)
            switch_drive(par, s, s.u_r, s.time, 0.0, events)
        if par.rock != NO_ROCK and change_rock(par, s, w, c) == 1:
            changed = 1
            move_datum(par, s, w)
            if s.mode == SS:
                enter_standstill(s, s.time)
                s.kinetic = kinetic_energy(c, w, par.n_p, par.n_b)
            push_event(s, events, s.time, s.mode, stiffness(s) * (s.p - origin(s)))
        if changed == 0:
            s.stuck = 0
            return
    s.stuck = 1
    s.locked += 1
