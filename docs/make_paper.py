"""Write docs/data/paper_statements.md and the figures of docs/paper.md.

`python -m docs.make_paper FOLDER` takes them from the folder of `percussion paper --out FOLDER`.
"""

from __future__ import annotations

import json
import shutil
import sys
from itertools import groupby
from pathlib import Path
from typing import Any

from percussion_model.simulation.markdown import table

HERE = Path(__file__).resolve().parent
PAGE = HERE / "data" / "paper_statements.md"
HEADINGS = ("place", "the paper", "found", "agrees", "it must be")
FIGURES = ("figures4and7", "sinking", "figure6", "figures7and8", "figure9", "scaling")

HEAD = """# Statements of the paper

Read this page to look up what the program finds for a statement of Depouhon, Denoël and Detournay
(2014). `percussion paper` writes these numbers, and [the paper again](../paper.md) discusses them.

{agree} of {all} statements agree. {errors}
"""


def page(found: dict[str, Any]) -> str:
    """Text of the page: a table for each section of the paper."""
    statements = found["statements"]
    agree = sum(one["agrees"] for one in statements)
    parts = [HEAD.format(agree=agree, all=len(statements), errors=found["errors"])]
    for section, ones in groupby(statements, key=section_of):
        parts += [f"## {section}\n\n{table(HEADINGS, map(cells, ones))}\n"]
    return "\n".join(parts)


def section_of(one: dict[str, Any]) -> str:
    """The section of the paper, or the table, that a statement is from."""
    number, _, _ = one["place"].partition(",")[0].partition(" ")
    return f"Section {number}" if number[0].isdigit() else one["place"]


def cells(one: dict[str, Any]) -> list[str]:
    """A row of a table, with the reason where a statement differs."""
    agrees = "yes" if one["agrees"] else f"**no**: {one['why']}"
    row = (one["place"], one["says"], one["found"], agrees, one["agrees_if"])
    return [text.replace("|", "/") for text in row]


def main(folder: Path) -> None:
    """Write the page and copy the figures."""
    found = json.loads((folder / "statements.json").read_text(encoding="utf-8"))
    PAGE.write_text(page(found), encoding="utf-8")
    for name in FIGURES:
        shutil.copyfile(folder / f"{name}.png", HERE / "images" / f"paper_{name}.png")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("name the folder of `percussion paper`: python -m docs.make_paper FOLDER")
    main(Path(sys.argv[1]))
