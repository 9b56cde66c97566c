"""A result as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from percussion_model.interface.page import (
    FigureBlock,
    inline_svg,
    render,
    without_zoom,
    write_page,
)
from percussion_model.interface.plotting import CAPTIONS, figures
from percussion_model.simulation.result import Result

# Numbers at the head of the report: key of the summary, what it is called, its
# SI unit, the unit that people use and SI units in one of those.
HEADLINES: tuple[tuple[str, str, str, str, float], ...] = (
    ("rate_of_penetration", "Rate of penetration", "m/s", "mm/s", 1e-3),
    ("rate_of_penetration_standard_error", "… its standard error", "m/s", "mm/s", 1e-3),
    ("blow_period", "Blow period", "s", "ms", 1e-3),
    ("blow_frequency", "Blow frequency", "Hz", "blows/min", 1.0 / 60.0),
    ("impact_velocity", "Impact velocity (mean of the piston)", "m/s", "m/s", 1.0),
    ("rebound_velocity", "Rebound velocity (mean of the piston)", "m/s", "m/s", 1.0),
    ("stroke", "Stroke", "m", "mm", 1e-3),
    ("blow_energy", "Blow energy", "J", "J", 1.0),
    ("rock_energy", "Energy into the rock, per blow", "J", "J", 1.0),
    ("transfer_efficiency", "Energy transfer efficiency", "–", "%", 1e-2),
    ("penetration_per_blow", "Penetration per blow", "m", "mm", 1e-3),
    ("contacts_per_blow", "Piston/bit contacts per blow", "–", "", 1.0),
    ("drilling_cycles_per_blow", "Drilling cycles per blow", "–", "", 1.0),
    ("peak_bit_force", "Greatest bit force", "N", "kN", 1e3),
    ("peak_contact_force", "Greatest contact force", "N", "kN", 1e3),
    ("standstill_bit_force", "Bit force at standstill", "N", "kN", 1e3),
    ("mean_bit_force", "Mean bit force", "N", "kN", 1e3),
    ("mean_contact_force", "Mean contact force", "N", "kN", 1e3),
)

# Greater numbers are written with an exponent.
LARGEST_PLAIN = 1e8

# Entries of the ledger in the order of the balance: initial + work = the rest.
LEDGER: tuple[tuple[str, tuple[tuple[str, str], ...]], ...] = (
    (
        "Put in",
        (
            ("initial", "energy at the start"),
            ("drive", "work of the drive on the piston"),
            ("feed", "work of the feed force on the bit"),
            ("gravity", "work of gravity on piston and bit"),
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
            ("numerical", "numerical: averaging in cells"),
        ),
    ),
    (
        "Stored at the end",
        (
            ("kinetic", "kinetic"),
            ("elastic", "elastic, in the bars"),
            ("recoverable", "elastic, in the rock"),
        ),
    ),
    ("Unexplained", (("residual", "residual"),)),
)


def write_report(
    result: Result, folder: str | Path, figure_files: Iterable[Path] | None = None
) -> Path:
    """Write `report.html`, which needs no other file and no network.

    Figures can be zoomed; without bokeh they are the drawings.

    Parameters
    ----------
    result : Result
    folder : str or Path
        Made if it is not there.
    figure_files : iterable of Path, optional
        What `figures` returned for this result; if left out, the figures are
        drawn into the folder as well.

    Returns
    -------
    Path
        The report.
    """
    folder = Path(folder)
    if figure_files is None:
        figure_files = figures(result, folder)
    page = render_report(result, [path for path in figure_files if path.suffix == ".svg"])
    return write_page(folder, page)


def render_report(result: Result, drawings: Sequence[Path]) -> str:
    """Return the page as text.

    Parameters
    ----------
    result : Result
    drawings : sequence of Path
        SVG files, for figures that cannot be zoomed.
    """
    blocks = {path.stem: inline_svg(path, CAPTIONS[path.stem]) for path in drawings}
    remark, scripts = without_zoom(), ""
    if not remark:
        from percussion_model.interface.plotting.zoom import embedded
        from percussion_model.interface.plotting.zoom_run import zoomable

        made = zoomable(result)
        places, scripts = embedded(list(made.values()))
        blocks |= {name: Markup(place) for name, place in zip(made, places, strict=True)}
    summary = result.summary()
    scene = result.scene
    # The run may have been asked for another length than the scene's.
    ran = {"run.duration": result.duration, "run.settle": result.settle}
    return render(
        "report.html.j2",
        scene,
        ran,
        summary=summary,
        headlines=headline_rows(summary),
        figures=[FigureBlock(blocks[name], text) for name, text in CAPTIONS.items()
                 if name in blocks],
        zoomable=not remark,
        remark=remark,
        scripts=Markup(scripts),
        ledger=ledger_rows(result.energy),
        computing=computing_rows(result),
    )  # fmt: skip


def headline_rows(summary: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Name, SI value and everyday value of the numbers that are defined."""
    rows = []
    for key, name, unit, other, factor in HEADLINES:
        value = summary.get(key)
        if value is None:
            continue
        si = f"{_digits(value, 5)} {unit}".removesuffix(" –")
        everyday = f"{_digits(value / factor, 4)} {other}" if other not in ("", unit) else ""
        rows.append((name, si, everyday))
    return rows


def _digits(value: float, count: int) -> str:
    """Write a number with so many digits; large ones without an exponent."""
    text = f"{value:.0f}" if 10**count <= abs(value) < LARGEST_PLAIN else f"{value:.{count}g}"
    return text.replace("-", "−", 1) if value < 0 else text


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


def computing_rows(result: Result) -> list[tuple[str, str]]:
    """What was computed with, and how fast."""
    rows = [("solver", result.solver)]
    if result.cells:
        rows.append(("cells", ", ".join(f"{n} in the {bar}" for bar, n in result.cells.items())))
    if result.time_step:
        rows.append(("time step", f"{result.time_step * 1e6:.4g} µs"))
    rows += [(name.replace("_", " "), f"{count:,}") for name, count in result.statistics.items()]
    rows.append(("time to compute", f"{result.wall_time:.3g} s"))
    if result.wall_time > 0:
        rows.append(("times real time", f"{result.real_time_factor:.3g}"))
    return rows
