"""Progress of a long command on stderr: a bar in a terminal, else lines."""

from __future__ import annotations

import math
import sys
import threading
import time
from bisect import bisect
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# Time to the first line [s]: a reader who sees none for five seconds takes the command for dead.
EVERY = 3.0
# The lines after it are so many times as far apart: a log of an hour is to be read.
RARER = 10.0
# A command that is not heard of before its first work has loaded modules so long at most [s].
LOADING = 2.0
# Below this share of the work the time that is left cannot be told.
EARLY = 0.05
# Nor where the pace of the later half of the time differs from that of all by more than this.
EVEN = 1.5
# Shares that differ by less are one place of the way.
SAME_PLACE = 1e-3
# Shorter times that are left are no number: they are as long as those between lines [s].
A_FEW = 3.0

# What ends sooner shows no bar [s].
_PATIENCE = 2.0

# Takes what is being done, and the share that is done of it; None where that is not known.
Report = Callable[[str, float | None], None]

_running: list[Lines] = []
# When the last piece of work ended, and what `said` was then [s].
_before: list[tuple[float, list[float]]] = []


class Lines:
    """What a command does at present, as a line of text.

    Parameters
    ----------
    text : str
        What it does.
    clock : callable
        Gives the time [s].
    done : float
        Share that is done already.
    """

    def __init__(
        self, text: str, clock: Callable[[], float] = time.monotonic, done: float = 0.0
    ) -> None:
        self.clock = clock
        self.started = clock()
        self.aside: float | None = None  # since when what has no share is done
        self.begin(text, done)

    def begin(self, text: str, done: float = 0.0) -> None:
        """Take what begins now, and the share that is done already."""
        self.marks = [(self.clock(), done)]
        self.show(text, None)
        self.aside = None

    def show(self, text: str, share: float | None) -> None:
        """Take what is done now, and its share; a smaller one than before begins another part.

        What has no share, as compilation, is done aside: its time is not in the pace of the rest.
        """
        now = self.clock()
        self.told, self.changed = (text, share), now
        if share is None:
            self.aside = now if self.aside is None else self.aside
            return
        if self.aside is not None:
            self.marks = [(t + now - self.aside, done) for t, done in self.marks]
            self.aside = None
        # the thread that prints may read them meanwhile: they are replaced, never changed
        if share < self.marks[-1][1]:
            self.marks = [(now, share)]
        elif share >= self.marks[-1][1] + SAME_PLACE:
            self.marks = [*self.marks, (now, share)]

    def line(self) -> str:
        """Time since the start, what is done, its share, and the time that it will still take.

        While work goes on it is never all of it.
        """
        text, share = self.told
        parts = [text]
        if share is not None and share >= 1.0:
            parts.append("finishing")
        elif share is not None:
            parts += [f"{math.floor(100.0 * share)}%", *filter(None, [self.left()])]
        return f"{self.clock() - self.started:4.0f} s: {', '.join(parts)}"

    def left(self) -> str:
        """The time that it will still take; nothing where it goes too unevenly to tell.

        There is never nothing left: as long as nothing has changed by now, it may well take
        once more.
        """
        now, marks, share = self.clock(), self.marks, self.told[1]
        (begun, first), elapsed = marks[0], now - marks[0][0]
        if share is None or not EARLY <= share < 1.0 or share <= first or elapsed <= 0.0:
            return ""
        pace = (share - first) / elapsed
        later = (share - _share_at(begun + 0.5 * elapsed, marks)) / (0.5 * elapsed)
        if not pace / EVEN <= later <= pace * EVEN:
            return ""
        left = max((1.0 - share) / pace, now - self.changed)
        return f"about {left:.0f} s left" if left > A_FEW else "a few s left"


def _share_at(moment: float, marks: list[tuple[float, float]]) -> float:
    """Share that was done at a moment, between the places of the way that are known."""
    k = bisect(marks, moment, key=lambda mark: mark[0])
    if k == len(marks):
        return marks[-1][1]
    (t, share), (later, more) = marks[k - 1], marks[k]
    return share + (more - share) * (moment - t) / (later - t)


