"""Every key of a scene file, from the parameter table."""

from __future__ import annotations

from itertools import groupby

from docs.blocks import Made
from percussion_model.scene.parameters import HOLE_DIAMETER, parameter_table
from percussion_model.scene.rows import ParameterRow, short_number, toml_value
from percussion_model.simulation.markdown import table

HEADINGS = ("key", "meaning", "unit", "default", "allowed", "typical", "matters if")


def default(row: ParameterRow) -> str:
    """How the default is shown."""
    if row.required:
        return "required"
    if row.default is None:
        return "not set"
    if row.kind == "sections":
        return "one, as in the reference scene"
    if row.kind == "rods":
        return "none"
    if row.kind == "number":
        return f"{row.default:.10g}"
    return f"`{toml_value(row.default)}`"


def allowed(row: ParameterRow) -> str:
    """What is allowed, without the unit, which has its own column."""
    if row.kind == "choice":
        return ", ".join(f"`{toml_value(choice)}`" for choice in row.choices)
    return row.allowed.removesuffix(f" {row.unit}") if row.unit else row.allowed


def typical(row: ParameterRow) -> str:
    """The range that sources have; nothing where they have none."""
    if row.typical is None:
        return ""
    low, high = map(short_number, row.typical)
    return f"{low} to {high}"


def cells(row: ParameterRow) -> tuple[str, ...]:
    """A row of a table of parameters."""
    key, needs = row.key.replace("*", "N"), f"`{row.effect}`" if row.effect else ""
    shown = default(row), allowed(row), typical(row), needs
    return f"`{key}`", row.description, row.unit, *shown


def tables() -> str:
    """A table for each group of parameters."""
    parts = [table(HEADINGS, [cells(HOLE_DIAMETER)])]
    for group, rows in groupby(parameter_table(), key=lambda row: row.key.split(".")[0]):
        parts.append(f"\n## {group}\n\n{table(HEADINGS, map(cells, rows))}")
    return "\n".join(parts)


def made() -> Made:
    """The tables."""
    return Made(("parameters.md",), {"parameters": tables})
