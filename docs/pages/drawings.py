"""Drawings of the documents, NAME ... or all, as PNG and SVG."""

from __future__ import annotations

from collections.abc import Callable

from matplotlib.figure import Figure

from docs.blocks import REFERENCE, Made
from docs.drawings.drill import draw_drill
from docs.drawings.house import draw_house
from docs.drawings.model import draw_model
from docs.drawings.system import draw_system
from docs.drawings.waves import draw_waves
from percussion_model import Scene

DPI = 120.0
DRAWINGS: dict[str, Callable[[], Figure]] = {
    "drawing_drill": draw_drill,
    "drawing_house": draw_house,
    "drawing_model": lambda: draw_model(Scene.from_toml(REFERENCE)),
    "drawing_system": draw_system,
    "drawing_waves": lambda: draw_waves(Scene.from_toml(REFERENCE)),
}


def made(*names: str) -> Made:
    """What is named."""
    figures = ((name, DRAWINGS[name]()) for name in names or DRAWINGS)
    return Made(figures=lambda: figures, dpi=DPI, kinds=("png", "svg"))
