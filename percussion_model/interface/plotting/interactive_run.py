"""Interactive figures of a run: the same panels as those of `figures`."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.layouts import column, gridplot
from bokeh.models import (
    BasicTicker,
    BoxAnnotation,
    ColorBar,
    ColumnDataSource,
    HoverTool,
    LayoutDOM,
    LinearColorMapper,
    Range1d,
    RangeTool,
)
from bokeh.palettes import interp_palette

from percussion_model.interface.plotting import FEWEST_BLOWS, style
from percussion_model.interface.plotting.interactive import hover, legend, line, panel, rule, shade
from percussion_model.interface.plotting.style import KN, MM, MPA, MS, US
from percussion_model.interface.plotting.window import StressField, Window
from percussion_model.physics.records import Mode
from percussion_model.simulation.result import Result
from percussion_model.simulation.uncertain import rate_text, shown_error

# Blue for tension, white, red for compression.
STRESS_COLOURS = ("#053061", "#4393C3", "#F7F7F7", "#D6604D", "#67001F")
# Rows of pixels of a bar whose cells differ in height.
MOST_ROWS = 240


def interactive_figures(
    result: Result, blow: tuple[Window, dict[str, StressField]] | None
) -> dict[str, LayoutDOM]:
    """Draw the figures of a result, by the names of `CAPTIONS`.

    Parameters
    ----------
    result : Result
    blow : (Window, dict of StressField) or None
        As from `last_blow`.
    """
    made: dict[str, LayoutDOM] = {}
    if len(result.blows) >= FEWEST_BLOWS:
        made["overview"] = _overview(result)
    if blow is None:
        return made
    window, fields = blow
    made["bit_motion"] = _motion(window)
    if fields:
        made["stress_waves"] = _stress(window, fields)
    return made


def _overview(result: Result) -> LayoutDOM:
    """Six panels over the blows, with one time axis."""
    blows, shared = result.blows, Range1d(0.0, result.duration)
    time = blows["time"]
    contents: list[tuple[str, str, list[tuple[str, np.ndarray, str]]]] = [
        ("Depth at each blow", "depth gained [mm]",
         [("mean bit position", blows["bit_position"] * MM, style.RULE_COLOUR),
          ("hole", blows["hole_depth"] * MM, style.BIT_COLOUR)]),
        ("Rate of penetration of each blow", "rate [mm/s]",
         [("", blows["hole_advance"] / blows["period"] * MM, style.BIT_COLOUR)]),
        ("Mean piston velocity at impact", "velocity [m/s]",
         [("", blows["impact_velocity"], style.BIT_COLOUR)]),
        ("Period of each blow", "period [ms]", [("", blows["period"] * MS, style.BIT_COLOUR)]),
        ("Contacts and drilling cycles", "number per blow [–]",
         [("drilling cycles", blows["drilling_cycles"], style.BIT_COLOUR),
          ("piston/bit contacts", blows["contacts"], style.PISTON_COLOUR)]),
        ("Greatest forces of each blow", "peak force [kN]",
         [("bit on rock", blows["peak_bit_force"] / KN, style.BIT_COLOUR),
          ("piston on bit", blows["peak_contact_force"] / KN, style.PISTON_COLOUR)]),
    ]  # fmt: skip
    panels = [_over_blows(time, *content, shared) for content in contents]
    _mean(panels[1], result)
    for one in panels:
        shade(one, [(0.0, result.settle)], "#EDEDED")
    return gridplot(panels, ncols=2, sizing_mode="stretch_width", toolbar_location="right")


def _mean(to: Any, result: Result) -> None:
    """Draw the mean rate with a band of its error, and say it in the title."""
    summary = result.summary()
    mean, error = summary["rate_of_penetration"], shown_error(summary, "rate_of_penetration")
    if mean is None:
        return
    to.title.text = f"Rate of each blow — mean {rate_text(summary)} mm/s"
    if result.rate_of_penetration_undecided:
        return
    rule(to, mean * MM, style.MEAN_COLOUR)
    if error:
        ends = (mean - error) * MM, (mean + error) * MM
        to.add_layout(
            BoxAnnotation(bottom=ends[0], top=ends[1], fill_color=style.MEAN_COLOUR,
                          fill_alpha=0.2, line_color=None)
        )  # fmt: skip


def _over_blows(
    time: np.ndarray,
    title: str,
    unit: str,
    lines: list[tuple[str, np.ndarray, str]],
    shared: Range1d,
) -> Any:
    made = panel(title, "time [s]", unit, x_range=shared)
    for name, values, colour in lines:
        if not np.isfinite(values).any():
            continue
        named = {"legend_label": name} if name else {}
        drawn = line(made, time, np.asarray(values, float), colour, **named)
        hover(made, drawn, ("time", "@x{0.0000} s"), (name or unit, "@y{0.0000}"))
    _keep_flat(made, np.concatenate([values for _, values, _ in lines]))
    legend(made)
    return made


def _keep_flat(made: Any, values: np.ndarray) -> None:
    """Do not blow up the rounding of a settled series into a mountain range."""
    finite = values[np.isfinite(values)]
    if len(finite):
        low, high = float(finite.min()), float(finite.max())
        room = max(0.08 * (high - low), 0.01 * max(abs(low), abs(high))) or 1.0
        made.y_range = Range1d(low - room, high + room)


def _motion(window: Window) -> LayoutDOM:
    """Bit motion and forces over time, the whole blow to choose from, and two portraits."""
    end, time = window.active_until * MS, window.time * MS
    shared = Range1d(min(0.0, float(time[0])), end)
    contacts = [(start * MS, stop * MS) for start, stop in window.contacts]
    position = window.since_start("bit_position") * MM
    force = window.samples["bit_force"] / KN
    modes = window.samples["drilling_mode"]
    upper = panel(f"Mean bit motion — {window.name}", "", "displacement [mm]", x_range=shared)
    _by_mode(upper, time, position, modes, named=True)
    lower = panel("Force on the rock, and of the piston on the bit", "time [ms]", "force [kN]",
                  x_range=shared)  # fmt: skip
    if contacts:
        pushed = window.samples["contact_force"] / KN
        line(lower, time, pushed, style.PISTON_COLOUR, line_dash="dotted",
             legend_label="piston on bit")  # fmt: skip
    _by_mode(lower, time, force, modes)
    whole = panel("The whole stretch: move or stretch the window", "time [ms]", "force [kN]",
                  height=130, tools="", x_range=Range1d(time[0], time[-1]))  # fmt: skip
    _by_mode(whole, time, force, modes)
    whole.yaxis.ticker = BasicTicker(desired_num_ticks=2)
    whole.add_tools(RangeTool(x_range=shared))
    for one in (upper, lower):
        shade(one, contacts, style.SHADE_COLOUR)
        legend(one)
    inside = window.time >= 0.0
    phase = panel("Phase portrait of the mean bit motion", "mean bit displacement [mm]",
                  "mean bit velocity [m/s]")  # fmt: skip
    velocity = window.samples["bit_velocity"]
    _by_mode(phase, position[inside], velocity[inside], modes[inside])
    curve = panel("Force against penetration", "displacement of the rock end [mm]",
                  "bit force [kN]")  # fmt: skip
    depth = window.since_start("bit_end_position") * MM
    touching = inside & (modes != Mode.FF)
    if touching.any():
        room = 0.05 * float(np.ptp(depth[touching])) or 1.0
        curve.x_range = Range1d(depth[touching].min() - room, depth[touching].max() + room)
    _by_mode(curve, depth[inside], force[inside], modes[inside])
    portraits = gridplot([[phase, curve]], sizing_mode="stretch_width")
    return column(upper, lower, whole, portraits, sizing_mode="stretch_width")


def _by_mode(to: Any, x: np.ndarray, y: np.ndarray, modes: np.ndarray, named: bool = False) -> None:
    """Draw a line whose colour is the drilling mode."""
    for mode, xs, ys in style.by_mode(x, y, modes):
        name = {"legend_label": style.MODE_NAMES[mode]} if named else {}
        line(to, xs, ys, style.MODE_COLOURS[mode], **name)


def _stress(window: Window, fields: dict[str, StressField]) -> LayoutDOM:
    """Stress over time and depth, with the forces at the ends of the bit below."""
    end = float(next(iter(fields.values())).time_edges[-1]) * US
    shared = Range1d(0.0, end)
    limit = max(float(np.abs(field.stress).max(initial=0.0)) for field in fields.values()) or 1.0
    mapper = LinearColorMapper(
        interp_palette(STRESS_COLOURS, 255), low=-limit / MPA, high=limit / MPA
    )
    images, ends = image_columns(fields)
    names = " and ".join(fields)
    upper = panel(f"Axial stress in {names} — {window.name}", "", "depth below the top [mm]",
                  x_range=shared, y_range=Range1d(ends[-1], 0.0), height=380)  # fmt: skip
    contacts = [(start * US, min(stop * US, end)) for start, stop in window.contacts
                if start * US < end]  # fmt: skip
    drawn = upper.image(*images, source=ColumnDataSource(images), color_mapper=mapper)
    told = [("time", "$x{0.0} µs"), ("depth", "$y{0.0} mm"), ("stress", "@image{0.0} MPa")]
    upper.add_tools(HoverTool(renderers=[drawn], tooltips=told))
    for border in ends[:-1]:
        rule(upper, border, "black")
        for stretch in contacts:
            upper.line(stretch, (border, border), color="black", line_width=3)
    upper.add_layout(
        ColorBar(color_mapper=mapper, title="MPa, compression positive", width=12), "right"
    )
    lower = panel("Forces at the ends of the bit", "time [µs]", "force [kN]", x_range=shared)
    shown = (window.time >= 0) & (window.time * US <= end)
    time = window.time[shown] * US
    for sampled, name, colour in (
        ("contact_force", "piston on bit", style.PISTON_COLOUR),
        ("bit_force", "bit on rock", style.BIT_COLOUR),
    ):
        if len(fields) == 2 or sampled == "bit_force":
            force = window.samples[sampled][shown] / KN
            line(lower, time, force, colour, legend_label=name)
    shade(lower, contacts, style.SHADE_COLOUR)
    legend(lower)
    return column(upper, lower, sizing_mode="stretch_width")


def image_columns(fields: dict[str, StressField]) -> tuple[dict[str, list[Any]], list[float]]:
    """Columns of the images of bars, one below the other [µs], [mm], [MPa], and their ends [mm]."""
    columns: dict[str, list[Any]] = {name: [] for name in ("image", "x", "y", "dw", "dh")}
    top, ends = 0.0, []
    for one in fields.values():
        values = (one.stress[_image_rows(one)] / MPA).astype(np.float32)
        first, last = float(one.time_edges[0]) * US, float(one.time_edges[-1]) * US
        depth = float(one.depth_edges[-1]) * MM
        row = values, first, top, last - first, depth
        for values_of, value in zip(columns.values(), row, strict=True):
            values_of.append(value)
        top += depth
        ends.append(top)
    return columns, ends


def _image_rows(field: StressField) -> np.ndarray:
    """Cell of each row of pixels: rows are alike in height, cells need not be."""
    edges, heights = field.depth_edges, np.diff(field.depth_edges)
    if np.ptp(heights) <= 1e-6 * heights.mean():
        return np.arange(len(heights))
    centres = (np.arange(MOST_ROWS) + 0.5) / MOST_ROWS * edges[-1]
    return np.clip(np.searchsorted(edges, centres) - 1, 0, len(heights) - 1)
