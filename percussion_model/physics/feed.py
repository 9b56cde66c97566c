"""Feed on the bit, or on a casing that passes on what the drive leaves of it.

A casing rests on the shoulder of the bit and takes the reaction of the drive, whose mean over a
blow the feed must balance (docs/model.md, eq. 3a). Where it does not, the casing lifts off until
the drive has no more force than is held: that of the pressure law is less, or the pressure of the
supply, since air gets past.
"""

from __future__ import annotations

from enum import IntEnum

from percussion_model.physics.kernel import LEAST_DIVISOR, inlined

# A drive throttled further does not tell its recoil.
LEAST_THROTTLE = 1e-2


class Throttled(IntEnum):
    """What a drive has less of where the casing lifts off."""

    NOTHING = 0
    FORCE = 1  # the pressure law
    SUPPLY = 2  # a component that says so


@inlined
def held(par, s):
    """Force that holds the casing down [N]."""
    return s.feed + par.casing_weight


@inlined
def full_recoil(par, s):
    """Mean force on the casing of a drive that is not throttled, up positive [N]."""
    if par.throttled == Throttled.FORCE:
        return s.recoil_share * s.drive_force
    return s.recoil_share


@inlined
def throttle(par, s):
    """Share of its strength that a drive has: as much as lifts no casing further."""
    if par.on_casing == 0 or par.throttled == Throttled.NOTHING:
        return 1.0
    recoil = full_recoil(par, s)
    return min(max(held(par, s), 0.0) / max(recoil, LEAST_DIVISOR), 1.0) if recoil > 0.0 else 1.0


@inlined
def feed_on_bit(par, s):
    """Feed force on the bit [N]."""
    if par.feed_taken == 1:
        return 0.0
    if par.on_casing == 0:
        return s.feed
    return max(held(par, s) - full_recoil(par, s), 0.0)


@inlined
def note_recoil(par, s, push):
    """Take the recoil from the mean force of the drive over a blow [N]."""
    if par.throttled == Throttled.NOTHING:
        s.recoil_share = max(push, 0.0)
    else:
        strength = s.drive_force if par.throttled == Throttled.FORCE else 1.0
        full = throttle(par, s) * strength
        if full > LEAST_THROTTLE * strength:
            s.recoil_share = max(push / max(full, LEAST_DIVISOR), 0.0)
