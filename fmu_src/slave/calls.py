"""What calls of a host go through: phases, errors, and bounds that are quick to look at."""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from percussion_model.scene.rows import Row

if TYPE_CHECKING:
    from fmu_src.slave.slave import Slave

INFINITE = float("inf")
NOWHERE = (INFINITE, -INFINITE)
LARGEST = sys.float_info.max


class FmuError(ValueError):
    """An error that the host must see; the text has its percent signs doubled."""


class Phase(IntEnum):
    """Where an instance is in the calling sequence of FMI 2.0."""

    INSTANTIATED = 0
    INITIALISING = 1
    STEPPING = 2
    TERMINATED = 3


# Looked up by name, a member of an enumeration takes as long as setting ten inputs.
STEPPING = Phase.STEPPING


def plain_bounds(row: Row | None) -> tuple[float, float]:
    """Between these, both of them allowed, a number is right without a closer look."""
    if row is None or row.kind != "number" or row.choices:
        return NOWHERE
    low = -LARGEST if row.lower is None else row.lower
    high = LARGEST if row.upper is None else row.upper
    return (
        math.nextafter(low, INFINITE) if row.lower_open else low,
        math.nextafter(high, -INFINITE) if row.upper_open else high,
    )


def guarded(method: Callable) -> Callable:
    """Let an error end the call as a fatal one in the host, without a crash."""

    @functools.wraps(method)
    def call(self: Slave, *arguments: Any) -> Any:
        try:
            return method(self, *arguments)
        except Exception as error:
            raise self.fatal(error) from None

    return call
