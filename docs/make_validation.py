"""Write the tables of docs/validation.md and its figures: `python -m docs.make_validation`.

Takes some seconds.
"""

from __future__ import annotations

from pathlib import Path

from docs.blocks import renewed
from percussion_model.interface.plotting.style import save_figures
from percussion_model.interface.plotting.validation import draw_all
from percussion_model.interface.progress import count_bar
from percussion_model.verification.measured import Comparison, compare, load, wanted
from percussion_model.verification.measured.table import NOTES, markdown

HERE = Path(__file__).resolve().parent
PAGE = HERE / "validation.md"
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
    PAGE.write_text(renewed(PAGE, {"tables": block(found)}), encoding="utf-8")
    save_figures(
        lambda: ((f"validation_{name}", figure) for name, figure in draw_all(found)),
        HERE / "images",
        kinds=("png",),
        dpi=DPI,
    )


if __name__ == "__main__":
    main()
