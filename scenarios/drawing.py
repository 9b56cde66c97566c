"""What the figures of all scenarios share; matplotlib is loaded by those who draw."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from typing import TYPE_CHECKING, ParamSpec, TypeVar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

P = ParamSpec("P")
R = TypeVar("R")


def in_style(draw: Callable[P, R]) -> Callable[P, R]:
    """Let a function draw in the style of all figures."""

    @wraps(draw)
    def drawn(*arguments: P.args, **named: P.kwargs) -> R:
        from matplotlib import rc_context

        from percussion_model.interface.plotting.style import STYLE

        with rc_context(STYLE):
            return draw(*arguments, **named)

    return drawn


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
    """
    from matplotlib.figure import Figure

    from percussion_model.interface.plotting.style import head

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(len(labels), 1, sharex=True, squeeze=False)
    for ax, label in zip(axes[:, 0], labels, strict=True):
        quantity, _, unit = label.partition(" [")
        ax.set_title(quantity[:1].upper() + quantity[1:])
        ax.set_ylabel(f"[{unit}" if unit else "")
    axes[-1, 0].set_xlabel("time [s]")
    head(figure, title)
    figure.align_ylabels()
    return figure, list(axes[:, 0])
