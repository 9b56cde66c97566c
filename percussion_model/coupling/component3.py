"""An FMU of FMI 3.0 in a coupled run: what it has differently from one of FMI 2.0."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Sequence
from typing import Any

from fmpy import platform_tuple
from fmpy.fmi3 import FMU3Slave

from percussion_model.coupling.calls import WARNING
from percussion_model.coupling.component import Component, CouplingError

_IN_C: dict[str, tuple[Any, str]] = {
    "Float64": (ctypes.c_double, "d"), "Float32": (ctypes.c_float, "f"),
    "Int8": (ctypes.c_int8, "b"), "UInt8": (ctypes.c_uint8, "B"),
    "Int16": (ctypes.c_int16, "h"), "UInt16": (ctypes.c_uint16, "H"),
    "Int32": (ctypes.c_int32, "i"), "UInt32": (ctypes.c_uint32, "I"),
    "Int64": (ctypes.c_int64, "q"), "UInt64": (ctypes.c_uint64, "Q"),
    "Boolean": (ctypes.c_bool, "?"),
}  # fmt: skip


class Component3(Component):
    """An instance of an FMU of FMI 3.0 that is unpacked; parameters as of `Component`.

    It is asked for no events, no early return and no update within a step. Scalars are all that
    is exchanged.
    """

    PREFIX, PLATFORM, IN_C = "fmi3", platform_tuple, _IN_C
    FAMILIES = {one: one for one in _IN_C} | {"Enumeration": "Int64"}
    SLAVE = FMU3Slave

    def _instantiate(self) -> None:
        def note(environment: Any, status: int, category: bytes, text: bytes) -> None:
            self._note(environment, b"", status, category, text)

        self._guarded(self.slave.instantiate, loggingOn=True, logMessage=note)
        real, flag = ctypes.c_double, ctypes.c_bool
        pointers = [ctypes.c_void_p] * 4
        self.stepper = self.function("fmi3DoStep", ctypes.c_void_p, real, real, flag, *pointers)
        self._ends, others = flag(), (flag(), flag(), real())
        self._told = [ctypes.byref(one) for one in (others[0], self._ends, *others[1:])]

    def further(self, size: Any) -> tuple[Any, ...]:
        """The number of values: each variable has one."""
        return (size,)

    def begin(self, time: float) -> None:
        """Enter the initialisation."""
        self._guarded(self.slave.enterInitializationMode, startTime=time)

    def step(self, time: float, step: float) -> None:
        """One communication step [s]."""
        status = self.stepper(self.pointer, time, step, bool(self._no_rollback), *self._told)
        if status > WARNING:
            self.fail("fmi3DoStep", status)
        if self._ends.value:
            raise CouplingError(f"{self.name}: asks for the end of the run")

    def save(self) -> Any:
        """State of the instance, to be given back by `drop`."""
        self._no_rollback = 0
        return self._guarded(self.slave.getFMUState)

    def restore(self, state: Any) -> None:
        """Go back to a state."""
        self._guarded(self.slave.setFMUState, state)

    def drop(self, state: Any) -> None:
        """Give the memory of a state back."""
        self._guarded(self.slave.freeFMUState, state)

    def refuse_large(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Raise the error of an input that is to take a number beyond its range."""
        for name, value in zip(names, values, strict=True):
            family = self.family(name)
            try:
                struct.pack(_IN_C[family][1], value if "Float" in family else int(value))
            except (struct.error, OverflowError):
                raise CouplingError(
                    f"{self.name}: {name} = {value!r} does not fit a {family}"
                ) from None
