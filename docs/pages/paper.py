"""Statements and figures of the paper, from FOLDER of `percussion paper --out FOLDER`."""

from __future__ import annotations

import json
import shutil
from itertools import groupby
from pathlib import Path
from typing import Any

from docs.blocks import IMAGES, Made
from percussion_model.simulation.markdown import table

HEADINGS = ("place", "the paper", "found", "agrees", "it must be")
FIGURES = ("figures4and7", "sinking", "figure6", "figures7and8", "figure9", "scaling")


def tables(statements: list[dict[str, Any]]) -> str:
    """A table for each section of the paper."""
    parts = [
        f"## {section}\n\n{table(HEADINGS, map(cells, ones))}"
        for section, ones in groupby(statements, key=section_of)
    ]
    return "\n\n".join(parts)


def section_of(one: dict[str, Any]) -> str:
    """The section of the paper, or the table, that a statement is from."""
    number, _, _ = one["place"].partition(",")[0].partition(" ")
    return f"Section {number}" if number[0].isdigit() else one["place"]


def cells(one: dict[str, Any]) -> list[str]:
    """A row of a table, with the reason where a statement differs."""
    agrees = "yes" if one["agrees"] else f"**no**: {one['why']}"
    row = (one["place"], one["says"], one["found"], agrees, one["agrees_if"])
    return [text.replace("|", "/") for text in row]


def made(folder: str) -> Made:
    """The page, and the figures of the folder."""
    found = json.loads((Path(folder) / "statements.json").read_text(encoding="utf-8"))
    for name in FIGURES:
        shutil.copyfile(Path(folder) / f"{name}.png", IMAGES / f"paper_{name}.png")
    statements = found["statements"]
    agree = sum(one["agrees"] for one in statements)
    count = f"{agree} of {len(statements)} statements agree. {found['errors']}"
    blocks = {"count": count, "statements": tables(statements)}
    return Made(("data/paper_statements.md",), blocks)
