"""What motions by any solver do: each call goes on to the entries of the solver that it has.

The entries are linked later (`percussion_model.engine.entries`).
"""

from __future__ import annotations

from typing import Any

from numba import types

from percussion_model.engine.entries import ENTRIES
from percussion_model.engine.layout import head_records
from percussion_model.engine.memory import words_at
from percussion_model.engine.records import BLOW_BYTES, BLOW_ROOM, GaugeBar, Kind
from percussion_model.physics.kernel import preparing

_KINDS = {"w": types.int64, "n": types.float64}


def _entry(solver: str, name: str) -> Any:
    """An entry as kernels call it."""
    result, _, arguments = ENTRIES[name].partition(":")
    form = _KINDS[result](*(_KINDS[one] for one in arguments))
    return types.ExternalFunction(f"{solver}_{name}", form)


def _by_kind(name: str) -> Any:
    """Kernel that calls the entry of a name of the solver whose `Kind` comes first."""
    modal, wave, fem, rigid = (_entry(one.name.lower(), name) for one in Kind)

    @preparing
    def call(kind, *arguments):
        if kind == Kind.MODAL:
            return modal(*arguments)
        if kind == Kind.WAVE:
            return wave(*arguments)
        if kind == Kind.FEM:
            return fem(*arguments)
        return rigid(*arguments)

    return call


refuse = _by_kind("refuse")
_create = _by_kind("create")
_state_time = _by_kind("state_time")
_grid_point_after = _by_kind("grid_point_after")
_is_quiet = _by_kind("is_quiet")
_time_of_blow = _by_kind("time_of_blow")
_run = _by_kind("run")
_read = _by_kind("read")
_stress = _by_kind("stress")
_find_fault = _by_kind("find_fault")


@preparing
def create(kind, image, bar, place):
    """Make the memory of a motion at time zero; its address, 0 where there is no memory left."""
    return _create(kind, image, bar, place, 0)


@preparing
def state_time(base, moving):
    """Time up to which the state in a copy of what moves is committed [s]."""
    return _state_time(head_records(base, 1)[0].kind, base, moving)


@preparing
def grid_point_after(base, t):
    """First time at or after `t` at which inputs can change [s]."""
    head = head_records(base, 1)[0]
    return _grid_point_after(head.kind, base, base + head.state_at, t)


@preparing
def is_quiet(base, t):
    """Whether nothing has to be done to come to a time."""
    head = head_records(base, 1)[0]
    return _is_quiet(head.kind, base, base + head.state_at, t) != 0


@preparing
def time_of_blow(base):
    """Time by which what is pending is over, if a blow may start in it [s]; 0 if none may."""
    head = head_records(base, 1)[0]
    return _time_of_blow(head.kind, base, base + head.state_at)


@preparing
def go(base, task, t, room):
    """Do a task with the state, with room for so many blows; status and blows."""
    head = head_records(base, 1)[0]
    moving, blows = base + head.state_at, base + head.blows_at
    events = blows + BLOW_ROOM * BLOW_BYTES
    status = _run(head.kind, base, moving, task, t, blows, room, events, 1, 0)
    return status, words_at(moving + head.record_at, head.blow_count_at + 1)[head.blow_count_at]


@preparing
def take_inputs(base):
    """Let the solver follow inputs that have changed."""
    head = head_records(base, 1)[0]
    if head.changed_at >= 0:
        words_at(base + head.state_at + head.record_at, head.changed_at + 1)[head.changed_at] = 1


@preparing
def read(base, moving, copy, t, reading, peaks):
    """Copy what moves, carry the copy to a time and read it.

    Parameters
    ----------
    moving, copy, reading : int
        Addresses.
    """
    return _read(head_records(base, 1)[0].kind, base, moving, copy, t, reading, peaks)


@preparing
def stress(base, copy):
    """Stress at the gauge [Pa], in a copy of what moves that was just read of the state."""
    head = head_records(base, 1)[0]
    if head.gauge_bar == GaugeBar.NONE:
        return 0.0
    # reading leaves the rings of waves alone
    at = base + head.state_at if head.kind == Kind.WAVE else copy
    return _stress(head.kind, base, at)


@preparing
def find_fault(base, moving, t, facts):
    """Number of what is wrong with what moves, from outside, 0 for nothing; fills four facts.

    Parameters
    ----------
    facts : int
        Address.
    """
    return _find_fault(head_records(base, 1)[0].kind, base, moving, t, facts)
