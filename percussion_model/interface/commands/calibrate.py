"""Command `calibrate`: rock parameters from measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.analysis.fitting import Fit
    from percussion_model.interface.progress import Report
    from percussion_model.scene.scene import Scene


def calibrate(
    scene: common.SceneFile,
    curve: Annotated[
        list[Path] | None,
        typer.Option(
            "--curve",
            metavar="CSV",
            help="Slow test: penetration [mm], force [kN]. May be repeated: fresh rock, to other "
            "peaks.",
        ),
    ] = None,
    drop: Annotated[
        list[str] | None,
        typer.Option(
            "--drop",
            metavar="CSV@SPEED",
            help="Drop test at a speed in m/s: time [ms] and one signal, as bit_position [mm]. "
            "May be repeated.",
        ),
    ] = None,
    measured: Annotated[
        list[str] | None,
        typer.Option(
            "--measured",
            metavar="QUANTITY=VALUE+-ERROR UNIT @SPEED",
            help="A single number: rebound_velocity or penetration of a drop at a speed in m/s, "
            "penetration_per_blow or rate_of_penetration (m/h) of the hammer. May be repeated.",
        ),
    ] = None,
    site: Annotated[
        Path | None,
        typer.Option(
            "--site",
            metavar="CSV",
            help="Rates and torques at settings: rate_of_penetration [m/h], rotation_torque [N m], "
            "and keys of the scene, as rotation.speed [rpm]. Fits breaking and rotation.",
        ),
    ] = None,
    crater: Annotated[
        Path | None,
        typer.Option(
            "--crater",
            metavar="CSV",
            help="Craters of one button: energy [J] that was crushed, volume [cm^3]. Fits crushing "
            "energy and threshold.",
        ),
    ] = None,
    gauge: Annotated[
        float | None,
        typer.Option("--gauge", help="Gauge, in m from the bit's top; else in its middle."),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option("--only", metavar="KEY", help="Fit this parameter; may be repeated."),
    ] = None,
    ranges: Annotated[
        list[str] | None,
        typer.Option(
            "--range",
            metavar="KEY=LOW:HIGH",
            help="Search a parameter there only; in SI, or with units.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="SCENE", help="Write the calibrated scene.")
    ] = None,
    force: common.Force = False,
    write_undetermined: Annotated[
        bool,
        typer.Option("--write-undetermined", help="Write values into it that are not determined."),
    ] = False,
    figure: Annotated[
        Path | None,
        typer.Option("--figure", metavar="PNG", help="Draw data, fit, residuals and profiles."),
    ] = None,
    solver: common.SolverName = None,
    cells: common.Cells = None,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    json_file: common.JsonFile = None,
) -> None:
    """Fit the rock of a scene to a slow test, drop tests and single numbers, all together.

    CSV headings may carry units, as in "penetration [mm]"; without one they are in SI. Separators
    are commas, semicolons or tabs; beside the last two a decimal comma is read as well.
    """
    from percussion_model.analysis.fitting import fit_rock
    from percussion_model.interface.calibrated_scene import commented_fit
    from percussion_model.interface.measured_files import read_curve, read_drop, read_reading
    from percussion_model.interface.progress import progress
    from percussion_model.scene.writing import is_special

    of_rock = bool(curve or drop or measured)
    if sum((of_rock, site is not None, crater is not None)) != 1:
        raise common.refusal(
            "one fit at a time: give --curve, --drop or --measured, or --site, or --crater"
            if of_rock or site or crater
            else "nothing to fit: give --curve, --drop, --measured, --site or --crater"
        )
    common.check_json(json_file)
    if figure is not None and not is_special(figure):
        figure = figure.with_suffix(".png")
    for option, path in (("--out", out), ("--figure", figure)):
        common.check_file(option, path)
        if path is not None:
            common.refuse_existing(path, force)
    chosen = common.load_scene(scene, solver, cells, settings, rock=rock, bit=bit)
    if (site is not None or crater is not None) and (only or ranges):
        raise common.refusal("--only and --range are of a fit to --curve, --drop or --measured")
    if site is not None or crater is not None:
        from percussion_model.interface.commands.calibrate_site import calibrate_breaking

        calibrate_breaking(chosen, site, crater, out, json_file, scene)
        return
    slow = [read_curve(path) for path in curve or ()]
    drops = [read_drop(word, gauge) for word in drop or ()]
    numbers = [read_reading(word) for word in measured or ()]
    limits = dict(_read_range(word) for word in ranges or ())
    with progress("preparing") as report:
        told = _Stages(report)
        found = fit_rock(
            chosen, slow, drops, numbers, only, limits, progress=told.done, stage=told.begin
        )
    common.write_json(json_file, found.summary())
    written = []
    if json_file != "-":
        _show(found, chosen)
    if out is not None:
        changes = found.changes(write_undetermined)
        calibrated = chosen.replace(**changes).to_toml()
        out = common.write_file(out, commented_fit(found, changes, scene.name) + calibrated)
        written.append(out)
        left = [key for key in found.estimates if key not in changes]
        if left:
            common.print_message(
                f"{out} keeps {', '.join(left)} of {scene}: not determined "
                "(--write-undetermined writes the best value)"
            )
    if figure is not None:
        with common.if_drawable():
            from percussion_model.interface.plotting.calibration import save_calibration

            written.append(save_calibration(found, figure))
    common.list_files(written)


class _Stages:
    """Stages of a fit, and their shares where it is known how much they take.

    Parameters
    ----------
    report : callable
        Takes a text and a share.
    """

    def __init__(self, report: Report) -> None:
        self._report, self._name, self._most, self._before, self._all = report, "fit", 0, 0, 0

    def begin(self, name: str, most: int) -> None:
        """Take the stage that begins, and its computations; 0 where they are not known."""
        self._name, self._most, self._before = name, most, self._all
        self._report(name, 0.0 if most else None)

    def done(self, count: int) -> None:
        """Take the number of all computations that are done."""
        self._all, here = count, count - self._before
        of = f" of {self._most}" if self._most else ""
        share = here / self._most if self._most else None
        self._report(f"{self._name}: {here}{of} computations", share)


def _read_range(word: str) -> tuple[str, tuple[float, float]]:
    from percussion_model.analysis.fitting import FitError
    from percussion_model.scene.parameters import read_number
    from percussion_model.scene.rows import SceneError

    key, _, ends = word.partition("=")
    low, colon, high = ends.partition(":")
    try:
        if not colon:
            raise ValueError
        key = key.strip()
        return key, (read_number(key, low), read_number(key, high))
    except SceneError as error:
        raise FitError(f"--range {word}: {error}") from None
    except ValueError:
        raise FitError(f"--range {word}: must be KEY=LOW:HIGH, in SI or with units") from None


def _show(found: Fit, scene: Scene) -> None:
    from rich.table import Table

    from percussion_model.analysis.fitting.found import NAMES
    from percussion_model.interface.tables import print_table
    from percussion_model.interface.terminal import show_warnings

    table = Table()
    interval = (
        "interval, widened" if found.is_widened else f"interval, {100 * found.confidence:g} %"
    )
    for heading in ("", "unit", "value", interval, "verdict"):
        table.add_column(heading, no_wrap=True, justify="right" if heading == "value" else "left")
    for key, one in found.estimates.items():
        unit = scene.row_of(key).unit
        value, low, high = one.texts()
        table.add_row(NAMES[key], unit, value, f"{low} to {high}", one.verdict)
    for key in found.kept:
        unit = scene.row_of(key).unit
        table.add_row(NAMES[key], unit, f"{scene[key]:.4g}", "not fitted", "kept")
    print_table(table)
    noises = Table("measurement", "data", "noise", "", box=None)
    sensors = Table("sensor of", "has", "found", "±", "prior ±", box=None)
    for source in found.explained:
        noise = f"{source.noise_text()} {source.unit}"
        word = "given" if source.noise_is_given else "estimated"
        noises.add_row(source.name, str(len(source.data)), noise, word)
        for it in source.sensor:
            sensors.add_row(source.name, it.name, *it.texts())
    print_table(noises)
    if sensors.rows:
        print_table(sensors)
    show_warnings(found.warnings)
