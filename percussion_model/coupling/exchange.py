"""What reads outputs and sets inputs of one FMU, many at once, in as few calls as there are types.

fmpy makes new arrays for each call. In a run the same variables are asked for again and
again, so arrays are made once here and the functions of the library called with them.
"""

from __future__ import annotations

import ctypes
import functools
import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from percussion_model.coupling.component import Component

# What fmpy calls the types that share a getter, and what their values are in C.
FAMILIES = {"Real": "Real", "Integer": "Integer", "Enumeration": "Integer", "Boolean": "Boolean"}
ORDER = ("Real", "Integer", "Boolean")
_IN_C: dict[str, tuple[Any, str]] = {
    "Real": (ctypes.c_double, "d"), "Integer": (ctypes.c_int, "i"), "Boolean": (ctypes.c_int, "i"),
}  # fmt: skip
# Integers of FMI are below this, by size.
LARGEST = 2.0**31
# The highest status of a call that did what it should.
WARNING = 1


class Group:
    """Variables of one family with the arrays of their calls."""

    def __init__(
        self, component: Component, family: str, names: Sequence[str], kind: str, begin: int
    ) -> None:
        references = [component.find(name).valueReference for name in names]
        self.family = family
        self.begin, self.end = begin, begin + len(names)  # places among all values
        kind_in_c, letter = _IN_C[family]
        values = (kind_in_c * len(names))()
        packed = struct.Struct(f"{len(names)}{letter}")
        self.fill = functools.partial(packed.pack_into, values, 0)
        self.found = functools.partial(packed.unpack_from, values)
        self.name = f"fmi2{kind}{family}"
        self.call = component.function(self.name)
        self.arguments = (
            component.pointer,
            (ctypes.c_uint * len(names))(*references),
            ctypes.c_size_t(len(names)),
            values,
        )


class Exchange:
    """Variables of an FMU that are read, or set, all at once.

    Parameters
    ----------
    component : Component
    names : sequence of str
    kind : {"Get", "Set"}

    Attributes
    ----------
    names : list of str
        In the order of the values: family by family.
    groups : list of Group
        Families with what calls them.
    """

    def __init__(self, component: Component, names: Sequence[str], kind: str) -> None:
        found: dict[str, list[str]] = {}
        for name in names:
            found.setdefault(FAMILIES[component.find(name).type], []).append(name)
        self.component = component
        self.names: list[str] = []
        self.groups: list[Group] = []
        for family in ORDER:
            if family in found:
                group = Group(component, family, found[family], kind, len(self.names))
                self.groups.append(group)
                self.names += found[family]


class Reader(Exchange):
    """Reads variables of an FMU."""

    def __init__(self, component: Component, names: Sequence[str]) -> None:
        super().__init__(component, names, "Get")

    def read(self) -> list[Any]:
        """Present values."""
        found: list[Any] = []
        for group in self.groups:
            status = group.call(*group.arguments)
            if status > WARNING:
                self.component.fail(group.name, status)
            found += map(bool, group.found()) if group.family == "Boolean" else group.found()
        return found


class Writer(Exchange):
    """Sets variables of an FMU; a family whose values are as before is left alone."""

    def __init__(self, component: Component, names: Sequence[str]) -> None:
        super().__init__(component, names, "Set")
        self._last: list[Any] = []
        self.forget()

    def forget(self) -> None:
        """Set all values the next time: the FMU may have others than were set last."""
        self._last = [None for _ in self.groups]

    def write(self, values: Sequence[Any]) -> None:
        """Set values, in the order of the names."""
        for k, group in enumerate(self.groups):
            chosen = values[group.begin : group.end]
            if chosen == self._last[k]:
                continue
            try:
                group.fill(*(chosen if group.family == "Real" else map(int, chosen)))
            except struct.error:
                self.component.refuse_large(self.names[group.begin : group.end], chosen)
                raise
            status = group.call(*group.arguments)
            if status > WARNING:
                self.component.fail(group.name, status)
            self._last[k] = chosen
