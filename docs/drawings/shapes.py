"""Arrows, boxes and labels that all drawings share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch
from matplotlib.text import Text

Place = tuple[float, float]
INK = "#222222"
NOTE = "#595959"
SMALL = 8.0
# Boxes of texts have a margin: they may overlap by so much [pixel].
TOUCHING = 1.0


def blank(ax: Axes, width: float, height: float, equal: bool = False) -> None:
    """Make axes a sheet of that size, its origin at the upper left, without frame or ticks."""
    ax.set_xlim(0.0, width)
    ax.set_ylim(height, 0.0)
    ax.set_axis_off()
    if equal:
        ax.set_aspect("equal", adjustable="box")


def arrow(
    ax: Axes, start: Place, end: Place, colour: str = INK, heads: str = "-|>", **look: Any
) -> FancyArrowPatch:
    """Draw an arrow; `heads` is matplotlib's name, `<|-|>` for two of them."""
    look = {"linewidth": 1.4, "mutation_scale": 11.0, "shrinkA": 0.0, "shrinkB": 0.0} | look
    patch = FancyArrowPatch(start, end, arrowstyle=heads, color=colour, **look)
    ax.add_patch(patch)
    return patch


def dimension(ax: Axes, x: float, top: float, bottom: float, text: str, at: float = 0.5) -> None:
    """Draw an upright dimension with its symbol left of it, at a share of its length."""
    arrow(ax, (x, top), (x, bottom), NOTE, "<|-|>", linewidth=0.9, mutation_scale=8.0)
    ax.text(x - 0.15, top + at * (bottom - top), text, ha="right", va="center", color=NOTE)


def box(
    ax: Axes, corner: Place, size: Place, face: str, edge: str = INK, **look: Any
) -> FancyBboxPatch:
    """Draw a box with round corners from its upper left corner."""
    look = {"linewidth": 1.2, "boxstyle": "round,pad=0,rounding_size=0.12"} | look
    patch = FancyBboxPatch(corner, *size, facecolor=face, edgecolor=edge, **look)
    ax.add_patch(patch)
    return patch


def lines_of_text(
    ax: Axes, place: Place, lines: Sequence[str], step: float, **look: Any
) -> list[Text]:
    """Write lines one below the other, each a text of its own."""
    return [
        ax.text(place[0], place[1] + k * step, line, va="center", **look)
        for k, line in enumerate(lines)
    ]


def misplaced_texts(fig: Figure) -> list[str]:
    """Texts of a drawn figure that leave it, or lie on each other; none in a good one."""
    fig.draw_without_rendering()
    unseen = _unseen_ticks(fig)
    texts = [one for one in fig.findobj(Text) if one.get_visible() and one.get_text().strip()]
    boxes = [
        (one.get_text(), one.get_window_extent())
        for one in texts
        if _is_shown(one) and one not in unseen
    ]
    frame, found = fig.bbox, []
    for k, (text, one) in enumerate(boxes):
        if one.x0 < frame.x0 or one.y0 < frame.y0 or one.x1 > frame.x1 or one.y1 > frame.y1:
            found.append(f"{text!r} leaves the figure")
        for other, two in boxes[k + 1 :]:
            wide = min(one.x1, two.x1) - max(one.x0, two.x0)
            high = min(one.y1, two.y1) - max(one.y0, two.y0)
            if wide > TOUCHING and high > TOUCHING:
                found.append(f"{text!r} lies on {other!r}")
    return found


def _unseen_ticks(fig: Figure) -> set[Text]:
    """Labels of ticks beyond the ends of their axis, which exist but are not drawn."""
    found = set()
    for ax in fig.axes:
        for axis in (ax.xaxis, ax.yaxis):
            low, high = sorted(axis.get_view_interval())
            room = 1e-9 * (high - low)
            for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
                if not low - room <= tick.get_loc() <= high + room:
                    found |= {tick.label1, tick.label2}
    return found


def _is_shown(text: Text) -> bool:
    """Whether a text is drawn at all: the names of axes that are off are not."""
    return text.axes is None or text.axes.axison or text in text.axes.texts
