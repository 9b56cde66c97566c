"""Drawing of the code: layers with their imports, what stands around them, and the way of a run."""

from __future__ import annotations

import ast
import re
import textwrap
import tomllib
from itertools import pairwise
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.drawings.shapes import INK, NOTE, SMALL, Place, arrow, blank, box, lines_of_text
from percussion_model.interface.plotting import style

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "percussion_model"
# What the layers of the contract do not name: folders that use the package.
AROUND = ("fmu_src", "scenarios", "benchmarks", "examples")
# Where a run passes: what it is called, what it is, its layer, and the share of the width there.
WAY = (
    ("Scene", "parameters, checked", "scene", (0.0, 0.47)),
    ("solver", "a state, and how it advances", "engine", (0.0, 0.47)),
    ("Simulation", "time, inputs, snapshots", "simulation", (0.0, 0.47)),
    ("Result", "blows, events, ledger", "simulation", (0.53, 1.0)),
    ("commands", "tables, figures, reports", "interface", (0.53, 1.0)),
)
WIDTH, ROW, GAP = 17.0, 1.55, 0.2
LEFT, WAY_AT, WAY_WIDTH, SIDE = 0.3, 8.9, 3.4, 13.0
BETWEEN = re.compile(" [|:] ")
RUN = "#0072B2"
COLOURS = {
    "interface": "#FBE5D6", "verification": "#F7EBC8", "coupling": "#F7EBC8",
    "analysis": "#E4EFD9", "simulation": "#D5ECE4", "engine": "#D5E8EC", "solvers": "#D6E8F3",
    "scene": "#DCE6EE",
    "physics": "#E8E3F0", "components": "#E8E3F0",
}  # fmt: skip


def layers() -> list[list[str]]:
    """Layers of the import contract, from the top: each the folders that share it."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    (found,) = (one["layers"] for one in contracts if one["type"] == "layers")
    return [BETWEEN.split(row) for row in found]


def line_on(folder: str) -> str:
    """First sentence of a folder's docstring."""
    text = (ROOT / folder / "__init__.py").read_text(encoding="utf-8")
    words = ast.get_docstring(ast.parse(text)) or ""
    return words.split(";")[0].split("\n")[0].split(": `")[0].replace("`", "").rstrip(".")


def folders_in(folder: str) -> str:
    """Names of the packages in a folder; empty where it has none."""
    place = ROOT / folder
    return ", ".join(sorted(one.name for one in place.iterdir() if (one / "__init__.py").is_file()))


def draw_house() -> Figure:
    """Draw layers, neighbours and the way of a run."""
    rows = layers()
    bottom = 1.0 + len(rows) * (ROW + GAP)
    fig = Figure(figsize=(10.6, 0.62 * (bottom + 0.4)), layout="constrained")
    ax = fig.subplots()
    blank(ax, WIDTH, bottom + 0.4)
    box(ax, (0.05, 0.1), (WAY_AT + WAY_WIDTH + 0.15, bottom + 0.1), "white", INK)
    for x, words in ((LEFT, f"{PACKAGE}: a layer imports from those below it alone"),
                     (WAY_AT, "the way of a run"), (SIDE, "what uses the package")):  # fmt: skip
        ax.text(x, 0.5, words, va="center", fontweight="bold")
    places = {}
    for k, row in enumerate(rows):
        y = 0.9 + k * (ROW + GAP)
        places |= dict.fromkeys(row, y)
        _layer(ax, row, y)
    _way(ax, places)
    _around(ax, 0.9, bottom - GAP)
    style.head(fig, "The code: layers, and the way of a run through them")
    return fig


def _layer(ax: Axes, row: list[str], y: float) -> None:
    """Draw a layer over its width, one box for each folder that shares it."""
    whole = WAY_AT - LEFT - 0.25
    width = (whole - 0.2 * (len(row) - 1)) / len(row)
    for k, name in enumerate(row):
        x = LEFT + k * (width + 0.2)
        box(ax, (x, y), (width, ROW), COLOURS[name], NOTE)
        ax.text(x + 0.2, y + 0.28, name, va="center", fontweight="bold")
        _lines(ax, (x + 0.2, y + 0.62), f"{PACKAGE}/{name}", int(9.5 * width))


def _lines(ax: Axes, place: Place, folder: str, columns: int) -> None:
    """Write what a folder is, and the folders that it holds."""
    about = textwrap.wrap(line_on(folder), columns)
    held = textwrap.wrap(folders_in(folder), columns)
    x, y = place
    for k, line in enumerate([*about, *held]):
        colour = INK if k < len(about) else NOTE
        ax.text(x, y + 0.29 * k, line, va="center", fontsize=SMALL, color=colour)


def _way(ax: Axes, places: dict[str, float]) -> None:
    """Draw what a run passes through, each beside its layer, from the scene up."""
    ends = []
    for name, words, layer, (start, stop) in WAY:
        x, width, y = WAY_AT + start * WAY_WIDTH, (stop - start) * WAY_WIDTH, places[layer] + 0.2
        box(ax, (x, y), (width, ROW - 0.4), "white", RUN)
        middle = x + 0.5 * width
        ax.text(middle, y + 0.22, name, ha="center", va="center", color=RUN, fontweight="bold")
        lines_of_text(ax, (middle, y + 0.52), textwrap.wrap(words, 16), 0.27, ha="center",
                      fontsize=SMALL)  # fmt: skip
        ends.append((x, width, y))
    for (x0, w0, y0), (x1, w1, y1) in pairwise(ends):
        if y0 == y1:
            arrow(ax, (x0 + w0, y0 + 0.5 * ROW - 0.2), (x1, y0 + 0.5 * ROW - 0.2), RUN)
        else:
            arrow(ax, (x1 + 0.5 * w1, y0), (x1 + 0.5 * w1, y1 + ROW - 0.4), RUN)


def _around(ax: Axes, top: float, bottom: float) -> None:
    """Draw the folders that use the package, each with its line and what it holds."""
    width = WIDTH - SIDE - 0.1
    height = (bottom - top - GAP * (len(AROUND) - 1)) / len(AROUND)
    for k, name in enumerate(AROUND):
        y = top + k * (height + GAP)
        box(ax, (SIDE, y), (width, height), "#F2F2F2", NOTE)
        ax.text(SIDE + 0.2, y + 0.35, name, va="center", fontweight="bold")
        _lines(ax, (SIDE + 0.2, y + 0.72), name, 38)
        at = y + 0.5 * height
        arrow(ax, (SIDE, at), (WAY_AT + WAY_WIDTH + 0.22, at), NOTE, linewidth=1.0)
