"""Equations as MathML, which browsers show by themselves: no script, nothing to fetch."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

TAG = re.compile(r"\\tag\{([^}]*)\}")


def _inline(writer: Any, node: nodes.Element) -> None:
    writer.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.Element) -> None:
    """Write an equation, and its number at the right where it has one."""
    latex = node.astext()
    tag = TAG.search(latex)
    number = f'<span class="equation-number">({tag[1]})</span>' if tag else ""
    anchor = f' id="equation-{tag[1]}"' if tag else ""
    formula = convert(TAG.sub("", latex), display="block")
    writer.body.append(f'<div class="equation"{anchor}>{formula}{number}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer with Sphinx."""
    app.add_html_math_renderer(
        "mathml", inline_renderers=(_inline, None), block_renderers=(_block, None)
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}
