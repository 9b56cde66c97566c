"""Reports: a result or a study as one self-contained HTML page."""

from __future__ import annotations

import platform
import re
from collections.abc import Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from percussion_model.analysis.drill_string import Extreme
from percussion_model.analysis.study import KNOWN_ERRORS, Study
from percussion_model.components import COMPONENTS
from percussion_model.interface.explore import blow, study
from percussion_model.interface.pages import filled
from percussion_model.interface.plotting import CAPTIONS, figures, watched_string
from percussion_model.interface.plotting.window import (
    StressField,
    Window,
    last_blow,
    peak_stresses,
)
from percussion_model.physics.gas import FREE_AIR
from percussion_model.scene.parameters import HOLE_DIAMETER, parameter_table, row_of
from percussion_model.scene.scene import Scene
from percussion_model.simulation.driller_numbers import DRILLER_NUMBERS, driller_text
from percussion_model.simulation.files import staged
from percussion_model.simulation.result import REPORT, Result
from percussion_model.simulation.uncertain import (
    MOST_DIGITS,
    SMALLEST_UNIT,
    TIMED,
    about_errors,
    in_digits,
    mean_text,
    rate_text,
)


def _of_drillers(key: str, unit: str, name: str = "") -> tuple[str, str, str, str, float]:
    """A number at the head of the report in the unit of drillers, and in SI."""
    one = DRILLER_NUMBERS[key]
    return key, name or one.name, unit, _shown_unit(one.unit), 1.0 / one.factor


def _shown_unit(unit: str) -> str:
    """A unit as a page shows it."""
    return {"-": "–"}.get(unit, unit).replace("^2", "²").replace("^3", "³")


# Numbers at the head of the report: key of the summary, what it is called, its
# SI unit, the unit that people use and SI units in one of those.
HEADLINES: tuple[tuple[str, str, str, str, float], ...] = (
    ("rate_of_penetration", "Rate of penetration", "m/s", "mm/s", 1e-3),
    ("rate_of_penetration_standard_error", "… its standard error", "m/s", "mm/s", 1e-3),
    ("rate_of_penetration_relative_error", "… its estimated relative error", "–", "%", 1e-2),
    (
        "rate_of_penetration_fixed_window",
        "… of the bit, from settling to the end",
        "m/s",
        "mm/s",
        1e-3,
    ),
    _of_drillers("rate_of_penetration", "m/s", DRILLER_NUMBERS["rate_of_penetration"].behind),
    ("blow_period", "Blow period", "s", "ms", 1e-3),
    _of_drillers("blow_frequency", "Hz"),
    ("impact_velocity", "Impact velocity (mean of the piston)", "m/s", "m/s", 1.0),
    ("rebound_velocity", "Rebound velocity (mean of the piston)", "m/s", "m/s", 1.0),
    ("stroke", "Stroke", "m", "mm", 1e-3),
    ("blow_energy", "Blow energy", "J", "J", 1.0),
    _of_drillers("percussive_power", "W", "Percussive power (blow energy times frequency)"),
    ("rock_energy", "Energy into the rock, per blow", "J", "J", 1.0),
    ("transfer_efficiency", "Energy transfer efficiency", "–", "%", 1e-2),
    _of_drillers("specific_energy", "J/m³", "Specific energy (blow energy per volume drilled)"),
    ("penetration_per_blow", "Penetration per blow", "m", "mm", 1e-3),
    ("contacts_per_blow", "Piston/bit contacts per blow", "–", "", 1.0),
    ("drilling_cycles_per_blow", "Drilling cycles per blow", "–", "", 1.0),
    ("breaking_blow_volume", "Volume broken, per blow", "m³", "cm³", 1e-6),
    ("rotation_index", "Turned per blow, at the mean radius", "m", "mm", 1e-3),
    ("rotation_torque", "Torque of the rotation", "N m", "N m", 1.0),
    ("peak_bit_force", "Greatest bit force", "N", "kN", 1e3),
    ("peak_contact_force", "Greatest contact force", "N", "kN", 1e3),
    ("standstill_bit_force", "Bit force at standstill", "N", "kN", 1e3),
    ("mean_bit_force", "Mean bit force", "N", "kN", 1e3),
    ("mean_contact_force", "Mean contact force", "N", "kN", 1e3),
    ("hammer_pressure", "Pressure at the hammer, at the end", "Pa", "bar", 1e5),
    ("pneumatic_air", "Air (free air at 0 °C, 1 atm)", "kg/s", "m³/min", FREE_AIR / 60.0),
    ("net_percussive_power", "Percussive power less the rebound", "W", "kW", 1e3),
    ("air_efficiency", "Percussive power by air power", "–", "%", 1e-2),
)

