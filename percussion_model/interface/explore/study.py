"""Points of a study as its report draws them (`study.js`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from percussion_model.analysis.study import PER_HOUR, Study
from percussion_model.analysis.study.response import KINDS
from percussion_model.interface.explore.build import as_json, joined, packed, source
from percussion_model.interface.plotting import style
from percussion_model.simulation.uncertain import UNDECIDED, UNSURE_DIGITS, of_the_cells

MODULES = ("words", "numbers", "plot", "study")
# Larger studies are thinned evenly where they are no grid.
MOST_SHOWN = 20_000
KIND_COLOURS = dict(
    zip(KINDS, (style.BIT_COLOUR, style.MEAN_COLOUR, "#222222", "#999999"), strict=True)
)
# Steps of an axis are even if they differ by no more than this share.
EVEN = 1e-6
# What can be shown: column of the page, name, unit, column of a study, factor from SI.
QUANTITIES = (
    ("rate", "Rate of penetration", PER_HOUR.unit, "rate_of_penetration", PER_HOUR.factor),
    (
        "off", "Standard error (scatter) or convergence", PER_HOUR.unit,
        "rate_of_penetration_error", PER_HOUR.factor,
    ),
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
)  # fmt: skip
# Digits of an error, and the sign for counts, which are whole or a mean.
OF_ERRORS, COUNT = 2, 0
# Digits of all: the errors of the grids are not known.
DIGITS = dict.fromkeys((name for name, *_ in QUANTITIES), UNSURE_DIGITS)
DIGITS |= {"off": OF_ERRORS, "error": OF_ERRORS, "contacts": COUNT, "cycles": COUNT, "order": COUNT}
# Those that the error of the rate may hide.
HIDDEN = ("rate", "advance")


def places(found: Study) -> dict[str, Markup]:
    """Where a study is drawn: "map" of a grid or "scatter" of samples, and "points", a table."""
    names = ("map" if found.points.is_grid else "scatter", "points")
    return {name: Markup(f'<div id="{name}" class="study"></div>') for name in names}


def script(found: Study) -> Markup:
    """What draws a study, with its points."""
    modules = {name: source(f"{name}.js") for name in MODULES}
    return Markup(
        f'<script id="study-data" type="application/json">{as_json(data(found))}</script>'
        f'<script type="module">{joined(modules)}</script>'
    )


def data(found: Study) -> dict[str, Any]:
    """What the report carries of each point, and how it is called."""
    kept, points = np.arange(len(found.points)), found.points
    if not points.is_grid:
        kept = np.unique(np.linspace(0, len(kept) - 1, min(len(kept), MOST_SHOWN)).astype(int))
    labels = {key: _label(key, found.scene.row_of(key).unit) for key in points.keys}
    return {
        "quantities": [
            {
                "name": name,
                "title": f"{words} [{unit}]",
                "unit": unit.strip("–"),
                "digits": DIGITS[name],
            }
            for name, words, unit, _, _ in QUANTITIES
        ],
        "columns": {name: packed(values[kept]) for name, values in _columns(found).items()},
        "keys": [
            {"key": key, "label": labels[key], "values": packed(points.values[kept, k], "<f8")}
            for k, key in enumerate(points.keys)
        ],
        "rates": _rates(found, kept),
        "motions": _motions(found, kept),
        "undecided": found.undecided[kept].astype(int).tolist(),
        "hideable": HIDDEN,
        "word": UNDECIDED,
        "colours": KIND_COLOURS,
        "axes": [axis.as_json() for axis in _axes(found)] if points.is_grid else None,
    }


def _columns(found: Study) -> dict[str, np.ndarray]:
    """What the page carries of each point, in the units that it shows."""
    rows = found.rows
    return {
        name: np.asarray(
            (rows[field] if field else found.relative_error) * factor, dtype=np.float32
        )
        for name, _, _, field, factor in QUANTITIES
    }


def _motions(found: Study, kept: np.ndarray) -> list[str]:
    """Words for the kinds of motion."""
    return np.array(KINDS)[found.rows["kind"][kept]].tolist()


def _rates(found: Study, kept: np.ndarray) -> list[str]:
    """Rates [m/h] as text, with what is known of their errors."""
    rates = PER_HOUR.factor * found.rows["rate_of_penetration"]
    of_cells = found.depends_on_cells
    known = np.isfinite(rates)
    return [
        "–"
        if not known[k]
        else of_the_cells(float(rates[k]))
        if of_cells[k] and rates[k]
        else found.rate_text(k, "", PER_HOUR.factor)
        for k in kept.tolist()
    ]


def _label(key: str, unit: str) -> str:
    """Key and unit of a parameter."""
    return f"{key} [{unit}]".replace("[-]", "[–]").replace("^2", "²").replace("^3", "³")


@dataclass(frozen=True)
class Axis:
    """Values of one parameter of a grid."""

    key: str
    unit: str
    values: np.ndarray
    stride: int  # from one value to the next among the points
    here: int  # the value next to that of the scene

    def as_json(self) -> dict[str, Any]:
        """As the report has it."""
        return {
            "key": self.key, "label": _label(self.key, self.unit), "values": self.values.tolist(),
            "edges": self.edges.tolist(), "scale": self.scale, "stride": self.stride,
            "here": self.here,
        }  # fmt: skip

    @property
    def scale(self) -> str:
        """Whether the values step evenly by number or by logarithm."""
        low = float(self.values.min())
        if len(self.values) < 3 or low <= 0 or self.values.max() / low < 3.0:
            return "linear"
        steps = np.diff(np.log(self.values))
        return "log" if np.ptp(steps) < EVEN * np.abs(steps).max() else "linear"

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
    made.sort(key=lambda axis: -len(axis.values))
    return [axis for k, axis in enumerate(made) if k < 2 or len(axis.values) > 1]
