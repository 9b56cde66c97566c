"""Variables of a slave by reference: what hosts read and set, quickly where they do so often.

The same variables are asked for and set again and again, in the same order. What such a list
of references needs is found once and kept as a function, or as a plan; new inputs are looked
at when they are needed, which is in the next step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pythonfmu import Fmi2Slave

from fmu_src.slave.calls import STEPPING, FmuError, Phase, guarded, plain_bounds
from fmu_src.slave.folder import read_variables
from percussion_model.scene.rows import refuse_value

# Types that share a getter and a setter.
REAL, INTEGER, BOOLEAN = ("Real",), ("Integer", "Enumeration"), ("Boolean",)

# Gives values of a slave; knows none itself, so that an instance is free as soon as it is left.
Read = Callable[[Any], list[Any]]


class Variables(Fmi2Slave):
    """Slave that knows its variables.

    Attributes
    ----------
    known : dict
        Variables by reference.
    values : dict
        Of parameters and inputs by reference, but for inputs that are `late`.
    late : dict
        Inputs that were set and not yet looked at: values by references, the newest last.
    """

    phase: Phase

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.known = read_variables(arguments["resources"])
        self.by_name = {one.name: one.reference for one in self.known.values()}
        self.values = {
            one.reference: one.start for one in self.known.values() if one.causality != "output"
        }
        self.late: dict[tuple[int, ...], list[float]] = {}
        self._plain_bounds = {one.reference: plain_bounds(one.row) for one in self.known.values()}
        self._real_reads: dict[tuple[int, ...], Read] = {}
        self._reads: dict[Any, Read] = {}
        # lists of Real inputs: reference, name, and bounds of each
        self._inputs_alone: dict[tuple[int, ...], list[tuple[int, str, float, float]]] = {}

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

    def changed(self, references: list[int]) -> None:
        """Take note of values that the host has set."""

    def reader(self, references: list[int]) -> Read:
        """What gives the present values of these outputs; asked for once."""
        raise NotImplementedError

    def fatal(self, error: Exception) -> FmuError:
        """Log an error and return what is to be raised."""
        raise NotImplementedError

    def choice(self, reference: int) -> Any:
        """Word behind the number of an enumeration, None where there is none."""
        row = self.known[reference].row
        choices = row.choices if row is not None else ()
        value = self.values[reference]
        if choices and isinstance(choices[0], int):
            return value if value in choices else None
        return choices[value - 1] if 1 <= value <= len(choices) else None

    # reading

    def read(self, references: list[int], types: tuple[str, ...]) -> list[Any]:
        """Present values."""
        read = self._reads.get((types, *references))
        if read is None:
            read = self._reads[(types, *references)] = self.plan(references, types)
            if types is REAL:
                self._real_reads[tuple(references)] = read
        return read(self)

    def plan(self, references: list[int], types: tuple[str, ...]) -> Read:
        """What reads these variables; raises ValueError if there is one that is not known."""
        outputs = []
        for reference in references:
            one = self.known.get(reference)
            if one is None or one.type not in types:
                raise ValueError(f"there is no {types[0]} variable of reference {reference}")
            if one.causality == "output":
                outputs.append(reference)
        if len(outputs) == len(references):
            return self.reader(references)
        reads = {reference: self.reader([reference]) for reference in outputs}

        def read(slave: Variables) -> list[Any]:
            slave.take_late()
            return [
                reads[reference](slave)[0] if reference in reads else slave.values[reference]
                for reference in references
            ]

        return read

    # setting

    def write(self, references: list[int], values: list[Any], types: tuple[str, ...]) -> None:
        """Set parameters and inputs."""
        self.take_late()
        held = self.values
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
        if types is REAL and all(self.known[r].causality == "input" for r in references):
            self._inputs_alone[tuple(references)] = [
                (r, self.known[r].name, *self._plain_bounds[r]) for r in references
            ]

    def take_late(self) -> None:
        """Take inputs that were set and not yet looked at into `values`."""
        for references, values in self.late.items():
            self.values.update(zip(references, values, strict=True))
        self.late.clear()

    # the calls of a host

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values of Real variables."""
        try:
            read = self._real_reads.get(tuple(vrs))
            return self.read(vrs, REAL) if read is None else read(self)
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
            references = tuple(vrs)
            if references in self._inputs_alone and self.phase is STEPPING:
                late = self.late
                late.pop(references, None)  # the newest goes last
                late[references] = values
            else:
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
