"""Write the tables of docs/validation.md and its figures: `python -m docs.make_validation`.

Takes some seconds.
"""

from __future__ import annotations

from pathlib import Path

from percussion_model.interface.plotting.style import save_figures
from percussion_model.interface.plotting.validation import draw_all
from percussion_model.interface.progress import count_bar
from percussion_model.verification.measured import Comparison, compare, load, wanted
from percussion_model.verification.measured.table import NOTES, markdown

HERE = Path(__file__).resolve().parent
PAGE = HERE / "validation.md"
DPI = 90

BEGIN, END = "<!-- tables: begin -->", "<!-- tables: end -->"


def block(found: Comparison) -> str:
    """The tables, what their columns are, and what could not be read."""
    lines = [f"- {note}" for note in NOTES]
    rows = [f"- {row['what']}: {row['where']}. Not had: {row['why']}." for row in wanted()]
    return "\n".join([*lines, "", *markdown(found), "### Wanted", "", *rows])


def page(found: Comparison) -> str:
    """Text of the page with its tables renewed."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n\n{block(found)}\n\n{END}{after}"


def main() -> None:
    """Compute, write the page and draw the figures."""
    with count_bar("fits") as progress:
        found = compare(load(), progress=progress)
    PAGE.write_text(page(found), encoding="utf-8")
    save_figures(
        lambda: ((f"validation_{name}", figure) for name, figure in draw_all(found)),
        HERE / "images",
        kinds=("png",),
        dpi=DPI,
    )


if __name__ == "__main__":
    main()
