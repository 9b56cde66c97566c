"""Figure of rates: predicted against measured."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from percussion_model.interface.plotting import style
from percussion_model.verification.rates import RateRow, Rates
from percussion_model.verification.rates.cases import TOP
from percussion_model.verification.rates.criteria import FACTOR
from percussion_model.verification.rates.table import HOUR

LEAST, MOST = 5.0, 220.0  # of measured rates; predicted ones are on a line below the least [m/h]
TICKS = (5, 10, 20, 50, 100, 200)
# From the point to its name, in points.
LEFT, RIGHT = (-7.0, -3.0), (7.0, -3.0)


def draw_rates(found: Rates) -> Figure:
    """Draw each case with what its rock's numbers leave open, and the factor of the criterion."""
    fig = Figure(figsize=(8.2, 7.6), layout="constrained")
    ax = fig.subplots()
    ends = np.geomspace(LEAST / FACTOR, MOST * FACTOR)
    ax.fill_between(ends, ends / FACTOR, ends * FACTOR, color=style.SHADE_COLOUR, linewidth=0)
    ax.plot(ends, ends, color=style.RULE_COLOUR, linewidth=1.0)
    looks = _looks(found)
    for row in found.rows:
        _draw(ax, row, looks[_kind(row)])
    ax.set_xscale("log")
    ax.set_yscale("symlog", linthresh=LEAST, linscale=0.5)
    ax.set_xlim(LEAST, MOST)
    ax.set_ylim(-0.5, MOST)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_minor_locator(NullLocator())
    ax.set_xticks(TICKS, [f"{one}" for one in TICKS])
    ax.set_yticks((0, *TICKS), [f"{one}" for one in (0, *TICKS)])
    ax.text(0.96 * MOST, 0.0, "nothing breaks", va="center", ha="right", fontsize=8)
    style.label(ax, "measured rate [m/h]", "predicted rate [m/h]")
    handles = [
        *(_handle(colour, marker, name) for name, (colour, marker) in looks.items()),
        Line2D([], [], color="black", linewidth=0.8, label="interval by the rock's numbers"),
        Patch(facecolor=style.SHADE_COLOUR, label=f"within a factor {FACTOR:g}"),
    ]
    style.head(fig, "Rates of penetration: published, and predicted with one set")
    ax.legend(handles=handles, loc="upper left", fontsize=9)
    return fig


def _kind(row: RateRow) -> str:
    case = row.case
    return f"top hammer, {case.bit * 1e3:.0f} mm" if case.type == TOP else case.type


def _looks(found: Rates) -> dict[str, tuple[str, str]]:
    kinds = list(dict.fromkeys(map(_kind, found.rows)))
    pairs = zip(kinds, style.LINE_COLOURS, "osD^v<>", strict=False)
    return {kind: (colour, marker) for kind, colour, marker in pairs}


def _handle(colour: str, marker: str, name: str) -> Line2D:
    return Line2D([], [], color=colour, marker=marker, linestyle="", markersize=6.0, label=name)


def _draw(ax: Axes, row: RateRow, look: tuple[str, str]) -> None:
    """One case; those outside the factor have their rock's name."""
    colour, marker = look
    told, x = row.predicted, row.case.rate * HOUR
    y = told.rate * HOUR
    ax.plot([x, x], [told.low * HOUR, told.high * HOUR], color=colour, linewidth=0.7, zorder=3)
    ax.plot([x], [y], marker, color=colour, markersize=6.5, markeredgecolor="black",
            markeredgewidth=0.5, zorder=5)  # fmt: skip
    if told.rate > 0.0 and not 1.0 / FACTOR <= row.ratio <= FACTOR:
        away, side = (LEFT, "right") if row.ratio > 1.0 else (RIGHT, "left")
        ax.annotate(
            f"{row.case.rock}, {row.case.strength / 1e6:.0f} MPa",
            (x, y),
            away,
            textcoords="offset points",
            ha=side,
            fontsize=8,
            zorder=4,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
        )
