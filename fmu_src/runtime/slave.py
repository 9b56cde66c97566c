"""A slave that behaves: what plain pythonfmu leaves to wish, mended in one place."""

from __future__ import annotations

import ctypes
import sys
from typing import Any

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from fmu_src.runtime.calls import INFINITE, STEPPING, FmuError, Phase, guarded, plain_bounds
from fmu_src.runtime.folder import finalise_in_time, read_variables
from percussion_model.parameter_rows import refuse_value

# Communication points may differ from the present time by rounding: this share
# of a step, and some units in the last place of the time.
SHARE_OF_STEP = 1e-3
LAST_PLACES = 8 * sys.float_info.epsilon

# Types that share a getter and a setter.
NOT_YET: tuple[None, dict[str, Any]] = (None, {})  # planned, as `plan` says
REAL, INTEGER, BOOLEAN = ("Real",), ("Integer", "Enumeration"), ("Boolean",)


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
        self._plain_bounds = {one.reference: plain_bounds(one) for one in self.known.values()}
        # what hosts ask for and set again and again, looked at once
        self._reads: dict[Any, Any] = {}
        self._writes: dict[Any, bool] = {}
        self.phase = Phase.INSTANTIATED
        self.start_time = 0.0
        self.now = 0.0  # time of the host [s]

    # what a slave does

    def check(self, references: Any) -> None:
        """Raise ValueError if a value is not allowed; names variable, value, bounds."""
        for reference in references:
            value = self.values[reference]
            low, high = self._plain_bounds[reference]
            if low <= value <= high:
                continue
            one = self.known[reference]
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

    def asked(self, references: list[int]) -> Any:
        """What `outputs` is to be given for these outputs; asked for once."""
        return list(references)

    def outputs(self, asked: Any) -> list[Any]:
        """Present values of outputs."""
        raise NotImplementedError

    def changed(self, references: list[int]) -> None:
        """Take note of values that the host has set."""

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

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Go on by a communication step."""
        # as `guarded`, without a call more: this and what reads and sets is called often
        try:
            if self.phase is not STEPPING:
                self.require(STEPPING)
            if not 0.0 < step_size < INFINITE:
                raise ValueError(f"communicationStepSize = {step_size!r}: must be above 0 s")
            slack = SHARE_OF_STEP * step_size + LAST_PLACES * abs(self.now)
            if not abs(current_time - self.now) <= slack:
                where = "before" if current_time < self.now else "after"
                raise ValueError(
                    f"currentCommunicationPoint = {current_time!r} s lies {where} the present time "
                    f"of {self.now!r} s: steps must follow each other; to go back, restore a state"
                )
            end = current_time + step_size
            self.step(end - self.start_time, step_size)
            self.now = end
            return True
        except Exception as error:
            raise self.fatal(error) from None

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
        plan = self._reads.get((types, *references))
        if plan is None:
            plan = self._reads[(types, *references)] = self.plan(references, types)
        outputs, lists_of_one = plan
        if lists_of_one is None:
            return self.outputs(outputs)
        return [
            self.outputs(lists_of_one[reference])[0]
            if reference in lists_of_one
            else self.values[reference]
            for reference in references
        ]

    def plan(self, references: list[int], types: tuple[str, ...]) -> tuple[Any, Any]:
        """What `outputs` is to give; hosts ask for the same variables again and again.

        Returns
        -------
        tuple
            What is asked for, where all are outputs; or None, and what is asked for by each
            output among the variables.
        """
        found = set()
        for reference in references:
            one = self.known.get(reference)
            if one is None or one.type not in types:
                raise ValueError(f"there is no {types[0]} variable of reference {reference}")
            if one.causality == "output":
                found.add(reference)
        if len(found) == len(set(references)):
            return self.asked(references), None
        return None, {reference: self.asked([reference]) for reference in found}

    def write(self, references: list[int], values: list[Any], types: tuple[str, ...]) -> None:
        """Set parameters and inputs."""
        held = self.values
        if (types, *references) in self._writes and len(values) == len(references):
            new = [r for r, value in zip(references, values, strict=False) if held[r] != value]
            if new:
                held.update(zip(references, values, strict=False))
                self.changed(new)
            return
        for reference, value in zip(references, values, strict=True):
            one = self.known.get(reference)
            if one is None or one.type not in types:
                raise ValueError(f"there is no {types[0]} variable of reference {reference}")
            if one.causality == "output":
                raise ValueError(f"{one.name} is an output: it cannot be set")
            if one.causality == "parameter" and self.phase > Phase.INITIALISING:
                raise ValueError(f"{one.name} is fixed: it can be set before the first step only")
            if held[reference] != value:
                held[reference] = value
                self.changed([reference])
        if all(self.known[reference].causality == "input" for reference in references):
            self._writes[(types, *references)] = True

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values of Real variables."""
        try:
            outputs, rest = self._reads.get((REAL, *vrs), NOT_YET)
            return self.outputs(outputs) if rest is None else self.read(vrs, REAL)
        except Exception as error:
            raise self.fatal(error) from None

    @guarded
    def get_integer(self, vrs: list[int]) -> list[int]:
        """Values of Integer variables and enumerations."""
        return self.read(vrs, INTEGER)

    @guarded
    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Values of Boolean variables."""
        return self.read(vrs, BOOLEAN)

    @guarded
    def get_string(self, vrs: list[int]) -> list[str]:
        """Values of String variables: there are none."""
        return self.read(vrs, ("String",))

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set Real variables."""
        try:
            self.write(vrs, values, REAL)
        except Exception as error:
            raise self.fatal(error) from None

    @guarded
    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Set Integer variables and enumerations."""
        self.write(vrs, values, INTEGER)

    @guarded
    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Set Boolean variables."""
        self.write(vrs, [bool(value) for value in values], BOOLEAN)

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
