"""Command `compare`: one scene by several solvers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from percussion_model.interface.commands import common


def compare(
    scene: common.SceneFile,
    solvers: Annotated[
        str | None,
        typer.Option(
            "--solvers",
            metavar="A,B",
            help="Solvers; the first is the one to compare with. Default: the scene's own, "
            "and modal, "
            "wave, fem and rigid as far as they compute it.",
        ),
    ] = None,
    duration: common.Duration = None,
    settle: common.Settle = None,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    out: common.OutOrDefault = None,
    json_file: common.JsonFile = None,
    force: common.Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the last blow of all solvers.")] = True,
) -> None:
    """Run a scene with several solvers: a table, and a figure in out/SCENE-compared."""
    from percussion_model.analysis.comparison import compare as run_all
    from percussion_model.analysis.comparison import read_solvers, usual_solvers
    from percussion_model.interface.progress import progress, progress_bar
    from percussion_model.interface.terminal import show_comparison

    asked = None if solvers is None else read_solvers(solvers)
    chosen = common.load_scene(scene, settings=settings, is_run=False, rock=rock, bit=bit)
    names = asked or usual_solvers(chosen)
    for name in names:
        chosen.computed_by(name)  # refuses before anything is claimed or compiled
    common.check_json(json_file)
    if figures:
        claimed = common.claim(
            "compare", out, Path("out") / f"{scene.stem}-compared", force,
            scene=chosen, solvers=names, duration=duration, settle=settle,
        )  # fmt: skip
    common.tell_of_compiling(*names)
    end = chosen.run.duration if duration is None else duration
    with progress_bar(end * len(names)) as bar:
        found = run_all(chosen, names, duration, settle, bar)
    common.write_json(json_file, found.to_dict())
    if json_file != "-":
        show_comparison(found)
    if figures:
        with common.if_drawable():
            from percussion_model.interface.plotting.compared_blows import draw_comparison
            from percussion_model.interface.plotting.style import save_figures

            with progress("drawing the figure"):
                files = save_figures(
                    lambda: [("comparison", draw_comparison(found))], claimed.folder
                )
            common.list_files([*files, claimed.sign()])
