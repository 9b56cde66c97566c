"""Signals of the drilling system, and variables of its parts."""

from __future__ import annotations

from typing import Any

from docs.blocks import Made
from docs.drawings.system import SYSTEM, connected
from fmu_src.parts.build import PARTS, part_variables
from fmu_src.system.archive import read_plan
from fmu_src.variables import Variable
from percussion_model.simulation.markdown import table

HEADINGS = ("name", "kind", "unit", "start", "range", "meaning")


def signals() -> str:
    """Table of the signals of the feed-controlled system, Markdown."""
    rows = []
    for source, sink, one in connected(read_plan(SYSTEM)):
        unit = (one.unit or "") if one else ""
        rows.append((f"`{source}`", f"`{sink}`", unit, one.description if one else ""))
    return table(("from", "to", "unit", "meaning"), rows)


def variables() -> str:
    """Tables of the variables of all parts, Markdown."""
    parts = []
    for name, part in PARTS.items():
        rows = [_cells(one) for one in part_variables(part) if not _repeated(one.name)]
        parts.append(f"## {name}\n\n{table(HEADINGS, rows)}")
    return "\n\n".join(parts)


def _repeated(name: str) -> bool:
    """Whether it is one of a row after the first, which reads like the first, as of layers."""
    return "[" in name and "[1]" not in name


def _cells(one: Variable) -> tuple[str, ...]:
    start: Any = "" if one.start is None else one.start
    span = ""
    if one.items:
        start, span = one.items[0][0], ", ".join(word for word, _, _ in one.items)
    elif one.type == "Boolean" and one.start is not None:
        start = str(one.start).lower()
    elif one.lower is not None:
        start, span = f"{one.start:g}", f"{one.lower:g} … {one.upper:g}"
    return f"`{one.name}`", one.causality, one.unit or "", str(start), span, one.description


def made() -> Made:
    """Both pages."""
    pages = ("system.md", "data/system_variables.md")
    return Made(pages, {"signals": signals, "variables": variables})
