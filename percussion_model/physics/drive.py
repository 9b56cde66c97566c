"""The drive: switching pressure law on the mean relative motion, docs/model.md, eqs 12-13."""

from __future__ import annotations

import math

from percussion_model.physics.blows import push_event
from percussion_model.physics.kernel import inlined
from percussion_model.physics.records import DriveKind, EventKind


@inlined
def drive_force(par, s):
    """Force of drive and components on the piston, down positive [N]."""
    if par.drive == DriveKind.PRESSURE:
        return s.alpha * s.drive_force + s.f_on_piston
    if par.drive == DriveKind.EXTERNAL:
        return s.external + s.f_on_piston
    return s.f_on_piston


@inlined
def room_to_turn(par, s, u_r):
    """How far a relative displacement is before that at which the drive turns [m].

    Infinite where it does not turn by itself. The pressure law turns at u_r = 0 while it pushes
    down, at u_r = -D_1 while it lifts; only one of them is watched at a time.
    """
    if par.drive != DriveKind.PRESSURE:
        return math.inf
    return -u_r if s.alpha > 0 else u_r + s.reversal


@inlined
def turn_drive(s, events, time, u_r):
    """Turn the pressure at `time`, where the relative displacement is `u_r` [m]."""
    s.alpha = -s.alpha
    kind = EventKind.DRIVE_UP
    if s.alpha > 0:
        kind = EventKind.DRIVE_DOWN
        s.armed = 1
    push_event(s, events, time, kind, u_r)


@inlined
def switch_drive(par, s, u_before, time, tau, events):
    """Turn the pressure where the relative motion reaches its threshold, see `room_to_turn`.

    Parameters
    ----------
    u_before : float
        u_r at the start of the step [m]; s.u_r holds it at the end.
    time, tau : float
        Start and duration of the step [s].

    Returns
    -------
    float
        Share of the step before the switch, or -1 where there is none.
    """
    if room_to_turn(par, s, s.u_r) > 0.0:
        return -1.0
    level = 0.0 if s.alpha > 0 else -s.reversal
    share = 0.0
    if u_before != s.u_r:
        share = min(max((level - u_before) / (s.u_r - u_before), 0.0), 1.0)
    turn_drive(s, events, time + share * tau, level)
    return share
