"""How many modes a scene asks for, itself or by an accuracy.

The rule was calibrated (docs/data/stated_errors.md). It only knows the scene: what it cannot know,
such as chatter, shows in the run.
"""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.elementary import exp, log
from percussion_model.physics.records import Piston
from percussion_model.scene.bars import bar_transit_time
from percussion_model.scene.numbers import Numbers
from percussion_model.solvers.setup import PISTONS, Bit, elastic_times, kelvin_voigt_time

# Relative error of the rate of penetration, and the modes of the bar with the shortest
# transit for which it held with a margin of two or more.
CALIBRATED = ((1e-1, 14), (2e-2, 20), (1e-2, 28), (1e-3, 56), (1e-4, 128))
LOGARITHMS = tuple((-math.log(error), math.log(modes)) for error, modes in CALIBRATED)

# Modes in the bar with the shortest transit time, where the scene names none.
DEFAULT_MODES = 20
# Runs to compare with have such shares of them: several, since two agree by chance. Requests
# have one more.
COARSER = (0.5, 0.7)
REQUESTED = (0.35, *COARSER)
# With modes whose loss time is so many times their time step nothing is expected to be right: at
# 0.01 steps 0.0075 was seen where fewer modes agreed to 0.0014, and 0.006 in most of 20 scenes.
SLIGHT_LOSS = 5e-4
# More modes than these would take as many seconds, and hundreds of megabytes, to be prepared.
MOST_MODES = 1000
# Modes come in whole lanes, and a few more than asked for.
SPARE = 32


def modes_for(numbers: Numbers, accuracy: float) -> int:
    """Modes in the first elastic bar for a wanted accuracy.

    Parameters
    ----------
    numbers : Numbers
        Of a scene with an elastic bit.
    accuracy : float
        Wanted relative error of the rate of penetration.
    """
    return in_first_bar(numbers, modes_by_rule(accuracy))


def most_modes(numbers: Numbers) -> int:
    """Most modes in the first elastic bar for which there are tables."""
    times = [bar_transit_time(bar) for bar in elastic_bars(numbers)]
    return int((MOST_MODES - SPARE) * times[0] / sum(times))


def asked_modes(numbers: Numbers) -> int:
    """Modes in the first elastic bar that a scene asks for, or the default."""
    values = numbers.values
    if not math.isnan(values.solver_cells):
        return int(values.solver_cells)
    if not math.isnan(values.solver_accuracy):
        return modes_for(numbers, values.solver_accuracy)
    return default_modes(numbers)


def default_modes(numbers: Numbers) -> int:
    """Modes in the first elastic bar where a scene asks for none."""
    return in_first_bar(numbers, DEFAULT_MODES)


def coarser_modes(modes: int, shares: tuple[float, ...]) -> list[int]:
    """Modes of the runs that a run is compared with, the fewest first."""
    counts = np.zeros(len(shares), np.int64)
    return [int(one) for one in counts[: fill_coarser(modes, shares, counts)]]


def fill_coarser(modes: int, shares: tuple[float, ...], counts: np.ndarray) -> int:
    """Fill in modes of the runs that a run is compared with; how many there are."""
    found = 0
    for share in shares:  # which rise
        count = math.ceil(share * modes)
        if count < modes and (found == 0 or count > counts[found - 1]):
            counts[found] = count
            found += 1
    return found


def elastic_bars(numbers: Numbers) -> list[np.ndarray]:
    """Sections of the bars that get modes, the one first whose modes are counted."""
    if numbers.values.bit_model != Bit.ELASTIC:
        return []
    if PISTONS[numbers.values.piston_model] == Piston.ELASTIC:
        return [numbers.piston, numbers.bit]
    return [numbers.bit]


def in_first_bar(numbers: Numbers, count: float) -> int:
    """Modes in the first elastic bar where that of the shortest transit has so many."""
    first, shortest = elastic_times(numbers)
    return math.ceil(count * first / shortest - 1e-9)


def promised_error(numbers: Numbers, modes: int) -> float:
    """Relative error of the rate that is expected of modes in the first elastic bar.

    By the rule, a power law between calibrated points, and by how long they ring.
    """
    first, shortest = elastic_times(numbers)
    at = min(max(log(modes * shortest / first), LOGARITHMS[0][1]), LOGARITHMS[-1][1])
    value = LOGARITHMS[-1][0]
    for k in range(len(LOGARITHMS) - 2, -1, -1):
        (error, count), (next_error, next_count) = LOGARITHMS[k], LOGARITHMS[k + 1]
        if at <= next_count:
            value = error + (at - count) / (next_count - count) * (next_error - error)
    steps = kelvin_voigt_time(numbers) * modes / first
    return max(exp(-value), SLIGHT_LOSS / steps if steps > 0.0 else math.inf)


def modes_by_rule(accuracy: float) -> float:
    """Modes of the bar with the shortest transit, a power law between calibrated points."""
    wanted = -log(accuracy)
    for k in range(len(LOGARITHMS) - 1):
        (error, count), (next_error, next_count) = LOGARITHMS[k], LOGARITHMS[k + 1]
        if wanted <= next_error:
            slope = (next_count - count) / (next_error - error)
            return exp(slope * max(0.0, wanted - error) + count)
    return exp(LOGARITHMS[-1][1])
