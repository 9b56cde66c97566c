"""Greatest forces since a time that the observer sets (`peak_from` of the state).

A communication step of a co-simulation is longer or shorter than what the solver
does in one go: what came before its start must not count.
"""

from __future__ import annotations

import math

from percussion_model.core.kernel import kernel


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
