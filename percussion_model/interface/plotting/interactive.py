"""Interactive figures (bokeh): panels, lines, and their embedding in a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from bokeh.embed import components
from bokeh.models import (
    BoxAnnotation,
    ColumnDataSource,
    CustomJS,
    HoverTool,
    LayoutDOM,
    Span,
    Widget,
)
from bokeh.plotting import figure
from bokeh.resources import Resources

from percussion_model.interface.plotting import style

# Longer lines are thinned: as much as a wide screen can show after a deep zoom.
MOST_POINTS = 12_000
HEIGHT = 260
TOOLS = "pan,box_zoom,wheel_zoom,save,reset"


def panel(title: str, x: str, y: str, **more: Any) -> Any:
    """Return an empty panel with named axes; drag a box to zoom, double-click to go back."""
    more = {"name": title, "height": HEIGHT, "sizing_mode": "stretch_width", "tools": TOOLS, **more}
    if "box_zoom" in str(more["tools"]):
        more["active_drag"] = "box_zoom"
    made = figure(title=title, x_axis_label=x, y_axis_label=y, **more)
    made.toolbar.logo = None
    made.toolbar.autohide = True
    made.js_on_event("doubletap", CustomJS(args={"made": made}, code="made.reset.emit()"))
    made.title.text_font_size = "13px"
    made.outline_line_color = None
    for axis in made.axis:
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_font_size = axis.major_label_text_font_size = "12px"
        axis.axis_line_color = style.RULE_COLOUR
        axis.minor_tick_line_color = None
    made.grid.grid_line_color = "#E6E6E6"
    return made


def source(**columns: Any) -> ColumnDataSource:
    """Columns of numbers that a page carries with single precision, which no eye can tell."""
    return ColumnDataSource(
        {name: np.asarray(values, dtype=np.float32) for name, values in columns.items()}
    )


def line(to: Any, x: np.ndarray, y: np.ndarray, colour: str, **more: Any) -> Any:
    """Draw a line, thinned so that each rise and fall is kept."""
    kept = thinned(y)
    columns = source(x=x[kept], y=y[kept])
    return to.line("x", "y", source=columns, color=colour, line_width=1.6, **more)


def thinned(values: np.ndarray) -> np.ndarray:
    """Indices of at most `MOST_POINTS` values: in each stretch the first, least and greatest."""
    count = len(values)
    if count <= MOST_POINTS:
        return np.arange(count)
    edges = np.linspace(0, count, MOST_POINTS // 3 + 1).astype(int)
    kept = [0, count - 1]
    for start, end in pairwise(edges):
        part = values[start:end]
        if np.isfinite(part).any():
            kept += [start, start + int(np.nanargmin(part)), start + int(np.nanargmax(part))]
        else:
            kept.append(start)  # a gap stays a gap
    return np.unique(kept)


def hover(to: Any, drawn: Any, *shown: tuple[str, str]) -> None:
    """Show numbers beside the pointer."""
    to.add_tools(HoverTool(renderers=[drawn], tooltips=list(shown), mode="vline"))


def shade(to: Any, stretches: Iterable[tuple[float, float]], colour: str) -> None:
    """Shade stretches of the horizontal axis."""
    for left, right in stretches:
        to.add_layout(
            BoxAnnotation(left=left, right=right, fill_color=colour, fill_alpha=0.6,
                          line_color=None, level="underlay")
        )  # fmt: skip


def rule(to: Any, value: float, colour: str) -> None:
    """Draw a dashed line across the panel."""
    to.add_layout(Span(location=value, dimension="width", line_color=colour, line_dash="dashed"))


def legend(to: Any, place: str = "above") -> None:
    """Put the legend, if there is one, beside the data; clicks hide lines."""
    for made in list(to.legend):
        made.orientation = "horizontal"
        made.border_line_color = None
        made.label_text_font_size = "12px"
        made.padding = made.margin = 2
        made.click_policy = "hide"
        to.add_layout(made, place)


def embedded(figures: Mapping[str, LayoutDOM]) -> tuple[dict[str, str], str]:
    """Return a place for each figure, and the scripts that fill them without any network.

    Returns
    -------
    places : dict of str
        HTML, by the names of the figures.
    scripts : str
        HTML, the library among it.
    """
    needed = ["bokeh"]
    if any(made.select({"type": Widget}) for made in figures.values()):
        needed += ["bokeh-widgets", "bokeh-tables"]
    resources = Resources(mode="inline", components=needed)
    script, places = components(dict(figures))
    return places, resources.render() + script
