"""Figure of error against computing time: every ladder a line, both axes logarithmic."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

from percussion_model.interface.plotting import style
from percussion_model.verification.accuracy.ladders import LADDERS
from percussion_model.verification.accuracy.problems import APERIODIC, HISTORY, QUANTITIES
from percussion_model.verification.accuracy.study import Point, Study

# Colour, dashes and marker of each ladder; families share a colour.
_WAVE, _FEM, _SCIPY, _RIGID = "#0072B2", "#D55E00", "#009E73", "#595959"
LINES: dict[str, tuple[str, Any, str]] = {
    "wave": (_WAVE, "-", "o"),
    "fem": (_FEM, "-", "s"),
    "fem-time": (_FEM, (0, (1.2, 1.2)), "v"),
    "fem-paper": ("#E69F00", (0, (4, 1.5)), "s"),
    "fem-gauss": ("#CC79A7", (0, (4, 1.5)), "D"),
    "rigid": (_RIGID, "-", "X"),
    "lsoda": (_SCIPY, "-", "^"),
    "lsoda-tol": (_SCIPY, (0, (1.2, 1.2)), "<"),
    "radau": ("#56B4E9", (0, (4, 1.5)), "P"),
    "rk45": ("#222222", (0, (4, 1.5)), "*"),
    "dop853": ("#8C6D00", (0, (4, 1.5)), "h"),
    "bdf": ("#7A5195", (0, (4, 1.5)), "d"),
}
# Errors below this are drawn at it: they are zero within the bar of the reference.
LEAST = 1e-7
IN_A_ROW = 4


def draw_accuracy(found: Study) -> Figure:
    """Draw the first quantity against time by second, the last against time by blow."""
    fig = Figure(figsize=(11.0, 6.2), layout="constrained")
    left, right = fig.subplots(1, 2)
    keys = (found.problem.main, found.problem.quantities[-1])
    for ax, key, by in zip((left, right), keys, ("second", "blow"), strict=True):
        _panel(ax, found, key, by)
    _head(fig, _title(found), found)
    return fig


def draw_quantities(found: Study) -> Figure:
    """Draw every quantity against time by simulated second."""
    keys = found.problem.quantities
    columns = 3 if len(keys) > 4 else 2
    rows = math.ceil(len(keys) / columns)
    fig = Figure(figsize=(11.0, 1.2 + 3.1 * rows), layout="constrained")
    axes = np.atleast_1d(fig.subplots(rows, columns)).ravel()
    for ax, key in zip(axes, keys, strict=False):
        _panel(ax, found, key, "second")
    for ax in axes[len(keys) :]:
        ax.set_visible(False)
    _head(fig, f"{_title(found)}: all quantities", found)
    return fig


def _head(fig: Figure, title: str, found: Study) -> None:
    """Title above and legend below; its entries are long, so few stand in a row."""
    style.head(fig, title)
    fig.legend(handles=_handles(found), loc="outside lower center", ncols=IN_A_ROW)


def _title(found: Study) -> str:
    what = "Standard error" if found.problem.kind == APERIODIC else "Error"
    return f"{what} against time to compute" + (f" — {found.title}" if found.title else "")


def _panel(ax: Axes, found: Study, key: str, by: str) -> None:
    names = [name for name in found.names if _points(found, name, key, by)]
    for name in names:
        _ladder(ax, found, name, key, by)
    floor = found.reference.floor(key)
    if math.isfinite(floor) and found.problem.kind != APERIODIC:
        ax.axhspan(LEAST / 10.0, max(floor, LEAST), color=style.SHADE_COLOUR, linewidth=0, zorder=0)
    ax.set_xscale("log")
    ax.set_yscale("log")
    low = [max(error, LEAST) for name in names for _, error in _points(found, name, key, by)]
    if low:
        bottom = min([*low, floor if math.isfinite(floor) and floor > LEAST else math.inf])
        ax.set_ylim(0.5 * bottom, 2.0 * max(low))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(10.0, numticks=12))
        axis.set_minor_locator(NullLocator())  # hundreds of ticks take most of the drawing
    unit = {"second": "a simulated second", "blow": "a blow"}[by]
    if by == "blow" and found.problem.kind == "drop":
        unit = "the whole drop"
    if found.problem.kind == APERIODIC:
        unit = "the run"
    quantity = QUANTITIES[key]
    kind = "L1, relative" if key == HISTORY else "relative"
    if not names:
        ax.text(0.5, 0.5, "no reference: see the table", ha="center", transform=ax.transAxes)
    title = quantity.label[0].upper() + quantity.label[1:]
    style.label(ax, f"time to compute {unit} [s]", f"error, {kind}", title)


def _cost(found: Study, point: Point, by: str) -> float:
    """Time of a point; of aperiodic motion that of the whole run, for its length is the effort."""
    if found.problem.kind == APERIODIC:
        return point.second * point.size
    return float(getattr(point, by))


def _points(found: Study, name: str, key: str, by: str) -> list[tuple[float, float]]:
    """Time and error of each point of a ladder that has both."""
    pairs = [(getattr(point, by), point.errors.get(key, math.nan)) for point in found.ladder(name)]
    return [(cost, error) for cost, error in pairs if cost > 0 and math.isfinite(error)]


def _ladder(ax: Axes, found: Study, name: str, key: str, by: str) -> None:
    """Line through the points that make the order; hollow markers for the others."""
    colour, dashes, marker = LINES[name]
    fitted = {point.label for point in found.fitted(name, key)}
    full: list[tuple[float, float]] = []
    hollow: list[tuple[float, float]] = []
    for point in found.ladder(name):
        error, cost = point.errors.get(key, math.nan), _cost(found, point, by)
        if cost > 0 and math.isfinite(error):
            (full if point.label in fitted else hollow).append((cost, max(error, LEAST)))
    if full:
        x, y = np.array(full).T
        ax.plot(x, y, color=colour, linestyle=dashes, marker=marker, markersize=5.0, zorder=3)
    if hollow:
        x, y = np.array(hollow).T
        ax.plot(
            x, y, color=colour, linestyle="", marker=marker, markersize=5.0,
            markerfacecolor="white", zorder=2,
        )  # fmt: skip


def _handles(found: Study) -> list[Any]:
    """Legend: ladders with their measured order in the first quantity."""
    handles = []
    for name in found.names:
        colour, dashes, marker = LINES[name]
        order = found.order(name, found.problem.main)
        text = LADDERS[name].title
        if order is not None:
            text += f" (order {order.value:.1f})"
        handles.append(
            Line2D([], [], color=colour, linestyle=dashes, marker=marker, markersize=5, label=text)
        )
    if found.problem.kind != APERIODIC:
        hollow = Line2D(
            [], [], color=style.RULE_COLOUR, linestyle="", marker="o", markersize=5,
            markerfacecolor="white", label="not fitted: lengths off, or below the bar",
        )  # fmt: skip
        bar = Line2D([], [], color=style.SHADE_COLOUR, linewidth=6, label="bar of the reference")
        handles += [hollow, bar]
    return handles
