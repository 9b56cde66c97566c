"""Variables of FMI 3.0, made of those of FMI 2.0: sections of a bar are arrays."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from fmu_src.variables import Variable

Type3 = Literal["Float64", "Int32", "Boolean", "Enumeration"]
TYPES: dict[str, Type3] = {
    "Real": "Float64",
    "Integer": "Int32",
    "Boolean": "Boolean",
    "Enumeration": "Enumeration",
}
# Of the independent variable; no variable of FMI 2.0 has it.
TIME, TIME_REFERENCE = "time", 0
_SECTION = re.compile(r"(.+\.sections)\[\d+\](\.\w+)")


@dataclass(frozen=True)
class Variable3:
    """A variable of FMI 3.0.

    Attributes
    ----------
    name : str
    reference : int
        Unique over all types; an array has that of its first member.
    type : str
        Values of an enumeration are Int64 in the calls.
    causality, variability : str
        As in the model description; `time` alone is "independent".
    members : tuple of str
        Names of the variables of FMI 2.0 that it is made of, in the order of its values;
        what is said of the first is true for all. `time` has none.
    dimensions : tuple of int
        Empty for a scalar.
    """

    name: str
    reference: int
    type: Type3
    causality: str
    variability: str
    members: tuple[str, ...] = ()
    dimensions: tuple[int, ...] = ()


def fmi3_variables(variables: Sequence[Variable]) -> list[Variable3]:
    """Return variables of FMI 2.0 as an FMU of FMI 3.0 has them, `time` first."""
    time = Variable3(TIME, TIME_REFERENCE, "Float64", "independent", "continuous")
    found = [time, *(_variable(group) for group in _groups(variables).values())]
    references = {one.reference for one in found}
    if len(references) != len(found):
        raise ValueError("two variables of FMI 3.0 have the same value reference")
    return found


def _groups(variables: Sequence[Variable]) -> dict[str, list[Variable]]:
    """Variables of FMI 2.0 by the name under which FMI 3.0 has them."""
    groups: dict[str, list[Variable]] = {}
    for one in variables:
        groups.setdefault(array_name(one.name) or one.name, []).append(one)
    return groups


def array_name(name: str) -> str:
    """Name of the array that has a variable of FMI 2.0 as a member; empty if none has."""
    found = _SECTION.fullmatch(name)
    return found[1] + found[2] if found else ""


def _variable(members: list[Variable]) -> Variable3:
    first = members[0]
    name = array_name(first.name)
    return Variable3(
        name=name or first.name,
        reference=first.reference,
        type=TYPES[first.type],
        causality=first.causality,
        variability=first.variability,
        members=tuple(one.name for one in members),
        dimensions=(len(members),) if name else (),
    )
