"""Pages whose blocks are made anew.

A block stands between `<!-- begin NAME -->` and `<!-- end -->`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path

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
