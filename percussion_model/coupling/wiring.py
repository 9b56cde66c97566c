"""Values and connections of an SSP archive, fitted to the variables of its FMUs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from operator import itemgetter
from types import SimpleNamespace
from typing import Any, NamedTuple

from percussion_model.coupling.component import (
    FAMILIES,
    CouplingError,
    find_variable,
    kind_of,
    naming,
    number_of_word,
    numbers_of_words,
)
from percussion_model.coupling.ssp import (
    SYSTEM,
    Archive,
    Connection,
    Connector,
    Place,
    name_within,
    place_of,
    signal_name,
)
from percussion_model.coupling.ssp_units import Unit, conversion, unit_named, units_of_fmu
from percussion_model.coupling.ssp_values import Change, Transformation, Value, chained
from percussion_model.scene.rows import shortened
from percussion_model.scene.units import UnitError

REMEDY = 'give both a unit, or suppressUnitConversion="true" where the numbers are right'
# From a component to another: two for each system between them.
MOST_CONNECTORS = 100
# Types of FMI that transformations go from and to.
_TO = {
    "Linear": ("Real",), "Boolean": ("Boolean",), "Integer": ("Integer", "Enumeration"),
    "Enumeration": ("Enumeration",),
}  # fmt: skip
_FROM = _TO | {"Linear": ("Real", "Integer")}
# Types whose numbers are right without one.
_ALIKE = (("Integer", "Real"), ("Integer", "Enumeration"), ("Enumeration", "Integer"))
# Kinds of connectors.
_SETTABLE, _GIVING = ("input", "parameter"), ("output", "calculatedParameter")


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
    def type(self) -> str:
        """Its type, in the words of FMI 2.0."""
        return kind_of(self.variable)

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
        # by the place to which a connection leads: the connection, and where it comes from
        self._feeds: dict[Place, tuple[Connection, Place]] = {}
        self._led: dict[Place, list[Place]] = {}  # the same from there on
        self._lacking: list[str] = []
        for one in archive.connections:
            with naming(one):
                source, sink = self._direction(one)
            if sink in self._feeds:
                raise CouplingError(f"{shortened(signal_name(*sink))} has two connections")
            self._feeds[sink] = one, source
            self._led.setdefault(source, []).append(sink)

    def values(self) -> dict[str, dict[str, Any]]:
        """Values to be set, by component; those of a system go before what is within it."""
        found: dict[str, dict[str, Any]] = {name: {} for name in self._variables}
        for name in self._variables:
            for variable, value in self.archive.values[name].items():
                if variable in self._variables[name] or name not in self.replaced:
                    end = self._end(name, variable)
                    found[name][variable] = self._fitted(value, end)
        for system in reversed(self.archive.systems):
            targets = [
                one
                for name, value in self.archive.values[system].items()
                for one in self._targets(system, name, value)
            ]
            # a variable that a connector feeds has the value of that, whatever else is bound to it
            for _, (component, variable), own in sorted(targets, key=itemgetter(0)):
                found[component][variable] = own
        return found

    def links(self) -> dict[str, list[Link]]:
        """Inputs of each component that are connected to outputs, within systems or across them."""
        found: dict[str, list[Link]] = {name: [] for name in self._variables}
        for place in self._feeds:
            if place[0] in found:
                source, way = self._way_to(place)
                if source[0] in found:  # else nothing outside the outermost system feeds it
                    found[place[0]].append(self._link(source, way))
        return found

    def _direction(self, connection: Connection) -> tuple[Place, Place]:
        """Where a connection comes from, and where it leads."""
        kinds, sources = [], []
        for end in connection.ends:
            kinds.append(self._kind(end))
            # within a system its inputs give what those of its elements take
            if kinds[-1] in (_SETTABLE if end[0] == connection.system else _GIVING):
                sources.append(end)
        sinks = [one for one in connection.ends if one not in sources]
        if len(sources) == 1 and {*kinds} <= {*_SETTABLE, *_GIVING}:
            given, taken = (kinds[connection.ends.index(one)] for one in (*sources, *sinks))
            # nothing outside the outermost system changes what its inputs have at the start
            is_value = given == "parameter" or sources[0][0] == SYSTEM
            if taken != "parameter" or is_value:
                return sources[0], sinks[0]
        raise CouplingError(f"must be of an output and an input, not of {' and '.join(kinds)}")

    def _kind(self, place: Place) -> str:
        """Causality of a variable of a component, or of a connector of a system."""
        element, name = place
        if element in self._variables:
            return str(self._end(element, name).variable.causality)
        if place not in self.archive.connectors:
            raise CouplingError(f"the system{element and ' '}{element} has no connector {name}")
        return self.archive.connectors[place].kind

    def _way_to(self, sink: Place) -> tuple[Place, list[Place]]:
        """What feeds an input in the end, and all to which connections lead on the way."""
        way = [sink]
        while True:
            _, source = self._feeds[way[0]]
            if source not in self._feeds:
                return source, way
            way.insert(0, source)
            _check_length(way)

    def _ways_from(self, place: Place, before: tuple[Place, ...] = ()) -> Iterator[list[Place]]:
        """All to which connections lead on the ways from a connector of a system to components."""
        way = (*before, place)
        _check_length(way)
        for sink in self._led.get(place, ()):
            if sink[0] in self._variables:
                yield [*way, sink]
            else:
                yield from self._ways_from(sink, way)

    def _units_on(self, way: list[Place], unit: Unit | None) -> list[Unit | None]:
        """Units on a way that begins in one; an input of a system has that to which it leads."""
        units = [self._end(*way[-1]).unit]
        for place in reversed(way[:-1]):
            said = self.archive.connectors[place]
            units.insert(0, said.unit or (units[0] if said.kind in _SETTABLE else None))
        for k, known in enumerate(units[:-1]):
            units[k] = unit = known or unit
        return units

    def _link(self, source: Place, way: list[Place]) -> Link:
        """Link of a component's input, with what all connections on the way change."""
        begin, sink, change = self._end(*source), self._end(*way[-1]), None
        is_difference = begin.is_difference or sink.is_difference
        for place, unit in zip(way, self._units_on(way, begin.unit), strict=True):
            connection, end = self._feeds[place][0], sink
            if place != way[-1]:
                end = self._between(place, unit, begin.variable, is_difference)
            with naming(connection):
                change = chained(change, _change(begin, end, connection))
            self._note_lack(begin, end, connection)
            begin = end
        return Link(sink.name, *source, change)

    def _note_lack(self, begin: End, end: End, connection: Connection) -> None:
        """Note a connection whose numbers stay as they are, since one end is without a unit."""
        if end.type == "Real" and not connection.keeps_unit and None in (begin.unit, end.unit):
            try:
                conversion(begin.unit, end.unit)
            except UnitError as error:
                self._lacking.append(f"{connection}: {error}: its numbers stay as they are")

    @property
    def remark(self) -> str:
        """What those should know who run it, empty if there is nothing; complete after `links`."""
        others = f"; so do those of {len(self._lacking) - 1} more" if self._lacking[1:] else ""
        return "".join(self._lacking[:1]) + others

    def _between(self, place: Place, unit: Unit | None, before: Any, is_difference: bool) -> End:
        """A connector of a system as a variable; what it does not say is as before it."""
        said = self.archive.connectors[place]
        items = [
            SimpleNamespace(name=word, value=number)
            for word, number in (said.items or numbers_of_words(before)).items()
        ]
        variable = SimpleNamespace(
            name=place[1], type=said.type or kind_of(before), unit=None,
            relativeQuantity=is_difference, declaredType=SimpleNamespace(items=items),
        )  # fmt: skip
        return End(*place, variable, unit)

    def _end(self, component: str, name: str) -> End:
        """A variable of a component, as FMU and archive describe it."""
        variable = find_variable(component, self._variables[component], name)
        units = self._units[component]
        unit = unit_named(variable.unit or getattr(variable.declaredType, "unit", None), units)
        said = self.archive.connectors.get((component, name))
        if said is None:
            return End(component, name, variable, unit)
        if component not in self.replaced:
            _check_connector(signal_name(component, name), said, variable, unit)
        return End(component, name, variable, unit or said.unit)

    def _targets(self, system: str, name: str, value: Value) -> Iterator[tuple[bool, Place, Any]]:
        """What a value that is bound to a system sets: if by connections, the place, its value."""
        full, is_known = signal_name(system, name), False
        for inner in self.archive.systems:
            place = inner, name_within(inner, full) or ""
            if inner != system and name_within(system, inner) is None:
                continue
            if place in self.archive.connectors:
                is_known, kind = True, self._kind(place)
                if kind not in _SETTABLE:
                    raise CouplingError(
                        f"parameter {shortened(full)}: is an {kind} of the system: must be "
                        f"{' or '.join(_SETTABLE)}"
                    )
                for way in self._ways_from(place):
                    yield True, way[-1], self._passed(value, way)
        for component, variables in self._variables.items():
            own = name_within(component, full) or ""
            if own in variables and name_within(system, component) is not None:
                is_known = True
                yield False, (component, own), self._fitted(value, self._end(component, own))
        if not is_known:
            self._refuse_name(full)

    def _refuse_name(self, name: str) -> None:
        """`CouplingError` for a value of a system that sets nothing."""
        component, own = place_of(name, self._variables)
        if component in self.replaced:
            return
        if component in self._variables:
            find_variable(component, self._variables[component], own)
        raise CouplingError(
            f"parameter {shortened(name)}: sets nothing: must be COMPONENT.VARIABLE or an input "
            "or parameter of the system"
        )

    def _passed(self, value: Value, way: list[Place]) -> Any:
        """A value as a variable takes it to which connections lead from a connector."""
        end, units = self._end(*way[-1]), self._units_on(way, None)
        for place, unit in zip(way[1:], units, strict=False):
            one, _ = self._feeds[place]
            with naming(one):
                inner = _changed(value, unit, end.is_difference)
            value = Value(value.kind, inner, unit, one.transformation, one.keeps_unit)
        return self._fitted(value, end)

    def _fitted(self, value: Value, end: End) -> Any:
        """A value as a variable takes it."""
        with naming(shortened(signal_name(end.component, end.name))):
            found = _changed(value, end.unit, end.is_difference)
        if isinstance(found, str) and end.type in FAMILIES:
            return number_of_word(end.component, end.variable, found)
        return found


