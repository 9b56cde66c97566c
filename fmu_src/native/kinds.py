"""What motions by any solver do: each call goes on to the solver that the motion has."""

from __future__ import annotations

import math

from fmu_src.native import modal
from fmu_src.native.layout import Kind, head_records
from percussion_model.physics.kernel import preparing


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
    return 0


@preparing
def state_time(base, moving):
    """Time up to which the state in a copy of what moves is committed [s]."""
    if head_records(base, 1)[0].kind == Kind.MODAL:
        return modal.state_time(base, moving)
    return math.nan


@preparing
def grid_point_after(base, t):
    """First time at or after `t` at which inputs can change [s]."""
    if head_records(base, 1)[0].kind == Kind.MODAL:
        return modal.grid_point_after(base, t)
    return math.nan


@preparing
def is_quiet(base, t):
    """Whether nothing has to be done to come to a time."""
    if head_records(base, 1)[0].kind == Kind.MODAL:
        return modal.is_quiet(base, t)
    return False


@preparing
def go(base, task, t, room):
    """Do a task with the state, with room for so many blows; status and blows."""
    if head_records(base, 1)[0].kind == Kind.MODAL:
        return modal.go(base, task, t, room)
    return 0, 0


@preparing
def read(base, moving, t, reading, peaks):
    """Carry a copy of what moves to a time and read it."""
    if head_records(base, 1)[0].kind == Kind.MODAL:
        modal.read(base, moving, t, reading, peaks)


@preparing
def stress(base, moving):
    """Stress at the gauge in a copy of what moves [Pa]."""
    if head_records(base, 1)[0].kind == Kind.MODAL:
        return modal.stress(base, moving)
    return 0.0


@preparing
def find_fault(base, moving, t, facts):
    """Number of what is wrong with what moves, from outside, 0 for nothing; fills three facts."""
    if head_records(base, 1)[0].kind == Kind.MODAL:
        return modal.find_fault(base, moving, t, facts)
    return 0
