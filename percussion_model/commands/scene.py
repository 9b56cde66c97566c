"""Run a scene, draw it, tell about it, write a new one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.commands.blow_map import ready_map
from percussion_model.commands.common import (
    BAD_INPUT,
    INTERRUPTED,
    Accuracy,
    Cells,
    Check,
    Duration,
    JsonFile,
    Out,
    SceneFile,
    Settings,
    Settle,
    SolverName,
    check_json,
    complain,
    load_scene,
    needs_plot_extra,
    write_json,
)

if TYPE_CHECKING:
    from percussion_model.result import Result

_NEW_TITLE = "A down-the-hole hammer"


def run(
    scene: SceneFile,
    duration: Duration = None,
    settle: Settle = None,
    solver: SolverName = None,
    cells: Cells = None,
    accuracy: Accuracy = None,
    check: Check = None,
    settings: Settings = None,
    trace: Annotated[
        float | None,
        typer.Option("--trace", metavar="DT", help="Keep a trace, sampled every DT, in s."),
    ] = None,
    out: Out = None,
    json_file: JsonFile = None,
    figures: Annotated[
        bool, typer.Option(help="With --out, draw figures and write report.html.")
    ] = True,
) -> None:
    """Run a scene; print a short table, write results with --out."""
    from percussion_model.result_files import check_writable
    from percussion_model.simulation import simulate
    from percussion_model.terminal import progress_bar, show_summary

    chosen = load_scene(scene, solver, cells, settings, accuracy, check)
    if out is not None:
        check_writable(out)
    check_json(json_file)
    if chosen.solver_name == "blow-map":
        ready_map(chosen)
    with progress_bar(chosen.run.duration if duration is None else duration) as progress:
        result = simulate(chosen, duration, settle, trace, progress=progress, on_interrupt="keep")
    interrupted = result.cut_short
    if out is not None:
        result.save(out)
        if figures and not interrupted:
            _draw(result, out)
    write_json(json_file, result.summary())
    if json_file != "-":
        show_summary(result)
    if interrupted:
        complain(result.warnings[-1])
        raise typer.Exit(INTERRUPTED)


def explain(
    scene: SceneFile,
    solver: SolverName = None,
    cells: Cells = None,
    accuracy: Accuracy = None,
    check: Check = None,
    settings: Settings = None,
    json_file: JsonFile = None,
) -> None:
    """Tell what a scene computes, how, and what the run will cost."""
    from percussion_model.forecast import explained, forecast
    from percussion_model.terminal import show_explanation

    chosen = load_scene(scene, solver, cells, settings, accuracy, check)
    check_json(json_file)
    if chosen.solver_name == "blow-map":
        ready_map(chosen)
    found = forecast(chosen)
    write_json(json_file, explained(chosen, found))
    if json_file != "-":
        show_explanation(chosen, found)


def plot(
    source: Annotated[
        Path, typer.Argument(metavar="RESULT_DIR|SCENE", help="A result folder, or a scene to run.")
    ],
    duration: Duration = None,
    settle: Settle = None,
    out: Out = None,
) -> None:
    """Draw the figures of a result, or run a scene and draw them."""
    from percussion_model.result import Result
    from percussion_model.result_files import check_writable
    from percussion_model.scene import Scene
    from percussion_model.simulation import simulate
    from percussion_model.terminal import progress_bar

    if not source.exists():
        raise typer.Exit(complain(f"{source}: there is no such folder or scene file", BAD_INPUT))
    folder = out or (source if source.is_dir() else Path("out") / source.stem)
    check_writable(folder)
    if source.is_dir():
        if duration is not None or settle is not None:
            raise typer.Exit(complain(f"{source}: has been run; give its scene file", BAD_INPUT))
        result = Result.load(source)
    else:
        scene = Scene.from_toml(source)
        with progress_bar(scene.run.duration if duration is None else duration) as progress:
            result = simulate(scene, duration, settle, progress=progress)
    try:
        from percussion_model.plotting import figures
    except ImportError as error:
        raise typer.Exit(complain(needs_plot_extra(error), BAD_INPUT)) from None
    for path in figures(result, folder):
        typer.echo(str(path))


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The scene file to write.")],
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write a commented scene to start from: the reference hammer."""
    from percussion_model.scene import Scene

    if file.exists() and not force:
        raise typer.Exit(complain(f"{file}: exists already; --force overwrites it", BAD_INPUT))
    Scene(title=_NEW_TITLE).to_toml(file, comments=True)
    typer.echo(f"wrote {file}")


def _draw(result: Result, folder: Path) -> None:
    """Write figures and report; the results are safe already."""
    try:
        from percussion_model.page import without_zoom
        from percussion_model.plotting import figures
        from percussion_model.report import write_report
    except ImportError as error:
        complain(needs_plot_extra(error))
        return
    if remark := without_zoom():
        complain(remark)
    write_report(result, folder, figures(result, folder))