def _check_length(way: Sequence[Place]) -> None:
    if len(way) > MOST_CONNECTORS:
        raise CouplingError(
            f"connector {shortened(signal_name(*way[0]))}: its connections lead back to it, or "
            f"through more than {MOST_CONNECTORS} connectors"
        )


def _check_connector(name: str, said: Connector, variable: Any, unit: Unit | None) -> None:
    """`CouplingError` where a connector contradicts the variable of its FMU."""
    own = kind_of(variable)
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
    given, wanted = source.type, sink.type
    transformation = connection.transformation
    if transformation is None:
        _check_types(source, sink)
    elif given not in _FROM[transformation.kind] or wanted not in _TO[transformation.kind]:
        kind = transformation.kind
        raise CouplingError(f"its transformation is of {kind} values, not of {given} to {wanted}")
    converted = None
    if wanted == "Real" and not connection.keeps_unit and None not in (source.unit, sink.unit):
        is_difference = source.is_difference or sink.is_difference
        converted = _conversion(source.unit, sink.unit, is_difference)
    if transformation is None:
        return converted
    if transformation.kind == "Linear":
        return chained(converted, transformation.change)
    return _by_table(source, sink, connection, transformation)


def _check_types(source: End, sink: End) -> None:
    """`CouplingError` where values would be rounded, or words change their meaning."""
    given, wanted = source.type, sink.type
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
