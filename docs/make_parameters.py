"""Write docs/parameters.md from the parameter table: `python docs/make_parameters.py`."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from percussion_model.scene.parameters import parameter_table
from percussion_model.scene.rows import Row, toml_value

HEAD = """# Parameters

Every key of a scene file, with its unit, its default and what is allowed. All are SI.
Any of them can be set on the command line, as in `--set rock.unloading_ratio=10`; sections
and rods are counted from 0, as in `--set piston.sections.0.length=0.2`. All bars may be given
as one list instead, `[[bars]]`, from the drive to the rock: the first is the piston, the last
the bit, and those between them are `string.rods`.

This page is written by `python docs/make_parameters.py`; change
`percussion_model/scene/parameters.py` or `bar_groups.py` instead.
"""


def default(row: Row) -> str:
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


def allowed(row: Row) -> str:
    """What is allowed, without the unit, which has its own column."""
    if row.kind == "choice":
        return ", ".join(f"`{toml_value(choice)}`" for choice in row.choices)
    return row.allowed.removesuffix(f" {row.unit}") if row.unit else row.allowed


def page() -> str:
    """Text of the page."""
    parts = [HEAD]
    for group, rows in groupby(parameter_table(), key=lambda row: row.key.split(".")[0]):
        parts.append(f"\n## {group}\n")
        parts.append("| key | meaning | unit | default | allowed | matters if |")
        parts.append("|---|---|---|---|---|---|")
        for row in rows:
            key = row.key.replace("*", "N")
            needs = f"`{row.effect}`" if row.effect else ""
            cells = (f"`{key}`", row.description, row.unit, default(row), allowed(row), needs)
            parts.append("| " + " | ".join(cells) + " |")
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    Path(__file__).with_name("parameters.md").write_text(page(), encoding="utf-8")
