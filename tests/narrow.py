"""What is wrong with text in a terminal of 80 columns."""

from __future__ import annotations

import io
import re

from rich.console import Console
from rich.table import Table

WIDTH = 80


def faults(text: str) -> list[str]:
    """Lines that are too long, but for one word like a path, or in which something was cut off."""
    return [
        line
        for line in text.splitlines()
        if (len(line.rstrip()) > WIDTH and len(line.split()) > 1) or re.search(r"…|\w\.\.\.", line)
    ]


def words(text: str) -> set[str]:
    """Words of a text, frames of tables left out."""
    return set(re.sub(r"[─-╿]", " ", text).split())


class Printed:
    """Words of everything that rich was given to print, as it was given."""

    def __init__(self, monkeypatch) -> None:
        self.words: set[str] = set()
        whole, original = Console(file=io.StringIO(), width=WIDTH), Console.print

        def note(console, *objects, **options):
            for one in objects:
                cells = [one]
                if isinstance(one, Table):
                    cells = [one.title or ""]
                    for column in one.columns:
                        cells += [column.header, *column.cells]
                for cell in cells:
                    if isinstance(cell, str):
                        self.words |= words(whole.render_str(cell).plain)
            original(console, *objects, **options)

        monkeypatch.setenv("COLUMNS", str(WIDTH))
        monkeypatch.setattr(Console, "print", note)

    def broken(self, text: str) -> set[str]:
        """Words that do not stand in the text, which was printed."""
        return self.words - words(text)
