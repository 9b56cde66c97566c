"""Figures of a study that can be zoomed: maps with sliders, or scatter, and a table to sort."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.layouts import column, gridplot
from bokeh.models import (
    ColumnDataSource,
    CustomJS,
    DataTable,
    HoverTool,
    LayoutDOM,
    ScientificFormatter,
    TableColumn,
)

from percussion_model.analysis.study import Study
from percussion_model.analysis.study.work import KINDS
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.zoom import TOOLS, panel
from percussion_model.interface.plotting.zoom_map import draw_map
from percussion_model.interface.plotting.zoom_quantities import choice, columns, labelled, titles

# Larger studies are thinned evenly where they are no grid, and in the table.
MOST_SHOWN = 20_000
KIND_COLOURS = dict(
    zip(KINDS, (style.BIT_COLOUR, style.MEAN_COLOUR, "#222222", "#999999"), strict=True)
)
# Columns of the table [pixels].
WIDE, NARROW = 190, 80


def zoomable_study(found: Study) -> dict[str, LayoutDOM]:
    """Draw a study: "map" of a grid or "scatter" of samples, and "points", a table."""
    found_there = columns(found)
    if found.points.is_grid:
        made: dict[str, LayoutDOM] = {"map": draw_map(found, found_there)}
    else:
        made = {"scatter": _scatter(found, found_there)}
    made["points"] = _table(found, found_there)
    return made


def _thinned(count: int) -> np.ndarray:
    return np.unique(np.linspace(0, count - 1, min(count, MOST_SHOWN)).astype(int))


def _scatter(found: Study, columns: dict[str, np.ndarray]) -> LayoutDOM:
    """What is shown over each parameter; points chosen in one panel stand out in all."""
    kept = _thinned(len(found.points))
    kinds = [KINDS[kind] for kind in found.rows["kind"][kept].tolist()]
    shared = ColumnDataSource(
        {
            **{name: values[kept] for name, values in columns.items()},
            **{f"at{k}": found.points.values[kept, k] for k in range(len(found.points.keys))},
            "value": columns["rate"][kept].copy(),
            "kind": kinds,
            "colour": [KIND_COLOURS[kind] for kind in kinds],
        }
    )
    chosen, names = choice(), titles()
    panels = []
    for k, key in enumerate(found.points.keys):
        label = labelled(key, found.scene.row_of(key).unit)
        made = panel(names["rate"], label, "", tools=f"{TOOLS},box_select,lasso_select")
        if len(found.points.keys) == 1:
            order = np.argsort(found.points.values[kept, 0])
            if np.array_equal(order, np.arange(len(order))):
                made.line("at0", "value", source=shared, color=style.BIT_COLOUR)
        drawn = made.scatter(f"at{k}", "value", source=shared, color="colour", size=5, alpha=0.7,
                             nonselection_alpha=0.06)  # fmt: skip
        made.add_tools(HoverTool(renderers=[drawn], tooltips=[
            (key, f"@at{k}{{0.[00000]}}"), ("shown", "@value{0.[00000]}"), ("motion", "@kind")
        ]))  # fmt: skip
        panels.append(made)
    update = CustomJS(
        args={"all": shared, "choice": chosen, "titles": names,
              "heads": [made.title for made in panels]},
        code="all.data.value = all.data[choice.value].slice(); all.change.emit();"
        "for (const head of heads) head.text = titles[choice.value];",
    )  # fmt: skip
    chosen.js_on_change("value", update)
    plots = gridplot(panels, ncols=min(2, len(panels)), sizing_mode="stretch_width")
    return column(chosen, plots, sizing_mode="stretch_width")


def _table(found: Study, columns: dict[str, np.ndarray]) -> LayoutDOM:
    """Points and numbers found; a click on a heading sorts."""
    kept = _thinned(len(found.points))
    number = ScientificFormatter(precision=4, power_limit_low=-4, power_limit_high=6)
    data: dict[str, Any] = {"kind": [KINDS[kind] for kind in found.rows["kind"][kept].tolist()]}
    shown = []
    for k, key in enumerate(found.points.keys):
        data[f"at{k}"] = found.points.values[kept, k]
        title = labelled(key, found.scene.row_of(key).unit)
        shown.append(TableColumn(field=f"at{k}", title=title, formatter=number, width=WIDE))
    shown.append(TableColumn(field="kind", title="motion", width=NARROW))
    for name, title in titles().items():
        data[name] = columns[name][kept]
        shown.append(TableColumn(field=name, title=title, formatter=number, width=WIDE))
    return DataTable(source=ColumnDataSource(data), columns=shown, height=360, index_position=None,
                     autosize_mode="none", reorderable=False,
                     sizing_mode="stretch_width")  # fmt: skip
