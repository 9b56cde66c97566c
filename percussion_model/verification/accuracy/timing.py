"""Processor times, turn by turn: a machine that slows down slows all methods."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence

__all__ = ["interleaved"]

# A method is repeated as long as its repeats take less than this together [s].
ENOUGH = 1.5
REPEATS = 5


def interleaved(
    costs: Sequence[Callable[[], float]], turn: Callable[[int], None] | None = None
) -> list[tuple[float, int]]:
    """Take times turn by turn.

    Parameters
    ----------
    costs : sequence of callable
        Each makes one run and returns its time [s].
    turn : callable, optional
        Called with the place of a run before it.

    Returns
    -------
    list of (float, int)
        Median [s] and number of repeats.
    """
    found: list[list[float]] = [[] for _ in costs]
    for _ in range(REPEATS):
        for k, cost in enumerate(costs):
            if found[k] and sum(found[k]) + found[k][-1] > ENOUGH:
                continue
            if turn is not None:
                turn(k)
            found[k].append(cost())
    return [(statistics.median(times), len(times)) for times in found]
