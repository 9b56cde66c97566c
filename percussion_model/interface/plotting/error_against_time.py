"""Figures of error against computing time."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from percussion_model.interface.plotting import style
from percussion_model.verification.accuracy.ladders import LADDERS
from percussion_model.verification.accuracy.problems import (
    APERIODIC,
    DROP,
    HISTORIES,
    HISTORY,
    QUANTITIES,
)
from percussion_model.verification.accuracy.study import Point, Study

# Colour, dashes and marker of each ladder that is drawn; families share a colour. Ladders
# that refine something else than steps or elements stand in the tables alone.
_MODAL = "#222222"
_WAVE, _FEM, _RIGID, _PEER = "#0072B2", "#D55E00", "#595959", "#CC79A7"
LINES: dict[str, tuple[str, Any, str]] = {
    "modal": (_MODAL, "-", "*"),
    "wave": (_WAVE, "-", "o"),
    "explicit": (_PEER, "-", "v"),
    "exact-flow": (_PEER, (0, (4, 1.5)), "d"),
    "fem": (_FEM, "-", "s"),
    "fem-paper": ("#E69F00", (0, (4, 1.5)), "s"),
    "fem-gauss": (_FEM, (0, (1.2, 1.2)), "D"),
    "rigid": (_RIGID, "-", "X"),
}
# Errors below this are drawn at it: they are zero within the bar of the reference.
LEAST = 1e-7
# Width of the line of the default solver, and of others; size of its markers, and of theirs.
OWN_WIDTH, WIDTH = 2.4, 1.0
OWN_SIZE, SIZE = 9.0, 5.0
# Time at which a run takes as long as what it simulates [s].
REAL_TIME = 1.0
IN_A_ROW = 4
# Axes that span less than this ratio have ticks between the powers of ten.
FEW_DECADES = 100.0


def draw_accuracy(found: Study) -> Figure:
    """Draw the first quantity and the force on the rock against time."""
    keys = [found.main] + [HISTORY] * (HISTORY in found.quantities)
    fig = Figure(figsize=(9.6 if len(keys) > 1 else 8.0, 5.6), layout="constrained")
    for ax, key in zip(np.atleast_1d(fig.subplots(1, len(keys))), keys, strict=True):
        _panel(ax, found, key)
    _head(fig, _title(found), found)
    return fig


def draw_quantities(found: Study) -> Figure:
    """Draw every quantity against time."""
    keys = found.quantities
    columns = 3 if len(keys) > 4 else 2
    rows = math.ceil(len(keys) / columns)
    fig = Figure(figsize=(11.0, 1.2 + 3.1 * rows), layout="constrained")
    axes = np.atleast_1d(fig.subplots(rows, columns)).ravel()
    for ax, key in zip(axes, keys, strict=False):
        _panel(ax, found, key)
    for ax in axes[len(keys) :]:
        ax.set_visible(False)
    _head(fig, f"{_title(found)}: all quantities", found)
    return fig


def _head(fig: Figure, title: str, found: Study) -> None:
    """Title above and legend below; its entries are long, so few stand in a row."""
    style.head(fig, title)
    fig.legend(handles=_handles(found), loc="outside lower center", ncols=IN_A_ROW)


def _title(found: Study) -> str:
    what = "Standard error" if found.kind == APERIODIC else "Error"
    where = f" — {found.title}" if found.title else ""
    return f"{what} against computing time{where}"


def _drawn(found: Study) -> list[str]:
    """Ladders that are drawn."""
    return [name for name in found.names if name in LINES]


def _panel(ax: Axes, found: Study, key: str) -> None:
    names = [name for name in _drawn(found) if _pairs(found, found.ladder(name), key)]
    for name in names:
        _ladder(ax, found, name, key)
    floor = found.reference.floor(key)
    known = math.isfinite(floor) and found.kind != APERIODIC
    if known:
        ax.axhspan(LEAST / 10.0, max(floor, LEAST), color=style.SHADE_COLOUR, linewidth=0, zorder=0)
    errors = [error for name in names for _, error in _pairs(found, found.ladder(name), key)]
    if errors:
        bottom = min([*errors, floor if known and floor > LEAST else math.inf])
        ax.set_ylim(0.5 * bottom, 2.0 * max(errors))
    else:
        ax.text(0.5, 0.5, "no reference: see the table", ha="center", transform=ax.transAxes)
    _log_axes(ax)
    if errors and 4.0 * max(errors) < FEW_DECADES * min(errors):
        ax.yaxis.set_major_locator(LogLocator(10.0, subs=(1.0, 2.0, 5.0), numticks=12))
    quantity = QUANTITIES[key]
    unit = {DROP: "the whole drop", APERIODIC: "the run"}.get(found.kind, "one simulated second")
    kind = "mean difference divided by the mean force" if key == HISTORY else "error"
    if key in HISTORIES and key != HISTORY:
        kind = "mean difference divided by the mean"
    if found.kind == APERIODIC:
        kind = "standard error"
    title = quantity.label[0].upper() + quantity.label[1:]
    if key == found.main:
        ax.text(0.99, 0.985, "lower left is better", transform=ax.transAxes, ha="right", va="top",
                color=style.RULE_COLOUR)  # fmt: skip
    style.label(ax, f"computing time of {unit} [s]", f"{kind} [%]", title)
    low, high = ax.get_xlim()
    if found.kind not in (DROP, APERIODIC) and low < REAL_TIME < high:
        ax.axvline(REAL_TIME, color=style.RULE_COLOUR, linestyle=":", linewidth=1.0, zorder=1)


def _log_axes(ax: Axes) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(10.0, numticks=12))
        axis.set_minor_locator(NullLocator())  # hundreds of ticks take most of the drawing
    ax.xaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100.0 * value:g}"))


def _cost(found: Study, point: Point) -> float:
    """Time of a point; of a drop and of aperiodic motion that of the whole run [s]."""
    return found.seconds(point) * (found.duration if found.kind == DROP else 1.0)


def _pairs(found: Study, points: Iterable[Point], key: str) -> list[tuple[float, float]]:
    """Time and error, as drawn, of each point that has both."""
    pairs = ((_cost(found, point), point.errors.get(key, math.nan)) for point in points)
    return [(cost, max(error, LEAST)) for cost, error in pairs if cost > 0 and math.isfinite(error)]


def _ladder(ax: Axes, found: Study, name: str, key: str) -> None:
    """Line through all points; hollow markers where an order does not count them."""
    colour, dashes, marker = LINES[name]
    x, y = np.array(_pairs(found, found.ladder(name), key)).T
    is_own = name == found.own
    width, size = (OWN_WIDTH, OWN_SIZE) if is_own else (WIDTH, SIZE)
    ax.plot(x, y, color=colour, linestyle=dashes, linewidth=width, zorder=4 if is_own else 2)
    fitted = {point.label for point in found.fitted(name, key)}
    full = [point for point in found.ladder(name) if point.label in fitted]
    rest = [point for point in found.ladder(name) if point.label not in fitted]
    for points, face in ((full, colour), (rest, "white")):
        pairs = _pairs(found, points, key)
        if pairs:
            x, y = np.array(pairs).T
            ax.plot(
                x, y, color=colour, linestyle="", marker=marker, markersize=size,
                markerfacecolor=face, zorder=5 if is_own else 3,
            )  # fmt: skip


def _handles(found: Study) -> list[Any]:
    """Legend: ladders, and what hollow markers and the shade mean."""
    handles = []
    for name in _drawn(found):
        colour, dashes, marker = LINES[name]
        text = LADDERS[name].title.replace("K_C", "$K_C$")
        width, size = WIDTH, SIZE
        if name == found.own:
            text, width, size = f"{text}, the default", OWN_WIDTH, OWN_SIZE
        handles.append(
            Line2D([], [], color=colour, linestyle=dashes, marker=marker, markersize=size,
                   label=text, linewidth=width)
        )  # fmt: skip
    if found.kind != APERIODIC:
        hollow = Line2D(
            [], [], color=style.RULE_COLOUR, linestyle="", marker="o", markersize=5,
            markerfacecolor="white", label="hollow: grey is near",
        )  # fmt: skip
        bar = Line2D(
            [], [], color=style.SHADE_COLOUR, linewidth=6, label="the reference is known no better"
        )
        handles += [hollow, bar]
    if found.kind not in (DROP, APERIODIC):
        real = Line2D([], [], color=style.RULE_COLOUR, linestyle=":", label="real time")
        handles.append(real)
    return handles
