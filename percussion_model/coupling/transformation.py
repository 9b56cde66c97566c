"""What SSP does to a value on its way: units, a linear transformation, a table."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from percussion_model.coupling.component import CouplingError
from percussion_model.coupling.ssp_units import Linear
from percussion_model.coupling.ssp_xml import elements, is_true, word_of
from percussion_model.scene.rows import shortened

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
