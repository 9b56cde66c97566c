"""What random cases are drawn from.

A source is hypothesis, which can shrink what fails, or a generator of numbers, which
needs no memory of what came before: case 12345 of a seed is made without the others.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np


class Source(Protocol):
    """What cases are drawn from."""

    def pick(self, options: Any) -> Any:
        """One of several."""

    def between(self, low: float, high: float) -> float:
        """A number, evenly spread."""

    def count(self, low: int, high: int) -> int:
        """A whole number, both ends included."""


class Generator:
    """A source for case `index` of a seed."""

    def __init__(self, seed: int, index: int) -> None:
        self._random = np.random.default_rng([seed, index])

    def pick(self, options: Any) -> Any:
        return options[int(self._random.integers(len(options)))]

    def between(self, low: float, high: float) -> float:
        return float(self._random.uniform(low, high))

    def count(self, low: int, high: int) -> int:
        return int(self._random.integers(low, high + 1))


def decades(source: Source, low: float, high: float) -> float:
    """A number above zero, evenly spread over its decades."""
    return min(max(10.0 ** source.between(math.log10(low), math.log10(high)), low), high)


def chance(source: Source, percent: int) -> bool:
    """Whether something that happens so often happens; unlikely ones shrink away."""
    return source.count(0, 99) >= 100 - percent
