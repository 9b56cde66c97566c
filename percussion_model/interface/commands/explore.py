"""Command `percussion explore`: sliders, and the response of the hammer to them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.scene.scene import Scene

PORT = 5006
OWN, REFERENCE = "the scene given", "reference hammer"


def explore(
    scene: Annotated[
        Path | None,
        typer.Argument(metavar="[SCENE]", help="A scene file, or a preset; left out: reference."),
    ] = None,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    solver: common.SolverName = None,
    port: Annotated[
        int, typer.Option("--port", min=0, max=65535, help="Port to serve on; 0 takes a free one.")
    ] = PORT,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")
    ] = True,
    page: Annotated[
        bool, typer.Option("--page", help="The page that needs no server, with its own hammers.")
    ] = False,
) -> None:
    """Open a page on which rate, waves and forces of one blow follow sliders."""
    if page:
        _open_page(browser, is_own=bool(scene or settings or rock or bit or solver))
        return
    from percussion_model.interface.progress import progress

    try:
        from percussion_model.interface.explore.server import Explored, PortError
    except ImportError as error:
        raise common.refusal(f"no page, since {common.needs_extra(error, 'report')}") from None
    from percussion_model.interface.explore.response import refuse_scene, respond

    scenes = _scenes(scene, solver, settings, rock, bit)
    first = next(iter(scenes.values()))()
    refuse_scene(first)
    try:
        served = Explored(scenes, port)
    except PortError as error:
        raise common.refusal(str(error)) from None
    with progress("preparing"):
        respond(first)  # compiles the kernels, so that the first slider does not wait
    try:
        served.run(
            browser,
            lambda: print(f"{served.url} follows the sliders; Ctrl-C ends it", flush=True),
        )
    except KeyboardInterrupt:
        raise typer.Exit(common.print_message("ended", common.INTERRUPTED)) from None


def _open_page(browser: bool, is_own: bool) -> None:
    """Open the page that runs the hammer itself, a file."""
    import webbrowser

    from percussion_model.engine.compiler import NoCompilerError
    from percussion_model.interface.explore_page.build import page_file
    from percussion_model.interface.progress import lines

    if is_own:
        raise common.refusal("--page: has hammers, bits and rocks of its own: give no others")
    try:
        with lines("compiling for browsers") as report:
            address = page_file(report).as_uri()
    except NoCompilerError as error:
        raise common.refusal(f"--page: {error}") from None
    print(address, flush=True)
    if browser:
        webbrowser.open(address)


def _scenes(
    path: Path | None,
    solver: str | None,
    settings: list[str] | None,
    rock: str | None,
    bit: str | None,
) -> dict[str, Callable[[], Scene]]:
    """Scenes to start from, by name; the first is shown."""
    from percussion_model.scene.hammers import hammer, hammers
    from percussion_model.scene.scene import Scene

    own = common.load_scene(path, solver, settings=settings, rock=rock, bit=bit)
    found: dict[str, Callable[[], Scene]] = {}
    if path is not None or settings or solver or rock or bit:
        found[OWN] = lambda: own
    found[REFERENCE] = Scene
    for name in hammers():
        if not hammer(name).effects.string:
            found[hammer(name).title] = partial(hammer, name)
    return found