# Those that are errors themselves; below this they are rounding [SI].
ERRORS = ("rate_of_penetration_standard_error", "rate_of_penetration_relative_error")
ROUNDING = 1e-9

# Cards: key of the summary, factor, unit, name.
CARDS = (
    ("blow_frequency", 1.0, "Hz", "blow frequency"),
    ("blow_energy", 1.0, "J", "blow energy"),
    ("transfer_efficiency", 100.0, "%", "of it given to the rock"),
    ("penetration_per_blow", 1e3, "mm", "penetration per blow"),
)


def _entries_on(side: str) -> list[tuple[str, str]]:
    """Entries of components on a side of the ledger, and what they are."""
    entries = [entry for one in COMPONENTS for entry in one.ledger.items()]
    return [(name, meaning) for name, (found, meaning) in entries if found == side]


# Entries of the ledger in the order of the balance: initial + work = the rest.
LEDGER: tuple[tuple[str, tuple[tuple[str, str], ...]], ...] = (
    (
        "Put in",
        (
            ("initial", "energy at the start"),
            ("drive", "work of the drive on the piston"),
            ("feed", "work of the feed force"),
            ("gravity", "work of gravity"),
            ("climb", "rotation, which lifts the bit out of craters"),
            ("refill", "cuttings that carry the bit"),
            *_entries_on("work"),
        ),
    ),
    (
        "Dissipated",
        (
            ("crushing", "crushing of the rock"),
            ("barrier", "energy barrier of the rock (mode DFC)"),
            ("standstill", "damping at standstill (mode SS)"),
            ("loss", "structural loss in the bars"),
            ("contact", "restitution of rigid contact"),
            ("joints", "joints of the drill string, and its damper"),
            ("ends", "ends without reflection, less what comes in there"),
            *_entries_on("dissipated"),
            ("numerical", "numerical: averaging in cells"),
            ("overshoot", "overshoot: events found just past their place"),
        ),
    ),
    (
        "Stored at the end",
        (
            ("kinetic", "kinetic"),
            ("elastic", "elastic, in the bars"),
            ("recoverable", "elastic, in the rock"),
            *_entries_on("stored"),
        ),
    ),
    ("Unexplained", (("residual", "residual"),)),
)
# Figures of a study.
STUDY_CAPTIONS = {
    "map": (
        "A map over two parameters and cuts through it; choose what is shown, and values of the "
        "others by the sliders. Crosses mark points whose motion is not periodic. Grey and hatched "
        "is undecided: the error of the rate is no smaller than the rate, or without loss in the "
        "bars it depends on the cells. The pointer shows ±."
    ),
    "scatter": (
        "All points over each parameter. Blue is periodic, orange aperiodic, with bars of the "
        "error of the rate; grey is undecided, as in maps. Points "
        "that are chosen with a box in one panel stand out in all."
    ),
    "points": (
        "All points and what was found there; a click on a heading sorts. The errors of the rate "
        f"{KNOWN_ERRORS}."
    ),
}
# How to look closer at figures.
DRAWN = "Drag a box to look closer, double-click to see all again."
OF_STUDY = (
    "Drag a box to look closer, of samples to choose points (with Shift: to look closer); "
    "double-click to see all again. The pointer shows the values of a point."
)
# So many failed points are listed.
MOST_FAILURES = 10
PACKAGES = ("percussion_model", "numpy", "numba", "scipy", "matplotlib")


class FigureBlock(NamedTuple):
    """A figure as HTML and what it shows."""

    html: Markup
    caption: str


def write_report(
    result: Result,
    folder: str | Path,
    figure_files: Iterable[Path] | None = None,
    rock_interval: str = "",
) -> Path:
    """Write `report.html`, which needs no other file and no network.

    The last blow can be moved through; a dragged box enlarges what is drawn.

    Parameters
    ----------
    result : Result
    folder : str or Path
        Made if it is not there.
    figure_files : iterable of Path, optional
        What `figures` returned for this result; if left out, the figures are
        drawn into the folder as well.
    rock_interval : str
        What the intervals of rock and bit leave of the rate, as a sentence.

    Returns
    -------
    Path
        The report.
    """
    folder = Path(folder)
    if figure_files is None:
        figure_files = figures(result, folder)
    drawings = [path for path in figure_files if path.suffix == ".svg"]
    page = render_report(result, drawings, rock_interval)
    return _write_page(folder, page)


