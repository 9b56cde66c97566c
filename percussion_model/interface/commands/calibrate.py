"""Command `calibrate`: rock parameters from measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.analysis.fitting import DropTest, Fit


def calibrate(
    scene: common.SceneFile,
    curve: Annotated[
        Path | None,
        typer.Option("--curve", metavar="CSV", help="Slow test: columns penetration, force."),
    ] = None,
    drop: Annotated[
        list[str] | None,
        typer.Option(
            "--drop",
            metavar="CSV@SPEED",
            help="Drop test at a speed in m/s: columns time and a signal, as bit_position. "
            "May be repeated.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="SCENE", help="Write the calibrated scene.")
    ] = None,
    force: common.Force = False,
    span: Annotated[
        float, typer.Option("--span", help="C_R and W_R are searched this factor around the scene.")
    ] = 10.0,
    solver: common.SolverName = None,
    cells: common.Cells = None,
    settings: common.Settings = None,
    json_file: common.JsonFile = None,
) -> None:
    """Fit the rock of a scene: K_R, gamma to a slow test, all four to drop tests; SI units."""
    from percussion_model.analysis.fitting import (
        ROCK,
        FitError,
        fit_drop_tests,
        fit_force_penetration,
    )
    from percussion_model.simulation.files import check_writable

    if curve is None and not drop:
        raise common.refusal("nothing to fit: give --curve, --drop or both")
    common.check_json(json_file)
    if out is not None:
        if out.is_dir():
            raise common.refusal(f"--out {str(out)!r}: is a folder; give the file to write")
        check_writable(out.absolute().parent)
        common.refuse_existing(out, force)
    chosen = common.load_scene(scene, solver, cells, settings)
    found: dict[str, Fit] = {}
    if curve is not None:
        names, columns = _read(curve)
        if names != ["penetration", "force"]:
            raise FitError(f"{curve}: the columns must be penetration, force, not {names}")
        found["curve"] = fit_force_penetration(columns[0], columns[1])
        chosen = chosen.replace(**found["curve"].changes())
    if drop:
        signal, tests = _drop_tests(drop)
        bit_alone = chosen.replace(**{"piston.model": "absent", "effects.drive": "none"})
        found["drop tests"] = fit_drop_tests(bit_alone, tests, ROCK, signal=signal, span=span)
        chosen = chosen.replace(**found["drop tests"].changes())
    common.write_json(json_file, {name: fit.summary() for name, fit in found.items()})
    if json_file != "-":
        _show(found)
    if out is not None:
        chosen.to_toml(out)


def _drop_tests(words: list[str]) -> tuple[str, list[DropTest]]:
    from percussion_model.analysis.fitting import DropTest, FitError

    tests, signals = [], set()
    for word in words:
        file, at, speed = word.rpartition("@")
        try:
            if not at:
                raise ValueError
            fast = float(speed)
        except ValueError:
            raise FitError(f"--drop {word}: must be CSV@SPEED, as in drop.csv@5.25") from None
        names, columns = _read(Path(file))
        if names[0] != "time" or len(names) != 2:
            raise FitError(f"{file}: the columns must be time and one signal, not {names}")
        signals.add(names[1])
        tests.append(DropTest(columns[0], columns[1], fast))
    if len(signals) > 1:
        raise FitError(f"--drop: all tests must be of one signal, not {sorted(signals)}")
    return signals.pop(), tests


def _read(path: Path) -> tuple[list[str], list[list[float]]]:
    """Names and columns of a CSV file with a heading."""
    import csv

    from percussion_model.analysis.fitting import FitError

    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            heading, *rows = [[word.strip() for word in row] for row in csv.reader(file) if row]
    except (OSError, UnicodeDecodeError) as error:
        raise FitError(f"{path}: cannot be read ({error})") from None
    except ValueError:
        raise FitError(f"{path}: is empty") from None
    for number, row in enumerate(rows, 1):
        if len(row) != len(heading):
            raise FitError(
                f"{path}: row {number} has {len(row)} columns, the heading {len(heading)}"
            )
    try:
        columns = [[float(word) for word in column] for column in zip(*rows, strict=True)]
    except ValueError as error:
        raise FitError(f"{path}: {error}") from None
    return heading, columns or [[] for _ in heading]


def _show(found: dict[str, Fit]) -> None:
    from rich.console import Console
    from rich.table import Table

    from percussion_model.interface.terminal import show_warnings

    table = Table("from", "", "value, SI", "standard error", "interval of 95 %")
    for name, fit in found.items():
        for key, (value, error, low, high) in fit.estimates.items():
            table.add_row(name, key, f"{value:.5g}", f"{error:.2g}", f"{low:.5g} to {high:.5g}")
    console = Console()
    console.print(table)
    show_warnings(console, [note for fit in found.values() for note in fit.warnings])
