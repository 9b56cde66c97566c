"""Interactive figures of a study: maps with sliders or scatter, and a table to sort."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from bokeh.layouts import column, gridplot, row
from bokeh.models import (
    ColorBar,
    ColumnDataSource,
    CustomJS,
    CustomJSTickFormatter,
    DataTable,
    HoverTool,
    LayoutDOM,
    LinearColorMapper,
    LogColorMapper,
    Range1d,
    Select,
    Slider,
    TableColumn,
    Whisker,
)
from bokeh.palettes import Viridis256

from percussion_model.analysis.study import Study
from percussion_model.analysis.study.response import KINDS
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.interactive import TOOLS, legend, panel
from percussion_model.interface.plotting.shown_digits import (
    COUNT,
    GIVEN,
    OF_ERRORS,
    in_column,
    in_hover,
    of_choice,
)
from percussion_model.simulation.uncertain import UNDECIDED, UNSURE_DIGITS, of_the_cells

# Larger studies are thinned evenly where they are no grid, and in the table.
MOST_SHOWN = 20_000
KIND_COLOURS = dict(
    zip(KINDS, (style.BIT_COLOUR, style.MEAN_COLOUR, "#222222", "#999999"), strict=True)
)
# Columns of the table [pixels].
WIDEST, WIDE, NARROW = 300, 190, 80
# Lines that can be told apart.
MOST_LINES = 9
# A greatest value so many times the least one has colours by ratios.
WIDE_RANGE = 10.0
# Steps of an axis are even if they differ by no more than this share.
EVEN = 1e-6
# What can be shown: column of the page, name, unit, column of a study, factor from SI.
QUANTITIES = (
    ("rate", "Rate of penetration", "mm/s", "rate_of_penetration", 1e3),
    ("off", "Standard error (scatter) or convergence", "mm/s", "rate_of_penetration_error", 1e3),
    ("error", "The same, relative to the rate", "–", "", 1.0),
    ("period", "Blow period", "ms", "blow_period", 1e3),
    ("impact", "Impact velocity", "m/s", "impact_velocity", 1.0),
    ("stroke", "Stroke", "mm", "stroke", 1e3),
    ("energy", "Blow energy", "J", "blow_energy", 1.0),
    ("given", "Energy into the rock, per blow", "J", "rock_energy", 1.0),
    ("advance", "Penetration per blow", "mm", "penetration_per_blow", 1e3),
    ("bit_force", "Greatest bit force", "kN", "peak_bit_force", 1e-3),
    ("contact_force", "Greatest contact force", "kN", "peak_contact_force", 1e-3),
    ("contacts", "Contacts per blow", "–", "contacts_per_blow", 1.0),
    ("cycles", "Drilling cycles per blow", "–", "drilling_cycles_per_blow", 1.0),
    ("order", "Blows of a cycle", "–", "order", 1.0),
)
# Digits of all: the errors of the grids are not known.
DIGITS = dict.fromkeys((name for name, *_ in QUANTITIES), UNSURE_DIGITS)
DIGITS |= {"off": OF_ERRORS, "error": OF_ERRORS, "contacts": COUNT, "cycles": COUNT, "order": COUNT}
# Those that the error of the rate may hide, as a script asks for them.
HIDDEN = ("rate", "advance")
UNDECIDED_COLOUR, HATCH_COLOUR, GREY_POINT = "#EEEEEE", "#666666", "#BBBBBB"
# What the pointer shows of each point besides.
RATE_TOOLTIPS = ("rate", "@rate_text mm/s"), ("motion", "@motion")


def interactive_study(found: Study) -> dict[str, LayoutDOM]:
    """Draw a study: "map" of a grid or "scatter" of samples, and "points", a table."""
    carried = _columns(found)
    if found.points.is_grid:
        made: dict[str, LayoutDOM] = {"map": _map(found, carried)}
    else:
        made = {"scatter": _scatter(found, carried)}
    made["points"] = _table(found, carried)
    return made


def _thinned(count: int) -> np.ndarray:
    return np.unique(np.linspace(0, count - 1, min(count, MOST_SHOWN)).astype(int))


def _scatter(found: Study, columns: dict[str, np.ndarray]) -> LayoutDOM:
    """What is shown over each parameter; points chosen in one panel stand out in all."""
    kept = _thinned(len(found.points))
    kinds = _motions(found, kept)
    undecided = found.undecided[kept]
    shared = ColumnDataSource(
        {
            **{name: values[kept] for name, values in columns.items()},
            **{f"at{k}": found.points.values[kept, k] for k in range(len(found.points.keys))},
            "value": columns["rate"][kept].copy(),
            **_bars(columns, kept),
            "motion": kinds,
            "rate_text": _rates(found, kept),
            "colour": [
                GREY_POINT if hidden else KIND_COLOURS[kind]
                for kind, hidden in zip(kinds, undecided.tolist(), strict=True)
            ],
        }
    )
    chosen, names = _selector(), _titles()
    panels = []
    for k, key in enumerate(found.points.keys):
        label = _label(key, found.scene.row_of(key).unit)
        made = panel(names["rate"], label, "", tools=f"{TOOLS},box_select,lasso_select")
        if len(found.points.keys) == 1:
            order = np.argsort(found.points.values[kept, 0])
            if np.array_equal(order, np.arange(len(order))):
                made.line("at0", "value", source=shared, color=style.BIT_COLOUR)
        made.add_layout(Whisker(base=f"at{k}", lower="lower", upper="upper", source=shared,
                                line_color="colour", upper_head=None, lower_head=None))  # fmt: skip
        drawn = made.scatter(f"at{k}", "value", source=shared, color="colour", size=5, alpha=0.7,
                             nonselection_alpha=0.06)  # fmt: skip
        digits = {f"@at{k}": in_hover(GIVEN), "@value": of_choice(chosen, DIGITS)}
        made.add_tools(HoverTool(renderers=[drawn], formatters=digits, tooltips=[
            (key, f"@at{k}{{given}}"), ("shown", "@value{known}"), *RATE_TOOLTIPS
        ]))  # fmt: skip
        panels.append(made)
    update = CustomJS(
        args={"all": shared, "choice": chosen, "titles": names,
              "heads": [made.title for made in panels]},
        code="const d = all.data, of_rate = choice.value == 'rate';"
        "d.value = d[choice.value].slice();"
        "d.lower = d.value.map((v, k) => of_rate ? v - d.off[k] : v);"
        "d.upper = d.value.map((v, k) => of_rate ? v + d.off[k] : v); all.change.emit();"
        "for (const head of heads) head.text = titles[choice.value];",
    )  # fmt: skip
    chosen.js_on_change("value", update)
    plots = gridplot(panels, ncols=min(2, len(panels)), sizing_mode="stretch_width")
    return column(chosen, plots, sizing_mode="stretch_width")


def _table(found: Study, columns: dict[str, np.ndarray]) -> LayoutDOM:
    """Points and numbers found; a click on a heading sorts."""
    kept = _thinned(len(found.points))
    data: dict[str, Any] = {"kind": _motions(found, kept)}
    shown = []
    for k, key in enumerate(found.points.keys):
        data[f"at{k}"] = found.points.values[kept, k]
        title = _label(key, found.scene.row_of(key).unit)
        shown.append(
            TableColumn(field=f"at{k}", title=title, formatter=in_column(GIVEN), width=WIDE)
        )
    shown.append(TableColumn(field="kind", title="motion", width=NARROW))
    data["verdict"] = np.where(found.undecided[kept], UNDECIDED, "").tolist()
    shown.append(TableColumn(field="verdict", title="rate is", width=NARROW))
    for name, title in _titles().items():
        data[name] = columns[name][kept]
        width, digits = WIDEST if name == "off" else WIDE, in_column(DIGITS[name])
        shown.append(TableColumn(field=name, title=title, formatter=digits, width=width))
    return DataTable(source=ColumnDataSource(data), columns=shown, height=360, index_position=None,
                     autosize_mode="none", reorderable=False,
                     sizing_mode="stretch_width")  # fmt: skip


def _columns(found: Study) -> dict[str, np.ndarray]:
    """What the page carries of each point, in the units that it shows."""
    rows = found.rows
    return {
        name: np.asarray(
            (rows[field] if field else found.relative_error) * factor, dtype=np.float32
        )
        for name, _, _, field, factor in QUANTITIES
    }


def _bars(columns: dict[str, np.ndarray], kept: np.ndarray) -> dict[str, np.ndarray]:
    """Ends of the error bars of the rate."""
    rate, off = columns["rate"][kept], np.nan_to_num(columns["off"][kept])
    return {"lower": rate - off, "upper": rate + off}


def _motions(found: Study, kept: np.ndarray) -> list[str]:
    """Words for the kinds of motion."""
    return np.array(KINDS)[found.rows["kind"][kept]].tolist()


def _rates(found: Study, kept: np.ndarray) -> list[str]:
    """Rates [mm/s] as text, with what is known of their errors."""
    rates, of_cells = 1e3 * found.rows["rate_of_penetration"], found.depends_on_cells
    known = np.isfinite(rates)
    return [
        "–"
        if not known[k]
        else of_the_cells(float(rates[k]))
        if of_cells[k] and rates[k]
        else found.rate_text(k, "")
        for k in kept.tolist()
    ]


def _label(key: str, unit: str) -> str:
    """Key and unit of a parameter."""
    return f"{key} [{unit}]".replace("[-]", "[–]").replace("^2", "²").replace("^3", "³")


def _titles() -> dict[str, str]:
    """Name and unit of each quantity."""
    return {name: f"{words} [{unit}]" for name, words, unit, _, _ in QUANTITIES}


def _selector() -> Select:
    """A list to choose a quantity from."""
    return Select(
        title="Show", name="shown", value="rate", options=list(_titles().items()), width=280
    )


@dataclass(frozen=True)
class Axis:
    """Values of one parameter of a grid."""

    key: str
    unit: str
    values: np.ndarray
    stride: int  # from one value to the next among the points
    here: int  # the value next to that of the scene

    @property
    def label(self) -> str:
        """Key and unit."""
        return _label(self.key, self.unit)

    @property
    def scale(self) -> str:
        """Whether the values step evenly by number or by logarithm."""
        low = float(self.values.min())
        if len(self.values) < 3 or low <= 0 or self.values.max() / low < 3.0:
            return "linear"
        steps = np.diff(np.log(self.values))
        return "log" if np.ptp(steps) < EVEN * np.abs(steps).max() else "linear"

    @property
    def ticks(self) -> list[float]:
        """Round numbers on a logarithmic scale."""
        low, high = self.edges[[0, -1]]
        decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)))
        return [t for n in decades for m in (1, 2, 5) if low <= (t := m * 10.0**n) <= high]

    @property
    def edges(self) -> np.ndarray:
        """Borders of the cells around the values."""
        if len(self.values) == 1:
            return self.values[0] + np.array([-0.5, 0.5]) * (abs(self.values[0]) or 1.0)
        on = np.log(self.values) if self.scale == "log" else self.values
        inner = 0.5 * (on[1:] + on[:-1])
        edges = np.concatenate([[2.0 * on[0] - inner[0]], inner, [2.0 * on[-1] - inner[-1]]])
        return np.exp(edges) if self.scale == "log" else edges


def _axes(found: Study) -> list[Axis]:
    """Axes of a grid, those with most values first."""
    points, made = found.points, []
    for k, (key, count) in enumerate(zip(points.keys, points.shape, strict=True)):
        stride = int(np.prod(points.shape[k + 1 :]))
        values = points.values[: count * stride : stride, k]
        own = found.scene[key]
        here = int(np.argmin(np.abs(values - own))) if own is not None else count // 2
        made.append(Axis(key, found.scene.row_of(key).unit, values, stride, here))
    return sorted(made, key=lambda axis: -len(axis.values))


def _map(found: Study, columns: dict[str, np.ndarray]) -> LayoutDOM:
    """A map over two axes and cuts through it; sliders for the other axes."""
    x, y, *others = _axes(found)
    others = [axis for axis in others if len(axis.values) > 1]
    base = sum(axis.here * axis.stride for axis in others)
    offset = (
        np.arange(len(y.values))[:, None] * y.stride + np.arange(len(x.values))[None, :] * x.stride
    )
    undecided, cells = found.undecided, _cells(x, y, base + offset, base, columns, found)
    rows = len(y.values)
    shown = sorted({int(k) for k in np.linspace(0, rows - 1, min(rows, MOST_LINES)).round()})
    lines = ColumnDataSource(
        {
            "xs": [x.values.tolist()] * len(shown),
            "ys": [_seen(columns["rate"], undecided)[base + offset[k]].tolist() for k in shown],
            "at": [float(y.values[k]) for k in shown],
            "colour": [Viridis256[int(235 * i / max(1, len(shown) - 1))]
                       for i in range(len(shown))],
        }
    )  # fmt: skip
    limits = _limits(cells.data["value"])
    # a map over decades would be of one colour: its colours step by ratios
    is_wide = limits["low"] > 0.0 and limits["high"] > WIDE_RANGE * limits["low"]
    mapper = (LogColorMapper if is_wide else LinearColorMapper)(
        Viridis256, nan_color="#DDDDDD", **limits
    )
    chosen, given = _selector(), in_hover(GIVEN)
    known = of_choice(chosen, DIGITS, name="known digits")
    left = panel("", x.label, y.label, height=400, x_axis_type=x.scale, y_axis_type=y.scale,
                 x_range=_over(x), y_range=_over(y), name="map")  # fmt: skip
    right = panel("", x.label, "", height=400, x_axis_type=x.scale)
    quads = left.quad("left", "right", "bottom", "top", source=cells, line_width=0.6,
                      color={"field": "value", "transform": mapper})  # fmt: skip
    left.quad("left", "right", "bottom", "top", source=cells, fill_color=UNDECIDED_COLOUR,
              fill_alpha="grey", hatch_pattern="right_diagonal_line", hatch_alpha="grey",
              hatch_color=HATCH_COLOUR, hatch_scale=12, line_color=None,
              legend_label=f"{UNDECIDED}: error ≥ rate", visible=True)  # fmt: skip
    left.scatter("x", "y", size="mark", source=cells, marker="x", color="white", line_width=1.5)
    left.add_tools(HoverTool(renderers=[quads], tooltips=[
        (x.key, "@x{given}"), (y.key, "@y{given}"), ("shown", "@value{known}"), *RATE_TOOLTIPS,
    ], formatters={"@x": given, "@y": given, "@value": known}))  # fmt: skip
    legend(left)
    left.legend.visible = bool(undecided.any())
    for made, axis in ((left.xaxis, x), (left.yaxis, y), (right.xaxis, x)):
        if axis.scale == "log":
            made.ticker, made.formatter = axis.ticks, CustomJSTickFormatter(code=SHORT)
    left.add_layout(ColorBar(color_mapper=mapper, width=12), "right")
    left.grid.visible = False
    drawn = right.multi_line("xs", "ys", source=lines, color="colour", line_width=2)
    right.add_tools(HoverTool(renderers=[drawn], tooltips=[
        (y.key, "@at{given}"), ("shown", "$data_y{known}")
    ], formatters={"@at": given, "$data_y": known}))  # fmt: skip
    sliders = [_slider(axis) for axis in others]
    everything = ColumnDataSource(
        {
            **columns, "rate_text": _rates(found, np.arange(len(found.points))),
            "kind": found.rows["kind"].astype(np.int32), "hidden": undecided.astype(np.int32),
        }
    )  # fmt: skip
    names = _titles()
    left.title.text = names["rate"]
    low, high = y.values.min(), y.values.max()
    # in two lines: half a page is too narrow for one
    right.title.text = f"Cuts, dark to light:\n{y.key} {low:.4g} to {high:.4g} {y.unit}"
    right.yaxis.axis_label = names["rate"]
    update = CustomJS(
        args={
            "all": everything, "cells": cells, "lines": lines, "mapper": mapper,
            "choice": chosen, "sliders": sliders, "titles": names, "left": left.title,
            "strides": [axis.stride for axis in others], "right": right.yaxis[0],
            "shown": shown, "width": len(x.values), "hideable": list(HIDDEN), "wide": is_wide,
            "words": UNDECIDED, "names": list(KINDS),
        },
        code=UPDATE_MAP,
    )  # fmt: skip
    for control in (chosen, *sliders):
        control.js_on_change("value", update)
    controls = row(chosen, *sliders, sizing_mode="stretch_width")
    return column(
        controls, gridplot([[left, right]], sizing_mode="stretch_width"),
        sizing_mode="stretch_width",
    )  # fmt: skip


# A number without its zeros.
SHORT = """
const plain = Number(tick.toPrecision(3));
return 1e-3 <= plain && plain < 1e5 ? String(plain) : plain.toExponential();
"""
# Takes the chosen slice of the chosen column out of all points.
UPDATE_MAP = """
const from = all.data[choice.value], kind = all.data.kind;
let base = 0;
for (let k = 0; k < sliders.length; k++) base += strides[k] * sliders[k].value;
const {offset, value, mark, grey, rate_text, verdict, motion} = cells.data;
const may_hide = hideable.includes(choice.value);
let low = Infinity, high = -Infinity;
for (let j = 0; j < offset.length; j++) {
  const k = base + offset[j], hidden = all.data.hidden[k] == 1;
  const v = may_hide && hidden ? NaN : from[k];
  value[j] = v;
  grey[j] = may_hide && hidden ? 1 : 0;
  rate_text[j] = all.data.rate_text[k];
  verdict[j] = hidden ? words : "";
  motion[j] = names[kind[k]];
  mark[j] = kind[k] == 0 ? 0 : 6;
  if (isFinite(v) && (v > 0 || !wide)) { low = Math.min(low, v); high = Math.max(high, v); }
}
if (low > high) { low = wide ? 0.1 : 0; high = 1; }
mapper.low = low;
mapper.high = high > low ? high : low + (Math.abs(low) || 1) * 1e-3;
lines.data.ys = shown.map(row => Array.from(value.slice(row * width, (row + 1) * width)));
left.text = titles[choice.value];
right.axis_label = titles[choice.value];
cells.change.emit();
lines.change.emit();
"""


def _cells(
    x: Axis, y: Axis, at: np.ndarray, base: int, columns: dict[str, np.ndarray], found: Study
) -> ColumnDataSource:
    """Cells of a map, row by row from the lowest value of the vertical axis on."""
    across, up = len(x.values), len(y.values)
    at, undecided = at.ravel(), found.undecided
    return ColumnDataSource(
        {
            "left": np.tile(x.edges[:-1], up), "right": np.tile(x.edges[1:], up),
            "bottom": np.repeat(y.edges[:-1], across), "top": np.repeat(y.edges[1:], across),
            "x": np.tile(x.values, up), "y": np.repeat(y.values, across),
            "offset": (at - base).astype(np.int32),
            "value": _seen(columns["rate"], undecided)[at],
            "grey": undecided[at].astype(np.float32),
            "rate_text": _rates(found, at),
            "verdict": np.where(undecided[at], UNDECIDED, "").tolist(),
            "motion": _motions(found, at),
            "mark": np.where(found.rows["kind"][at] == KINDS.index("periodic"), 0.0, 6.0),
        },
        name="cells",
    )  # fmt: skip


def _seen(values: np.ndarray, undecided: np.ndarray) -> np.ndarray:
    """Values without those that their errors hide."""
    return np.where(undecided, np.float32(np.nan), values)


def _limits(values: Any) -> dict[str, float]:
    finite = np.asarray(values)[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    return {"low": low, "high": high if high > low else low + 1e-3 * (abs(low) or 1.0)}


def _over(axis: Axis) -> Range1d:
    return Range1d(float(axis.edges[0]), float(axis.edges[-1]))


def _slider(axis: Axis) -> Slider:
    shown = CustomJSTickFormatter(
        args={"values": axis.values.tolist()},
        code="return String(Number(values[tick].toPrecision(5)))",
    )
    return Slider(start=0, end=len(axis.values) - 1, value=axis.here, step=1, title=axis.label,
                  format=shown, name=axis.key, sizing_mode="stretch_width")  # fmt: skip
