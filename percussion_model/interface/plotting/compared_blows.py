"""Figure of bit force and motion through a blow, by several solvers."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from percussion_model.analysis.comparison import Comparison
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MS
from percussion_model.interface.plotting.window import CONTACTS_SHARE, Window, last_blow_window

# The close view ends at this multiple of the last early contact.
CLOSE = 1.6
# Colour, dashes and width of each solver; dashes tell apart what lies on each other.
LINES: dict[str, tuple[str, Any, float]] = {
    "wave": ("#0072B2", "-", 1.6),
    "fem": ("#D55E00", (0, (4, 1.5)), 1.4),
    "rigid": ("#595959", (0, (1.2, 1.2)), 1.4),
    "blow-map": ("#009E73", (0, (6, 1.5, 1.2, 1.5)), 1.4),
}


def draw_comparison(comparison: Comparison) -> Figure:
    """Draw the last blow of each solver, just after the impact and as a whole."""
    windows = {name: last_blow_window(found) for name, found in comparison.results.items()}
    early = CLOSE * CONTACTS_SHARE * max(window.activation_until for window in windows.values())
    whole = max(window.length for window in windows.values())
    fig = Figure(figsize=(10.5, 8.6), layout="constrained")
    axes = fig.subplots(3, 2)
    for column, (end, span) in enumerate(
        ((early, f"First {early * MS:.2g} ms"), (whole, "One blow"))
    ):
        for name, window in windows.items():
            shown = (window.time >= 0.0) & (window.time <= end)
            _draw(axes[:, column], name, window, shown)
        for ax in axes[:, column]:
            ax.set_xlim(0.0, end * MS)
        style.label(axes[0, column], "", "bit force [kN]", f"{span}: force on the rock")
        style.label(axes[1, column], "", "displacement [mm]", f"{span}: mean bit motion")
        title = f"{span}: piston relative to bit"
        style.label(axes[2, column], "time since impact [ms]", "piston − bit, $u_r$ [mm]", title)
    handles = [
        Line2D([], [], color=colour, linestyle=dashes, linewidth=2.0, label=name)
        for name, (colour, dashes, _) in LINES.items()
        if name in windows
    ]
    title = comparison.results[comparison.first].scene.title
    title = f" — {title}" if title else ""
    style.head(fig, f"The last blow by {len(windows)} solvers{title}", handles)
    return fig


def _draw(axes: np.ndarray, name: str, window: Window, shown: np.ndarray) -> None:
    colour, dashes, width = LINES[name]
    time = window.time[shown] * MS
    curves = (
        window.samples["bit_force"] / KN,
        window.since_start("bit_position") * MM,
        window.samples["relative_displacement"] * MM,
    )
    for ax, values in zip(axes, curves, strict=True):
        ax.plot(time, values[shown], color=colour, linestyle=dashes, linewidth=width)
