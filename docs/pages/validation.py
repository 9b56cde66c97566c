"""Published experiments beside computed ones."""

from __future__ import annotations

from docs.blocks import Made
from percussion_model.interface.plotting.validation import draw_all
from percussion_model.interface.progress import count_bar
from percussion_model.verification.measured import Comparison, compare, load, wanted
from percussion_model.verification.measured.table import NOTES, markdown


def block(found: Comparison) -> str:
    """The tables, what their columns are, and what could not be read."""
    lines = [f"- {note}" for note in NOTES]
    rows = [f"- {row['what']}: {row['where']}. Not had: {row['why']}." for row in wanted()]
    return "\n".join([*lines, "", *markdown(found), "### Wanted", "", *rows])


def made() -> Made:
    """Compute."""
    with count_bar("fits") as progress:
        found = compare(load(), progress=progress)
    return Made(
        ("data/validation.md",), {"tables": block(found)}, dpi=90,
        figures=lambda: ((f"validation_{name}", figure) for name, figure in draw_all(found)),
    )  # fmt: skip