def render_report(result: Result, drawings: Sequence[Path], rock_interval: str = "") -> str:
    """Return the page as text.

    Parameters
    ----------
    result : Result
    drawings : sequence of Path
        SVG files.
    rock_interval : str
    """
    blocks = {path.stem: _inline_svg(path, CAPTIONS[path.stem]) for path in drawings}
    shown = last_blow(result)
    summary = result.summary()
    scene = result.scene
    # The run may have other times than the scene.
    ran = {"run.duration": result.duration, "run.settle": result.settle}
    return _render(
        "report.html.j2",
        scene,
        ran,
        summary=summary,
        rate=rate_text(summary),
        hourly_rate=driller_text(summary, "rate_of_penetration"),
        means=mean_cards(summary),
        headlines=headline_rows(summary),
        about_errors=about_errors(summary),
        rock_interval=rock_interval,
        stress=stress_note(result, shown),
        figures=[FigureBlock(blocks[name], text) for name, text in CAPTIONS.items()
                 if name in blocks],
        zoomable=DRAWN,
        scripts=blow.script(),
        blow=blow.data(shown[0]) if shown and result.scene.piston.model != "absent" else "",
        places=blow.places(),
        style=blow.style(),
        ledger=ledger_rows(result.energy),
        computing=_computing_rows(result),
    )  # fmt: skip


