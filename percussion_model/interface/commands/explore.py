"""Command `percussion explore`: sliders, and the response of the hammer to them."""

from __future__ import annotations

import tempfile
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from percussion_model.interface.commands import common


def explore(
    scene: Annotated[
        Path | None,
        typer.Argument(
            metavar="[SCENE]", help="A scene file, or a preset. Default: the page's own."
        ),
    ] = None,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    solver: common.SolverName = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", dir_okay=False, help="Write the page there, an HTML file."),
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")
    ] = True,
    port: Annotated[int | None, typer.Option("--port", hidden=True)] = None,
) -> None:
    """Open a page on which rate, waves and forces of one blow follow sliders."""
    from percussion_model.engine.compiler import NoCompilerError
    from percussion_model.interface.explore.build import FOLDER, page_file, with_scene
    from percussion_model.interface.progress import lines
    from percussion_model.scene.writing import write_whole

    if port is not None:
        raise common.refusal("--port: the page is a file now, which needs no server: omit it")
    own = None
    if scene or settings or rock or bit or solver:
        own = common.load_scene(scene, solver, settings=settings, rock=rock, bit=bit)
    try:
        with lines("compiling for browsers") as report:
            file = page_file(report)
    except NoCompilerError as error:
        is_old = (FOLDER / "table.json").is_file()
        what = "is of other sources" * is_old or "is not there"
        raise common.refusal(f"no page: the engine in {FOLDER} {what}: {error}") from None
    if own is not None or out is not None:
        text = file.read_text("utf-8")
        # a browser reads it after this command has ended
        file = out or Path(tempfile.mkdtemp(prefix="percussion-")) / "explore.html"
        try:
            write_whole(file, text if own is None else with_scene(text, own))
        except OSError as error:
            raise common.refusal(f"--out {file}: {error.strerror or error}") from None
    address = file.resolve().as_uri()
    print(address, flush=True)
    if browser:
        webbrowser.open(address)
