"""The command `percussion`: run, explain, plot, compare, new."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from percussion_model.quick_start import own_process

if TYPE_CHECKING:
    from percussion_model.comparison import Comparison
    from percussion_model.result import Result
    from percussion_model.scene import Scene

BAD_INPUT = 2
INTERRUPTED = 130  # what shells report for Ctrl-C

# `explain` measures for about so long [s], or for so much simulated time [s].
_MEASURE_WALL = 1.0
_MEASURE_DURATION = 0.5

_NEW_TITLE = "A down-the-hole hammer"

app = typer.Typer(
    help="Percussive drilling with travelling waves: piston, bit and rock, blow by blow.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="A scene file (TOML).")]
SolverName = Annotated[
    Literal["wave", "fem", "rigid"] | None,
    typer.Option("--solver", help="Solver; rigid makes piston and bit rigid."),
]
Cells = Annotated[int | None, typer.Option("--cells", help="Cells or elements in the piston.")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set any parameter, as in rock.unloading_ratio=10; may be repeated.",
    ),
]
Duration = Annotated[float | None, typer.Option("--duration", help="Simulated time, in s.")]
Settle = Annotated[float | None, typer.Option("--settle", help="Time before blows count, in s.")]
JsonFile = Annotated[
    str | None,
    typer.Option("--json", metavar="FILE|-", help="Write the summary as JSON; - for stdout."),
]
Out = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for results.")]


def _show_version(wanted: bool) -> None:
    if wanted:
        from percussion_model import __version__

        typer.echo(f"percussion {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Percussive drilling with travelling waves: piston, bit and rock, blow by blow."""


