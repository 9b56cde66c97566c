"""One FMU in a coupled run: its instance, and what its log says of an error."""

from __future__ import annotations

import ctypes
import difflib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

from percussion_model.coupling.exchange import FAMILIES, LARGEST, WARNING, Reader, Writer

_STATUS = {2: "discard", 3: "error", 4: "fatal", 5: "pending"}


class CouplingError(ValueError):
    """A system that cannot be set up or cannot go on; says which part, when and why."""


class Component:
    """An instance of an FMU that is unpacked.

    Parameters
    ----------
    name : str
        Of the component in the system.
    folder : str
        Of the unpacked FMU.
    """

    def __init__(self, name: str, folder: str) -> None:
        self.name = name
        description = read_model_description(folder, validate=False)
        if description.coSimulation is None:
            raise CouplingError(f"{name}: this FMU has no co-simulation")
        self.variables = {one.name: one for one in description.modelVariables}
        self.can_save = bool(description.coSimulation.canGetAndSetFMUstate)
        self.can_vary = bool(description.coSimulation.canHandleVariableCommunicationStepSize)
        self.messages: list[tuple[int, str]] = []
        # both have to live as long as the instance
        self._logger = fmi2CallbackLoggerTYPE(self._note)
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = self._logger
        self._slave: Any = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self._slave.instantiate(callbacks=self._callbacks, loggingOn=True)
        self.pointer = ctypes.c_void_p(self._slave.component)
        self.stepper = self.function(
            "fmi2DoStep", ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int
        )
        self._goes_forward = 1  # to the FMU: it will not be told to go back

    def function(self, name: str, *types: Any) -> Any:
        """A function of the library that returns a status; without types, by those of ctypes."""
        # an object of its own, since fmpy gives types to that of the library
        return ctypes.cast(getattr(self._slave.dll, name), ctypes.CFUNCTYPE(ctypes.c_int, *types))

    def _note(
        self, environment: Any, name: bytes, status: int, category: bytes, text: bytes
    ) -> None:
        self.messages.append((status, text.decode("utf-8", "replace")))

    def find(self, name: str) -> Any:
        """A variable by name; the error suggests another one."""
        if name not in self.variables:
            near = difflib.get_close_matches(name, self.variables, 1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise CouplingError(f"{self.name} has no variable {name}{hint}")
        return self.variables[name]

    def set(self, values: Mapping[str, Any]) -> None:
        """Set variables by name; enumerations by number or by word."""
        for name, value in values.items():
            one = self.find(name)
            family = FAMILIES[one.type]
            if isinstance(value, str):
                value = self._number_of(one, value)
            converted = self._converted(one, family, value)
            setter = getattr(self._slave, f"set{family}")
            self._guarded(setter, [one.valueReference], [converted])

    def _converted(self, one: Any, family: str, value: Any) -> Any:
        """A value as its type; nothing is rounded, no number is taken for a truth."""
        kind = {"Real": float, "Integer": int, "Boolean": bool}[family]
        try:
            converted = kind(value)
        except (ValueError, OverflowError, TypeError):
            converted = None
        truth = isinstance(value, bool | np.bool_)
        if converted is None or truth != (kind is bool) or (kind is int and converted != value):
            raise CouplingError(f"{self.name}.{one.name} = {value!r}: must be of type {one.type}")
        return converted

    def _number_of(self, one: Any, word: str) -> int:
        """Number of a word of an enumeration."""
        items = one.declaredType.items if one.type == "Enumeration" else []
        found = {item.name: int(item.value) for item in items or []}
        if word not in found:
            allowed = ", ".join(found) or {"Boolean": "true or false"}.get(one.type, "a number")
            raise CouplingError(f"{self.name}.{one.name} = {word}: must be {allowed}")
        return found[word]

    def reader(self, names: Sequence[str]) -> Reader:
        """What reads these variables, all at once."""
        return Reader(self, names)

    def writer(self, names: Sequence[str]) -> Writer:
        """What sets these variables, all at once."""
        return Writer(self, names)

    def begin(self, time: float) -> None:
        """Enter the initialisation."""
        self._guarded(self._slave.setupExperiment, startTime=time)
        self._guarded(self._slave.enterInitializationMode)

    def end_initialisation(self) -> None:
        """Leave the initialisation."""
        self._guarded(self._slave.exitInitializationMode)

    def step(self, time: float, step: float) -> None:
        """One communication step [s]."""
        status = self.stepper(self.pointer, time, step, self._goes_forward)
        if status > WARNING:
            self.fail("fmi2DoStep", status)

    def save(self) -> Any:
        """State of the instance, to be given back by `drop`."""
        self._goes_forward = 0
        return self._guarded(self._slave.getFMUstate)

    def restore(self, state: Any) -> None:
        """Go back to a state."""
        self._guarded(self._slave.setFMUstate, state)

    def drop(self, state: Any) -> None:
        """Give the memory of a state back."""
        self._guarded(self._slave.freeFMUstate, state)

    def _guarded(self, call: Any, *arguments: Any, **named: Any) -> Any:
        """Call, and put what the FMU logged into the error."""
        try:
            return call(*arguments, **named)
        except Exception as error:
            raise self._error(str(error)) from error

    def fail(self, function: str, status: int) -> None:
        """Raise the error of a call that ended with this status."""
        raise self._error(f"{function} failed with status {status} ({_STATUS.get(status, '?')})")

    def refuse_large(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Raise the error of an Integer input that is to take a number beyond its range."""
        for name, value in zip(names, values, strict=True):
            if FAMILIES[self.variables[name].type] != "Real" and not abs(value) < LARGEST:
                raise CouplingError(f"{self.name}: {name} = {value!r} does not fit an Integer")

    def _error(self, text: str) -> CouplingError:
        # the line of the FMU itself comes first, that of its export library after it
        said = [text for status, text in self.messages if status > WARNING and text.strip()]
        text = said[0].removeprefix(f"{self.name}: ") if said else text
        return CouplingError(f"{self.name}: {text}")

    def free(self) -> None:
        """End the instance."""
        if self._slave is not None:
            self._slave.freeInstance()
            self._slave = None
