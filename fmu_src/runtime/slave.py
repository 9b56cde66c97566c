"""A slave that behaves: what plain pythonfmu leaves to wish, mended in one place."""

from __future__ import annotations

import ctypes
import functools
import sys
from collections.abc import Callable
from enum import IntEnum
from typing import Any

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from fmu_src.runtime.folder import finalise_in_time, read_variables
from percussion_model.parameter_rows import refuse_value

# Communication points may differ from the present time by rounding: this share
# of a step, and some units in the last place of the time.
SHARE_OF_STEP = 1e-3
LAST_PLACES = 8 * sys.float_info.epsilon


class FmuError(ValueError):
    """An error that the host must see; the text has its percent signs doubled."""


class Phase(IntEnum):
    """Where an instance is in the calling sequence of FMI 2.0."""

    INSTANTIATED = 0
    INITIALISING = 1
    STEPPING = 2
    TERMINATED = 3


def guarded(method: Callable) -> Callable:
    """Let an error end the call as a fatal one in the host, without a crash."""

    @functools.wraps(method)
    def call(self: Slave, *arguments: Any) -> Any:
        try:
            return method(self, *arguments)
        except Exception as error:
            raise self.fatal(error) from None

    return call


class Slave(Fmi2Slave):
    """Base of the slaves: values by reference, phases, and errors that hosts see.

    A slave gives `outputs(references)` and overrides `check`, `begin` and `step`.
    """

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        folder = arguments["resources"]
        # The export library adds the folder for each instance; once loaded it is not needed.
        while folder in sys.path:
            sys.path.remove(folder)
        finalise_in_time(folder)
        self.known = read_variables(folder)
        self.by_name = {one.name: one.reference for one in self.known.values()}
        self.values = {
            one.reference: one.start for one in self.known.values() if one.causality != "output"
        }
        self._plans: dict[Any, Any] = {}
        self.phase = Phase.INSTANTIATED
        self.start_time = 0.0
        self.now = 0.0  # time of the host [s]

    # what a slave does

    def check(self, references: Any) -> None:
        """Raise ValueError if a value is not allowed; names variable, value, bounds."""
        for reference in references:
            one = self.known[reference]
            value = self.values[reference]
            if one.row is None or one.type == "Boolean" or value == one.left_out:
                continue
            allowed = value in one.row.choices if one.row.choices else one.row.allows(value)
            if one.type == "Enumeration":
                allowed = self.choice(reference) is not None
            if not allowed:
                raise ValueError(refuse_value(one.row, one.name, value))

    def begin(self) -> None:
        """Make everything ready for the first step."""

    def step(self, time: float, step_size: float) -> None:
        """Go on; `time` is the end of the step since the start [s]."""
        raise NotImplementedError

    def outputs(self, references: list[int]) -> list[Any]:
        """Present values of outputs."""
        raise NotImplementedError

    def changed(self, reference: int) -> None:
        """Take note of a value that the host has set."""

    def choice(self, reference: int) -> Any:
        """Word behind the number of an enumeration, None where there is none."""
        row = self.known[reference].row
        choices = row.choices if row is not None else ()
        value = self.values[reference]
        if choices and isinstance(choices[0], int):
            return value if value in choices else None
        return choices[value - 1] if 1 <= value <= len(choices) else None

    # calling sequence

    @guarded
    def setup_experiment(
        self, start_time: float, stop_time: float | None, tolerance: float | None
    ) -> None:
        """Take the start time."""
        self.require(Phase.INSTANTIATED)
        if not abs(start_time) < float("inf"):
            raise ValueError(f"startTime = {start_time!r}: must be a finite time in s")
        self.start_time = self.now = start_time

    @guarded
    def enter_initialization_mode(self) -> None:
        """Check all values."""
        self.require(Phase.INSTANTIATED)
        self.check(self.values)
        self.phase = Phase.INITIALISING

    @guarded
    def exit_initialization_mode(self) -> None:
        """Check again what may have changed, and make everything ready."""
        self.require(Phase.INITIALISING)
        self.check(self.values)
        self.begin()
        self.phase = Phase.STEPPING

    @guarded
    def do_step(self, current_time: float, step_size: float) -> bool:
        """Go on by a communication step."""
        self.require(Phase.STEPPING)
        if not 0.0 < step_size < float("inf"):
            raise ValueError(f"communicationStepSize = {step_size!r}: must be above 0 s")
        slack = SHARE_OF_STEP * step_size + LAST_PLACES * abs(self.now)
        if not abs(current_time - self.now) <= slack:
            where = "before" if current_time < self.now else "after"
            raise ValueError(
                f"currentCommunicationPoint = {current_time!r} s lies {where} the present "
                f"time of {self.now!r} s: steps must follow each other; to go back, restore a state"
            )
        end = current_time + step_size
        self.step(end - self.start_time, step_size)
        self.now = end
        return True

    @guarded
    def terminate(self) -> None:
        """No further steps."""
        self.phase = Phase.TERMINATED

    def require(self, phase: Phase) -> None:
        """Raise ValueError if a call comes out of order."""
        if self.phase != phase:
            raise ValueError(
                f"call out of order: allowed while {phase.name.lower()}, "
                f"but the instance is {self.phase.name.lower()}"
            )

    # values

    def read(self, references: list[int], types: tuple[str, ...]) -> list[Any]:
        """Present values."""
        key = (tuple(references), types[0])
        plan = self._plans.get(key)
        if plan is None:
            plan = self._plans[key] = self.plan(references, types)
        if plan == "outputs":
            return self.outputs(references)
        return [
            self.outputs([reference])[0] if reference in plan else self.values[reference]
            for reference in references
        ]

    def plan(self, references: list[int], types: tuple[str, ...]) -> str | set[int]:
        """Which of the variables are outputs; hosts ask for the same ones again and again."""
        found = set()
        for reference in references:
            one = self.known.get(reference)
            if one is None or one.type not in types:
                raise ValueError(f"there is no {types[0]} variable of reference {reference}")
            if one.causality == "output":
                found.add(reference)
        return "outputs" if len(found) == len(set(references)) else found

    def write(self, references: list[int], values: list[Any], types: tuple[str, ...]) -> None:
        """Set parameters and inputs."""
        for reference, value in zip(references, values, strict=True):
            one = self.known.get(reference)
            if one is None or one.type not in types:
                raise ValueError(f"there is no {types[0]} variable of reference {reference}")
            if one.causality == "output":
                raise ValueError(f"{one.name} is an output: it cannot be set")
            if one.causality == "parameter" and self.phase > Phase.INITIALISING:
                raise ValueError(f"{one.name} is fixed: it can be set before the first step only")
            if self.values[reference] != value:
                self.values[reference] = value
                self.changed(reference)

    @guarded
    def get_real(self, vrs: list[int]) -> list[float]:
        """Values of Real variables."""
        return self.read(vrs, ("Real",))

    @guarded
    def get_integer(self, vrs: list[int]) -> list[int]:
        """Values of Integer variables and enumerations."""
        return self.read(vrs, ("Integer", "Enumeration"))

    @guarded
    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Values of Boolean variables."""
        return self.read(vrs, ("Boolean",))

    @guarded
    def get_string(self, vrs: list[int]) -> list[str]:
        """Values of String variables: there are none."""
        return self.read(vrs, ("String",))

    @guarded
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set Real variables."""
        self.write(vrs, values, ("Real",))

    @guarded
    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Set Integer variables and enumerations."""
        self.write(vrs, values, ("Integer", "Enumeration"))

    @guarded
    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Set Boolean variables."""
        self.write(vrs, [bool(value) for value in values], ("Boolean",))

    @guarded
    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Set String variables: there are none."""
        self.write(vrs, values, ("String",))

    # states: bytes, made and read by the slave

    @staticmethod
    def _fmu_state_to_bytes(state: bytes) -> bytes:
        return state

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> bytes:
        return state

    # messages

    def log(
        self,
        msg: str,
        status: Fmi2Status = Fmi2Status.ok,
        category: str | None = None,
        debug: bool | None = None,
    ) -> None:
        """Log a message; hosts take it for a printf format, so percent signs are doubled."""
        super().log(msg.replace("%", "%%"), status, category)

    def warn(self, message: str) -> None:
        """Log a warning."""
        self.log(message, Fmi2Status.warning, "logStatusWarning")

    def fatal(self, error: Exception) -> FmuError:
        """Log an error and return what is to be raised.

        After an exception the export library gives the instance, its class and its
        message queue back twice: one reference more to each keeps the heap whole.
        """
        for held in (self, type(self), self.log_queue):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(held))
        text = str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
        self.log(f"{self.instance_name}: {text}", Fmi2Status.error, "logStatusError")
        return FmuError(text.replace("%", "%%"))
