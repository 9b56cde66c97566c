"""Page of the explorer: one session of a browser, from a slider to what is drawn."""

from __future__ import annotations

import html
import logging
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from bokeh.document import Document
from bokeh.layouts import column
from bokeh.models import (
    Button,
    CustomJS,
    Div,
    Select,
    TextAreaInput,
    Toggle,
)

from percussion_model.interface.explore.figures import CAPTIONS, Figures
from percussion_model.interface.explore.inputs import WIDGETS, Entry, Switch, keys_of, switch_keys
from percussion_model.interface.explore.response import (
    Overtaken,
    Response,
    motion,
    notes,
    numbers,
    respond,
    verdict,
)
from percussion_model.interface.explore.worker import Worker
from percussion_model.interface.plotting import style
from percussion_model.scene.scene import Scene, SceneError

log = logging.getLogger(__name__)

# Differences of two scenes that are named; more are counted.
MOST_NAMED = 4
COPY = """
const done = () => { note.text = '<span role="status">copied</span>';
  setTimeout(() => { note.text = ''; }, 3000); };
const refused = () => {
  note.text = '<span role="alert">not copied: mark the text below and copy it by hand</span>'; };
if (navigator.clipboard) navigator.clipboard.writeText(area.value).then(done, refused);
else refused();
"""
NUMBERS = """
:host { font: 15px/1.4 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
.bk-clearfix { display: block !important; width: 100%; }
dl { display: flex; flex-wrap: wrap; gap: .5rem .5rem; margin: 0; }
dl div { padding-left: .45rem; min-width: 8.4rem; border-left: 3px solid #0072B2; }
dt { color: #5f6368; font-size: 12.5px; }
dd { margin: 0; font-size: 13.5px; font-weight: 600; font-variant-numeric: tabular-nums;
  white-space: nowrap; }
dd.pinned { color: #6b6b6b; font-weight: 400; }
p { margin: .35rem 0; color: #5f6368; font-size: 14px; }
p.refusal, p.warning { padding: .4rem .6rem; color: #1a1a1a; background: #fff4e0;
  border-left: 4px solid #e69f00; }
"""


