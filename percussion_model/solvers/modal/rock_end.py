"""Changes of mode of the rock law, and what a standing bit has of energy."""

from __future__ import annotations

from percussion_model.physics.blows import push_checkpoint, push_event
from percussion_model.physics.kernel import inlined, kernel
from percussion_model.physics.records import Mode, RockKind
from percussion_model.physics.rock import (
    REST_VELOCITY,
    barrier_level,
    close_interface,
    ends_standstill,
    enter_standstill,
    leave_by_velocity,
    leave_standstill,
    recoverable,
    spring_force,
)
from percussion_model.solvers.modal.bar import bit_kinetic, standing_energy
from percussion_model.solvers.modal.forms import change_spring, leave_out
from percussion_model.solvers.modal.piston import WHOLE, time_of
from percussion_model.solvers.modal.records import JOINED, LOOK

# A standstill with less than this share of W_R stays one if nothing comes from outside.
QUIET_SHARE = 0.9


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
        if par.rock == RockKind.WALL:
            s.e_standstill += before
            s.p_u = s.p
        close_interface(par, s, energy)
    elif par.rock != RockKind.BILINEAR:
        if par.rock == RockKind.WALL:
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
        if par.rock == RockKind.SPRING or left == Mode.BC:
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
    if par.rock == RockKind.NONE:
        return False
    if s.mode == Mode.FF:
        return p > s.p_u and v > 0.0
    if par.rock == RockKind.SPRING:
        return p < 0.0
    if par.rock == RockKind.WALL:
        return force < 0.0
    if s.mode == Mode.DFC and s.w + work >= s.w_r:
        return True
    if s.mode == Mode.DFC or s.mode == Mode.FC:
        return v < -REST_VELOCITY and s.time >= s.rest_until
    if s.mode == Mode.BC:
        return p < s.p_u or v > REST_VELOCITY
    return par.release == 1 and force < 0.0
