"""Figures of the explorer: made once, and filled with one response after the other."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from bokeh.models import ColorBar, ColumnDataSource, HoverTool, LinearColorMapper, Range1d
from bokeh.palettes import interp_palette

from percussion_model.interface.explore.response import Response
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.interactive import panel
from percussion_model.interface.plotting.interactive_run import STRESS_COLOURS, image_columns
from percussion_model.interface.plotting.style import KN, MM, MPA, MS, US
from percussion_model.interface.plotting.window import Window
from percussion_model.physics.records import Mode

# A figure is moved by its page alone; on a telephone a finger on it moves the page.
TOOLS = "save"
EMPTY = np.zeros(0, np.float32)
ROOM = 0.05
# Forces are drawn beyond the time for which the bit is active, since the axis is rounded.
REACH = 1.25
CAPTIONS = {
    "stress": (
        "Stress along piston and bit, top to bottom, from the impact on. Red is compression, blue "
        "tension. The line between the bars is thick while the piston touches the bit."
    ),
    "forces": "Force of the bit on the rock and of the piston on the bit, positive in compression.",
    "law": (
        "Path of one blow in the law of the rock: force against the penetration of the bit's end "
        "since the impact."
    ),
}


class Figures:
    """The three figures, and the columns of numbers behind them."""

    def __init__(self) -> None:
        self.mapper = LinearColorMapper(interp_palette(STRESS_COLOURS, 255), low=-1.0, high=1.0)
        self.images = ColumnDataSource(image_columns({})[0])
        self.border, self.closed = _pairs(), _pairs()
        self.stress = self._stress()
        self.contact, self.force, self.path = _line(), _by_mode(), _by_mode()
        # each change of a column is a message: lines of all modes share one
        self.pinned = {name: _line() for name in ("contact", "force", "path")}
        self.forces = panel(
            "Forces over time", "time [ms]",
            "force [kN]", tools=TOOLS, x_range=Range1d(0.0, 1.0), y_range=Range1d(0.0, 1.0),
        )  # fmt: skip
        self.law = panel(
            "Force against penetration", "penetration [mm]", "bit force [kN]",
            tools=TOOLS, x_range=Range1d(0.0, 1.0), y_range=Range1d(0.0, 1.0),
        )  # fmt: skip
        _draw(self.forces, self.pinned["contact"], style.RULE_COLOUR, line_dash="dotted")
        _draw(self.forces, self.pinned["force"], style.RULE_COLOUR)
        _draw(self.law, self.pinned["path"], style.RULE_COLOUR)
        _draw(self.forces, self.contact, style.PISTON_COLOUR, line_dash="dotted")
        for made, columns in ((self.forces, self.force), (self.law, self.path)):
            made.multi_line("x", "y", color="colour", source=columns, line_width=2)
        for made, x in ((self.forces, "ms"), (self.law, "mm")):
            shown = [("", f"$x{{0.000}} {x}, $y{{0.0}} kN")]
            made.add_tools(HoverTool(tooltips=shown, mode="mouse"))
        for made in (self.stress, self.forces, self.law):
            made.js_event_callbacks = {}  # a double click would go back to axes of nothing

    def _stress(self) -> Any:
        made = panel(
            "Stress in piston and bit", "time [µs]",
            "depth below the top [mm]", tools=TOOLS, height=340,
            x_range=Range1d(0.0, 1.0), y_range=Range1d(1.0, 0.0),
        )  # fmt: skip
        drawn = made.image("image", "x", "y", "dw", "dh", source=self.images,
                           color_mapper=self.mapper)  # fmt: skip
        made.multi_line("x", "y", source=self.border, color="black", line_dash="dashed")
        made.multi_line("x", "y", source=self.closed, color="black", line_width=3)
        told = [("", "$x{0.0} µs, $y{0.0} mm: @image{0.0} MPa")]
        made.add_tools(HoverTool(renderers=[drawn], tooltips=told))
        bar = ColorBar(color_mapper=self.mapper, title="stress [MPa], compression positive",
                       height=10, title_text_font_style="normal")  # fmt: skip
        made.add_layout(bar, "below")
        return made

    def draw(self, response: Response) -> None:
        """Show a response; nothing where there is none."""
        window = response.window
        curves = _curves(window)
        self.contact.data = _columns(*curves["contact"][:2])
        self._draw_stress(response)
        self.force.data = _mode_columns(*curves["force"])
        self.path.data = _mode_columns(*curves["path"])
        self._fit()
        if window is None:
            return
        start, end = min(0.0, float(window.time[0])), window.active_until
        _move(self.forces.x_range, *_rounded(start * MS, end * MS))
        depth, _, modes = curves["path"]
        _move(self.law.x_range, *_rounded(*_touching(depth, modes)))

    def pin(self, response: Response | None) -> None:
        """Keep the curves of a response in grey, or of none."""
        curves = _curves(None if response is None else response.window)
        for name, columns in self.pinned.items():
            x, y, modes = curves[name]
            in_flight = (modes == Mode.FF) & (name == "path")
            columns.data = _columns(np.where(in_flight, np.nan, x), y)
        self._fit()

    def _fit(self) -> None:
        """Let the axes of forces span what is drawn, now and pinned."""
        pinned = {name: columns.data["y"] for name, columns in self.pinned.items()}
        forces = self.contact.data["y"], *self.force.data["y"], pinned["contact"], pinned["force"]
        for made, drawn in (
            (self.forces, forces),
            (self.law, (*self.path.data["y"], pinned["path"])),
        ):
            values = np.concatenate(drawn)
            values = values[np.isfinite(values)]
            low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
            room = ROOM * (high - low) or 1.0
            _move(made.y_range, *_rounded(low - room, high + room))

    def _draw_stress(self, response: Response) -> None:
        fields, window = response.fields, response.window
        self.images.data, ends = image_columns(fields)
        closed = []
        if fields and window is not None:
            limit = max(float(np.abs(one.stress).max(initial=0.0)) for one in fields.values())
            _, limit = _rounded(0.0, limit / MPA or 1.0)
            if self.mapper.high != limit:
                self.mapper.update(low=-limit, high=limit)
            end = float(next(iter(fields.values())).time_edges[-1]) * US
            _move(self.stress.x_range, 0.0, end)
            _move(self.stress.y_range, ends[-1], 0.0)
            closed = [(a * US, min(b * US, end)) for a, b in window.contacts if a * US < end]
        inner, time = ends[:-1], self.stress.x_range
        self.border.data = {
            "x": [[time.start, time.end] for _ in inner], "y": [[at, at] for at in inner]
        }  # fmt: skip
        self.closed.data = {
            "x": [list(pair) for pair in closed for _ in inner],
            "y": [[at, at] for _ in closed for at in inner],
        }


def _columns(x: np.ndarray, y: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of a line, with single precision, which no eye can tell."""
    return {"x": np.asarray(x, np.float32), "y": np.asarray(y, np.float32)}


