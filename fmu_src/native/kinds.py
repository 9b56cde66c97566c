"""What motions by any solver do: each call goes on to the solver that the motion has."""

from __future__ import annotations

from fmu_src.native import fem, modal, rigid, wave
from fmu_src.native.layout import GaugeBar, Kind, head_records
from percussion_model.physics.kernel import preparing


@preparing
def refuse(kind, numbers, facts):
    """Number of why a solver cannot set up a scene, 0 for none.

    Parameters
    ----------
    kind : int
        `Kind`.
    numbers : Numbers
    facts : float array, shape (4,)
        Filled where there is one.
    """
    if kind == Kind.MODAL:
        return modal.refuse(numbers, facts)
    if kind == Kind.WAVE:
        return wave.refuse(numbers, facts)
    if kind == Kind.FEM:
        return fem.refuse(numbers, facts)
    return 0


@preparing
def create(kind, numbers, bar, place):
    """Make the memory of a motion at time zero; its address, 0 where there is no memory left.

    Parameters
    ----------
    kind : int
        `Kind`.
    numbers : Numbers
    bar : int
        `GaugeBar`.
    place : float
        Of the gauge, from the top of its bar [m].
    """
    if kind == Kind.MODAL:
        return modal.create(numbers, bar, place)
    if kind == Kind.WAVE:
        return wave.create(numbers, bar, place)
    if kind == Kind.FEM:
        return fem.create(numbers, bar, place)
    return rigid.create(numbers)


@preparing
def state_time(base, moving):
    """Time up to which the state in a copy of what moves is committed [s]."""
    kind = head_records(base, 1)[0].kind
    if kind == Kind.MODAL:
        return modal.state_time(base, moving)
    if kind == Kind.WAVE:
        return wave.state_time(base, moving)
    if kind == Kind.FEM:
        return fem.state_time(moving)
    return rigid.state_time(moving)


@preparing
def grid_point_after(base, t):
    """First time at or after `t` at which inputs can change [s]."""
    head = head_records(base, 1)[0]
    if head.kind == Kind.MODAL:
        return modal.grid_point_after(base, t)
    if head.kind == Kind.WAVE:
        return wave.grid_point_after(base, t)
    return max(t, state_time(base, base + head.state_at))


@preparing
def is_quiet(base, t):
    """Whether nothing has to be done to come to a time."""
    kind = head_records(base, 1)[0].kind
    if kind == Kind.MODAL:
        return modal.is_quiet(base, t)
    if kind == Kind.WAVE:
        return wave.is_quiet(base, t)
    if kind == Kind.RIGID:
        return rigid.is_quiet(base, t)
    return False


@preparing
def time_of_blow(base):
    """Time by which what is pending is over, if a blow may start in it [s]; 0 if none may."""
    kind = head_records(base, 1)[0].kind
    if kind == Kind.MODAL:
        return modal.time_of_blow(base)
    if kind == Kind.WAVE:
        return wave.time_of_blow(base)
    if kind == Kind.FEM:
        return fem.time_of_blow(base)
    return 0.0


@preparing
def go(base, task, t, room):
    """Do a task with the state, with room for so many blows; status and blows."""
    kind = head_records(base, 1)[0].kind
    if kind == Kind.MODAL:
        return modal.go(base, task, t, room)
    if kind == Kind.WAVE:
        return wave.go(base, t, room)
    if kind == Kind.FEM:
        return fem.go(base, task, t, room)
    return rigid.go(base, task, t, room)


@preparing
def take_inputs(base):
    """Let the solver follow inputs that have changed."""
    if head_records(base, 1)[0].kind == Kind.FEM:
        fem.take_inputs(base)


@preparing
def read(base, moving, t, reading, peaks):
    """Carry a copy of what moves to a time and read it."""
    kind = head_records(base, 1)[0].kind
    if kind == Kind.MODAL:
        modal.read(base, moving, t, reading, peaks)
    elif kind == Kind.WAVE:
        wave.read(base, moving, t, reading, peaks)
    elif kind == Kind.FEM:
        fem.read(base, moving, t, reading)
    else:
        rigid.read(base, moving, t, reading)


@preparing
def stress(base, moving):
    """Stress at the gauge in a copy of what moves [Pa]."""
    head = head_records(base, 1)[0]
    if head.gauge_bar == GaugeBar.NONE:
        return 0.0
    if head.kind == Kind.MODAL:
        return modal.stress(base, moving)
    if head.kind == Kind.WAVE:
        return wave.stress(base, moving)
    return fem.stress(base, moving)


@preparing
def find_fault(base, moving, t, facts):
    """Number of what is wrong with what moves, from outside, 0 for nothing; fills four facts."""
    kind = head_records(base, 1)[0].kind
    if kind == Kind.MODAL:
        return modal.find_fault(base, moving, t, facts)
    if kind == Kind.WAVE:
        return wave.find_fault(base, moving, t, facts)
    if kind == Kind.FEM:
        return fem.find_fault(base, moving, t, facts)
    return rigid.find_fault(moving, t, facts)
