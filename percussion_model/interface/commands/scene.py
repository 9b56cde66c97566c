"""Commands on one scene: run, settled, explain, plot, new."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common
from percussion_model.interface.commands.blow_map import ready_map, warn_of_outside

if TYPE_CHECKING:
    from percussion_model.simulation.result import Result

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
    trace: Annotated[
        float | None,
        typer.Option("--trace", metavar="DT", help="Keep a trace, sampled every DT, in s."),
    ] = None,
    out: common.Out = None,
    json_file: common.JsonFile = None,
    figures: Annotated[
        bool, typer.Option(help="With --out, draw figures and write report.html.")
    ] = True,
) -> None:
    """Run a scene; print a short table, write results with --out."""
    from percussion_model.interface.terminal import progress_bar, show_summary
    from percussion_model.simulation.simulate import simulate

    chosen = common.load_scene(scene, solver, cells, settings, accuracy, check)
    common.check_outputs(out, json_file)
    if chosen.solver_name == "blow-map":
        ready_map(chosen)
    with progress_bar(chosen.run.duration if duration is None else duration) as progress:
        result = simulate(
            chosen,
            duration,
            settle,
            trace,
            progress=progress,
            on_interrupt="keep",
            error_estimate=error_estimate,
        )
    interrupted = result.cut_short
    if out is not None:
        result.save(out)
        if figures and not interrupted:
            _draw(result, out)
    common.write_json(json_file, result.summary())
    if json_file != "-":
        show_summary(result)
    if interrupted:
        common.print_message(result.warnings[-1])
        raise typer.Exit(common.INTERRUPTED)


def settled(
    scene: common.SceneFile,
    solver: common.SolverName = None,
    cells: common.Cells = None,
    settings: common.Settings = None,
    tolerance: common.Tolerance = 1e-4,
    most_time: Annotated[
        float,
        typer.Option("--most-time", help="Processor time after which it is given up, in s."),
    ] = 300.0,
    json_file: common.JsonFile = None,
) -> None:
    """Run until the blows repeat: rate, period, order and stability of the cycle."""
    from percussion_model.analysis.stationary import settled as run_until_settled
    from percussion_model.interface.terminal import progress_bar, show_settled

    common.check_json(json_file)
    chosen = common.load_scene(scene, solver, cells, settings)
    with progress_bar(0.0):
        found = run_until_settled(chosen, tolerance, most_time=most_time)
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
    json_file: common.JsonFile = None,
) -> None:
    """Tell what a scene computes, how, and what the run will cost; makes no blow map."""
    from percussion_model.analysis.cost import explained, forecast
    from percussion_model.interface.terminal import progress_bar, show_explanation

    chosen = common.load_scene(scene, solver, cells, settings, accuracy, check)
    common.check_json(json_file)
    if chosen.solver_name == "blow-map":
        warn_of_outside(chosen)
    with progress_bar(0.0):
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
) -> None:
    """Draw the figures of a result, or run a scene and draw them."""
    from percussion_model.interface.terminal import progress_bar
    from percussion_model.scene.scene import Scene
    from percussion_model.simulation.result import Result
    from percussion_model.simulation.simulate import simulate

    try:
        from percussion_model.interface.plotting import figures
    except ImportError as error:
        raise common.refusal(common.needs_plot_extra(error)) from None
    if not source.exists():
        raise common.refusal(f"{source}: there is no such folder or scene file")
    folder = out or (source if source.is_dir() else Path("out") / source.stem)
    common.check_outputs(folder, None)
    if source.is_dir():
        if duration is not None or settle is not None:
            raise common.refusal(f"{source}: has been run; give its scene file")
        result = Result.load(source)
    else:
        scene = Scene.from_toml(source)
        with progress_bar(scene.run.duration if duration is None else duration) as progress:
            result = simulate(scene, duration, settle, progress=progress)
    for path in figures(result, folder):
        typer.echo(str(path))


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The scene file to write.")],
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write a commented scene to start from: the reference hammer."""
    from percussion_model.scene.scene import Scene

    if file.exists() and not force:
        raise common.refusal(f"{file}: exists already; --force overwrites it")
    Scene(title=_NEW_TITLE).to_toml(file, comments=True)
    typer.echo(f"wrote {file}")


def _draw(result: Result, folder: Path) -> None:
    """Write figures and report; the results are safe already."""
    with common.if_drawable():
        from percussion_model.interface.plotting import figures
        from percussion_model.interface.report import why_not_interactive, write_report

        if remark := why_not_interactive():
            common.print_message(remark)
        write_report(result, folder, figures(result, folder))
