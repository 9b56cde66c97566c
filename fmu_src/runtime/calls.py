"""What calls of a host go through: phases, errors, and bounds that are quick to look at."""

from __future__ import annotations

import functools
from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from fmu_src.runtime.folder import Known

if TYPE_CHECKING:
    from fmu_src.runtime.slave import Slave

INFINITE = float("inf")
NOWHERE = (INFINITE, -INFINITE)


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


def plain_bounds(one: Known) -> tuple[float, float]:
    """Between these, both of them allowed, a Real is right without a closer look."""
    row = one.row
    if one.type != "Real" or row is None or row.lower is None or row.upper is None:
        return NOWHERE
    return NOWHERE if row.choices or row.lower_open or row.upper_open else (row.lower, row.upper)


def guarded(method: Callable) -> Callable:
    """Let an error end the call as a fatal one in the host, without a crash."""

    @functools.wraps(method)
    def call(self: Slave, *arguments: Any) -> Any:
        try:
            return method(self, *arguments)
        except Exception as error:
            raise self.fatal(error) from None

    return call
