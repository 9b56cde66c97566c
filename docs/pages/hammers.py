"""Hammers that are stored, number by number."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import fill

from docs.blocks import Made
from percussion_model.interface.commands.hammers import HEADINGS, NOTE, cells, number_cells
from percussion_model.scene.hammers.library import (
    StoredHammer,
    sources,
    stored_hammer,
    stored_hammers,
)
from percussion_model.simulation.markdown import table


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


def tables() -> str:
    """All hammers in one table, each in its own, and sources."""
    chosen = [stored_hammer(name) for name in stored_hammers()]
    rows = [(f"`{name}`", *rest) for name, *rest in map(cells, chosen)]
    read = [
        (key, one["cited"], one["read_in"], "yes" if one["second_hand"] else "no")
        for key, one in sources().items()
    ]
    lines = [
        table(HEADINGS, rows),
        *map(section, chosen),
        "\n## Sources\n",
        table(("name", "cited", "read in", "second hand"), read),
    ]
    return "\n".join(lines)


def made() -> Made:
    """The note and the tables."""
    return Made(("data/hammers.md",), {"note": fill(NOTE, 110), "hammers": tables})
