"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], left: Collection[str] | None = None
) -> str:
    """Markdown of a table; all columns but those of the headings `left` stand at the right.

    All stand at the left where it is None.
    """
    marks = ["---" if left is None or one in left else "---:" for one in head]
    lines = [f"| {' | '.join(row)} |" for row in (head, *rows)]
    return "\n".join([lines[0], f"|{'|'.join(marks)}|", *lines[1:]])
