"""What the figures of all scenarios share; matplotlib is loaded by those who draw."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def stacked(
    title: str, labels: Sequence[str], size: tuple[float, float]
) -> tuple[Figure, list[Axes]]:
    """A figure of panels over time, one below the other.

    Parameters
    ----------
    title : str
    labels : sequence of str
        "quantity [unit]" of each panel.
    size : tuple of float
        Of the figure [inch].

    Returns
    -------
    Figure, list of Axes
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=size)
    axes = figure.subplots(len(labels), 1, sharex=True, squeeze=False)
    for ax, label in zip(axes[:, 0], labels, strict=True):
        quantity, _, unit = label.partition(" [")
        ax.set_title(quantity, loc="left", fontsize="medium")
        ax.set_ylabel(f"[{unit}" if unit else "")
        ax.grid(alpha=0.3)
    axes[-1, 0].set_xlabel("time [s]")
    figure.suptitle(title, fontweight="bold")
    figure.align_ylabels()
    return figure, list(axes[:, 0])


def save_png(figure: Figure, path: Path, dpi: float = 110) -> Path:
    """Write a figure, whole or not at all; return its file."""
    from percussion_model.interface.plotting.style import save_png as save

    return save(figure, path, dpi)
