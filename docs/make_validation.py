"""Write the tables of docs/validation.md and its figures: `python -m docs.make_validation`.

Takes some seconds.
"""

from __future__ import annotations

from docs.blocks import DOCS, publish
from percussion_model.interface.plotting.validation import draw_all
from percussion_model.interface.progress import count_bar
from percussion_model.verification.measured import Comparison, compare, load, wanted
from percussion_model.verification.measured.table import NOTES, markdown

PAGE = DOCS / "validation.md"
DPI = 90


def block(found: Comparison) -> str:
    """The tables, what their columns are, and what could not be read."""
    lines = [f"- {note}" for note in NOTES]
    rows = [f"- {row['what']}: {row['where']}. Not had: {row['why']}." for row in wanted()]
    return "\n".join([*lines, "", *markdown(found), "### Wanted", "", *rows])


def main() -> None:
    """Compute, write the page and draw the figures."""
    with count_bar("fits") as progress:
        found = compare(load(), progress=progress)
    publish(
        {"tables": block(found)}, PAGE, dpi=DPI,
        figures=lambda: ((f"validation_{name}", figure) for name, figure in draw_all(found)),
    )  # fmt: skip


if __name__ == "__main__":
    main()
