"""How a whole run goes through time: in chunks, with sampling and Ctrl-C."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Protocol

import numpy as np

from percussion_model.physics.records import SAMPLE_FIELDS
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.rows import is_number

# Between chunks a run reports progress and can be interrupted: short enough in
# wall time [s] to react at once, and at most so long in simulated time [s].
_WANTED_CHUNK_TIME = 0.05
_LONGEST_CHUNK = 50.0
# The first is so short that even a very fine grid comes back soon [s].
_FIRST_CHUNK = 1e-6
_GROWTH = 4.0

# More samples than this would fill the memory of a common computer.
_MOST_SAMPLES = 20_000_000
# Samples in a window where the solver has no time step.
_WINDOW_SAMPLES = 1000
# A sampling interval this close to dividing the duration does divide it.
_ROUNDING = 1e-9


class Run(Protocol):
    """What the loop needs of a `Simulation`."""

    @property
    def time(self) -> float:
        """Present time [s]."""

    def advance(self, t: float) -> None:
        """Run up to `t`."""

    def sample_rows(self, times: np.ndarray) -> np.ndarray:
        """Advance through `times`, a row for each."""


def run_in_chunks(
    run: Run,
    end: float,
    times: np.ndarray,
    progress: Callable[[float], None] | None,
    stop: Callable[[], bool],
) -> np.ndarray:
    """Advance a run to `end` and sample it at `times`.

    Chunks change no bit of the run, since reading is not touching.

    Returns
    -------
    ndarray, shape (m, len(SAMPLE_FIELDS))
        Samples; fewer than `times` after an interruption.
    """
    rows = np.empty((len(times), len(SAMPLE_FIELDS)))
    done = 0
    chunk = _FIRST_CHUNK
    while run.time < end and not stop():
        began = time.perf_counter()
        t = min(run.time + chunk, end)
        until = int(np.searchsorted(times, t, side="right"))
        if until > done:
            rows[done:until] = run.sample_rows(times[done:until])
        done = until
        run.advance(t)
        if progress is not None:
            progress(t)
        taken = time.perf_counter() - began
        if taken < _WANTED_CHUNK_TIME / _GROWTH:
            chunk = min(chunk * _GROWTH, _LONGEST_CHUNK)
        elif taken > _WANTED_CHUNK_TIME * _GROWTH:
            chunk = max(chunk / _GROWTH, _FIRST_CHUNK)
    return rows[:done]


def sampling_times(
    end: float,
    time_step: float | None,
    interval: float | None,
    windows: Iterable[tuple[float, float]],
) -> np.ndarray:
    """Times of a trace: every `interval`, and each step within the windows [s]."""
    parts = [np.zeros(0)]
    if interval is not None:
        if not is_number(interval) or not interval > 0:
            raise SimulationError(f"trace = {interval!r}: must be a sampling interval above 0 s")
        _refuse_too_many(end / interval)
        count = int(np.floor(end / interval * (1.0 + _ROUNDING)))
        parts.append(np.minimum(np.arange(count + 1) * interval, end))
    for window in windows:
        start, stop = _checked_window(window, end)
        if time_step is None:
            parts.append(np.linspace(start, stop, _WINDOW_SAMPLES))
            continue
        _refuse_too_many((stop - start) / time_step)
        first, last = np.ceil(start / time_step), np.floor(stop / time_step)
        parts.append(np.arange(first, last + 1) * time_step)
    return np.unique(np.concatenate(parts))


def _checked_window(window: tuple[float, float], end: float) -> tuple[float, float]:
    start, stop = window
    if not (is_number(start) and is_number(stop) and 0 <= start < stop <= end):
        raise SimulationError(
            f"window {start!r} to {stop!r} s: must rise and lie within the {end!r} s of the run"
        )
    return float(start), float(stop)


def _refuse_too_many(count: float) -> None:
    if count > _MOST_SAMPLES:
        raise SimulationError(
            f"the trace would have {count:.3g} samples, more than {_MOST_SAMPLES:.0g}: "
            "sample less often or in shorter windows"
        )


@contextmanager
def stop_on_interrupt(keep: bool) -> Iterator[Callable[[], bool]]:
    """Turn Ctrl-C into a wish to stop at the end of a chunk; a second one raises.

    Yields
    ------
    callable
        Whether to stop.
    """
    if not keep or threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    wishes: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        if wishes:
            raise KeyboardInterrupt
        wishes.append(number)

    previous = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(wishes)
    finally:
        signal.signal(signal.SIGINT, previous)
