"""Forces on the bodies from outside: weight, feed, drive, and effects that hold a force."""

from __future__ import annotations

from percussion_model.physics.effects import book_forces, hold_forces
from percussion_model.physics.kernel import inlined, merged


@inlined
def bit_load(par, s):
    """Constant force on the bit: weight, feed and held forces [N]."""
    return par.mass_b * par.gravity + (s.feed + s.f_held)


@inlined
def bit_acceleration(par, s):
    """Acceleration that its body forces give the bit [m/s^2]."""
    return par.gravity + (s.feed + s.f_held) / par.mass_b


@inlined
def piston_acceleration(par, push):
    """Acceleration of a free piston under a force of the drive [m/s^2], eq. 3 of docs/model.md."""
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
