"""Greatest bit force within a leap of standstill, for an observer who asks for it."""

from __future__ import annotations

from percussion_model.core.contact_leap import WATCHED, load_contact, look_ahead, step_constants
from percussion_model.core.kernel import kernel
from percussion_model.core.linear import multiply
from percussion_model.core.peaks import note_peak
from percussion_model.core.records import Mode
from percussion_model.core.totals import now

SS = int(Mode.SS)

# A chunk of standstill is WATCHED = 2^6 steps.
CHUNK_LEVEL = 6
# Standstill is searched until its vibration is below this share of the force at rest.
STILL_SHARE = 1e-3


@kernel
def watch_standstill(par, s, wb, cb, rest, watch, steps, x, v, y):
    """Note the greatest bit force of a leap of `steps` steps about to be made.

    The look ahead of a watched leap, chunk by chunk, until the vibration has
    died away.
    """
    load_contact(par, s, wb, cb, x)
    K, C, z, fade, d, _q = step_constants(par, s)
    rate = K / (z + C)
    level = par.mass_b * par.gravity + s.feed
    time = now(par, s)
    done = 0
    if s.peak_from > time:
        chunks = int((s.peak_from - time) / par.dt) // WATCHED
        done = chunks * WATCHED
        for power in range(CHUNK_LEVEL, par.leaps):
            if (chunks >> (power - CHUNK_LEVEL)) & 1:
                go_on(rest, power, x, y, par.size_r)
    while done < steps:
        look_ahead(watch, SS, par.size_r, x, v)
        spring = level + K * x[2 * par.n_b]
        swing = 0.0
        for k in range(min(WATCHED, steps - done)):
            begin = time + (done + k) * par.dt
            first = spring + C * v[k]
            if begin + par.dt > s.peak_from:
                note_peak(s, begin, first, z * v[k], rate, first + z * v[k] * fade)
            spring += K * v[k] * d
            swing = max(swing, abs(first - level))
        if swing < STILL_SHARE * abs(level):
            s.peak_bit = max(s.peak_bit, level)
            return
        go_on(rest, CHUNK_LEVEL, x, y, par.size_r)
        done += WATCHED


@kernel
def go_on(rest, power, x, y, size):
    """Carry the deviation `x` over 2^power steps of standstill."""
    multiply(rest, power, 0, x, y, size)
    for i in range(size):
        x[i] = y[i]
