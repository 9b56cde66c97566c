"""How many modes a scene asks for, itself or by an accuracy."""

from __future__ import annotations

import math

from percussion_model.scene.bars import bar_transit_time
from percussion_model.scene.numbers import Numbers
from percussion_model.solvers.wave.grid import elastic_bars
from percussion_model.solvers.wave.resolution import cells_by_rule, in_first_bar

# Modes in the bar with the shortest transit time, where the scene names none.
DEFAULT_MODES = 20
# Runs to compare with have such shares of them: several, since two agree by chance. Requests
# have one more.
COARSER = (0.5, 0.7)
REQUESTED = (0.35, *COARSER)
# More modes than these would take as many seconds, and hundreds of megabytes, to be prepared.
MOST_MODES = 1000
# Modes come in whole lanes, and a few more than asked for.
SPARE = 32


def modes_for(numbers: Numbers, accuracy: float) -> int:
    """Modes in the first elastic bar for a wanted accuracy: as many as cells that fit.

    Parameters
    ----------
    numbers : Numbers
        Of a scene with an elastic bit.
    accuracy : float
        Wanted relative error of the rate of penetration.
    """
    return in_first_bar(numbers, cells_by_rule(accuracy))


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
    counts = {math.ceil(share * modes) for share in shares}
    return sorted(count for count in counts if count < modes)
