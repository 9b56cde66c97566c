"""The drive: switching pressure law on the mean relative motion, eq. 11-16 of the paper."""

from __future__ import annotations

from percussion_model.physics.blows import push_event
from percussion_model.physics.kernel import inlined
from percussion_model.physics.records import DriveKind, EventKind

PRESSURE, EXTERNAL = int(DriveKind.PRESSURE), int(DriveKind.EXTERNAL)
DRIVE_UP, DRIVE_DOWN = int(EventKind.DRIVE_UP), int(EventKind.DRIVE_DOWN)


@inlined
def drive_force(par, s):
    """Force of the drive on the piston, down positive [N]."""
    if par.drive == PRESSURE:
        return s.alpha * s.drive_force
    if par.drive == EXTERNAL:
        return s.external
    return 0.0


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
    if par.drive != PRESSURE:
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
    s.alpha = -s.alpha
    kind = DRIVE_UP
    if s.alpha > 0:
        kind = DRIVE_DOWN
        s.armed = 1
    push_event(s, events, time + share * tau, kind, level)
    return share
