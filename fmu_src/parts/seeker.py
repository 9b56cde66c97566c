"""Seeker of the best rate: swings feed and pressure, and climbs where the rate follows them.

Feed swings once in a window, pressure a whole number of times: F = F_0 (1 + a sin w t). Over a
whole window such swings, and a constant, know nothing of each other. Feed, pressure and rate are
each demodulated at both frequencies; the slopes of the rate over the *measured* feed and pressure
that explain best what the rate does at these frequencies, by the means, are the logarithmic
slopes, whatever the rig makes of a swing and even if one swing shakes the other quantity.
They move the logarithm of the two centres by a limited amount.
"""

from __future__ import annotations

import math

from fmu_src.parts.part import FLAG, NUMBER
from percussion_model.physics.elementary import cos_and_sin, exp, sin
from percussion_model.physics.kernel import kernel

FEED, PRESSURE = 0, 1
# Less than this share of the product of both swings: they cannot be told apart.
ALIKE = 1e-6
# Feed, pressure and rate at both frequencies, each a real and an imaginary number.
MEASURED, WAVES = 3, 12
# Sums in a window, the same at both frequencies; feed [N] and pressure [Pa] about which the seeker
# swings; logarithmic slopes of the rate, as found last. Windows that begin after `pause_end` count.
STATE = {
    "phase": NUMBER,
    "pause_end": NUMBER,
    "counts": FLAG,
    "sums": (*NUMBER, MEASURED),
    "waves": (*NUMBER, WAVES),
    "centres": (*NUMBER, 2),
    "gradients": (*NUMBER, 2),
}


@kernel
def restart(s):
    """Begin a window."""
    s.phase = 0.0
    for i in range(MEASURED):
        s.sums[i] = 0.0
    for i in range(WAVES):
        s.waves[i] = 0.0


@kernel
def pause(p, s):
    """Lose the present window, and count none that begins before the wait is over."""
    s.pause_end = s.time + p.seek_wait
    restart(s)


@kernel
def sample(p, u, s, h):
    """Take a sample of the inputs; return the feed [N] and the pressure [Pa] to be kept."""
    if s.phase == 0.0:
        s.counts = s.time > s.pause_end
    s.phase += h
    angle = 2.0 * math.pi * s.phase / p.seek_period
    values = u.feed_force, u.supply_pressure, u.rate_of_penetration
    for k in range(2):
        cosine, sine = cos_and_sin((p.seek_pressure_cycles if k == 1 else 1) * angle)
        for i in range(MEASURED):
            s.waves[6 * k + 2 * i] += values[i] * cosine
            s.waves[6 * k + 2 * i + 1] -= values[i] * sine
    for i in range(MEASURED):
        s.sums[i] += values[i]
    if s.phase >= p.seek_period - 0.5 * h:
        if s.counts:
            climb(p, s)
        restart(s)
        angle = 0.0
    feed = s.centres[FEED] * (1.0 + p.seek_swing * sin(angle))
    swing = p.seek_pressure_swing if p.seek_pressure_on else 0.0
    return feed, s.centres[PRESSURE] * (1.0 + swing * sin(p.seek_pressure_cycles * angle))


@kernel
def product(s, i, j):
    """Sum over both frequencies of the products of two relative swings, as far as in phase."""
    total = 0.0
    for k in range(2):
        at, of = 6 * k + 2 * i, 6 * k + 2 * j
        real = s.waves[at] / s.sums[i] * (s.waves[of] / s.sums[j])
        total += real + s.waves[at + 1] / s.sums[i] * (s.waves[of + 1] / s.sums[j])
    return total


@kernel
def in_phase(s, i, j):
    """Product of two relative swings at the first frequency."""
    real = s.waves[2 * i] / s.sums[i] * (s.waves[2 * j] / s.sums[j])
    return real + s.waves[2 * i + 1] / s.sums[i] * (s.waves[2 * j + 1] / s.sums[j])


@kernel
def climb(p, s):
    """Move the centres by the slopes of the window that has ended."""
    if min(min(s.sums[0], s.sums[1]), s.sums[2]) <= 0.0:
        return
    if p.seek_pressure_on:
        # real slopes over feed and pressure that explain the rate best
        aa, bb, ab = product(s, 0, 0), product(s, 1, 1), product(s, 0, 1)
        ra, rb = product(s, 2, 0), product(s, 2, 1)
        spread = aa * bb - ab * ab
        if spread <= ALIKE * aa * bb:
            return
        s.gradients[FEED] = (ra * bb - rb * ab) / spread
        s.gradients[PRESSURE] = (rb * aa - ra * ab) / spread
        move(p, s, PRESSURE, p.seek_pressure_gain, p.seek_pressure_lowest, p.seek_pressure_highest)
    else:
        own = in_phase(s, 0, 0)
        if own == 0.0:
            return
        s.gradients[FEED] = in_phase(s, 2, 0) / own
    move(p, s, FEED, p.seek_gain, p.seek_lowest, p.seek_highest)


@kernel
def move(p, s, which, gain, lowest, highest):
    """Move the logarithm of a centre by a limited amount."""
    most = p.seek_largest_move
    moved = s.centres[which] * exp(min(max(gain * s.gradients[which], -most), most))
    s.centres[which] = min(max(moved, lowest), highest)
