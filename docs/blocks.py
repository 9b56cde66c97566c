"""Pages whose blocks are made anew.

A block stands between `<!-- begin NAME -->` and `<!-- end -->`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from matplotlib.figure import Figure

from percussion_model.interface.plotting.style import save_figures
from percussion_model.scene.text import write_text

DOCS = Path(__file__).resolve().parent
BLOCK = re.compile(r"(<!-- begin (\w+) -->)\n.*?(<!-- end -->)", re.DOTALL)


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


def publish(
    blocks: Mapping[str, str | Callable[[], str]],
    *pages: Path,
    figures: Callable[[], Iterable[tuple[str, Figure]]] | None = None,
    dpi: float | None = None,
) -> None:
    """Write pages with their blocks made anew, and draw figures into docs/images."""
    if figures is not None:
        save_figures(figures, DOCS / "images", ("png",), dpi=dpi)
    for page in pages:
        write_text(page, renewed(page, blocks))