def _line() -> ColumnDataSource:
    return ColumnDataSource(_columns(EMPTY, EMPTY))


def _pairs() -> ColumnDataSource:
    return ColumnDataSource({"x": [], "y": []})


def _by_mode() -> ColumnDataSource:
    return ColumnDataSource(_mode_columns(EMPTY, EMPTY, EMPTY))


def _mode_columns(x: np.ndarray, y: np.ndarray, modes: np.ndarray) -> dict[str, list[Any]]:
    """Lines of all modes that occur, and their colours."""
    lines = list(style.by_mode(x, y, modes))
    return {
        "x": [np.asarray(xs, np.float32) for _, xs, _ in lines],
        "y": [np.asarray(ys, np.float32) for _, _, ys in lines],
        "colour": [style.MODE_COLOURS[mode] for mode, _, _ in lines],
    }


def _draw(to: Any, columns: ColumnDataSource, colour: str, **more: Any) -> None:
    to.line("x", "y", source=columns, color=colour, line_width=2, **more)


def _rounded(start: float, end: float) -> tuple[float, float]:
    """Round a stretch outwards, so that axes stand still while a slider moves by little."""
    unit = 10.0 ** math.floor(math.log10(end - start)) / 4.0
    return unit * math.floor(start / unit), unit * math.ceil(end / unit)


def _move(to: Range1d, start: float, end: float) -> None:
    """Show a stretch of an axis."""
    changed = {"start": start, "end": end}
    to.update(**{name: at for name, at in changed.items() if getattr(to, name) != at})


Line = tuple[np.ndarray, np.ndarray, np.ndarray]


def _curves(window: Window | None) -> dict[str, Line]:
    """Forces on bit and rock [kN] over time [ms], that on the rock over penetration [mm]; modes.

    Time goes as far as the bit is active, the path in the law of the rock from the impact on.
    """
    if window is None:
        return dict.fromkeys(("contact", "force", "path"), (EMPTY, EMPTY, EMPTY))
    shown, inside = window.time <= REACH * window.active_until, window.time >= 0.0
    time, depth = window.time[shown] * MS, window.since_start("bit_end_position") * MM
    force, modes = window.samples["bit_force"] / KN, window.samples["drilling_mode"]
    pushed = np.nan_to_num(window.samples["contact_force"]) / KN
    return {
        "contact": (time, pushed[shown], modes[shown]),
        "force": (time, force[shown], modes[shown]),
        "path": (depth[inside], force[inside], modes[inside]),
    }


def _touching(depth: np.ndarray, modes: np.ndarray) -> tuple[float, float]:
    """Stretch of penetration in which the bit is on the rock, with some room [mm]."""
    touching = depth[modes != Mode.FF] if (modes != Mode.FF).any() else depth
    room = ROOM * float(np.ptp(touching)) or 1.0
    return float(touching.min()) - room, float(touching.max()) + room