@contextmanager
def lines(text: str, done: float = 0.0) -> Iterator[Report]:
    """Print a line after a few seconds and then now and again; within what does so, tell more.

    Parameters
    ----------
    text : str
        What begins.
    done : float
        Share that is done already.
    """
    if _running:
        (outer,) = _running
        before = outer.told, outer.marks, outer.changed, outer.aside
        outer.begin(text, done)
        try:
            yield outer.show
        finally:
            outer.told, outer.marks, outer.changed, outer.aside = before
        return
    own = Lines(text, done=done)
    over = threading.Event()
    said = _silent_since(own.started)
    thread = threading.Thread(target=_print, args=(own, over, said), daemon=True)
    _running.append(own)
    thread.start()
    try:
        yield own.show
    finally:
        over.set()
        thread.join()
        _running.remove(own)
        _before[:] = [(time.monotonic(), said[-2:])]


def _silent_since(now: float) -> list[float]:
    """The start, and the last line; of short pieces of work in a row those of all together."""
    if not _before:
        return [now - min(time.process_time(), LOADING)]
    ended, said = _before[-1]
    return said if now - ended < EVERY else [now]


def _print(told: Lines, over: threading.Event, said: list[float]) -> None:
    while True:
        wait = EVERY * (RARER if len(said) > 1 else 1.0)
        if over.wait(max(said[-1] + wait - time.monotonic(), 0.0)):
            return
        said.append(time.monotonic())
        try:
            print(told.line(), file=sys.stderr, flush=True)
        except (OSError, ValueError):
            return  # nobody reads it any more


class RunProgress:
    """Progress of a run, or of several one after the other.

    Parameters
    ----------
    report : Report
    end : float
        Simulated time of the whole [s].
    """

    def __init__(self, report: Report, end: float) -> None:
        self.report = report
        self.name, self.end = "", end
        self.before, self.whole = 0.0, 0.0

    def __call__(self, t: float) -> None:
        """Show the simulated time reached [s]."""
        name = f"{self.name}, " if self.name else ""
        end = max(t, self.end)
        whole = self.whole or end
        share = (self.before + t) / whole if whole else None
        self.report(f"{name}{t:.4g} s of {end:g} s simulated", share)

    def stage(self, name: str, end: float, before: float = 0.0, whole: float = 0.0) -> None:
        """Take the run that begins now.

        Parameters
        ----------
        name : str
        end : float
            Its simulated time [s].
        before, whole : float
            Simulated time of the runs before it and of all; without it the share is that of
            this run [s].
        """
        self.name, self.end, self.before, self.whole = name, end, before, whole
        self(0.0)


@contextmanager
def progress_bar(end: float) -> Iterator[RunProgress]:
    """Show how far a run has come; see `progress`.

    Parameters
    ----------
    end : float
        Its simulated time [s].
    """
    with progress("preparing") as report:
        yield RunProgress(report, end)


@contextmanager
def count_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show how many of a number of things are done; see `progress`.

    Yields
    ------
    callable
        To be called with the number done and that of all.
    """
    with progress(what) as report:
        yield lambda done, total: report(f"{done} of {total} {what}", done / total)


@contextmanager
def progress(text: str, done: float = 0.0) -> Iterator[Report]:
    """Show on stderr what a long command does: a bar in a terminal, else lines.

    Parameters
    ----------
    text : str
        What it does until it says more.
    done : float
        Share that is done already.
    """
    if not sys.stderr.isatty():
        with lines(text, done) as report:
            yield report
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
    from rich.text import Text

    told = Lines(text, done=done)

    class Left(ProgressColumn):
        """The time that is left, in the words of the lines."""

        def render(self, task: Task) -> Text:
            return Text(told.left())

    words = TextColumn("{task.description}", markup=False)
    bar = Progress(BarColumn(), Left(), words, console=Console(stderr=True), transient=True)
    task = bar.add_task(text, total=None)
    starter = threading.Timer(_PATIENCE, bar.start)
    starter.daemon = True
    starter.start()

    def show(text: str, share: float | None) -> None:
        told.show(text, share)
        # where all is done but the end, how long that takes is not known
        total = None if share is None or share >= 1.0 else 1.0
        bar.update(task, description=text, completed=share or 0.0, total=total)

    try:
        yield show
    finally:
        starter.cancel()
        starter.join()
        bar.stop()
