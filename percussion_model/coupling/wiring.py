"""Values and connections of an SSP archive, fitted to the variables of its FMUs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from percussion_model.coupling.component import (
    FAMILIES,
    CouplingError,
    find_variable,
    naming,
    number_of_word,
    numbers_of_words,
)
from percussion_model.coupling.ssp import SYSTEM, Archive, Connection, Connector, signal_name
from percussion_model.coupling.ssp_units import Unit, conversion, unit_named, units_of_fmu
from percussion_model.coupling.ssp_values import Change, Transformation, Value, chained
from percussion_model.scene.rows import shortened
from percussion_model.scene.units import UnitError

REMEDY = 'give both a unit, or suppressUnitConversion="true" where the numbers are right'
# Types of FMI that transformations go from and to.
_TO = {
    "Linear": ("Real",), "Boolean": ("Boolean",), "Integer": ("Integer", "Enumeration"),
    "Enumeration": ("Enumeration",),
}  # fmt: skip
_FROM = _TO | {"Linear": ("Real", "Integer")}
# Types whose numbers are right without one.
_ALIKE = (("Integer", "Real"), ("Integer", "Enumeration"), ("Enumeration", "Integer"))
_SETTABLE = ("input", "parameter")


class Link(NamedTuple):
    """A connection to an input of a component, with what is done to its values on the way."""

    input: str
    source: str  # component
    output: str  # of that component
    change: Change | None = None


class End(NamedTuple):
    """A variable of an FMU, as an end of a connection or the target of a value."""

    component: str
    name: str
    variable: Any
    unit: Unit | None

    @property
    def is_difference(self) -> bool:
        """Whether its zero is zero in every unit."""
        own = self.variable.relativeQuantity
        declared = self.variable.declaredType
        return bool(getattr(declared, "relativeQuantity", False) if own is None else own)


class Wiring:
    """Fits what an archive says to its FMUs.

    Parameters
    ----------
    archive : Archive
    descriptions : mapping
        Model descriptions by component.
    replaced : set of str
        Components that have another FMU than that of the archive: what they lack is not set.
    """

    def __init__(
        self, archive: Archive, descriptions: Mapping[str, Any], replaced: set[str]
    ) -> None:
        self.archive, self.replaced = archive, replaced
        self._variables = {
            name: {one.name: one for one in found.modelVariables}
            for name, found in descriptions.items()
        }
        self._units = {name: units_of_fmu(found) for name, found in descriptions.items()}

    def values(self) -> dict[str, dict[str, Any]]:
        """Values to be set, by component; those of the system go before others."""
        found: dict[str, dict[str, Any]] = {name: {} for name in self._variables}
        for name in self._variables:
            for variable, value in self.archive.values[name].items():
                if variable in self._variables[name] or name not in self.replaced:
                    end = self._end(name, variable)
                    found[name][variable] = self._fitted(value, end)
        for name, value in self.archive.values[SYSTEM].items():
            for end, own in self._targets(name, value):
                found[end.component][end.name] = own
        return found

    def links(self) -> dict[str, list[Link]]:
        """Inputs of each component that are connected."""
        found: dict[str, list[Link]] = {name: [] for name in self._variables}
        fed: set[tuple[str, str]] = set()
        for one in self.archive.connections:
            with naming(one):
                ends = [self._end(*end) for end in one.ends if self._is_inside(*end)]
                sinks = [end for end in ends if end.variable.causality == "input"]
                if len(ends) == 2:
                    sources = [end for end in ends if end.variable.causality == "output"]
                    if not (sources and sinks):
                        kinds = " and ".join(end.variable.causality for end in ends)
                        raise CouplingError(f"must be of an output and an input, not of {kinds}")
                    (source,), (sink,) = sources, sinks
                    change = _change(source, sink, one)
                    link = Link(sink.name, source.component, source.name, change)
                    found[sink.component].append(link)
            for end in sinks:
                if end[:2] in fed:
                    name = signal_name(end.component, end.name)
                    raise CouplingError(f"{shortened(name)} has two connections")
                fed.add(end[:2])
        return found

    def _is_inside(self, element: str, name: str) -> bool:
        """Whether an end is of a component. Those of the system move nothing in a run: nothing
        is outside, and what is bound to them is among the values.
        """
        if element == SYSTEM and (SYSTEM, name) not in self.archive.connectors:
            raise CouplingError(f"the system has no connector {shortened(name)}")
        return element != SYSTEM

    def _end(self, component: str, name: str) -> End:
        """A variable of a component, as FMU and archive describe it."""
        if component not in self._variables:
            known = shortened(", ".join(self._variables))
            raise CouplingError(f"there is no component {shortened(component)}, only {known}")
        variable = find_variable(component, self._variables[component], name)
        units = self._units[component]
        unit = unit_named(variable.unit or getattr(variable.declaredType, "unit", None), units)
        said = self.archive.connectors.get((component, name))
        if said is None:
            return End(component, name, variable, unit)
        if component not in self.replaced:
            _check_connector(signal_name(component, name), said, variable, unit)
        return End(component, name, variable, unit or said.unit)

    def _targets(self, name: str, value: Value) -> Iterator[tuple[End, Any]]:
        """What a value that is bound to the system sets."""
        connector = self.archive.connectors.get((SYSTEM, name))
        ends = []
        if connector is not None:
            if connector.kind not in _SETTABLE:
                raise CouplingError(
                    f"parameter {shortened(name)}: is an {connector.kind} of the system: must be "
                    f"{' or '.join(_SETTABLE)}"
                )
            for one in self.archive.connections:
                if (SYSTEM, name) in one.ends:
                    other = one.ends[one.ends[0] == (SYSTEM, name)]
                    if other[0] == SYSTEM:
                        continue
                    with naming(one):
                        end = self._end(*other)
                        ends.append((end, self._passed(value, connector, end, one)))
        for component, variables in self._variables.items():
            own = name.removeprefix(f"{component}.")
            if own != name and own in variables:
                end = self._end(component, own)
                ends.append((end, self._fitted(value, end)))
        if not ends:
            self._refuse_name(name)
        yield from ends

    def _refuse_name(self, name: str) -> None:
        """`CouplingError` for a value of the system that sets nothing."""
        for component, variables in self._variables.items():
            if name.startswith(f"{component}.") and component not in self.replaced:
                find_variable(component, variables, name.removeprefix(f"{component}."))
        if name.partition(".")[0] not in self.replaced:
            raise CouplingError(
                f"parameter {shortened(name)}: sets nothing: must be COMPONENT.VARIABLE or a "
                "connected input or parameter of the system"
            )

    def _passed(self, value: Value, connector: Connector, end: End, connection: Connection) -> Any:
        """A value as a variable takes it that is connected to a connector of the system.

        A connector without a unit has that of the variable.
        """
        unit = connector.unit or end.unit
        inner = _changed(value, unit, end.is_difference)
        outer = Value(value.kind, inner, unit, connection.transformation, connection.keeps_unit)
        return self._fitted(outer, end)

    def _fitted(self, value: Value, end: End) -> Any:
        """A value as a variable takes it."""
        with naming(shortened(signal_name(end.component, end.name))):
            found = _changed(value, end.unit, end.is_difference)
        if isinstance(found, str) and end.variable.type in FAMILIES:
            return number_of_word(end.component, end.variable, found)
        return found


def _check_connector(name: str, said: Connector, variable: Any, unit: Unit | None) -> None:
    """`CouplingError` where a connector contradicts the variable of its FMU."""
    own = variable.type
    types = {own, "Integer"} if own == "Enumeration" else {own}
    for key, given, allowed in (
        ("kind", said.kind, {variable.causality}),
        ("type", said.type, types | {None}),
    ):
        if given not in allowed:
            known = " or ".join(sorted(one for one in allowed if one))
            raise CouplingError(f"connector {name}: {key} = {given}: its FMU has {known}")
    if said.unit is not None and unit is not None:
        try:
            differs = conversion(said.unit, unit) is not None
        except UnitError:
            differs = True
        if differs:
            raise CouplingError(
                f"connector {name}: unit = {said.unit.name}: its FMU has {unit.name}"
            )


def _changed(value: Value, unit: Unit | None, is_difference: bool) -> Any:
    """A value in another unit and after its transformation."""
    found = value.value
    if value.unit is not None and not value.keeps_unit:
        with naming(shortened(f"{found} {value.unit.name}")):
            change = _conversion(value.unit, unit, is_difference)
        found = found if change is None else change(found)
    if value.transformation is not None:
        kind = value.transformation.kind
        if value.kind not in (("Real", "Integer") if kind == "Linear" else (kind,)):
            raise CouplingError(f"a transformation of {kind} values is none of {value.kind}")
        found = value.transformation.change(found)
    if isinstance(found, float) and not math.isfinite(found):
        raise CouplingError(f"{value.value}: is no finite number after its conversion")
    return found


def _conversion(given: Unit | None, wanted: Unit | None, is_difference: bool) -> Change | None:
    try:
        return conversion(given, wanted, is_difference)
    except UnitError as error:
        raise CouplingError(f"{error}: {REMEDY}") from None


def _change(source: End, sink: End, connection: Connection) -> Change | None:
    """What a connection does to its values, None where they stay as they are."""
    given, wanted = source.variable.type, sink.variable.type
    transformation = connection.transformation
    if transformation is None:
        _check_types(source, sink)
    elif given not in _FROM[transformation.kind] or wanted not in _TO[transformation.kind]:
        kind = transformation.kind
        raise CouplingError(f"its transformation is of {kind} values, not of {given} to {wanted}")
    converted = None
    if wanted == "Real" and not connection.keeps_unit:
        is_difference = source.is_difference or sink.is_difference
        converted = _conversion(source.unit, sink.unit, is_difference)
    if transformation is None:
        return converted
    if transformation.kind == "Linear":
        return chained(converted, transformation.change)
    return _by_table(source, sink, connection, transformation)


def _check_types(source: End, sink: End) -> None:
    """`CouplingError` where values would be rounded, or words change their meaning."""
    given, wanted = source.variable.type, sink.variable.type
    if given == wanted == "Enumeration":
        have, known = numbers_of_words(source.variable), numbers_of_words(sink.variable)
        if not have.items() <= known.items():
            raise CouplingError("the enumerations differ: give an EnumerationMappingTransformation")
    elif given != wanted and (given, wanted) not in _ALIKE:
        raise CouplingError(f"{given} does not fit {wanted}")


def _by_table(
    source: End, sink: End, connection: Connection, transformation: Transformation
) -> Change:
    """What looks values up in the table of a connection; one that lacks some is refused."""
    table = transformation.table
    needed: set[Any] = set()
    if transformation.kind == "Boolean":
        needed = {True, False}
    elif transformation.kind == "Enumeration":
        have, known = numbers_of_words(source.variable), numbers_of_words(sink.variable)
        needed = set(have)
        for word in table.values():
            number_of_word(sink.component, sink.variable, word)
        table = {have[word]: known[table[word]] for word in have if word in table}
    if lacking := sorted(map(str, needed - transformation.table.keys())):
        raise CouplingError(
            f"its {transformation.kind}MappingTransformation lacks {shortened(', '.join(lacking))}"
        )

    known_table = transformation._replace(table=table)

    def look_up(value: Any) -> Any:
        with naming(connection):  # numbers are known in the run alone
            return known_table.change(value)

    return look_up
