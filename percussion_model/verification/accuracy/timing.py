"""Timing: processor times taken in turn, and the machine that they were taken on."""

from __future__ import annotations

import math
import os
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

# A method is repeated as long as its repeats take less than this together [s].
ENOUGH = 1.5
REPEATS = 5


@dataclass(frozen=True)
class Timing:
    """Repeated times."""

    median: float  # [s]
    repeats: int
    spread: float  # half their range by the median; NaN with one

    @classmethod
    def of(cls, times: Sequence[float]) -> Timing:
        """Sum up times [s]."""
        median = statistics.median(times)
        spread = 0.5 * (max(times) - min(times)) / median if len(times) > 1 else math.nan
        return cls(median, len(times), spread)


def interleaved(
    costs: Sequence[Callable[[], float]], turn: Callable[[float], None] | None = None
) -> list[Timing]:
    """Take times turn by turn: a machine that slows down slows all methods.

    Parameters
    ----------
    costs : sequence of callable
        Each makes one run and returns its time [s].
    turn : callable, optional
        Called with the share that is done, before each run.
    """
    found: list[list[float]] = [[] for _ in costs]
    for repeat in range(REPEATS):
        for k, cost in enumerate(costs):
            if found[k] and sum(found[k]) + found[k][-1] > ENOUGH:
                continue
            if turn is not None:
                turn((repeat + k / len(costs)) / REPEATS)
            found[k].append(cost())
    return [Timing.of(times) for times in found]


def machine() -> dict[str, Any]:
    """Processor, load, system and versions that figures are taken with."""
    name = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = cpuinfo.read_text(encoding="utf-8").splitlines()
        named = (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
        name = next(named, name)
    packages = ("numba", "numpy", "scipy", "percussion_model")
    return {
        "processor": name,
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "system": platform.system(),
        "python": platform.python_version(),
        "date": time.strftime("%Y-%m-%d"),
        **{package: version(package) for package in packages},
    }
