"""Fits of breaking and rotation, of the command `calibrate`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.analysis.fitting.site import SiteFit
    from percussion_model.scene.scene import Scene

TOLD, NOT_TOLD = "determined", "not determined: close to what it was"
HOUR = 3600.0


def calibrate_breaking(
    scene: Scene,
    site: Path | None,
    crater: Path | None,
    out: Path | None,
    json_file: str | None,
    name: Path | None,
) -> None:
    """Fit to a site's rates and torques, or to craters; show it, and write the scene."""
    from percussion_model.analysis.fitting.site import fit_craters, fit_site
    from percussion_model.interface.progress import progress
    from percussion_model.interface.tables import print_notes

    changes: dict[str, float]
    notes: list[str] = []
    if crater is not None:
        columns = _craters(crater)
        energy, error, threshold, other = fit_craters(columns["energy"], columns["volume"])
        changes = {
            "breaking.crushing_energy": energy,
            "breaking.threshold": max(threshold, 0.0),
        }
        rows = [
            ("crushing energy, MJ/m^3", f"{1e-6 * energy:.3g} ± {1e-6 * error:.2g}", TOLD),
            ("threshold of a button, J", f"{threshold:.3g} ± {other:.2g}", TOLD),
        ]
        told = {"changes": changes, "errors": [error, other]}
    else:
        assert site is not None
        columns = _settings(scene, site)
        with progress("preparing") as report:
            found = fit_site(
                scene, columns, lambda count: report(f"fit: {count} settings run", None)
            )
        changes = found.changes()
        rows = [*_estimates(found), *_comparison(found)]
        told = asdict(found)
        notes = _about_rate(found)
    common.write_json(json_file, told)
    if json_file != "-":
        _show(rows)
        print_notes(notes)
    if site is not None and (missed := found.unexplained()):
        common.print_message(
            f"not explained, more than three errors off: {', '.join(missed)}; trust no number of it"
        )
    if out is not None:
        text = scene.replace(**changes).to_toml()
        of = name or "the reference"
        head = [f"{of}, with breaking and rotation fitted to {site or crater}"]
        head += [": ".join(row[:2]) for row in rows]
        comments = "".join(f"# {line}\n" for line in head)
        common.list_files([common.write_file(out, comments + text)])


def _craters(path: Path) -> dict[str, list[float]]:
    from percussion_model.analysis.fitting import FitError
    from percussion_model.interface.csv_tables import read_columns

    wanted = {"energy": "J", "volume": "m^3"}
    columns, _ = read_columns(path, wanted, "energy and volume are wanted")
    for one in wanted:
        if one not in columns:
            raise FitError(f"{path}: no column is {one}: energy and volume are wanted")
    return {key: values.tolist() for key, values in columns.items()}


def _settings(scene: Scene, path: Path) -> dict[str, list[float]]:
    """Columns of a file: numbers of the scene that matter, and what was measured."""
    from percussion_model.analysis.fitting import FitError
    from percussion_model.analysis.fitting.site import MEASURED
    from percussion_model.interface.csv_tables import UNITS, read_columns
    from percussion_model.scene.parameters import parameter_table

    known = {
        row.key: row.unit
        for row in parameter_table()
        if row.unit in UNITS and "*" not in row.key and scene.matters(row.key)
    }
    known |= {name: unit for name, (unit, *_) in MEASURED.items()}
    columns, others = read_columns(path, known, f"{' or '.join(MEASURED)} is wanted")
    if meant := [one for one in others if "." in one]:
        raise FitError(
            f"{path}: {meant[0]} is no parameter that matters in this scene, nor "
            f"{' or '.join(MEASURED)}: omit it, or correct its name"
        )
    if others:
        common.print_message(f"{path}: not read: {', '.join(others)}")
    return {key: values.tolist() for key, values in columns.items()}


def _estimates(found: SiteFit) -> list[tuple[str, str, str]]:
    from percussion_model.scene.parameters import find_row

    rows = []
    for one in found.estimates:
        row = find_row(one.key)
        unit = f", {row.unit}" if row and row.unit != "-" else ""
        text = f"{one.value:.3g}, factor {one.factor:.2f}"
        rows.append((f"{one.key}{unit}", text, TOLD if one.is_told else NOT_TOLD))
    return rows


def _about_rate(found: SiteFit) -> list[str]:
    """What the fit leaves of the rate, and what it does not hold for."""
    low, high = (f"{HOUR * end:.2g}" for end in found.rate_interval())
    return [
        "factor: one standard error, up or down.",
        f"Rate of the scene: {HOUR * found.rate:.3g} m/h; {low} to {high} m/h by what the site "
        "leaves of its parameters, with nine tenths. In other rock and for other drills it holds "
        "less: after one factor a site a third of the published rates were met within 30 % "
        "(percussion validate rates).",
    ]


def _comparison(found: SiteFit) -> list[tuple[str, str, str]]:
    rows = []
    for name, measured, model in found.rows:
        factor, unit = (HOUR, "m/h") if name.startswith("rate") else (1.0, "N m")
        text = f"measured {factor * measured:.4g}, model {factor * model:.4g}"
        rows.append((f"{name}, {unit}", text, f"{100 * (model / measured - 1):+.1f} %"))
    return rows


def _show(rows: list[tuple[str, str, str]]) -> None:
    from rich.table import Table

    from percussion_model.interface.tables import print_table

    table = Table(show_header=False)
    for _ in range(3):
        table.add_column()
    for row in rows:
        table.add_row(*row)
    print_table(table)
