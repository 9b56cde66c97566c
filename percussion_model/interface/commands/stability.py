"""Command `stability`: the hard cases by every solver."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.simulation.origin import Claim
    from percussion_model.verification.hard_cases import Collection


def stability(
    cases: Annotated[
        list[str] | None, typer.Argument(metavar="[CASE]...", help="Cases. Default: all.")
    ] = None,
    solvers: Annotated[
        str, typer.Option("--solvers", metavar="A,B", help="Solvers that run them.")
    ] = "wave,modal,fem,rigid",
    share: Annotated[
        float, typer.Option("--share", min=0.01, max=1.0, help="Share of each case's duration.")
    ] = 1.0,
    refined: Annotated[
        bool, typer.Option("--refine/--no-refine", help="Run each on a finer grid as well.")
    ] = True,
    workers: Annotated[
        int | None, typer.Option("--workers", min=0, help="Processes; 0: none but this one.")
    ] = None,
    out: common.Out = None,
    json_file: common.JsonFile = None,
    force: common.Force = False,
) -> None:
    """Run the hard cases by every solver: what must hold, and where solvers disagree."""
    from percussion_model.interface.progress import count_bar
    from percussion_model.interface.terminal import show_stability
    from percussion_model.verification.hard_cases import SOLVERS, run_collection

    common.check_outputs(out, json_file)
    if math.isnan(share):  # which no range keeps out
        raise common.refusal("--share 'nan': must be a number")
    names = [name.strip() for name in solvers.split(",")]
    common.tell_of_compiling(*(name for name in names if name in SOLVERS))
    claimed = None
    if out is not None:
        claimed = common.claim(
            "stability", out, None, force, cases=cases, solvers=names, share=share, refined=refined
        )
    with count_bar("runs of hard cases") as progress:
        found = run_collection(cases or None, names, share, refined, workers, progress)
    common.write_json(json_file, found.to_dict())
    if json_file != "-":
        show_stability(found)
    if claimed is not None:
        _write(found, claimed)
        common.list_files(common.sign(claimed))
    if found.failures():
        raise typer.Exit(common.FAILED)


def _write(found: Collection, claimed: Claim) -> None:
    """Write the page and its figure into a claimed folder."""
    from percussion_model.interface.progress import progress
    from percussion_model.verification.hard_cases.stability_page import page

    picture = None
    with common.if_drawable():
        from percussion_model.interface.plotting.stability_dots import draw_stability
        from percussion_model.interface.plotting.style import save_figures

        with progress("drawing the figure"):
            save_figures(
                lambda: [("stability", draw_stability(found))],
                claimed.folder / "images",
                kinds=("png",),
            )
        picture = "images/stability.png"
    texts = {"hard_cases.md": page(found, picture)}
    common.write_texts(claimed, texts)
