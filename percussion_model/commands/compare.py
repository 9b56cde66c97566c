"""One scene by several solvers."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.commands.blow_map import ready_map
from percussion_model.commands.common import (
    Duration,
    JsonFile,
    Out,
    SceneFile,
    Settings,
    Settle,
    check_json,
    complain,
    load_scene,
    needs_plot_extra,
    write_json,
)

if TYPE_CHECKING:
    from percussion_model.comparison import Comparison


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
    from percussion_model.result_files import check_writable
    from percussion_model.terminal import progress_bar, show_comparison

    names = read_solvers(solvers)
    chosen = load_scene(scene, None, None, settings)
    folder = out or Path("out") / f"{scene.stem}-compared"
    check_writable(folder)
    check_json(json_file)
    if "blow-map" in names:
        ready_map(chosen)
    end = chosen.run.duration if duration is None else duration
    with progress_bar(end * len(names)) as progress:
        found = run_all(chosen, names, duration, settle, progress)
    write_json(json_file, found.to_dict())
    if json_file != "-":
        show_comparison(found)
    if figures:
        _draw_comparison(found, folder)


def _draw_comparison(found: Comparison, folder: Path) -> None:
    try:
        from percussion_model.plotting.comparison import save_comparison
    except ImportError as error:
        complain(needs_plot_extra(error))
        return
    for path in save_comparison(found, folder):
        print(path, file=sys.stderr)
