"""Progress of a long command as lines on stderr, where that is no terminal."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# Time between lines [s]: a reader who sees none for five seconds takes the command for dead.
EVERY = 3.0
# Below this share of the work the time that is left cannot be told.
EARLY = 0.05
# Shorter times that are left are no number: they are as long as those between lines [s].
A_FEW = 3.0

# Takes what is being done, and the share that is done of it; None where that is not known.
Report = Callable[[str, float | None], None]

_running: list[Lines] = []


class Lines:
    """What a command does at present, as a line of text.

    Parameters
    ----------
    text : str
        What it does.
    clock : callable
        Gives the time [s].
    """

    def __init__(self, text: str, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self.started = clock()
        self.begin(text)

    def begin(self, text: str) -> None:
        """Take what begins now."""
        self.begun = self.clock()
        self.show(text, None)

    def show(self, text: str, share: float | None) -> None:
        """Take what is done now, and the share that is done since `begin`."""
        self.told, self.changed = (text, share), self.clock()

    def line(self) -> str:
        """Time since the start, what is done, its share, and the time that it will still take.

        While work goes on it is never all of it, nor is there nothing left: as long as nothing
        has changed by now, it may well take once more.
        """
        now = self.clock()
        text, share = self.told
        parts = [text]
        if share is not None and share >= 1.0:
            parts.append("finishing")
        elif share is not None:
            parts.append(f"{math.floor(100.0 * share)}%")
            if share >= EARLY:
                left = (now - self.begun) * (1.0 - share) / share
                left = max(left, now - self.changed)
                parts.append(f"about {left:.0f} s left" if left > A_FEW else "a few s left")
        return f"{now - self.started:4.0f} s: {', '.join(parts)}"


@contextmanager
def lines(text: str) -> Iterator[Report]:
    """Print a line every few seconds; within a command that does so, say more of what it does.

    Parameters
    ----------
    text : str
        What begins.
    """
    if _running:
        (outer,) = _running
        before = outer.told, outer.begun, outer.changed
        outer.begin(text)
        try:
            yield outer.show
        finally:
            outer.told, outer.begun, outer.changed = before
        return
    own = Lines(text)
    over = threading.Event()
    thread = threading.Thread(target=_print, args=(own, over), daemon=True)
    _running.append(own)
    thread.start()
    try:
        yield own.show
    finally:
        over.set()
        thread.join()
        _running.remove(own)


def _print(told: Lines, over: threading.Event) -> None:
    while not over.wait(EVERY):
        try:
            print(told.line(), file=sys.stderr, flush=True)
        except (OSError, ValueError):
            return  # nobody reads it any more
