"""Forces on the bodies from outside: weight, feed, drive, and effects that hold a force."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from percussion_model.physics.effects import EFFECTS, Effect
from percussion_model.physics.kernel import composed, inlined, merged


@composed
def _no_force(par: Any, s: Any) -> float:
    return 0.0


@composed
def _no_work(s: Any, path: float) -> None:
    pass


def _and_force(before: Callable, effect: Effect) -> Callable:
    force, held = effect.force, f"f_{effect.name}"

    @composed
    def hold(par: Any, s: Any) -> float:
        total = before(par, s)
        s[held] = force(par, s)
        return total + s[held]

    return hold


def _and_work(before: Callable, effect: Effect) -> Callable:
    held, entry = f"f_{effect.name}", f"e_{effect.name}"

    @composed
    def book(s: Any, path: float) -> None:
        before(s, path)
        s[entry] -= s[held] * path

    return book


# hold_forces(par, s): take the force of each effect now; their sum [N].
# book_forces(s, path): enter what the held forces take from the bit over a path [m].
hold_forces, book_forces = _no_force, _no_work
for _effect in EFFECTS:
    hold_forces, book_forces = _and_force(hold_forces, _effect), _and_work(book_forces, _effect)


@inlined
def bit_load(par, s):
    """Constant force on the bit: weight, feed and held forces [N]."""
    return par.mass_b * par.gravity + (s.feed + s.f_held)


@inlined
def bit_acceleration(par, s):
    """Acceleration that its body forces give the bit [m/s^2], docs/model.md, eq. 3."""
    return par.gravity + (s.feed + s.f_held) / par.mass_b


@inlined
def piston_acceleration(par, push):
    """Acceleration of a free piston under a force of the drive [m/s^2], docs/model.md, eq. 3."""
    return par.gravity + push / par.mass_p


@merged
def hold_effects(par, s):
    """Take the forces of the effects in the present state; they hold until the next call."""
    if par.effects == 1:
        s.f_held = hold_forces(par, s)


@inlined
def book_bit_load(par, s, path):
    """Enter the work of the bit's body forces over a path of its mean motion [m]."""
    s.e_feed += s.feed * path
    s.e_gravity += par.mass_b * par.gravity * path
    if par.effects == 1:
        book_forces(s, path)


@inlined
def book_piston_load(par, s, push, path, impulse):
    """Enter the work of drive and weight over a path of the piston's mean motion [m].

    Parameters
    ----------
    push, impulse : float
        Force [N] and impulse [N s] of the drive.
    """
    s.e_drive += push * path
    s.e_gravity += par.mass_p * par.gravity * path
    s.i_drive += impulse


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
