"""What is made of pages: blocks between `<!-- begin NAME -->` and `<!-- end -->`, and figures."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from matplotlib.figure import Figure

DOCS = Path(__file__).resolve().parent
IMAGES = DOCS / "images"
REFERENCE = DOCS.parent / "scenarios" / "reference.toml"
BLOCK = re.compile(r"(<!-- begin (\w+) -->)\n.*?(<!-- end -->)", re.DOTALL)


@dataclass(frozen=True)
class Made:
    """What a module of `docs/pages` makes."""

    pages: tuple[str, ...] = ()  # files within docs/ that have the blocks
    blocks: Mapping[str, str | Callable[[], str]] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)  # of whole files within docs/
    figures: Callable[[], Iterable[tuple[str, Figure]]] | None = None  # with their names
    dpi: float | None = None
    kinds: tuple[str, ...] = ("png",)

    def files(self) -> dict[Path, str]:
        """Texts of all files as they should be."""
        whole = {DOCS / name: text for name, text in self.texts.items()}
        return whole | {DOCS / name: renewed(DOCS / name, self.blocks) for name in self.pages}


def renewed(page: Path, blocks: Mapping[str, str | Callable[[], str]]) -> str:
    """Text of a page with its blocks made anew, by their names.

    Raises
    ------
    KeyError
        If the page has a block of another name.
    """

    def made(found: re.Match[str]) -> str:
        block = blocks[found[2]]
        return f"{found[1]}\n{block if isinstance(block, str) else block()}\n{found[3]}"

    return BLOCK.sub(made, page.read_text(encoding="utf-8"))
