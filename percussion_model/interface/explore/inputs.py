"""Inputs of the explorer: a slider with a field, a switch or a choice for rows of the table."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

from bokeh.layouts import column
from bokeh.layouts import row as side_by_side
from bokeh.models import Checkbox, Div, LayoutDOM, Select, Slider, TextInput

from percussion_model.scene.parameters import GROUPS
from percussion_model.scene.rows import ParameterRow, SceneError, shortened
from percussion_model.scene.scene import Scene
from percussion_model.scene.text import read_setting

# Numbers with a slider, in the order of the page, and where it reaches from and to [SI]: what is
# worth trying. The field beside it takes all that the table of parameters allows.
SLIDERS = {
    "feed.force": (0.0, 20e3),
    "drive.force": (500.0, 20e3),
    "drive.reversal_distance": (0.005, 0.1),
    "drive.external_force": (-20e3, 20e3),
    "rock.loading_stiffness": (1e8, 3e9),
    "rock.unloading_ratio": (1.1, 20.0),
    "rock.barrier_energy": (0.0, 0.5),
}
LENGTH = (0.02, 0.5)
BARS = ("piston", "bit")
# So many sections of a bar have a slider; the lengths of others stay those of the scene.
MOST_SECTIONS = 6
# Switches of a drill string, which the explorer does not show.
_OF_STRINGS = ("string", "joints", "damper")
# A slider has so many steps, about; its values have so many digits.
STEPS, DIGITS = 200, 10
# Outside of these numbers are written with an exponent.
LEAST_PLAIN, LARGEST_PLAIN = 1e-4, 1e6
# No number is written with more characters.
LONGEST = 60

WIDGETS = """
:host { font: 15px/1.35 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
.bk-input:focus, .noUi-handle:focus, .bk-btn:focus, input:focus, textarea:focus, select:focus {
  outline: 3px solid #0072B2 !important; outline-offset: 1px; }
.bk-input-group label, label { white-space: normal; }
.key { color: #5f6368; font: 12.5px ui-monospace, "DejaVu Sans Mono", monospace; }
.noUi-handle { border-radius: 4px; }
:host(.refused) .bk-input { border-color: #D55E00; background: #FFF4E0; }
"""

# Takes a key and its value; what is wrong with it, else nothing.
Change = Callable[[str, Any], str]


def label_of(row: ParameterRow, key: str) -> str:
    """Name of a number with its unit: where it is in a bar, and what the table says of it."""
    parts = key.split(".")
    place = f"{parts[0]}, section {int(parts[2]) + 1}: " if len(parts) > 2 else ""
    unit = f" [{row.unit}]" if row.unit not in ("", "-") else ""
    return f"{place}{row.description}{unit}"


def range_of(key: str, value: float) -> tuple[float, float, float]:
    """Start, end and step of the slider of a number, so that it reaches a value."""
    low, high = SLIDERS.get(key, LENGTH)
    start, end = min(low, value), max(high, value)
    step = 10.0 ** math.floor(math.log10((end - start) / STEPS))
    step *= next(m for m in (1.0, 2.0, 5.0, 10.0) if m * step * STEPS >= 0.99 * (end - start))
    return start, end, step


def short(value: float) -> str:
    """A number as one writes it in a scene, without the rounding of a slider: 0.04, 2500, 7.5e8."""
    if value == 0.0 or LEAST_PLAIN <= abs(value) < LARGEST_PLAIN:
        return f"{value:.{DIGITS}g}"
    mantissa, _, exponent = f"{value:.{DIGITS - 1}e}".partition("e")
    return f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}"


class Quiet:
    """Widgets that are changed without hearing of it."""

    _quiet = False

    def _set(self, widget: Any, **values: Any) -> None:
        self._quiet = True
        try:
            widget.update(**values)
        finally:
            self._quiet = False


class Entry(Quiet):
    """Slider and field of one number; the field takes what the slider does not reach."""

    def __init__(self, key: str, scene: Scene, change: Change) -> None:
        self.key, self.change = key, change
        self.row = scene.row_of(key)
        value = float(scene[key])
        start, end, step = range_of(self.key, value)
        self.slider = Slider(
            start=start, end=end, step=step, value=value,
            show_value=False, tooltips=False, name=key, stylesheets=[WIDGETS],
            sizing_mode="stretch_width", bar_color="#0072B2",
        )  # fmt: skip
        self.field = TextInput(
            value=short(value), width=112, name=f"{key} field", stylesheets=[WIDGETS],
            max_length=LONGEST,
        )  # fmt: skip
        named = f'<span class="name">{html.escape(label_of(self.row, key))}</span>'
        wide: dict[str, Any] = {"sizing_mode": "stretch_width", "stylesheets": [WIDGETS]}
        self.label = Div(text=f'{named} <span class="key">{key}</span>', **wide)
        self.note = Div(name=f"{key} note", text="", visible=False, **wide)
        self.refused = False
        self.slider.on_change("value", self._slid)
        self.field.on_change("value", self._typed)
        self.show_use(scene)

    @cached_property
    def layout(self) -> LayoutDOM:
        """The label, the row of both, and the note below."""
        pair = side_by_side(self.slider, self.field, sizing_mode="stretch_width", spacing=14)
        return column(self.label, pair, self.note, sizing_mode="stretch_width", spacing=0)

    def start(self, scene: Scene) -> None:
        """Take the value of a scene to start from."""
        self._show(float(scene[self.key]))
        self._tell("")
        self.show_use(scene)

    def show_use(self, scene: Scene) -> None:
        """Take the value of a scene; grey out what has no effect there, and say what it needs."""
        self.value = float(scene[self.key])
        needed = scene.matters(self.key)
        for widget in (self.slider, self.field):
            if widget.disabled == needed:
                widget.disabled = not needed
        if not self.refused:  # what is refused is still in the field
            self._say("" if needed else f"without effect: needs {self.row.effect}", "calm")

    def _slid(self, _: str, __: Any, value: float) -> None:
        if self._quiet:
            return
        value = float(f"{value:.{DIGITS}g}")
        self._set(self.field, value=short(value))
        self._tell(self.change(self.key, value))

    def _typed(self, _: str, __: Any, text: str) -> None:
        if self._quiet:
            return
        try:
            if len(text) > LONGEST:
                raise SceneError(f"{self.key}: must be written in up to {LONGEST} characters")
            _, value = read_setting(f"{self.key}={text}")
        except SceneError as error:
            self._tell(str(error))
            return
        refused = self.change(self.key, value)
        if not refused:
            self._show(self.value)  # as the scene has it: it may have been written with a unit
        self._tell(refused)

    def _show(self, value: float) -> None:
        start, end, step = range_of(self.key, value)
        self._set(self.slider, start=start, end=end, step=step, value=value)
        self._set(self.field, value=short(value))

    def _tell(self, refused: str) -> None:
        self.refused = bool(refused)
        self.field.css_classes = ["refused"] if refused else []
        self._say(refused, "refusal")

    def _say(self, text: str, kind: str) -> None:
        role = ' role="alert"' if kind == "refusal" else ""
        colour = "#A03B00" if kind == "refusal" else "#5f6368"
        told = html.escape(shortened(text))
        shown = f'<span{role} class="{kind}" style="color: {colour}">{told}</span>' if text else ""
        if self.note.text != shown:
            self.note.update(text=shown, visible=bool(text))


class Switch(Quiet):
    """A switch or a choice of `effects`; what is refused goes back."""

    def __init__(self, key: str, scene: Scene, change: Change, tell: Callable[[str], None]) -> None:
        self.key, self.change, self.tell = key, change, tell
        self.row = scene.row_of(key)
        self.kept = scene[key]
        more: dict[str, Any] = {"name": key, "stylesheets": [WIDGETS]}
        if self.row.kind == "flag":
            self.widget = Checkbox(active=self.kept, label=self.row.description, **more)
            self.property = "active"
        else:
            choices = [str(choice) for choice in self.row.choices]
            self.widget = Select(
                value=self.kept, options=choices, title=self.row.description,
                sizing_mode="stretch_width", **more,
            )  # fmt: skip
            self.property = "value"
        self.widget.on_change(self.property, self._chosen)
        self.show_use(scene)

    def start(self, scene: Scene) -> None:
        """Take the value of a scene to start from."""
        self.kept = scene[self.key]
        self._set(self.widget, **{self.property: self.kept})
        self.show_use(scene)

    def show_use(self, scene: Scene) -> None:
        """Grey out what has no effect in a scene."""
        needed = scene.matters(self.key)
        if self.widget.disabled == needed:
            self.widget.disabled = not needed

    def _chosen(self, _: str, __: Any, value: Any) -> None:
        if self._quiet:
            return
        refused = self.change(self.key, value)
        self.tell(refused)
        if refused:
            self._set(self.widget, **{self.property: self.kept})
        else:
            self.kept = value


def keys_of(scene: Scene) -> Iterator[str]:
    """Keys that have a slider in a scene."""
    yield from SLIDERS
    for bar in BARS:
        for k in range(min(len(scene[f"{bar}.sections"]), MOST_SECTIONS)):
            yield f"{bar}.sections.{k}.length"


def switch_keys() -> list[str]:
    """Keys that have a switch or a choice."""
    return [f"effects.{name}" for name in GROUPS["effects"].rows if name not in _OF_STRINGS]
