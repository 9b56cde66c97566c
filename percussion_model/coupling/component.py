"""One FMU in a coupled run: variables by name, read and set many at once."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

# What fmpy calls the types that share a getter.
FAMILIES = {"Real": "Real", "Integer": "Integer", "Enumeration": "Integer", "Boolean": "Boolean"}


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
        self.messages: list[str] = []
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

    def _note(
        self, environment: Any, name: bytes, status: int, category: bytes, text: bytes
    ) -> None:
        self.messages.append(text.decode("utf-8", "replace"))

    def find(self, name: str) -> Any:
        """A variable by name; the error suggests another one."""
        if name not in self.variables:
            near = difflib.get_close_matches(name, self.variables, 1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise CouplingError(f"{self.name} has no variable {name}{hint}")
        return self.variables[name]

    def set(self, values: Mapping[str, Any]) -> None:
        """Set variables by name."""
        for name, value in values.items():
            family = FAMILIES[self.find(name).type]
            converted = {"Real": float, "Integer": int, "Boolean": bool}[family](value)
            setter = getattr(self._slave, f"set{family}")
            self._guarded(setter, [self.variables[name].valueReference], [converted])

    def getter(self, names: Iterable[str]) -> Getter:
        """What reads these variables, all at once."""
        return Getter(self, list(names))

    def setter(self, names: Iterable[str]) -> Setter:
        """What sets these variables, all at once."""
        return Setter(self, list(names))

    def begin(self, time: float) -> None:
        """Enter the initialisation."""
        self._guarded(self._slave.setupExperiment, startTime=time)
        self._guarded(self._slave.enterInitializationMode)

    def end_initialisation(self) -> None:
        """Leave the initialisation."""
        self._guarded(self._slave.exitInitializationMode)

    def step(self, time: float, step: float) -> None:
        """One communication step [s]."""
        self._guarded(self._slave.doStep, time, step)

    def _guarded(self, call: Any, *arguments: Any, **named: Any) -> Any:
        """Call, and put what the FMU logged into the error."""
        try:
            return call(*arguments, **named)
        except Exception as error:
            # the line of the FMU itself comes first, that of its export library after it
            said = [text for text in self.messages if text.strip()]
            text = said[0].removeprefix(f"{self.name}: ") if said else str(error)
            raise CouplingError(f"{self.name}: {text}") from error

    def free(self) -> None:
        """End the instance."""
        if self._slave is not None:
            self._slave.freeInstance()
            self._slave = None


class _Many:
    """References of several variables by family, with their places."""

    def __init__(self, component: Component, names: list[str]) -> None:
        self.component = component
        self.names = names
        found: dict[str, tuple[list[int], list[int]]] = {}
        for place, name in enumerate(names):
            one = component.find(name)
            references, places = found.setdefault(FAMILIES[one.type], ([], []))
            references.append(one.valueReference)
            places.append(place)
        self.families = [(family, *both) for family, both in found.items()]


class Getter(_Many):
    """Reads variables."""

    def __call__(self) -> list[Any]:
        """Values in the order of the names."""
        values: list[Any] = [None] * len(self.names)
        slave = self.component._slave
        for family, references, places in self.families:
            read = self.component._guarded(getattr(slave, f"get{family}"), references)
            for place, value in zip(places, read, strict=True):
                values[place] = bool(value) if family == "Boolean" else value
        return values


class Setter(_Many):
    """Sets variables."""

    def __call__(self, values: list[Any]) -> None:
        """Set values in the order of the names."""
        slave = self.component._slave
        for family, references, places in self.families:
            chosen = [values[place] for place in places]
            self.component._guarded(getattr(slave, f"set{family}"), references, chosen)
