"""An FMU in a coupled run: its instance, errors from its log, and grouped reads and writes.

fmpy makes new arrays for each call. In a run the same variables are asked for again and
again, so arrays are made once here and the functions of the library called with them.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import calloc, free, platform, read_model_description, sharedLibraryExtension
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from lxml import etree

from percussion_model.coupling.calls import LARGEST, WARNING
from percussion_model.scene.retired import remark
from percussion_model.scene.rows import nearest, shortened, unit_suffix
from percussion_model.scene.units import UnitError, in_si

# Number of a bar or a section within a key of a scene, and one in either way of writing.
_PLACE = re.compile(r"\.([0-9]{1,4})(?=\.|$)")
_COUNTED = re.compile(r"\.[0-9]|\[[0-9]")
# What fmpy calls the types that share a getter, and what their values are in C.
FAMILIES = {"Real": "Real", "Integer": "Integer", "Enumeration": "Integer", "Boolean": "Boolean"}
_IN_C: dict[str, tuple[Any, str]] = {
    "Real": (ctypes.c_double, "d"), "Integer": (ctypes.c_int, "i"), "Boolean": (ctypes.c_int, "i"),
}  # fmt: skip
# What types of FMI 3.0 are in FMI 2.0 and SSP 1.0.
KINDS = {"Float64": "Real", "Float32": "Real"} | {
    f"{sign}Int{bits}": "Integer" for sign in ("", "U") for bits in (8, 16, 32, 64)
}
# What FMUs of this project say before they compile; others log what they like.
COMPILING = "compiling the solver"
_STATUS = {2: "discard", 3: "error", 4: "fatal", 5: "pending"}


class CouplingError(ValueError):
    """A system that cannot be set up or cannot go on; says which part, when and why."""


@contextlib.contextmanager
def naming(place: object) -> Iterator[None]:
    """Put a place, as a component or a connection, before what is said of it."""
    try:
        yield
    except CouplingError as error:
        raise type(error)(f"{place}: {error}") from error


def read_description(name: str, folder: str) -> Any:
    """Model description of an unpacked FMU for co-simulation, FMI 2.0 or 3.0.

    Parameters
    ----------
    name, folder : str
        Of the component, and of its unpacked FMU.
    """
    try:
        found = read_model_description(folder, validate=False)
    except Exception as error:  # fmpy has no errors of its own
        text = shortened(" ".join(str(error).split()))
        raise CouplingError(f"{name}: modelDescription.xml cannot be read: {text}") from error
    if found.fmiVersion not in ("2.0", "3.0") or found.coSimulation is None:
        raise CouplingError(f"{name}: this FMU has no co-simulation by FMI 2.0 or 3.0")
    if found.fmiVersion == "2.0":
        _mark_differences(found, Path(folder) / "modelDescription.xml")
    return found


def kind_of(variable: Any) -> str:
    """Type of a variable in the words of FMI 2.0 and SSP 1.0."""
    if getattr(variable, "dimensions", None):
        return "array"
    return KINDS.get(variable.type, variable.type)


def _mark_differences(description: Any, path: Path) -> None:
    """Set `relativeQuantity` of the variables, which fmpy 0.3.32 reads of their types alone."""
    if b"relativeQuantity" not in path.read_bytes():
        return
    said = {
        one.getparent().get("name"): one.get("relativeQuantity")
        for one in etree.parse(str(path)).iterfind("ModelVariables/ScalarVariable/Real")
    }
    for variable in description.modelVariables:
        if said.get(variable.name):
            variable.relativeQuantity = said[variable.name] in ("true", "1")


def find_variable(component: str, variables: Mapping[str, Any], name: str) -> Any:
    """A variable by name; the error suggests another one."""
    if name not in variables:
        name = shortened(name)
        # as a scene writes it, which counts from 0
        bracketed = _PLACE.sub(lambda place: f"[{int(place[1]) + 1}]", name)
        near = nearest(bracketed, variables)
        hint = f"; did you mean {near}?" if near else ""
        if near and _COUNTED.search(name):
            hint += " Bars and sections count from 1 in FMUs, from 0 in scenes"
        raise CouplingError(f"{component} has no variable {name}{hint}")
    return variables[name]


def numbers_of_words(variable: Any) -> dict[str, int]:
    """Numbers of an enumeration by their words; empty for another variable."""
    items = variable.declaredType.items if variable.type == "Enumeration" else []
    return {item.name: int(item.value) for item in items or []}


def number_of_word(component: str, variable: Any, word: str) -> int:
    """Number of a word of an enumeration."""
    found = numbers_of_words(variable)
    if word not in found:
        unit = unit_suffix(variable.unit or "").replace(" ", " in ", 1)
        number = f"a number{unit}, with a decimal point"
        kind = {"Boolean": "true or false"}.get(variable.type, number)
        raise CouplingError(
            f"{component}.{variable.name} = {shortened(word)}: must be "
            f"{', '.join(found) or kind}{remark(variable.name, word)}"
        )
    return found[word]


def number_of_text(component: str, variable: Any, text: str) -> float:
    """Number of a text: of a word of an enumeration, or with its unit."""
    if FAMILIES[kind_of(variable)] == "Real":
        with contextlib.suppress(UnitError):
            unit = "-" if variable.unit in (None, "", "1") else variable.unit
            return in_si(text, unit.replace(".", " "))
    return number_of_word(component, variable, text)


def check_library(name: str, folder: Path, identifier: str, platform: str) -> None:
    """`CouplingError` unless an unpacked FMU has a whole library for this platform.

    Parameters
    ----------
    identifier : str
        Name of the library without its ending, which must be a C identifier.
    platform : str
        As the folders of its libraries are called.
    """
    if not (identifier.isascii() and identifier.isidentifier()):
        raise CouplingError(
            f"{name}: modelIdentifier = {shortened(identifier)!r}: must be a plain name of "
            "letters, digits and underlines"
        )
    path = folder / "binaries" / platform / f"{identifier}{sharedLibraryExtension}"
    if not path.is_file():
        found = sorted(one.name for one in folder.glob("binaries/*") if one.is_dir())
        raise CouplingError(
            f"{name}: its FMU has no library {'/'.join(path.parts[-3:])}, only for "
            f"{shortened(', '.join(found)) or 'no platform'}"
        )
    if not _is_whole(path):
        raise CouplingError(f"{name}: the library {path.name} of its FMU is cut short")


def _is_whole(path: Path) -> bool:
    """Whether a library holds the segments that it lists; Linux would crash with one cut short."""
    data = path.read_bytes()
    if data[:6] != b"\x7fELF\x02\x01":  # others are refused by those that load them
        return True
    try:
        (start,) = struct.unpack_from("<Q", data, 32)
        size, count = struct.unpack_from("<HH", data, 54)
        for k in range(count):
            offset, _, _, length = struct.unpack_from("<4Q", data, start + k * size + 8)
            if offset + length > len(data):
                return False
    except struct.error:
        return False
    return True


class Group:
    """Variables of one family with the arrays of their calls."""

    def __init__(
        self, component: Component, family: str, names: Sequence[str], kind: str, begin: int
    ) -> None:
        references = [component.find(name).valueReference for name in names]
        self.family = family
        self.begin, self.end = begin, begin + len(names)  # places among all values
        kind_in_c, letter = component.IN_C[family]
        values = (kind_in_c * len(names))()
        packed = struct.Struct(f"{len(names)}{letter}")
        self.is_real = kind_in_c in (ctypes.c_double, ctypes.c_float)
        self.fill = functools.partial(packed.pack_into, values, 0)
        self.found = functools.partial(packed.unpack_from, values)
        self.name = f"{component.PREFIX}{kind}{family}"
        self.call = component.function(self.name)
        size = ctypes.c_size_t(len(names))
        self.arguments = (
            component.pointer, (ctypes.c_uint * len(names))(*references), size, values,
            *component.further(size),
        )  # fmt: skip


class Exchange:
    """Variables of an FMU that are read, or set, all at once.

    Parameters
    ----------
    component : Component
    names : sequence of str
    kind : str
        "Get" or "Set".

    Attributes
    ----------
    names : list of str
        In the order of the values: family by family.
    groups : list of Group
        Families with what calls them.
    """

    def __init__(self, component: Component, names: Sequence[str], kind: str) -> None:
        self.component = component
        self.names: list[str] = []
        self.groups: list[Group] = []
        families = [component.family(name) for name in names]
        for family in component.IN_C:
            own = [name for name, of in zip(names, families, strict=True) if of == family]
            if own:
                self.groups.append(Group(component, family, own, kind, len(self.names)))
                self.names += own
        self.forget()

    def read(self) -> list[Any]:
        """Present values."""
        found: list[Any] = []
        for group in self.groups:
            self._call(group)
            found += map(bool, group.found()) if group.family == "Boolean" else group.found()
        return found

    def forget(self) -> None:
        """Set all values the next time: the FMU may have others than were set last."""
        self._last: list[Any] = [None for _ in self.groups]

    def write(self, values: Sequence[Any]) -> None:
        """Set values, in the order of the names; a family that is as before is left alone."""
        for k, group in enumerate(self.groups):
            chosen = values[group.begin : group.end]
            if chosen == self._last[k]:
                continue
            try:
                group.fill(*(chosen if group.is_real else map(int, chosen)))
            except (struct.error, OverflowError):
                self.component.refuse_large(self.names[group.begin : group.end], chosen)
                raise
            self._call(group)
            self._last[k] = chosen

    def _call(self, group: Group) -> None:
        status = group.call(*group.arguments)
        if status > WARNING:
            self.component.fail(group.name, status)


class Component:
    """An instance of an FMU of FMI 2.0 that is unpacked.

    Parameters
    ----------
    name : str
        Of the component in the system.
    folder : str
        Of the unpacked FMU.
    description : ModelDescription
        Of `read_description`.
    """

    # what another version of FMI has differently
    PREFIX, PLATFORM, FAMILIES, IN_C = "fmi2", platform, FAMILIES, _IN_C
    SLAVE = FMU2Slave

    def __init__(self, name: str, folder: str, description: Any) -> None:
        self.name = name
        identifier = description.coSimulation.modelIdentifier
        check_library(name, Path(folder), identifier, self.PLATFORM)
        self.variables = {one.name: one for one in description.modelVariables}
        self.can_save = bool(description.coSimulation.canGetAndSetFMUstate)
        self.can_vary = bool(description.coSimulation.canHandleVariableCommunicationStepSize)
        self.messages: list[str] = []
        self.faults: list[str] = []  # those of them that are errors
        self.slave: Any = None
        try:
            with contextlib.chdir("."):  # fmpy stays in the folder of a library that fails
                self.slave = self.SLAVE(
                    guid=description.guid, unzipDirectory=folder, modelIdentifier=identifier,
                    instanceName=name,
                )  # fmt: skip
        except Exception as error:  # fmpy has no errors of its own
            text = str(error).replace(f"{folder}{os.sep}", "")
            text = text.partition(f"{sharedLibraryExtension}. ")[2] or text
            raise CouplingError(
                f"{name}: the library of its FMU cannot be loaded: {text}"
            ) from error
        self._instantiate()
        self.pointer = ctypes.c_void_p(self.slave.component)
        self._no_rollback = 1  # promised to the FMU until a state is saved

    def _instantiate(self) -> None:
        # both have to live as long as the instance
        self._logger = fmi2CallbackLoggerTYPE(self._note)
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = self._logger
        # the functions of C themselves: some FMUs call them in each step
        allocate, release = (ctypes.cast(one, ctypes.c_void_p).value for one in (calloc, free))
        self._callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(allocate)
        self._callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(release)
        self._guarded(self.slave.instantiate, callbacks=self._callbacks, loggingOn=True)
        self.stepper = self.function(
            "fmi2DoStep", ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int
        )

    def further(self, size: Any) -> tuple[Any, ...]:
        """What a getter or a setter takes after the values, of which there are `size`."""
        return ()

    def function(self, name: str, *types: Any) -> Any:
        """A function of the library that returns a status; without types, by those of ctypes."""
        # an object of its own, since fmpy gives types to that of the library
        return ctypes.cast(getattr(self.slave.dll, name), ctypes.CFUNCTYPE(ctypes.c_int, *types))

    def _note(
        self, environment: Any, name: bytes, status: int, category: bytes, text: bytes
    ) -> None:
        self.messages.append(text.decode("utf-8", "replace"))
        if status > WARNING:
            self.faults.append(self.messages[-1])

    def find(self, name: str) -> Any:
        """A variable by name; the error suggests another one."""
        return find_variable(self.name, self.variables, name)

    def family(self, name: str) -> str:
        """Family of a variable by name: what its getter is called."""
        one = self.find(name)
        if kind_of(one) not in FAMILIES or one.type not in self.FAMILIES:
            raise CouplingError(
                f"{self.name}.{name} is of type {kind_of(one)}: must be one of "
                f"{', '.join(self.FAMILIES)}"
            )
        return self.FAMILIES[one.type]

    def set(self, values: Mapping[str, Any]) -> None:
        """Set variables by name, also texts; enumerations by number or by word."""
        for name, value in values.items():
            one = self.find(name)
            if kind_of(one) != "String":
                self.family(name)
            if one.variability == "constant" or one.initial == "calculated":
                raise CouplingError(f"{self.name}.{name} is calculated: it cannot be set")
            if one.causality == "structuralParameter":
                raise CouplingError(
                    f"{self.name}.{name} is a structural parameter: it cannot be set"
                )
            if kind_of(one) == "String":
                if not isinstance(value, str):
                    raise CouplingError(f"{self.name}.{name} = {value!r}: must be a text")
                self._guarded(self.slave.setString, [one.valueReference], [value])
                continue
            if isinstance(value, str):
                value = number_of_text(self.name, one, value)
            self.writer([name]).write([self._converted(one, value)])

    def _converted(self, one: Any, value: Any) -> Any:
        """A value as its type; nothing is rounded, no number is taken for a Boolean."""
        kind = {"Real": float, "Integer": int, "Boolean": bool}[FAMILIES[kind_of(one)]]
        try:
            converted = kind(value)
        except (ValueError, OverflowError, TypeError):
            converted = None
        is_boolean = isinstance(value, bool | np.bool_)
        if (
            converted is None
            or is_boolean != (kind is bool)
            or (kind is int and converted != value)
        ):
            raise CouplingError(f"{self.name}.{one.name} = {value!r}: must be of type {one.type}")
        return converted

    def reader(self, names: Sequence[str]) -> Exchange:
        """Return a reader of these variables, all at once."""
        return Exchange(self, names, "Get")

    def writer(self, names: Sequence[str]) -> Exchange:
        """Return a writer of these variables, all at once."""
        return Exchange(self, names, "Set")

    def begin(self, time: float) -> None:
        """Enter the initialisation."""
        self._guarded(self.slave.setupExperiment, startTime=time)
        self._guarded(self.slave.enterInitializationMode)

    def compilation(self) -> list[str]:
        """What the FMU has logged of kernels that it is going to compile."""
        return [text for text in self.messages if COMPILING in text]

    def end_initialisation(self) -> None:
        """Leave the initialisation."""
        self._guarded(self.slave.exitInitializationMode)

    def step(self, time: float, step: float) -> None:
        """One communication step [s]."""
        status = self.stepper(self.pointer, time, step, self._no_rollback)
        if status > WARNING:
            self.fail("fmi2DoStep", status)

    def save(self) -> Any:
        """State of the instance, to be given back by `drop`."""
        self._no_rollback = 0
        return self._guarded(self.slave.getFMUstate)

    def restore(self, state: Any) -> None:
        """Go back to a state."""
        self._guarded(self.slave.setFMUstate, state)

    def drop(self, state: Any) -> None:
        """Give the memory of a state back."""
        self._guarded(self.slave.freeFMUstate, state)

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
            family = self.family(name)
            if family != "Real" and not abs(value) < LARGEST:
                raise CouplingError(f"{self.name}: {name} = {value!r} does not fit an {family}")

    def _error(self, text: str) -> CouplingError:
        # the line of the FMU itself comes first, that of its export library after it
        logged = next(filter(str.strip, self.faults), text)
        return CouplingError(f"{self.name}: {logged.removeprefix(f'{self.name}: ')}")

    def free(self) -> None:
        """End the instance."""
        if self.slave is not None:
            self.slave.freeInstance()
            self.slave = None