@app.command()
def run(
    scene: SceneFile,
    duration: Duration = None,
    settle: Settle = None,
    solver: SolverName = None,
    cells: Cells = None,
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
    from percussion_model.result_files import check_writable, staged_text, to_json
    from percussion_model.simulation import simulate
    from percussion_model.terminal import progress_bar, show_summary

    chosen = _load(scene, solver, cells, settings)
    if out is not None:
        check_writable(out)
    if json_file not in (None, "-"):
        check_writable(Path(json_file).absolute().parent)
    with progress_bar(chosen.run.duration if duration is None else duration) as progress:
        result = simulate(chosen, duration, settle, trace, progress=progress, on_interrupt="keep")
    interrupted = result.cut_short
    if out is not None:
        result.save(out)
        if figures and not interrupted:
            _draw(result, out)
    if json_file == "-":
        typer.echo(to_json(result.summary()))
    elif json_file is not None:
        staged_text(Path(json_file), to_json(result.summary()) + "\n")
    if json_file != "-":
        show_summary(result)
    if interrupted:
        _complain(result.warnings[-1])
        raise typer.Exit(INTERRUPTED)


@app.command()
def explain(
    scene: SceneFile,
    solver: SolverName = None,
    cells: Cells = None,
    settings: Settings = None,
) -> None:
    """Tell what a scene computes, how, and what a blow costs."""
    from percussion_model.simulation import Simulation
    from percussion_model.terminal import show_explanation

    chosen = _load(scene, solver, cells, settings)
    simulation = Simulation(chosen)
    step = 1e-6
    end = min(_MEASURE_DURATION, chosen.run.duration)
    while simulation.wall_time < _MEASURE_WALL and simulation.time < end:
        simulation.advance(min(simulation.time + step, end))
        step = min(2.0 * step, 0.1 * end)
    cost = {
        "wall_time": simulation.wall_time,
        "duration": simulation.time,
        "blows": simulation.statistics()["blows"],
    }
    show_explanation(chosen, simulation.solver, cost)


@app.command()
def plot(
    source: Annotated[
        Path, typer.Argument(metavar="RESULT_DIR|SCENE", help="A result folder, or a scene to run.")
    ],
    out: Out = None,
) -> None:
    """Draw the figures of a result, or run a scene and draw them."""
    from percussion_model.result import Result
    from percussion_model.result_files import check_writable
    from percussion_model.scene import Scene
    from percussion_model.simulation import simulate
    from percussion_model.terminal import progress_bar

    folder = out or (source if source.is_dir() else Path("out") / source.stem)
    check_writable(folder)
    if source.is_dir():
        result = Result.load(source)
    else:
        scene = Scene.from_toml(source)
        with progress_bar(scene.run.duration) as progress:
            result = simulate(scene, progress=progress)
    try:
        from percussion_model.plotting import figures
    except ImportError as error:
        raise typer.Exit(_complain(_needs_plot_extra(error), BAD_INPUT)) from None
    for path in figures(result, folder):
        typer.echo(str(path))


@app.command()
def compare(
    scene: SceneFile,
    solvers: Annotated[
        str, typer.Option("--solvers", metavar="A,B", help="Solvers, the first to compare with.")
    ] = "wave,fem,rigid",
    duration: Duration = None,
    settle: Settle = None,
    settings: Settings = None,
    out: Out = None,
    json_file: JsonFile = None,
    figures: Annotated[bool, typer.Option(help="Draw the last blow of all solvers.")] = True,
) -> None:
    """Run a scene with several solvers: a table and a figure side by side."""
    from percussion_model.comparison import compare as run_all
    from percussion_model.comparison import read_solvers
    from percussion_model.result_files import check_writable, staged_text, to_json
    from percussion_model.terminal import progress_bar, show_comparison

    names = read_solvers(solvers)
    chosen = _load(scene, None, None, settings)
    folder = out or Path("out") / f"{scene.stem}-compared"
    check_writable(folder)
    end = chosen.run.duration if duration is None else duration
    with progress_bar(end * len(names)) as progress:
        found = run_all(chosen, names, duration, settle, progress)
    if json_file == "-":
        typer.echo(to_json(found.to_dict()))
    elif json_file is not None:
        staged_text(Path(json_file), to_json(found.to_dict()) + "\n")
    if json_file != "-":
        show_comparison(found)
    if figures:
        _draw_comparison(found, folder)


@app.command()
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The scene file to write.")],
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write a commented scene to start from: the reference hammer."""
    from percussion_model.scene import Scene

    if file.exists() and not force:
        raise typer.Exit(_complain(f"{file}: exists already; --force overwrites it", BAD_INPUT))
    Scene(title=_NEW_TITLE).to_toml(file, comments=True)
    typer.echo(f"wrote {file}")


def _load(path: Path, solver: str | None, cells: int | None, settings: list[str] | None) -> Scene:
    """Read a scene and apply what the command line changes."""
    from percussion_model.quick_start import load_numba
    from percussion_model.scene import Scene, read_setting

    load_numba()
    scene = Scene.from_toml(path)
    changes: dict[str, Any] = dict(read_setting(text) for text in settings or ())
    if solver is not None:
        scene = scene.computed_by(solver, **changes)
    elif changes:
        scene = scene.replace(**changes)
    if cells is not None:
        key = "fem.elements" if scene.solver_name == "fem" else "solver.cells"
        scene = scene.replace(**{key: cells})
    return scene


def _draw(result: Result, folder: Path) -> None:
    """Write figures and report; the results are safe already."""
    try:
        from percussion_model.plotting import figures
        from percussion_model.report import write_report
    except ImportError as error:
        _complain(_needs_plot_extra(error))
        return
    write_report(result, folder, figures(result, folder))


def _draw_comparison(found: Comparison, folder: Path) -> None:
    try:
        from percussion_model.plotting.comparison import save_comparison
    except ImportError as error:
        _complain(_needs_plot_extra(error))
        return
    for path in save_comparison(found, folder):
        print(path, file=sys.stderr)


def _needs_plot_extra(error: ImportError) -> str:
    name = error.name or str(error)
    return f"no figures, since {name} is missing: pip install 'percussion_model[plot]'"


def _complain(message: str, code: int = 0) -> int:
    """Print one message on stderr; return the exit code."""
    print(f"percussion: {message}", file=sys.stderr)
    return code


def main() -> None:
    """Run the command line; errors are one message and an exit code."""
    own_process()
    sys.exit(_guarded(lambda: app(standalone_mode=False)))


def _guarded(work: Callable[[], Any]) -> int:
    """Turn errors that a user can mend into a message."""
    try:
        code = work()
        return code if isinstance(code, int) else 0
    except (KeyboardInterrupt, typer.Abort):
        return _complain("interrupted before there was a result", INTERRUPTED)
    except Exception as error:
        if type(error).__module__.startswith("percussion_model."):
            return _complain(str(error), BAD_INPUT)
        # Bad arguments: typer hides the class of its errors, which show themselves.
        show = getattr(error, "show", None)
        if show is None:
            raise
        show()
        return BAD_INPUT