class Explorer:
    """One page in one browser; pages know nothing of each other.

    Parameters
    ----------
    document : Document
        Of the session.
    scenes : mapping of str to callable
        Scenes to start from, by name; the first is shown.
    worker : Worker
        Computes for all pages.
    """

    def __init__(
        self, document: Document, scenes: Mapping[str, Callable[[], Scene]], worker: Worker
    ) -> None:
        self.document, self.scenes, self.worker = document, scenes, worker
        self.figures = Figures()
        self.asked = self.shown = 0
        self.response: Response | None = None
        self.pinned: Response | None = None
        self.pinned_from = ""
        self.over = False
        self.made: dict[str, Entry] = {}
        self.entries: list[Entry] = []
        self.effects: list[Switch] = []
        self._make_widgets()
        self._take(scenes[next(iter(scenes))]())
        for made in self._roots():
            document.add_root(made)
        document.on_session_destroyed(self._end)

    def _make_widgets(self) -> None:
        more: dict[str, Any] = {"stylesheets": [WIDGETS]}
        names = list(self.scenes)
        self.preset = Select(
            title="start from", value=names[0], options=names, name="preset",
            sizing_mode="stretch_width", visible=len(names) > 1, **more,
        )  # fmt: skip
        self.preset.on_change("value", self._choose)
        self.reset = Button(label="Reset", name="reset", **more)
        self.reset.on_click(self._reset)
        self.pin = Toggle(label="Pin to compare", name="pin", **more)
        self.pin.on_change("active", self._pin)
        self.copied = Div(text="", name="copied", stylesheets=[NUMBERS])
        self.toml = TextAreaInput(
            title="the scene as a file for percussion run", name="toml", rows=14,
            max_length=None, sizing_mode="stretch_width", **more,
        )  # fmt: skip
        self.copy = Button(label="Copy as TOML", name="copy", **more)
        self.copy.js_on_click(CustomJS(args={"area": self.toml, "note": self.copied}, code=COPY))
        self.note = Div(text="", name="note", visible=False, stylesheets=[NUMBERS],
                        sizing_mode="stretch_width")  # fmt: skip
        self.numbers = Div(text="<p>computing …</p>", name="numbers", stylesheets=[NUMBERS],
                           sizing_mode="stretch_width", tags=[0, 0, 0.0])  # fmt: skip
        self.remarks = Div(text="", name="remarks", stylesheets=[NUMBERS],
                           sizing_mode="stretch_width")  # fmt: skip
        told = CustomJS(code="window.explorer?.(cb_obj.tags)")
        self.numbers.js_on_change("tags", told)
        self.inputs = column(name="inputs", sizing_mode="stretch_width", spacing=6)
        self.switches = column(name="switches", sizing_mode="stretch_width", spacing=6)

    def _roots(self) -> list[Any]:
        figures = self.figures
        for name, made in (("stress", figures.stress), ("forces", figures.forces),
                           ("law", figures.law)):  # fmt: skip
            made.name = name
        return [
            *(self.preset, self.reset, self.pin, self.copy, self.copied, self.note),
            *(self.inputs, self.switches, self.numbers, self.remarks, self.toml),
            *(figures.stress, figures.forces, figures.law),
        ]

    # ------------------------------------------------------------------ what is asked for

    def _take(self, scene: Scene) -> None:
        """Start from a scene: inputs of its own, which are made once."""
        self.first = self.scene = scene
        shown = []
        for key in keys_of(scene):
            if key not in self.made:
                self.made[key] = Entry(key, scene, self._change)
            shown.append(self.made[key])
        for entry in shown:
            entry.start(scene)
        layouts = [entry.layout for entry in shown]
        if layouts != self.inputs.children:
            self.inputs.children = layouts
        if not self.effects:
            keys = switch_keys()
            self.effects = [Switch(key, scene, self._change, self._tell) for key in keys]
            self.switches.children = [switch.widget for switch in self.effects]
        for switch in self.effects:
            switch.start(scene)
        self.entries = shown
        self._ask()

    def _choose(self, _: str, __: Any, name: str) -> None:
        if name in self.scenes:
            self._tell("")
            self._take(self.scenes[name]())

    def _reset(self) -> None:
        self._tell("")
        self._take(self.first)

    def _change(self, key: str, value: Any) -> str:
        """Change one value of the scene; what is wrong with it, else nothing."""
        first = self.first
        # what was not given in the first scene, and is as it was there, is not given again
        is_back = key.count(".") == 1 and key not in first.given and value == first[key]
        wanted = None if is_back else value
        try:
            scene = self.scene.replace(**{key: wanted})
        except SceneError as error:
            return str(error)
        if scene == self.scene:
            return ""
        self.scene = scene
        for entry in self.entries:
            entry.show_use(scene)
        for switch in self.effects:
            switch.show_use(scene)
        self._tell("")
        self._ask()
        return ""

    def _ask(self) -> None:
        """Wish for the response of the scene as it is now."""
        self.asked += 1
        self.toml.value = self.scene.to_toml()
        self._mark()
        self.worker.ask(self, partial(self._compute, self.scene, self.asked))

    def _tell(self, text: str) -> None:
        told = f'<p class="refusal" role="alert">{html.escape(text)}</p>' if text else ""
        if told != self.note.text:
            self.note.update(text=told, visible=bool(text))

    # ------------------------------------------------------------------ what is shown

    def _compute(self, scene: Scene, number: int, is_overtaken: Callable[[], bool]) -> None:
        """Find a response, in the thread of the worker."""
        try:
            response = respond(scene, lambda: self.over or is_overtaken())
        except Overtaken:
            return
        except Exception:  # a fault of the program: the page must not wait for ever
            log.exception("a response could not be computed")
            response = Response(scene, refusal="Not computed: the terminal says why.")
        if not self.over:
            self.document.add_next_tick_callback(partial(self._show, response, number))

    def _show(self, response: Response, number: int) -> None:
        if self.over or number <= self.shown:
            return
        self.response, self.shown = response, number
        self.document.hold("collect")
        try:
            self.figures.draw(response)
            self._write()
            self._mark()
        finally:
            self.document.unhold()

    def _mark(self) -> None:
        """Tell the page what was asked for, what is shown, and how long that took [ms]."""
        taken = 0.0 if self.response is None else 1e3 * self.response.taken
        self.numbers.tags = [self.asked, self.shown, taken]

    def _pin(self, _: str, __: Any, active: bool) -> None:
        self.pinned = self.response if active else None
        self.pinned_from = self.preset.value
        self.pin.label = "Remove pinned" if active else "Pin to compare"
        self.figures.pin(self.pinned)
        self._write()

    def _write(self) -> None:
        if self.response is not None:
            self.numbers.text = cards(self.response, self.pinned)
            name = "" if self.pinned_from == self.preset.value else self.pinned_from
            self.remarks.text = remarks(self.response, self.pinned, name)

    def _end(self, _: Any) -> None:
        self.over = True
        self.worker.drop(self)


