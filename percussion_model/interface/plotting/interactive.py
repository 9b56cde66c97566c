"""Interactive figures of studies (bokeh): panels, and their embedding in a page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bokeh.embed import components
from bokeh.models import CustomJS, LayoutDOM, Widget
from bokeh.plotting import figure
from bokeh.resources import Resources

from percussion_model.interface.plotting import style

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
