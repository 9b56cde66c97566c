"""Arrows, boxes and labels that all drawings share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch
from matplotlib.text import Text

Place = tuple[float, float]
INK = "#222222"
NOTE = "#595959"
SMALL = 8.0


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
