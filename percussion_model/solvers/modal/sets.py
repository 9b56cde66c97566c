"""Which modes of the bit are moved: all after a blow, few once the others have died away."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel
from percussion_model.solvers.modal.bar import LOW, SOFT, bit_vibration, elastic_of, kinetic_of

# Modes are left out once they have less than this share of the bit's energy of vibration.
LEAST_SHARE = 1e-8
# Steps between two looks.
LOOK = 32


@kernel
def leave_out(par, s, bars):
    """Go to a smaller set where what it lacks has died away.

    Offsets of the modes that go are those under a constant force, nearly: they join what is
    beyond the modes.
    """
    c, w = bars.cb, bars.wb
    while s.set + 1 < len(c.sizes):
        n, smaller = c.sizes[s.set], c.sizes[s.set + 1]
        before = bit_vibration(par, s, bars)
        offset = 0.0
        for k in range(smaller, n):
            offset += c.shape[LOW, k] * w[0, k]
        r = s.r_b + offset
        ends = s.r_t * s.r_t / c.beyond[s.set + 1, 0] + r * r / c.beyond[s.set + 1, 1]
        few = kinetic_of(w, 0, smaller) + elastic_of(w, c, 0, smaller)
        after = few + 0.5 * ends
        if abs(before - after) > LEAST_SHARE * before or after > before:
            return
        s.e_numerical += before - after
        s.r_b = r
        for k in range(smaller, n):
            w[0, k] = w[1, k] = 0.0
        s.set += 1


@kernel
def take_all(s, bars):
    """Take all modes; those that come back are where the force at the low end holds them."""
    if s.set == 0:
        return
    c, w = bars.cb, bars.wb
    force = -s.r_b / c.beyond[s.set, 1]
    for k in range(c.sizes[s.set], c.sizes[0]):
        w[0, k] = -c.shape[SOFT, k] * c.shape[LOW, k] * force
        w[1, k] = 0.0
    s.r_b *= c.beyond[0, 1] / c.beyond[s.set, 1]
    s.r_t *= math.sqrt(c.beyond[0, 0] / c.beyond[s.set, 0])  # as much energy
    s.set = 0
