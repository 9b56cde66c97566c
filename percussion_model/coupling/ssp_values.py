"""Values that an SSP archive binds to its parts, and what it does to values on their way."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from percussion_model.coupling.component import CouplingError
from percussion_model.coupling.ssp_units import Linear, Unit, unit_named, units_of
from percussion_model.coupling.ssp_xml import Reader, elements, is_true, tag, validated, word_of
from percussion_model.scene.rows import shortened

SET, MAPPING = "application/x-ssp-parameter-set", "application/x-ssp-parameter-mapping"
_READ: dict[str, Callable[[str], Any]] = {
    "Real": float, "Integer": int, "Boolean": is_true, "Enumeration": str, "String": str
}  # fmt: skip
Change = Callable[[Any], Any]
_ENTRIES: dict[str, Callable[[str], Any]] = {
    "Boolean": is_true, "Integer": int, "Enumeration": str
}  # fmt: skip


class Transformation(NamedTuple):
    """A transformation of a connection or of an entry of a mapping.

    Attributes
    ----------
    kind : str
        "Linear", or the type of the entries of a table: "Boolean", "Integer", "Enumeration".
    linear : Linear
    table : dict
        Target by source.
    """

    kind: str
    linear: Linear
    table: dict[Any, Any]

    def change(self, value: Any) -> Any:
        """What a value becomes; `CouplingError` for one that the table does not have."""
        if self.kind == "Linear":
            return self.linear(value)
        try:
            return self.table[value]
        except KeyError:
            known = shortened(", ".join(map(str, self.table)))
            raise CouplingError(
                f"{shortened(str(value))} is not in its {self.kind}MappingTransformation, which "
                f"has {known}"
            ) from None


def transformation_of(node: Any) -> Transformation | None:
    """Transformation that stands in a connection, or in an entry of a mapping."""
    found = [one for one in elements(node, "*") if word_of(one).endswith("Transformation")]
    if not found:
        return None
    (one,) = found
    kind = word_of(one).removesuffix("Transformation").removesuffix("Mapping")
    if kind == "Linear":
        linear = Linear(float(one.get("factor", 1.0)), float(one.get("offset", 0.0)))
        if not (math.isfinite(linear.gain) and math.isfinite(linear.shift)):
            raise CouplingError(
                f"LinearTransformation: factor = {linear.gain}, offset = {linear.shift}: must be "
                "finite"
            )
        return Transformation(kind, linear, {})
    read, table = _ENTRIES[kind], {}
    for entry in elements(one, "ssc:MapEntry"):
        source = read(entry.get("source"))
        if source in table:
            raise CouplingError(f"{kind}MappingTransformation: has {source} twice")
        table[source] = read(entry.get("target"))
    return Transformation(kind, Linear(), table)


def chained(first: Change | None, second: Change | None) -> Change | None:
    """What does one change after the other, None where there is none."""
    if first is None or second is None:
        return first or second
    return lambda value: second(first(value))


class Value(NamedTuple):
    """A value of a parameter set, with what is to become of it.

    Attributes
    ----------
    kind : str
        Type in the words of SSP.
    value : float, int, bool or str
    unit : Unit or None
    transformation : Transformation or None
        Of the mapping.
    keeps_unit : bool
        Whether no unit is converted.
    """

    kind: str
    value: Any
    unit: Unit | None = None
    transformation: Transformation | None = None
    keeps_unit: bool = False


def bound_values(node: Any, reader: Reader, units: dict[str, Unit]) -> dict[str, Value]:
    """Values of all bindings of a component or a system; of two of a name the last.

    Parameters
    ----------
    node : element
    reader : Reader
    units : dict
        Those that the structure defines, by name.
    """
    found: dict[str, Value] = {}
    for binding in elements(node, "ssd:ParameterBindings/ssd:ParameterBinding"):
        given = _content(binding, "ssd:ParameterValues", "ssv", SET, reader)
        if given is None:
            raise CouplingError("ParameterBinding: has neither a source nor ParameterValues")
        prefix = binding.get("prefix", "")
        values = {prefix + name: one for name, one in _parameters(given, units).items()}
        for mapping in elements(binding, "ssd:ParameterMapping"):
            entries = _content(mapping, ".", "ssm", MAPPING, reader)
            if entries is None:
                raise CouplingError("ParameterMapping: has neither a source nor entries")
            values = _mapped(values, entries)
        found |= values
    return found


def _content(node: Any, path: str, space: str, kind: str, reader: Reader) -> Any:
    """Parameter set or mapping that an element names or holds, None without one."""
    name, source = word_of(node), node.get("source")
    for key, allowed in (("type", kind), ("sourceBase", "SSD")):
        if node.get(key, allowed) != allowed:
            raise CouplingError(f"{name}: {key} = {shortened(node.get(key))}: must be {allowed}")
    inside = [one for place in elements(node, path) for one in elements(place, "*")]
    if name == "ParameterMapping":
        inside = [one for one in inside if word_of(one) != "Annotations"]
    if source is not None:
        if inside:
            raise CouplingError(f"{name}: has a source, {shortened(source)}, and values besides")
        return reader.file(source, space)
    if not inside:
        return None
    wanted = {"ssv": "ParameterSet", "ssm": "ParameterMapping"}[space]
    if len(inside) > 1 or inside[0].tag != tag(space, wanted):
        raise CouplingError(f"{name}: must hold one {space}:{wanted}, no {word_of(inside[0])}")
    return validated(inside[0], f"{space}:{wanted} of a {name}", space)


def _parameters(node: Any, units: dict[str, Unit]) -> dict[str, Value]:
    """Values of a parameter set by name; its own units go before those of the structure."""
    known = units | units_of(node, "ssv:Units/ssc:Unit")
    found: dict[str, Value] = {}
    for one in elements(node, "ssv:Parameters/ssv:Parameter"):
        name, content = one.get("name"), elements(one, "*")[0]
        kind, text = word_of(content), content.get("value")
        if name in found:
            raise CouplingError(f"parameter {shortened(name)}: stands twice in its set")
        if kind not in _READ:
            raise CouplingError(f"parameter {shortened(name)}: {kind} is no type of FMI 2.0")
        value = _READ[kind](text)
        if kind == "Real" and not math.isfinite(value):
            raise CouplingError(f"parameter {shortened(name)} = {text}: must be a finite number")
        found[name] = Value(kind, value, unit_named(content.get("unit"), known))
    return found


def _mapped(values: dict[str, Value], node: Any) -> dict[str, Value]:
    """Values by the names that a mapping gives them; those that it leaves out are not applied."""
    found: dict[str, Value] = {}
    for one in elements(node, "ssm:MappingEntry"):
        source, target = one.get("source"), one.get("target")
        if not source:
            continue  # a form that was not filled in
        if target in found:
            raise CouplingError(f"mapping to {shortened(target)}: there are two")
        if source not in values:
            raise CouplingError(f"mapping of {shortened(source)}: its set has no such parameter")
        found[target] = values[source]._replace(
            transformation=transformation_of(one),
            keeps_unit=is_true(one.get("suppressUnitConversion")),
        )
    return found
