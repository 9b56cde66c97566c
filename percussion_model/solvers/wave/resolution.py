"""Steps in which a wave crosses the first elastic bar, for a wanted accuracy.

Where there are rods contacts that begin within a step count from its nearer end: the error of a
rate is of first order in the step. Top hammers of four rods were off by 0.4 to 0.9 % with 20 steps
in the piston (`benchmarks.hammers`, docs/top_hammer.md).
"""

from __future__ import annotations

import math

import numpy as np

# Steps in the piston, where a scene asks for none, and the relative error of a rate by them.
DEFAULT_STEPS, DEFAULT_ERROR = 16, 5e-3
# And where there are no rods, whose steps are cut at closures: the reference is then off by 1e-4,
# ready-made hammers by up to 1 %.
STEPS_OF_TWO, ERROR_OF_TWO = 24, 1e-2
# Steps of a wave from outside, and the relative error of what it does, times them: its front and
# end are spread over one or two. Without loss up to 0.3 was seen of peaks, 0.6 of work on rock.
PULSE_STEPS, ERROR_OF_A_STEP = 192, 0.7
# A run is compared with one whose steps are so many times as long.
COARSER = 1.5
# Where loss refuses those: with steps this many times as long, or else up to this many.
LEAST_COARSER, MOST_COARSER = 1.25, 2.0


def steps_for(accuracy: float, is_string: bool) -> int:
    """Steps for a wanted relative error of the rate of penetration, of rods or of two bars."""
    if is_string:
        return max(DEFAULT_STEPS, math.ceil(DEFAULT_STEPS * DEFAULT_ERROR / accuracy))
    return max(STEPS_OF_TWO, math.ceil(STEPS_OF_TWO * ERROR_OF_TWO / accuracy))


def error_by_steps(steps: int, is_string: bool) -> float:
    """Relative error of the rate of penetration that so many steps promise."""
    if is_string:
        return DEFAULT_ERROR * DEFAULT_STEPS / steps
    return ERROR_OF_TWO * STEPS_OF_TWO / steps


def error_by_pulse(steps: float) -> float:
    """Relative error of what a wave from outside does that lasts for so many steps."""
    return ERROR_OF_A_STEP / steps


def coarser_steps(steps: int) -> int:
    """Steps of the run that a run is compared with."""
    return max(1, round(steps / COARSER))


def comparable_steps(steps: int) -> list[int]:
    """Steps of runs that a run may be compared with, the best first; none for a single step.

    The coarsest that is not coarser than `coarser_steps` and differs by a quarter, then coarser
    ones, the nearest first, then those that differ by less.
    """
    counts = np.zeros(max(steps, 1), np.int64)
    return [int(one) for one in counts[: fill_comparable(steps, counts)]]


def fill_comparable(steps: int, counts: np.ndarray) -> int:
    """Fill in steps of runs that a run may be compared with; how many there are."""
    wanted, found = coarser_steps(steps), 0
    near = max(wanted, math.floor(steps / LEAST_COARSER))
    least = math.ceil(steps / MOST_COARSER)
    for first, end, way in (
        (wanted, near + 1, 1),
        (wanted - 1, least - 1, -1),
        (near + 1, steps, 1),
    ):
        for count in range(first, end, way):
            if 0 < count < steps:
                counts[found] = count
                found += 1
    return found
