"""Figure of the stability of the solvers: cases by solvers, a panel for each measure."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from percussion_model.interface.plotting import style
from percussion_model.verification.hard_cases import ALL_SOLVERS, Collection

# What lies below this is rounding of one number: it gets the colour of it.
LEAST = 1e-16
# Title, key of a row, limits of the colours (powers of ten), colours.
PANELS = (
    ("energy residual", "residual", (-16, -6), "viridis"),
    ("momentum", "momentum", (-16, -6), "viridis"),
    ("numerical dissipation", "numerical", (-6, 0), "cividis"),
    ("events a second", "events_per_second", (1, 7), "magma_r"),
)
_ROW_HEIGHT = 0.135


def draw_stability(found: Collection) -> Figure:
    """Draw a heat map of each measure; what a solver does not compute is left white."""
    cases = list(dict.fromkeys(row["case"] for row in found.rows))
    solvers = [name for name in ALL_SOLVERS if any(row["solver"] == name for row in found.rows)]
    height = 2.2 + _ROW_HEIGHT * len(cases)
    fig = Figure(figsize=(10.5, height), layout="constrained")
    axes = np.atleast_1d(fig.subplots(1, len(PANELS), sharey=True))
    for ax, (title, key, limits, colours) in zip(axes, PANELS, strict=True):
        values = _table(found, cases, solvers, key)
        image = ax.imshow(
            values,
            aspect="auto",
            cmap=matplotlib.colormaps[colours].with_extremes(bad="white"),
            vmin=limits[0],
            vmax=limits[1],
        )
        ax.set_xticks(range(len(solvers)), solvers)
        ax.set_yticks(range(len(cases)), cases, fontsize=6.5)
        ax.set_title(title)
        ax.grid(False)
        ax.tick_params(length=0)
        ticks = range(limits[0], limits[1] + 1, 2)
        bar = fig.colorbar(image, ax=ax, location="bottom", pad=0.01, ticks=list(ticks))
        bar.ax.set_xticklabels([f"$10^{{{k}}}$" for k in ticks], fontsize=7)
    style.head(fig, f"{len(cases)} hard cases by {len(solvers)} solvers")
    return fig


def _table(
    found: Collection, cases: list[str], solvers: list[str], key: str
) -> np.ma.MaskedArray[Any, Any]:
    """Logarithms of a measure, shape (cases, solvers); masked where there is none."""
    values = np.full((len(cases), len(solvers)), np.nan)
    for row in found.rows:
        if row[key] is not None:
            place = cases.index(row["case"]), solvers.index(row["solver"])
            values[place] = np.log10(max(abs(row[key]), LEAST))
    return np.ma.masked_invalid(values)
