"""Write docs/parameters.md from the parameter table: `python -m docs.make_parameters`."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from percussion_model.scene.parameters import HOLE_DIAMETER, parameter_table
from percussion_model.scene.rows import ParameterRow, short_number, toml_value
from percussion_model.simulation.markdown import table

HEAD = """# Parameters

Every key of a scene file, with its unit, its default and what is allowed. A plain number is in
SI. A number may also have its unit, as text: `force = "5 kN"`, `"1124 lbf"`, `"0.75 GN/m"`; scenes
that are written out are in SI.
Any of them can be set on the command line, as in `--set rock.unloading_ratio=10` or
`--set feed.force=5kN`; sections
and rods are counted from 0, as in `--set piston.sections.0.length=0.2` (in FMUs from 1:
`piston.sections[1].length`). All bars may be given
as one list instead, `[[bars]]`, from the drive to the rock: the first is the piston, the last
the bit, and those between them are `string.rods`.

*Typical* is the range of the [sources of hammers](data/hammer_sources.md), of the paper and of
steel. It is no bound. Commands hint, once for each key, at a value ten times beyond, since that is
mostly a slip of the unit.

This page is written by `python -m docs.make_parameters`; change
`percussion_model/scene/parameters.py` or `bar_groups.py` instead.

One key stands before all tables, beside `title`. No solver takes it, and FMUs do not have it.
"""

HEADINGS = ("key", "meaning", "unit", "default", "allowed", "typical", "matters if")


def default(row: ParameterRow) -> str:
    """How the default is shown."""
    if row.required:
        return "required"
    if row.default is None:
        return "left out"
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


def page() -> str:
    """Text of the page."""
    parts = [HEAD, table(HEADINGS, [cells(HOLE_DIAMETER)])]
    for group, rows in groupby(parameter_table(), key=lambda row: row.key.split(".")[0]):
        parts.append(f"\n## {group}\n\n{table(HEADINGS, map(cells, rows))}")
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    Path(__file__).with_name("parameters.md").write_text(page(), encoding="utf-8")
