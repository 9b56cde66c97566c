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
from percussion_model.simulation.uncertain import in_digits

# The close view ends at this multiple of the last early contact.
CLOSE = 1.6
# Colour, dashes and width of each solver; dashes tell apart what lies on each other.
LINES: dict[str, tuple[str, Any, float]] = {
    "wave": ("#0072B2", "-", 1.6),
    "modal": ("#CC79A7", (0, (3, 1.5, 1.2, 1.5)), 1.5),
    "fem": ("#D55E00", (0, (4, 1.5)), 1.4),
    "rigid": ("#595959", (0, (1.2, 1.2)), 1.4),
}


def draw_comparison(comparison: Comparison) -> Figure:
    """Draw the last blow of each solver, or its fall, at the start and as a whole."""
    windows = {name: last_blow_window(found) for name, found in comparison.results.items()}
    early = CLOSE * CONTACTS_SHARE * max(window.activation_until for window in windows.values())
    whole = max(window.length for window in windows.values())
    scene = comparison.results[comparison.first].scene
    alone = scene.piston.model == "absent"
    rows = 2 if alone else 3
    fig = Figure(figsize=(10.5, 0.6 + 2.67 * rows), layout="constrained")
    axes = fig.subplots(rows, 2)
    words, start = ("The fall", "first contact") if alone else ("One blow", "impact")
    for column, (end, span) in enumerate(
        ((early, f"First {in_digits(early * MS, 2)} ms"), (whole, words))
    ):
        for name, window in windows.items():
            shown = (window.time >= 0.0) & (window.time <= end)
            _draw(axes[:, column], name, window, shown)
        for ax in axes[:, column]:
            ax.set_xlim(0.0, end * MS)
        style.label(axes[0, column], "", "bit force [kN]", f"{span}: force on the rock")
        style.label(axes[1, column], "", "displacement [mm]", f"{span}: mean bit motion")
        if rows > 2:
            title = f"{span}: piston relative to bit"
            style.label(axes[2, column], "", "piston − bit, $u_r$ [mm]", title)
        axes[-1, column].set_xlabel(f"time since {start} [ms]")
    handles = [
        Line2D([], [], color=colour, linestyle=dashes, linewidth=2.0, label=name)
        for name, (colour, dashes, _) in LINES.items()
        if name in windows
    ]
    title = f" — {scene.title}" if scene.title else ""
    head = "The fall" if alone else "The last blow"
    count = f"{len(windows)} solver" + "s" * (len(windows) > 1)
    style.head(fig, f"{head} by {count}{title}", handles)
    return fig


def _draw(axes: np.ndarray, name: str, window: Window, shown: np.ndarray) -> None:
    colour, dashes, width = LINES[name]
    time = window.time[shown] * MS
    curves = (
        window.samples["bit_force"] / KN,
        window.since_start("bit_position") * MM,
        window.samples["relative_displacement"] * MM,
    )
    for ax, values in zip(axes, curves, strict=False):  # without a piston there is no third
        ax.plot(time, values[shown], color=colour, linestyle=dashes, linewidth=width)