def headline_rows(summary: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Name, SI value and everyday value of the numbers that are defined."""
    rows = []
    for key, name, unit, other, factor in HEADLINES:
        value = summary.get(key)
        if value is None:
            continue
        if key in ERRORS:
            rows.append((name, _error(value, 1.0, unit), _error(value, factor, other)))
            continue
        si = f"{_text(summary, key, 1.0, SMALLEST_UNIT)} {unit}".removesuffix(" –")
        shown = _text(summary, key, 1.0 / factor, MOST_DIGITS)
        rows.append((name, si, f"{shown} {other}" if other not in ("", unit) else ""))
    return rows


def stress_note(result: Result, blow: tuple[Window, dict[str, StressField]] | None) -> str:
    """Where steel is pressed and pulled most in a blow; empty where the solver has no stress."""
    if result.scene.effects.string:
        if result.scene.piston.model == "absent" or not len(result.counted):
            return ""
        found, when = watched_string(result).bars, "the first counted blow"
    elif blow is None:
        return ""
    else:
        found, when = peak_stresses(blow[1]), blow[0].name
    if not found:
        return ""
    pressed = max(found, key=lambda bar: found[bar].compression.value)
    pulled = min(found, key=lambda bar: found[bar].tension.value)
    text = f"Steel is pressed most by {_stress_at(pressed, found[pressed].compression)}"
    if found[pulled].tension.value < 0.0:
        text += f", and pulled most by {_stress_at(pulled, found[pulled].tension)}"
    return f"{text} ({when}). These are means of a cell, whose errors were not estimated."


def _stress_at(bar: str, extreme: Extreme) -> str:
    """A stress and its place."""
    value, place = in_digits(abs(extreme.value) / 1e6), in_digits(extreme.place * 1e3)
    return f"{value} MPa, in the {bar}, {place} mm below its top"


def _error(value: float, factor: float, unit: str) -> str:
    """Write an error with two digits; of rounding only that it is no more."""
    small = value < ROUNDING
    least = f"{ROUNDING / factor:.0e}".replace("e-0", "e-")
    text = f"below {least}" if small else in_digits(value / factor, 2)
    return f"{text} {unit}".removesuffix(" –")


def mean_cards(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Number with its unit, and name, of the cards beside that of the rate."""
    return [
        (f"{_text(summary, key, factor, MOST_DIGITS)} {unit}", f"{name}{_power(summary, key)}")
        for key, factor, unit, name in CARDS
        if summary[key] is not None
    ]


def _power(summary: dict[str, Any], key: str) -> str:
    """The percussive power, behind the name of the blow energy."""
    if key != "blow_energy" or summary.get("percussive_power") is None:
        return ""
    unit = DRILLER_NUMBERS["percussive_power"].unit
    return f" (power {driller_text(summary, 'percussive_power')} {unit})"


def _text(summary: dict[str, Any], key: str, factor: float, most_digits: int) -> str:
    """Write a number with its error, with the minus sign of print."""
    return mean_text(summary, key, factor, most_digits).replace("-", "−")


def ledger_rows(energy: dict[str, float]) -> list[tuple[str, list[tuple[str, float, float]]]]:
    """Parts of the balance with their entries [J] and shares of the energy put in."""
    put_in = sum(abs(energy.get(name, 0.0)) for name, _ in LEDGER[0][1])
    return [
        (
            part,
            [
                (name, energy[key], energy[key] / put_in if put_in > 0 else 0.0)
                for key, name in entries
                if key in energy
            ],
        )
        for part, entries in LEDGER
    ]


def _computing_rows(result: Result) -> list[tuple[str, str]]:
    """Solver, grid, counts and speed."""
    rows = [("solver", result.solver)]
    if result.cells:
        rows.append(("cells", ", ".join(f"{n} in the {bar}" for bar, n in result.cells.items())))
    if result.time_step:
        rows.append(("time step", f"{result.time_step * 1e6:.4g} µs"))
    rows += [(name.replace("_", " "), f"{count:,}") for name, count in result.statistics.items()]
    rows.append(("time to compute", f"{in_digits(result.wall_time, TIMED)} s"))
    if result.wall_time > 0:
        rows.append(("times real time", in_digits(result.real_time_factor, TIMED)))
    return rows


def write_study_report(found: Study, folder: str | Path) -> Path:
    """Write `report.html`, which needs no other file and no network.

    Parameters
    ----------
    found : Study
    folder : str or Path
        Made if it is not there.

    Returns
    -------
    Path
        The report.
    """
    return _write_page(Path(folder), render_study_report(found))


def render_study_report(found: Study) -> str:
    """Return the page as text."""
    blocks = [
        FigureBlock(place, STUDY_CAPTIONS[name]) for name, place in study.places(found).items()
    ]
    points = found.points
    failed = [k for k, text in enumerate(found.failures) if text]
    return _render(
        "study.html.j2",
        found.scene,
        dict.fromkeys(points.keys, "varied"),
        count=len(points),
        headlines=found.headlines(),
        axes=[_axis(found, k) for k in range(len(points.keys))],
        failures=[
            (found.place(k), found.failures[k]) for k in failed[:MOST_FAILURES]
        ],
        failed=len(failed),
        figures=blocks,
        zoomable=OF_STUDY,
        style=blow.style(),
        scripts=study.script(found),
    )  # fmt: skip


def _axis(found: Study, k: int) -> tuple[str, str, str, str, str, str]:
    """Key, ends, count, unit and meaning of what was varied."""
    key, values = found.points.keys[k], found.points.values[:, k]
    row = found.scene.row_of(key)
    ends = f"{values.min():.6g}", f"{values.max():.6g}"
    return key, *ends, f"{len(np.unique(values)):,}", _shown_unit(row.unit), row.description


def _write_page(folder: Path, page: str) -> Path:
    """Write a page as the report of a folder."""
    with staged(folder) as draft:
        (draft / REPORT).write_text(page, encoding="utf-8")
    return folder / REPORT


def _render(template: str, scene: Scene, changed: dict[str, Any], **values: Any) -> str:
    """Fill a template that shows a scene, with parameters that the run replaced."""
    return filled(
        template,
        title=scene.title or "Percussive drilling",
        parameters=_parameter_rows(scene, changed),
        effects_on=scene.effects_on,
        effects_off=scene.effects_off,
        unused=scene.unused,
        versions=_versions(),
        **values,
    )


def _parameter_rows(scene: Scene, changed: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Key, value, unit and description of each parameter that has an influence."""
    rows = []
    for row in parameter_table():
        if row is HOLE_DIAMETER and scene.hole_diameter is None:
            continue
        if "*" not in row.key and scene.matters(row.key):
            rows += _rows_of(scene[row.key], row.key, changed)
    return rows


def _rows_of(value: Any, key: str, changed: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """The row of a value; those of the sections of a bar, or of bars with their sections."""
    if isinstance(value, tuple):
        return [
            row
            for k, entry in enumerate(value)
            for name in entry.telling
            for row in _rows_of(getattr(entry, name), f"{key}.{k}.{name}", changed)
        ]
    row = row_of(key)
    shown = _written(changed.get(key, value))
    return [(key, shown, _shown_unit(row.unit), row.description)]


def _written(value: Any) -> str:
    """A value as a page shows it."""
    if value is None:
        return "by default"
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _versions() -> list[tuple[str, str]]:
    """Versions of what the numbers were made with."""
    found = [("Python", platform.python_version())]
    for name in PACKAGES:
        try:
            found.append((name, version(name)))
        except PackageNotFoundError:
            continue
    return found


def _inline_svg(path: Path, caption: str) -> Markup:
    """Read an SVG file for use inside a page.

    The page knows the name spaces; names of parts get the file's name in
    front, since several drawings share the page.
    """
    text = path.read_text(encoding="utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", text)
    text = re.sub(r'\sid="', f' id="{path.stem}-', text)
    text = re.sub(r'href="#', f'href="#{path.stem}-', text)
    text = text.replace("*{stroke", "svg *{stroke")  # its style sheet is for drawings only
    text = text.replace("url(#", f"url(#{path.stem}-")
    name = caption.split(".")[0]
    # Only the page decides how wide a drawing is.
    text = re.sub(r'(<svg\b[^>]*?)\swidth="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg\b[^>]*?)\sheight="[^"]*"', r"\1", text, count=1)
    label = Markup.escape(name)
    return Markup(text.replace("<svg", f'<svg role="img" aria-label="{label}"', 1))
