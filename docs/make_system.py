"""Write the tables of signals and variables of the drilling system: `python -m docs.make_system`.

The signals stand in docs/system.md, the variables of the parts in docs/data/system_variables.md.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from docs.blocks import publish
from docs.drawings.system import SYSTEM, connected
from fmu_src.parts.build import PARTS, part_variables
from fmu_src.system.archive import read_plan
from fmu_src.variables import Variable
from percussion_model.simulation.markdown import table

PAGE = Path(__file__).with_name("system.md")
VARIABLES = Path(__file__).parent / "data" / "system_variables.md"
HEADINGS = ("name", "kind", "unit", "start", "range", "meaning")
HEAD = """# Variables of the drilling system

This page lists every input, output and parameter of the parts of a [drilling
system](../system.md). The hammer has [a page of its own](fmu_interface.md). Values are in SI units;
down is positive. Of the six layers of rock only the first is listed: the others have the same
variables, and are off until their `top` is set. `.venv/bin/python -m docs.make_system` writes this
page from the tables of the parts.
"""


def signals() -> str:
    """Table of the signals of the feed-controlled system, Markdown."""
    rows = []
    for source, sink, one in connected(read_plan(SYSTEM)):
        unit = (one.unit or "") if one else ""
        rows.append((f"`{source}`", f"`{sink}`", unit, one.description if one else ""))
    return table(("from", "to", "unit", "meaning"), rows)


def variables_page() -> str:
    """Text of the page of the variables of all parts."""
    lines = [HEAD.rstrip()]
    for name, part in PARTS.items():
        rows = [_cells(one) for one in part_variables(part) if not _repeated(one.name)]
        lines.append(f"\n## {name}\n\n{table(HEADINGS, rows)}")
    return "\n".join(lines) + "\n"


def _repeated(name: str) -> bool:
    """Whether it is a parameter of a layer after the first, which reads like the first."""
    return name.startswith("layers[") and not name.startswith("layers[1]")


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


if __name__ == "__main__":
    VARIABLES.parent.mkdir(exist_ok=True)
    VARIABLES.write_text(variables_page(), encoding="utf-8")
    publish({"signals": signals}, PAGE)
