"""Commands on one scene: run, settled, explain, plot, new."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from percussion_model.interface.commands import common
from percussion_model.scene.hammers import at_altitude, hammers

if TYPE_CHECKING:
    from percussion_model.analysis.rock_interval import RateInterval
    from percussion_model.interface.progress import Report
    from percussion_model.scene.scene import Scene
    from percussion_model.simulation.result import Result

# A key with the unit of a pressure.
_PRESSURE = "pneumatic.supply_pressure"
_NEW_TITLE = "A down-the-hole hammer"


def run(
    scene: common.SceneFile,
    duration: common.Duration = None,
    settle: common.Settle = None,
    solver: common.SolverName = None,
    cells: common.Cells = None,
    accuracy: common.Accuracy = None,
    check: common.Check = None,
    error_estimate: common.ErrorEstimate = None,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    altitude: common.Altitude = None,
    trace: Annotated[
        float | None,
        typer.Option("--trace", metavar="DT", help="Keep a trace, sampled every DT, in s."),
    ] = None,
    out: common.Out = None,
    json_file: common.JsonFile = None,
    figures: Annotated[
        bool, typer.Option(help="With --out, draw figures and write report.html.")
    ] = True,
    force: common.Force = False,
    rock_interval: Annotated[
        bool,
        typer.Option(help="Show in what range the intervals of rock and bit put the rate."),
    ] = True,
) -> None:
    """Run a scene; print a short table, write results with --out."""
    from percussion_model.analysis.rock_interval import interval_text
    from percussion_model.interface import terminal
    from percussion_model.interface.progress import progress, progress_bar
    from percussion_model.interface.tables import print_notes
    from percussion_model.simulation.simulate import simulate

    chosen = common.load_scene(scene, solver, cells, settings, accuracy, check, rock=rock, bit=bit)
    chosen = chosen if altitude is None else at_altitude(chosen, altitude)
    common.check_outputs(out, json_file)
    made_from = _made_from(chosen, duration, settle)
    made_from |= {"trace": trace, "error_estimate": error_estimate}
    claimed = None if out is None else common.claim("run", out, None, force, **made_from)
    end = chosen.run.duration if duration is None else duration
    with progress_bar(end) as bar:
        result = simulate(
            chosen,
            duration,
            settle,
            trace,
            progress=bar,
            on_interrupt="keep",
            error_estimate=error_estimate,
            stage=bar.stage,
        )
    files: list[Path] = []
    if claimed is not None:
        if result.cut_short:  # part of a run does not replace the whole one
            made_from["until"] = result.duration
            claimed = common.claim("run", None, out, force, **made_from)
        files += common.write_folder(claimed, result.save)
        files += common.sign(claimed)
    by_rock = None if result.cut_short else _by_rock(chosen, rock_interval, rock)
    told_by_rock = "" if by_rock is None else interval_text(by_rock, result.summary())
    if claimed is not None and figures and not result.cut_short:
        with progress("drawing") as report:
            files += _draw(result, claimed.folder, report, told_by_rock)
        common.sign(claimed)
    if json_file != "-":
        terminal.show_summary(result)
        print_notes([told_by_rock] if told_by_rock else [])
    if result.interrupted:
        told = (text for text in result.warnings if text.startswith("interrupted"))
        common.print_message(next(told, "interrupted before its error was known"))
    common.list_files(files)
    further = {} if by_rock is None else {"rate_by_rock": by_rock._asdict()}
    common.write_json(json_file, result.summary() | further)
    if result.interrupted:
        raise typer.Exit(common.INTERRUPTED)


def _by_rock(scene: Scene, is_wanted: bool, asked: str | None) -> RateInterval | None:
    """What the intervals of rock and bit leave of the rate, where they are known."""
    from percussion_model.analysis.rock_interval import (
        NOT_CALIBRATED,
        rate_interval,
        uncertain_numbers,
    )
    from percussion_model.interface.progress import progress

    if not (is_wanted and scene["effects.breaking"]):
        return None
    if not uncertain_numbers(scene)[1]:
        why = (
            "has other numbers than the rock" if asked else "names no rock of the library (--rock)"
        )
        common.print_message(
            f"rock and bit leave the rate uncertain, by how much is not known: the scene {why}. "
            f"{NOT_CALIBRATED}"
        )
        return None
    text = "sampling the intervals of rock and bit"
    with progress(text) as report:
        return rate_interval(scene, progress=lambda share: report(text, share))


def settled(
    scene: common.SceneFile,
    solver: common.SolverName = None,
    cells: common.Cells = None,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    tolerance: common.Tolerance = 1e-4,
    most_time: Annotated[
        float,
        typer.Option("--most-time", help="Processor time after which it is given up, in s."),
    ] = 300.0,
    json_file: common.JsonFile = None,
) -> None:
    """Run until the blows repeat: rate, period, order and stability of the cycle."""
    from percussion_model.analysis.stationary import settled as run_until_settled
    from percussion_model.interface.progress import progress
    from percussion_model.interface.terminal import show_settled

    common.check_json(json_file)
    chosen = common.load_scene(scene, solver, cells, settings, rock=rock, bit=bit)
    with progress("preparing") as report:
        found = run_until_settled(
            chosen,
            tolerance,
            progress=lambda count: report(f"{count} blows", None),
            most_time=most_time,
            error_estimate=True,
        )
    common.write_json(json_file, found.summary())
    if json_file != "-":
        show_settled(found)


def explain(
    scene: common.SceneFile,
    solver: common.SolverName = None,
    cells: common.Cells = None,
    accuracy: common.Accuracy = None,
    check: common.Check = None,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    json_file: common.JsonFile = None,
) -> None:
    """Show what a scene computes, how, and what the run will cost."""
    from percussion_model.analysis.cost import explained, forecast
    from percussion_model.interface.progress import progress
    from percussion_model.interface.terminal import show_explanation

    chosen = common.load_scene(scene, solver, cells, settings, accuracy, check, rock=rock, bit=bit)
    common.check_json(json_file)
    with progress("trying the first blows"):
        found = forecast(chosen)
    common.write_json(json_file, explained(chosen, found))
    if json_file != "-":
        show_explanation(chosen, found)


def plot(
    source: Annotated[
        Path, typer.Argument(metavar="RESULT_DIR|SCENE", help="A result folder, or a scene to run.")
    ],
    duration: common.Duration = None,
    settle: common.Settle = None,
    out: common.Out = None,
    force: common.Force = False,
) -> None:
    """Draw the figures of a result, or run a scene and draw them."""
    from percussion_model.interface.progress import progress, progress_bar
    from percussion_model.scene.presets import scene_file
    from percussion_model.scene.scene import Scene
    from percussion_model.simulation.result import Result
    from percussion_model.simulation.simulate import simulate

    try:
        from percussion_model.interface.plotting import figures
    except ImportError as error:
        raise common.refusal(common.needs_plot_extra(error)) from None
    file = source if source.is_dir() else scene_file(source)
    if not file.exists():
        raise common.refusal(f"{source}: there is no such folder or scene file")
    claimed = None
    if source.is_dir():
        if duration is not None or settle is not None:
            raise common.refusal(f"{source}: has been run; give its scene file")
        common.check_outputs(out or source, None)
        result = Result.load(source)
        if out is not None and out.resolve() != source.resolve():
            numbers = common.digest(source / "summary.json")
            claimed = common.claim("plot", out, None, force, result=numbers)
    else:
        scene = Scene.from_toml(file)
        common.hint_at_unusual(scene)
        common.tell_of_compiling(scene.solver_name)
        made_from = _made_from(scene, duration, settle)
        # its figures belong to the result of that run, and may stand beside it
        claimed = common.claim("run", out, Path("out") / source.stem, force, **made_from)
        with progress_bar(scene.run.duration if duration is None else duration) as bar:
            result = simulate(scene, duration, settle, progress=bar, stage=bar.stage)
    with progress("drawing") as report:
        files = figures(result, (out or source) if claimed is None else claimed.folder, report)
    common.tell_of_moving()
    for path in files:
        typer.echo(str(path))
    if claimed is not None:
        claimed.sign()


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The scene file to write.")],
    hammer: Annotated[
        str | None,
        typer.Option("--hammer", help="A hammer on the market: " + ", ".join(hammers()) + "."),
    ] = None,
    rods: Annotated[
        int | None, typer.Option("--rods", help="Rods of a top hammer, from 1 on; default 4.")
    ] = None,
    pressure: Annotated[
        str | None,
        typer.Option(
            "--pressure",
            help="Air or oil in the chambers of a hammer, at a pressure as '24 bar'.",
        ),
    ] = None,
    altitude: common.Altitude = None,
    kind: Annotated[
        Literal["hammer", "hopkinson"],
        typer.Option("--kind", help="hammer, or hopkinson: a striker, a bar and rock."),
    ] = "hammer",
    rock: common.RockName = None,
    bit: common.BitName = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write a commented scene to start from: the reference hammer, or another."""
    from percussion_model.scene.hammers import bar_test, with_chambers
    from percussion_model.scene.hammers import hammer as find
    from percussion_model.scene.parameters import read_number
    from percussion_model.scene.scene import Scene
    from percussion_model.scene.units import has_unit
    from percussion_model.simulation.warnings import precharge_note

    common.refuse_existing(file, force)
    common.check_file("FILE", file)
    if kind == "hopkinson":
        if hammer is not None or rods is not None or pressure is not None:
            raise common.refusal("--kind hopkinson has no --hammer, no --rods and no --pressure")
        scene = bar_test()
    elif pressure is not None:
        if hammer is None:
            raise common.refusal("--pressure needs --hammer")
        if not has_unit(pressure):
            raise common.refusal(f"--pressure {pressure}: needs a unit, as in '24 bar'")
        scene = with_chambers(hammer, read_number(_PRESSURE, pressure, "--pressure"), rods)
    elif hammer is not None:
        scene = find(hammer, rods)
    elif rods is not None:
        raise common.refusal("--rods needs --hammer: one of the top hammers")
    else:
        scene = Scene(title=_NEW_TITLE)
    scene = common.with_bit(scene, bit)
    scene = scene if altitude is None else at_altitude(scene, altitude)
    if changes := common.rock_changes(rock, scene):
        scene = scene.replace(**changes)
        if pressure is not None:
            common.hint(
                "drive.force",
                "drive.force and drive.reversal_distance, for effects.drive = pressure, are those "
                "of the hammer's usual rock: `percussion drive-map` finds those of this one",
            )
    if told := precharge_note(scene):
        common.print_message(f"warning: the accumulator will be empty: {told}")
    scene.to_toml(file, comments=True)
    typer.echo(f"wrote {file}")


def _made_from(scene: Scene, duration: float | None, settle: float | None) -> dict[str, Any]:
    """What the result of a run follows from."""
    return {
        "scene": scene,
        "duration": scene.run.duration if duration is None else float(duration),
        "settle": scene.run.settle if settle is None else float(settle),
    }


def _draw(result: Result, folder: Path, report: Report, told_by_rock: str) -> list[Path]:
    """Write figures and report; the results are safe already."""
    files: list[Path] = []
    with common.if_drawable():
        from percussion_model.interface.plotting import figures
        from percussion_model.interface.report import write_report

        files += figures(result, folder, report)
        report("writing the report", None)
        files.append(write_report(result, folder, files, told_by_rock))
    return files
