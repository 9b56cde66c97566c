"""Greatest forces since a time that the observer sets (`peak_from` of the state).

A communication step of a co-simulation is longer or shorter than what the solver
does in one go: what came before its start must not count.
"""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel


@kernel
def note_peak(s, time, first, change, rate, last):
    """Bit force of a stretch that begins at `time`; monotone, so its ends tell.

    Parameters
    ----------
    first, last : float
        Force at the start and the end of the stretch [N].
    change, rate : float
        Force t after the start is first + change (1 - exp(-rate t)) [N, 1/s].
    """
    if time < s.peak_from:
        first -= change * math.expm1(-rate * (s.peak_from - time))
    s.peak_bit = max(s.peak_bit, first, last)


@kernel
def note_steps(s, time, dt, spring, v, steps, K, C, z, fade, d, level):
    """Bit force of steps in one contact mode from the end velocities at their starts.

    Parameters
    ----------
    time, dt : float
        Start of the first step, and duration of each [s].
    spring : float
        Force of the rock's spring at the start [N].
    v : float array
        End velocities [m/s].
    K, C, z, fade, d : float
        From `step_constants`.
    level : float
        [N]

    Returns
    -------
    float
        Greatest distance of the force from `level` at the start of a step [N].
    """
    rate = K / (z + C)
    swing = 0.0
    for k in range(steps):
        first = spring + C * v[k]
        begin = time + k * dt
        if begin + dt > s.peak_from:
            note_peak(s, begin, first, z * v[k], rate, first + z * v[k] * fade)
        spring += K * d * v[k]
        swing = max(swing, abs(first - level))
    return swing
