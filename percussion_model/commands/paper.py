"""The figures and statements of the paper, one after the other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.commands.common import (
    BAD_INPUT,
    JsonFile,
    check_json,
    complain,
    needs_plot_extra,
    write_json,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from percussion_model.paper.statements import Statement
    from percussion_model.study import Study


def paper(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")],
    processes: Annotated[
        int | None, typer.Option("--processes", help="For the sweeps; default: all cores.")
    ] = None,
    json_file: JsonFile = None,
) -> None:
    """Reproduce figures 6 to 9 of the paper, and check what it says one by one."""
    from percussion_model.quick_start import load_numba
    from percussion_model.result_files import check_writable
    from percussion_model.terminal import show_statements

    check_writable(out)
    check_json(json_file)
    load_numba()
    try:
        from matplotlib import rc_context

        from percussion_model.plotting.paper import draw_drops, draw_sweeps
        from percussion_model.plotting.style import STYLE
    except ImportError as error:
        raise typer.Exit(complain(needs_plot_extra(error), BAD_INPUT)) from None
    from percussion_model.paper import paper_scene
    from percussion_model.paper.drop import run_drops
    from percussion_model.paper.statements import about_drops, about_sweeps

    drops = run_drops(paper_scene())
    sweeps = _sweeps(out, processes)
    with rc_context(STYLE):
        cycle_figures, about_blow = _cycle()
        _save(out, {"figure6": draw_drops(drops), **cycle_figures, "figure9": draw_sweeps(sweeps)})
    said = [*about_drops(drops), *about_blow, *about_sweeps(sweeps)]
    write_json(json_file, {"statements": [one.to_dict() for one in said]})
    write_json(str(out / "statements.json"), {"statements": [one.to_dict() for one in said]})
    if json_file != "-":
        show_statements(said)


def _cycle() -> tuple[dict[str, Figure], list[Statement]]:
    """Figures 7 and 8 by waves and by finite elements, and what the paper says of them."""
    from percussion_model.comparison import compare
    from percussion_model.paper import paper_scene
    from percussion_model.paper.statements import about_cycle
    from percussion_model.plotting.activation import draw_activation
    from percussion_model.plotting.comparison import draw_comparison
    from percussion_model.plotting.motion import draw_motion
    from percussion_model.plotting.window import last_blow_window
    from percussion_model.terminal import progress_bar

    scene = paper_scene()
    with progress_bar(2 * scene.run.duration) as progress:
        both = compare(scene, ("wave", "fem"), progress=progress)
    figures = {"figures7and8": draw_comparison(both)}
    said: list[Statement] = []
    for name, result in both.results.items():
        window = last_blow_window(result)
        figures[f"figure7_{name}"] = draw_motion(window)
        figures[f"figure8_{name}"] = draw_activation(window)
        said += about_cycle(result, window.samples, window.origin)
    return figures, said


def _sweeps(out: Path, processes: int | None) -> dict[str, Study]:
    from percussion_model.paper import paper_scene
    from percussion_model.paper.sweeps import SWEEPS, run_sweep
    from percussion_model.terminal import count_bar

    found = {}
    for sweep in SWEEPS:
        with count_bar(f"points of figure 9{sweep.name}") as progress:
            folder = out / f"figure9{sweep.name}"
            found[sweep.name] = run_sweep(paper_scene(), sweep, folder, processes, progress)
        found[sweep.name].save(folder)
    return found


def _save(out: Path, figures: dict[str, Figure]) -> None:
    from percussion_model.plotting.style import save
    from percussion_model.result_files import staged

    with staged(out) as draft:
        for name, figure in figures.items():
            save(figure, draft, name)
