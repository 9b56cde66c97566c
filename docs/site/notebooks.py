"""Notebooks as pages: cells of text as they are, code and what it showed below it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from myst_parser.parsers.sphinx_ import MystParser
from sphinx.application import Sphinx

SUFFIX, KIND = ".ipynb", "notebook"


class NotebookParser(MystParser):
    """Reads the text of a notebook as the Markdown that it stands for."""

    supported = (KIND,)

    def parse(self, inputstring: str, document: nodes.document) -> None:
        """As docutils calls it."""
        super().parse(to_markdown(json.loads(inputstring)), document)


def to_markdown(notebook: dict[str, Any]) -> str:
    """Text of a page."""
    parts = []
    for cell in notebook["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        language = "sh" if source.startswith("!") else "python"
        parts.append(fenced(language, source.removeprefix("!")))
        for output in cell["outputs"]:
            parts += shown(output)
    return "\n\n".join(parts) + "\n"


def shown(output: dict[str, Any]) -> Iterator[str]:
    """What a cell showed: a picture before a table, and that before text."""
    found = output.get("data", {"text/plain": output.get("text", "")})
    for kind in ("image/png", "text/html", "text/plain"):
        if kind in found:
            text = "".join(found[kind])
            break
    if kind == "image/png":
        yield f"![](data:image/png;base64,{text.strip()})"
    elif kind == "text/html":
        yield fenced("{raw} html", text)
    else:
        yield fenced("text", text)


def fenced(language: str, text: str) -> str:
    """A block of code."""
    return f"````{language}\n{text.rstrip()}\n````"


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect the extension."""
    app.add_source_suffix(SUFFIX, KIND)
    app.add_source_parser(NotebookParser)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
