"""Draw the drawings of the documents: `python -m docs.make_drawings [NAME]...`.

Each is written as PNG and SVG into docs/images, whole or not at all. It takes a minute, most of
which compiles kernels.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from docs.drawings.house import draw_house
from docs.drawings.model import draw_model
from docs.drawings.system import draw_system
from docs.drawings.waves import draw_waves
from percussion_model import Scene
from percussion_model.interface.plotting.style import save_figures

IMAGES = Path(__file__).resolve().parent / "images"
REFERENCE = IMAGES.parents[1] / "scenarios" / "reference.toml"
DPI = 120.0
DRAWINGS: dict[str, Callable[[], Figure]] = {
    "drawing_house": draw_house,
    "drawing_model": lambda: draw_model(Scene.from_toml(REFERENCE)),
    "drawing_system": draw_system,
    "drawing_waves": lambda: draw_waves(Scene.from_toml(REFERENCE)),
}


def main(names: list[str]) -> None:
    """Draw what is named, all if nothing is."""
    for name in names:
        if name not in DRAWINGS:
            sys.exit(f"{name}: one of {', '.join(DRAWINGS)}")
    save_figures(lambda: ((name, DRAWINGS[name]()) for name in names or DRAWINGS), IMAGES, dpi=DPI)


if __name__ == "__main__":
    main(sys.argv[1:])
