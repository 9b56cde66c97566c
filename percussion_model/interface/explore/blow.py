"""One blow of a run as the page draws it, for reports."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from markupsafe import Markup

from percussion_model.analysis.drill_string import cells_of
from percussion_model.interface.explore.build import REFERENCE_HOLE, as_json, joined, packed, source
from percussion_model.interface.plotting.window import TRANSITS_SHOWN, Window
from percussion_model.scene.bits import bit, bit_of
from percussion_model.simulation.simulate import Simulation

MODULES = ("words", "numbers", "pictures", "plot", "figures", "drawing", "player", "report")
# What is drawn of samples.
COLUMNS = (
    *("bit_force", "contact_force", "drive_force", "gap", "bit_end_position"),
    *("piston_velocity", "bit_kinetic_energy"),
)
# As of the page: samples while waves are busy, and later; and how long that is.
BUSY, QUIET, WAVES = 1600, 400, 1.6 * TRANSITS_SHOWN
STRESSES, MOST_INTEGER = 600, 32767  # times with stresses, and what these are written by
BUTTONS = 15  # of a bit without a name


def script() -> Markup:
    """What draws blows, and enlarges drawings."""
    modules = {name: source(f"{name}.js") for name in MODULES}
    return Markup(f'<script type="module">{joined(modules)}</script>')


def style() -> Markup:
    """How the pictures of a blow look."""
    return Markup(source("figures.css"))


def places() -> Markup:
    """Where a blow is drawn, as on the page."""
    page = source("index.html")
    (watch,) = re.findall(r'<section id="watch".*?</section>', page, re.S)
    figures = re.findall(r"<figure><figcaption>.*?</figure>", page)[:4]
    return Markup(f'{watch}<section id="plots">{"".join(figures)}</section>')


def data(window: Window) -> Markup:
    """A blow as JSON within a page.

    Parameters
    ----------
    window : Window
        Of a scene with a piston.
    """
    scene, time, own = window.scene, window.time, bit_of(window.scene)
    busy = min(WAVES * max(bar.transit_time for bar in scene.bars.values()), window.length)
    blow = {
        "time": packed(time[_near(time, busy, BUSY)]),
        "columns": {
            name: packed(window.samples[name][_near(time, busy, BUSY)]) for name in COLUMNS
        },
        "fields": _fields(window, time[_near(time, busy, STRESSES)]),
        "period": window.length,
        "busy": busy,
    }
    whole = {
        "blow": blow,
        "bars": [bar.numbers for bar in scene.bars.values()],
        "hole": scene.hole_diameter or REFERENCE_HOLE,
        "buttons": bit(own).buttons.value if own else BUTTONS,
        "which": f"{window.name[0].upper()}{window.name[1:]}.",
    }
    return Markup(f'<script id="blow-data" type="application/json">{as_json(whole)}</script>')


def _near(time: np.ndarray, busy: float, count: int) -> np.ndarray:
    """Samples next to so many times while waves are busy, and to some later."""
    wanted = np.append(np.linspace(time[0], busy, count), np.linspace(busy, time[-1], QUIET))
    return np.unique(np.clip(np.searchsorted(time, wanted), 0, len(time) - 1))


def _fields(window: Window, times: np.ndarray) -> list[dict[str, Any]]:
    """Stress [Pa] and kinetic energy [J] of elastic bars at times since the blow began [s]."""
    simulation = Simulation(window.scene)
    simulation.restore(window.restart)
    times = times[window.origin + times >= simulation.time]
    seen: list[dict[str, np.ndarray]] = []
    for time in times:
        simulation.advance(window.origin + time)
        seen.append(simulation.fields())
    found = []
    for number, (name, bar) in enumerate(window.scene.bars.items()):
        grid = simulation.solver.grid_of(name)
        if grid is None:
            continue
        edges, areas = cells_of(bar, simulation.solver.section_cells(bar))
        speed = np.array([one[f"{name}_velocity"] for one in seen])
        stress = np.array([one[f"{name}_force"] for one in seen]) / areas
        scale = float(np.abs(stress).max()) / MOST_INTEGER or 1.0
        found.append(
            {
                "bar": number,
                "edges": packed(edges),
                "time": packed(times),
                "kinetic": packed(0.5 * np.sum(grid.mass * speed * speed, axis=1)),
                "scale": scale,
                "stress": packed(np.round(stress / scale), "<i2"),
            }
        )
    return found
