"""The table of all parameters, read off the fields of `percussion_model.parameters`.

Everything that lists parameters reads this: error messages, commented scenes,
the command line's help and the docs.
"""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, Union, get_args, get_origin

import tomli_w
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from percussion_model.parameter_fields import Needs, Parameters
from percussion_model.parameters import GROUPS, Section

Kind = Literal["number", "whole number", "flag", "choice", "sections"]

_NO_NEEDS: Needs = {}


@dataclass(frozen=True)
class Row:
    """One parameter.

    Keys of sections have a `*` for the number of the section, counted from 0.
    """

    key: str
    kind: Kind
    unit: str
    lower: float | None
    lower_open: bool  # the bound itself is not allowed
    upper: float | None
    upper_open: bool
    default: Any
    required: bool
    choices: tuple[Any, ...]
    description: str
    needs: Mapping[str, tuple[Any, ...]]

    @property
    def allowed(self) -> str:
        """Say what values are allowed, as in "a number above 0 and up to 10 m^2"."""
        if self.kind == "flag":
            return "true or false"
        if self.kind == "choice":
            return "one of " + ", ".join(toml_value(choice) for choice in self.choices)
        if self.kind == "sections":
            return "a list of at least one section, each with length and area"
        return f"a {self.kind} {self._range()}{unit_suffix(self.unit)}".rstrip()

    def _range(self) -> str:
        if self.lower is None or self.upper is None:
            return ""
        if self.lower_open or self.upper_open:
            start = "above" if self.lower_open else "from"
            end = "below" if self.upper_open else "up to"
            return f"{start} {_short(self.lower)} and {end} {_short(self.upper)}"
        return f"from {_short(self.lower)} to {_short(self.upper)}"

    @property
    def effect(self) -> str:
        """Say what must be on for this parameter to matter; empty if it always does."""
        parts = []
        for key, values in self.needs.items():
            parts.append(f"{key} = " + " or ".join(toml_value(value) for value in values))
        return ", ".join(parts)


def _short(number: float) -> str:
    """Write a bound without needless digits, as in 1e9."""
    return f"{number:g}".replace("e+0", "e").replace("e+", "e").replace("e-0", "e-")


def unit_suffix(unit: str) -> str:
    """Return the unit as it follows a number, nothing for pure numbers."""
    return f" {unit}" if unit not in ("", "-") else ""


def toml_value(value: object) -> str:
    """Write a value as in a TOML file."""
    text = tomli_w.dumps({"_": value}).strip()
    return text.removeprefix("_ = ")


@cache
def parameter_table() -> tuple[Row, ...]:
    """Return a row for each parameter, in the order of a scene file."""
    return tuple(row for group, model in GROUPS.items() for row in _rows(group, model))


@cache
def rows_by_key() -> Mapping[str, Row]:
    """Return the rows of `parameter_table` by their dotted keys."""
    return {row.key: row for row in parameter_table()}


def find_row(key: str) -> Row | None:
    """Find the row of a dotted key, `piston.sections.0.length` included."""
    return rows_by_key().get(generic_key(key))


def generic_key(key: str) -> str:
    """Replace the numbers of sections in a dotted key by `*`."""
    return ".".join("*" if part.isdigit() else part for part in key.split("."))


def _rows(prefix: str, model: type[Parameters]) -> Iterator[Row]:
    for name, field in model.model_fields.items():
        row = _row(f"{prefix}.{name}", field)
        yield row
        if row.kind == "sections":
            yield from _rows(f"{row.key}.*", Section)


def _row(key: str, field: FieldInfo) -> Row:
    extra: Any = field.json_schema_extra or {}
    kind, choices = _kind(field.annotation)
    bounds = {
        name: float(value)
        for constraint in field.metadata
        for name in ("gt", "ge", "lt", "le")
        if (value := getattr(constraint, name, None)) is not None
    }
    required = field.default is PydanticUndefined
    return Row(
        key=key,
        kind=kind,
        unit=extra.get("unit", ""),
        lower=bounds.get("gt", bounds.get("ge")),
        lower_open="gt" in bounds,
        upper=bounds.get("lt", bounds.get("le")),
        upper_open="lt" in bounds,
        default=None if required else field.default,
        required=required,
        choices=choices,
        description=field.description or "",
        needs=extra.get("needs", _NO_NEEDS),
    )


def _kind(annotation: Any) -> tuple[Kind, tuple[Any, ...]]:
    if get_origin(annotation) in (Union, types.UnionType):
        (annotation,) = (one for one in get_args(annotation) if one is not type(None))
    if get_origin(annotation) is Literal:
        return "choice", get_args(annotation)
    kinds: dict[Any, Kind] = {bool: "flag", int: "whole number", float: "number"}
    return kinds.get(annotation, "sections"), ()
