"""The drive: switching pressure law on the mean relative motion, docs/model.md, eqs 12-13."""

from __future__ import annotations

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
    """Turn the pressure where the relative motion reaches its threshold.

    Only one threshold is watched at a time: u_r = 0 while the pressure pushes
    down, u_r = -D_1 while it lifts.

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
    if par.drive != DriveKind.PRESSURE:
        return -1.0
    if s.alpha > 0:
        level = 0.0
        passed = s.u_r >= level
    else:
        level = -s.reversal
        passed = s.u_r <= level
    if not passed:
        return -1.0
    share = 0.0
    if u_before != s.u_r:
        share = min(max((level - u_before) / (s.u_r - u_before), 0.0), 1.0)
    turn_drive(s, events, time + share * tau, level)
    return share