def cards(now: Response, pinned: Response | None) -> str:
    """Numbers of a response as HTML, above those of a pinned one."""
    if now.refusal:
        return f'<p class="refusal" role="status">{html.escape(now.refusal)}</p>'
    shown, other = _rows(now), {} if pinned is None else _rows(pinned)
    made = []
    for name in dict.fromkeys([*shown, *other]):
        parts = f'<dt>{name}</dt><dd class="now">{_lines(shown.get(name, "–"))}</dd>'
        if pinned is not None:
            parts += f'<dd class="pinned">{_lines(other.get(name, "–"))}</dd>'
        made.append(f"<div>{parts}</div>")
    told = [] if now.found is None else verdict(now.found)
    words = "".join(f'<p class="warning" role="status">{html.escape(text)}</p>' for text in told)
    return f"<dl>{''.join(made)}</dl>{_motions(now, pinned)}{words}"


def _motions(now: Response, pinned: Response | None) -> str:
    """Say how the blows follow each other, now and in what is pinned."""
    told = [f"<p>Motion: <b>{html.escape(_motion(now))}</b></p>"]
    if pinned is not None and _motion(pinned) != _motion(now):
        told.append(f"<p>Motion, pinned: {html.escape(_motion(pinned))}</p>")
    return "".join(told)


def _motion(response: Response) -> str:
    return response.refusal if response.found is None else motion(response.found)


def remarks(now: Response, pinned: Response | None, name: str) -> str:
    """What one must know of the numbers, as HTML: what is pinned, what ± is of, warnings.

    Parameters
    ----------
    now, pinned : Response
    name : str
        What the pinned one started from, if that is another scene.
    """
    told = [] if now.found is None else notes(now.found)
    if pinned is not None:
        told.insert(0, f"In grey, pinned: {name or _apart(now, pinned)}.")
    return "".join(f"<p>{html.escape(text)}</p>" for text in told)


def _rows(response: Response) -> dict[str, str]:
    return {} if response.found is None else numbers(response.found)


def _lines(text: str) -> str:
    """Parts of a text, each on a line of its own."""
    return "<br>".join(html.escape(part) for part in text.split("; "))


def _apart(now: Response, pinned: Response) -> str:
    """Say in which values two scenes differ."""
    keys = dict.fromkeys([*keys_of(now.scene), *switch_keys()])
    others = [f"{key} = {pinned.scene[key]}" for key in keys if pinned.scene[key] != now.scene[key]]
    more = f" and {len(others) - MOST_NAMED} more" if len(others) > MOST_NAMED else ""
    return f"{', '.join(others[:MOST_NAMED])}{more}" if others else "the same scene"


def legend() -> list[tuple[str, str, str]]:
    """Colours of the curves: kind of line, colour, name."""
    lines = [("solid", colour, style.MODE_NAMES[mode]) for mode, colour in
             style.MODE_COLOURS.items()]  # fmt: skip
    return [*lines, ("dotted", style.PISTON_COLOUR, "piston on bit"),
            ("solid", style.RULE_COLOUR, "pinned")]  # fmt: skip


def page_variables(title: str) -> dict[str, Any]:
    """What the template of the page takes."""
    return {"heading": title, "captions": CAPTIONS, "legend": legend()}
