"""Write docs/data/hammers.md from the hammers that are stored: `python -m docs.make_hammers`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from textwrap import fill

from percussion_model.interface.commands.hammers import HEADINGS, NOTE, cells, number_cells
from percussion_model.scene.hammers.library import (
    StoredHammer,
    sources,
    stored_hammer,
    stored_hammers,
)
from percussion_model.simulation.markdown import table

PAGE = Path(__file__).parent / "data" / "hammers.md"
HEAD = f"""# Hammers on the market

What makers tell of hammers down the hole and of top hammers, number by number. `percussion hammers`
prints this table, `percussion hammers NAME` all of one. In Python: `stored_hammer("hc-25")` of
`percussion_model.scene.hammers.library`. They are data, no scenes; [sources of the
scenes](hammer_sources.md) are another page.

{fill(NOTE, 110)}

`python -m docs.make_hammers` writes this page from the files in
`percussion_model/scene/hammers/library`.
"""


def numbers(one: StoredHammer) -> Iterable[tuple[str, ...]]:
    """Rows of the table of one hammer, and of what follows from its numbers."""
    for number in one.figures:
        named, text = number_cells(number, number.at)
        yield named, text, number.kind, number.source, number.why
    for other in one.consistency:
        yield *number_cells(other), "follows", "", other.why


def section(one: StoredHammer) -> str:
    """Heading, table and note of one hammer."""
    rows = table(("number", "value", "kind", "source", "remark"), numbers(one))
    scene = f" Scene `{one.scene}`." if one.scene else ""
    note = f" {one.note}" if one.note else ""
    return f"\n## {one.title}\n\n`{one.name}`, driven by {one.kind}.{scene}{note}\n\n{rows}"


def page() -> str:
    """Text of the page."""
    chosen = [stored_hammer(name) for name in stored_hammers()]
    rows = [(f"`{name}`", *rest) for name, *rest in map(cells, chosen)]
    read = [
        (key, one["cited"], one["read_in"], "yes" if one["second_hand"] else "no")
        for key, one in sources().items()
    ]
    lines = [
        HEAD,
        table(HEADINGS, rows),
        *map(section, chosen),
        "\n## Sources\n",
        table(("name", "cited", "read in", "second hand"), read),
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
