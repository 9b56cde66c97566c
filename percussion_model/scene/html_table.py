"""Tables in HTML, which notebooks show in place of an object's `repr`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from percussion_model.scene.rows import toml_value

if TYPE_CHECKING:
    from percussion_model.scene.scene import Scene


def html_table(title: str, about: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A title, a sentence and a table; all texts are plain."""
    body = "".join(_row("td", row) for row in rows)
    table = f"<table><thead>{_row('th', heads)}</thead><tbody>{body}</tbody></table>"
    return f"<p><strong>{escape(title)}</strong><br>{escape(about)}</p>{table if body else ''}"


def _row(kind: str, cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{kind}>{escape(one)}</{kind}>" for one in cells) + "</tr>"


def scene_html(scene: Scene) -> str:
    """Solver, effects that are on, and the parameters that are not those of the reference."""
    about = f"solver: {scene.solver_name}; effects: {', '.join(scene.effects_on)}"
    own = [key for key in sorted(scene.given) if scene[key] != scene.row_of(key).default]
    rows = [
        (key, _shown(scene[key]), scene.row_of(key).unit, scene.row_of(key).description)
        for key in own
    ]
    if not rows:
        about += "; all parameters are those of the reference"
    return html_table(
        scene.title or "Scene", about, ("parameter", "value", "unit", "meaning"), rows
    )


def _shown(value: Any) -> str:
    """A value as a scene file has it; of sections and rods their number."""
    return f"{len(value)} in a list" if isinstance(value, tuple) else toml_value(value)
