"""Greatest bit force within a leap of standstill, for an observer who asks for it."""

from __future__ import annotations

from percussion_model.physics.kernel import kernel
from percussion_model.physics.records import Mode
from percussion_model.solvers.wave.leaps.contact_leap import (
    WATCHED,
    load_contact,
    look_ahead,
    step_constants,
)
from percussion_model.solvers.wave.leaps.linear import carry
from percussion_model.solvers.wave.peaks import note_steps
from percussion_model.solvers.wave.totals import now

SS = int(Mode.SS)

# Standstill is searched until its vibration is below this share of the force at rest.
STILL_SHARE = 1e-3


@kernel
def watch_standstill(par, s, wb, cb, powers, watch, steps, x, v, y):
    """Note the greatest bit force of a leap of `steps` steps about to be made.

    The look ahead of a watched leap, chunk by chunk, until the vibration has
    died away.
    """
    load_contact(par, s, wb, cb, x)
    K, C, z, fade, d, _q = step_constants(par, s)
    level = par.mass_b * par.gravity + s.feed
    time = now(par, s)
    done = 0
    if s.peak_from > time:
        done = min(int((s.peak_from - time) / par.dt), steps - 1)
        carry(powers[SS], done, x, y, par.size_r)
    while done < steps:
        count = min(WATCHED, steps - done)
        look_ahead(watch[SS], par.size_r, x, v, count, False)
        spring = level + K * x[2 * par.n_b]
        begin = time + done * par.dt
        swing = note_steps(s, begin, par.dt, spring, v, count, K, C, z, fade, d, level)
        if swing < STILL_SHARE * abs(level):
            s.peak_bit = max(s.peak_bit, level)
            return
        carry(powers[SS], WATCHED, x, y, par.size_r)
        done += WATCHED
