"""The table of all parameters, read off the fields of `percussion_model.scene.parameters`.

Everything that lists parameters reads this: error messages, commented scenes,
the command line's help and the docs.
"""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from percussion_model.scene.fields import Needs, Parameters
from percussion_model.scene.parameters import GROUPS, Section
from percussion_model.scene.rows import Kind, Row, generic_key

_NO_NEEDS: Needs = {}


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
