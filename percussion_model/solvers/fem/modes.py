"""Changes of mode of a state that lies just past an event: contact, drive, rock.

What a spring holds there that it should not, or the reverse, is booked as
overshoot.
"""

from __future__ import annotations

from percussion_model.physics.blows import (
    close_gap,
    open_gap,
    push_event,
    standstill_force,
    start_blow,
    starts_blow,
)
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.loads import switch_drive
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import (
    close_interface,
    damping,
    enter_standstill,
    has_rock,
    is_crushable,
    is_elastic_rock,
    leave_by_velocity,
    leave_standstill,
    overcomes_barrier,
    recoverable,
    spring_force,
)
from percussion_model.solvers.fem.bars import bit_position, kinetic_energy, read_means
from percussion_model.solvers.fem.records import Node

# Nodes are counted from the datum of the drilling cycle nearer than this, and from where the
# rock end was when it was further than that from where they are counted [m].
NEAR, FAR = 0.01, 0.02


@merged
def change_contact(par, s, w, c, blows, events):
    """Close or open the gap where its sign asks for it; 1 where it changed."""
    if s.closed == 0:
        if s.gap >= 0.0:
            return 0
        read_means(par, s, w, c)
        if starts_blow(par, s, s.time):
            force = standstill_force(s, s.time, s.i_bit)
            start_blow(par, s, blows, s.time, s.v_p, bit_position(s), force)
            move_datum(par, s, w)
        s.closed = 1
        s.e_overshoot -= 0.5 * par.k_c * s.gap * s.gap
        close_gap(s, events, s.time, -s.gap_rate)
        return 1
    if s.gap <= 0.0:
        return 0
    read_means(par, s, w, c)
    s.closed = 0
    s.e_overshoot += 0.5 * par.k_c * s.gap * s.gap
    open_gap(s, events, s.time, -s.gap_rate)
    return 1


@merged
def close_on_rock(par, s, energy):
    """The flying bit meets the rock."""
    rebounding = s.rebounding
    standstill = s.e_standstill + recoverable(par, s)
    close_interface(par, s, energy)
    s.rebounding = 0
    if rebounding == 0:
        # what flight and law take for rock still pressed in is overshoot
        s.e_standstill = standstill
        s.e_overshoot -= recoverable(par, s)


@merged
def lift_off(par, s):
    """The bit leaves the rock, which may still be pressed in."""
    left = recoverable(par, s)
    s.mode = Mode.FF
    if s.p > s.p_u:
        s.rebounding = 1
    else:
        s.e_overshoot += left


@merged
def change_rock(par, s, w, c):
    """Make the change that the present mode asks for; 1 where there is one."""
    v = s.v_end
    energy = 0.0
    if s.mode != Mode.SS and is_crushable(par):
        energy = kinetic_energy(c, w, par.n_p, par.n_b)
    if s.mode == Mode.FF:
        if s.rebounding == 1 and s.p <= s.p_u:
            s.rebounding = 0
        if s.rebounding == 1:
            if v <= 0.0:
                return 0
        elif s.p <= s.p_u:
            return 0
        close_on_rock(par, s, energy)
        return 1
    if is_elastic_rock(par):
        if s.p >= 0.0:
            return 0
        lift_off(par, s)
        return 1
    if s.mode == Mode.DFC and s.w >= s.w_r:
        s.mode = Mode.FC
        return 1
    if s.mode == Mode.BC and s.p < s.p_u:
        lift_off(par, s)
        return 1
    if s.mode == Mode.SS:
        if overcomes_barrier(par, s, s.kinetic):
            leave_standstill(par, s, v)
            return 1
        if par.release == 1 and spring_force(par, s) + damping(s) * v < 0.0:
            lift_off(par, s)
            return 1
        return 0
    return leave_by_velocity(par, s, v, energy)


@inlined
def shift_nodes(par, w, shift, end):
    """Move all nodes, the rock end to `end`."""
    last = par.n_p + par.n_b - 1
    for i in range(last):
        w[Node.U, i] += shift
    w[Node.U, last] = end


@merged
def move_datum(par, s, w):
    """Count the nodes from the datum of the drilling cycle that has begun."""
    shift = s.p - (w[Node.U, par.n_p + par.n_b - 1] + s.far)
    if shift != 0.0:
        shift_nodes(par, w, shift + s.far, s.p)
        s.far = 0.0
        s.mean_p += shift
        s.mean_b += shift


@merged
def keep_near(par, s, w):
    """Count the nodes of a bit far from the datum, as in a long flight, from where it is.

    A stiff contact turns the rounding of a large displacement into a force.
    """
    here = w[Node.U, par.n_p + par.n_b - 1]
    if s.far != 0.0 and abs(s.p) < NEAR:
        shift_nodes(par, w, s.far, s.p)
        s.far = 0.0
    elif abs(here) > FAR:
        shift_nodes(par, w, -here, 0.0)
        s.far = s.p


@kernel
def change_modes(par, s, w, c, blows, events):
    """Make all changes that the present state asks for."""
    for _ in range(par.most_changes):
        changed = 0
        if par.n_p > 0:
            changed = change_contact(par, s, w, c, blows, events)
            switch_drive(par, s, s.u_r, s.time, 0.0, events)
        if has_rock(par) and change_rock(par, s, w, c) == 1:
            changed = 1
            move_datum(par, s, w)
            if s.mode == Mode.SS:
                enter_standstill(s, s.time)
                s.kinetic = kinetic_energy(c, w, par.n_p, par.n_b)
            push_event(s, events, s.time, s.mode, spring_force(par, s))
        if changed == 0:
            s.skip_events = 0
            return
    s.skip_events = 1
    s.count_locked += 1
