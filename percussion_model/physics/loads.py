"""Forces on the bodies from outside: weight, feed, drive, and those of components.

The drive is a switching pressure law on the mean relative motion, docs/model.md, eqs 12-13.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from percussion_model.components import COMPONENTS, Component
from percussion_model.physics.blows import push_event
from percussion_model.physics.feed import feed_on_bit, throttle
from percussion_model.physics.kernel import LEAST_DIVISOR, composed, inlined, merged
from percussion_model.physics.records import DriveKind, EventKind


@composed
def _no_force(par: Any, s: Any, h: float) -> float:
    return 0.0


def _and_slope(before: Callable, one: Component) -> Callable:
    if one.slope is None:
        return before
    slope, present = one.slope, f"with_{one.name}"

    @composed
    def more(par: Any, s: Any) -> float:
        return before(par, s) + slope(par, s) if par[present] == 1 else before(par, s)

    return more


@composed
def _steady(par: Any, s: Any) -> float:
    return 0.0


def _and_drive(before: Callable, one: Component) -> Callable:
    if not (one.is_drive and one.on_bit):
        return before
    held = f"f_{one.name}_bit"

    @composed
    def add(s: Any) -> float:
        return before(s) + s[held]

    return add


@composed
def _no_drive(s: Any) -> float:
    return 0.0


@composed
def _always(par: Any, s: Any) -> float:
    return math.inf


@composed
def _nothing(par: Any, s: Any, amount: float) -> None:
    pass


@composed
def _path_of_bit(par: Any, s: Any, path: float) -> None:
    s.path_b += path


def _and_force(before: Callable, one: Component, body: str) -> Callable:
    force = getattr(one, f"on_{body}")
    if force is None:
        return before
    present, held = f"with_{one.name}", f"f_{one.name}_{body}"

    @composed
    def hold(par: Any, s: Any, h: float) -> float:
        total = before(par, s, h)
        if par[present] == 1:
            s[held] = force(par, s, h)
            total += s[held]
        return total

    return hold


def _and_work(before: Callable, one: Component, body: str) -> Callable:
    if body not in one.pushes:
        return before
    held, entry, sign = f"f_{one.name}_{body}", f"e_{one.name}", 1.0 if one.takes_feed else -1.0
    if one.is_drive:
        entry, sign = "e_drive", 1.0

    @composed
    def book(par: Any, s: Any, path: float) -> None:
        before(par, s, path)
        s[entry] += sign * s[held] * path

    return book


def _and_time(before: Callable, one: Component) -> Callable:
    take_on, present = one.pass_time, f"with_{one.name}"
    if take_on is None:
        return before

    @composed
    def pass_on(par: Any, s: Any, h: float) -> None:
        before(par, s, h)
        if par[present] == 1:
            take_on(par, s, h)

    return pass_on


def _and_lasting(before: Callable, one: Component) -> Callable:
    if one.lasts is None:  # with others that push no force is held (`steps`)
        return before
    lasts, present = one.lasts, f"with_{one.name}"

    @composed
    def until(par: Any, s: Any) -> float:
        return min(before(par, s), lasts(par, s)) if par[present] == 1 else before(par, s)

    return until


def _joined(start: Callable, add: Callable, *more: str) -> Callable:
    for one in COMPONENTS:
        start = add(start, one, *more)
    return start


# hold_...(par, s, h): take the mean force of each component over the next h; their sum [N].
hold_on_bit = _joined(_no_force, _and_force, "bit")
hold_on_piston = _joined(_no_force, _and_force, "piston")

# book_...(par, s, path): enter what the held forces take from a body over a path [m].
book_on_bit = _joined(_path_of_bit, _and_work, "bit")
book_on_piston = _joined(_nothing, _and_work, "piston")

# pass_own_time(par, s, h): take the states of components on by h [s].
pass_own_time = _joined(_nothing, _and_time)

# drive_on_bit(s): force of drives on the bit [N].
drive_on_bit = _joined(_no_drive, _and_drive)

# slope_on_piston(par, s): how fast the force on the piston changes while it is held [N/s].
slope_on_piston = _joined(_steady, _and_slope)

# lasting(par, s): time for which mean forces may be held [s].
lasting = _joined(_always, _and_lasting)


@merged
def hold_components(par, s, h):
    """Take the mean forces of components over the next time h; they hold until the next call."""
    if par.effects == 1:
        s.f_on_bit = hold_on_bit(par, s, h)
        s.f_on_piston = hold_on_piston(par, s, h)


@merged
def pass_time(par, s, h):
    """Take the states of components on by a time h, at whose end the bodies are."""
    if par.effects == 1:
        s.i_on_bit += drive_on_bit(s) * h
        pass_own_time(par, s, h)


@inlined
def bend_of(par, s, h):
    """Way that a piston is late or early by where a mean force was held for a changing one [m]."""
    way = -slope_on_piston(par, s) * h * h * h / (12.0 * max(par.mass_p, LEAST_DIVISOR))
    s.path_p += way
    return way


@inlined
def bit_load(par, s):
    """Constant force on the bit: weight, feed and forces of components [N]."""
    return par.mass_b * par.gravity + (feed_on_bit(par, s) + s.f_on_bit)


@inlined
def bit_acceleration(par, s):
    """Acceleration that its body forces give the bit [m/s^2], docs/model.md, eq. 3."""
    return par.gravity + (feed_on_bit(par, s) + s.f_on_bit) / par.mass_b


@inlined
def piston_acceleration(par, push):
    """Acceleration of a free piston under a force of the drive [m/s^2], docs/model.md, eq. 3."""
    return par.gravity + push / par.mass_p


@inlined
def book_bit_load(par, s, path):
    """Enter the work of the bit's body forces over a path of its mean motion [m]."""
    s.e_feed += feed_on_bit(par, s) * path
    s.e_gravity += par.mass_b * par.gravity * path
    if par.effects == 1:
        book_on_bit(par, s, path)


@inlined
def book_piston_load(par, s, push, path, impulse):
    """Enter the work of drive and weight over a path of the piston's mean motion [m].

    Parameters
    ----------
    push, impulse : float
        Force [N] and impulse [N s] of drive and components.
    """
    s.e_drive += push * path
    s.e_gravity += par.mass_p * par.gravity * path
    s.i_drive += impulse
    move_to_components(par, s, path)


@inlined
def move_to_components(par, s, path):
    """Enter what components do over a path of the piston [m] as theirs, not as the drive's."""
    if par.effects == 1:
        s.e_drive -= s.f_on_piston * path
        s.path_p += path
        book_on_piston(par, s, path)


@inlined
def time_to_cover(distance, velocity, acceleration):
    """First time at which v t + a t^2 / 2 reaches a positive distance.

    Returns
    -------
    float
        Time [s]; infinity when it never does, 0 for a distance <= 0.
    """
    if distance <= 0.0:
        return 0.0
    if distance == math.inf:
        return math.inf
    disc = velocity * velocity + 2.0 * acceleration * distance
    if disc < 0.0:
        return math.inf
    bottom = velocity + math.sqrt(disc)
    if bottom <= 0.0:
        return math.inf
    return 2.0 * distance / bottom


@inlined
def drive_force(par, s):
    """Force of drive and components on the piston, down positive [N]."""
    if par.drive == DriveKind.PRESSURE:
        return s.alpha * s.drive_force * throttle(par, s) + s.f_on_piston
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
