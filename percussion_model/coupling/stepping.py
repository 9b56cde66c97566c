"""How many steps a run has, and what else Python does meanwhile."""

from __future__ import annotations

import gc
import math
from collections.abc import Iterator
from contextlib import contextmanager

from percussion_model.coupling.component import CouplingError

# New objects that may be there before garbage is looked for.
YOUNG = 50_000
# A number of steps is whole if it misses by no more than this.
ROUNDING = 1e-9


@contextmanager
def little_collection() -> Iterator[None]:
    """Look for garbage seldom, and not in what is there already: a step makes hardly any."""
    thresholds = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(YOUNG, *thresholds[1:])
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)
        gc.unfreeze()


def whole_steps(duration: float, step: float, interval: float | None) -> tuple[int, int]:
    """Number of steps, and of steps between rows."""
    given = {"duration": duration, "step": step}
    if interval is not None:
        given["interval"] = interval
    for name, value in given.items():
        if not 0.0 < value < math.inf:
            raise CouplingError(f"{name} = {value!r} s: must be above 0 s")
    count = math.floor(duration / step + ROUNDING)
    if count < 1:
        raise CouplingError(f"step = {step!r} s: is longer than the duration of {duration!r} s")
    every = 1 if interval is None else max(1, round(interval / step))
    return count, every
