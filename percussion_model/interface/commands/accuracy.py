"""What accuracy costs in time, scene by scene."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.scene.scene import Scene
    from percussion_model.verification.accuracy import Study

Report = Callable[[float, str], None]


def accuracy(
    scenes: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[SCENE]...", help="Scene files; the reference scene if left out."),
    ] = None,
    full: Annotated[
        bool, typer.Option("--full", help="Finer and dearer rungs too: up to an hour.")
    ] = False,
    methods: Annotated[
        str | None,
        typer.Option("--methods", metavar="A,B", help="As wave,fem,rigid,scipy; all if left out."),
    ] = None,
    make_references: Annotated[
        bool,
        typer.Option("--make-references", help="Make the stored references of the scenes anew."),
    ] = False,
    settings: common.Settings = None,
    out: common.OutOrDefault = None,
    json_file: common.JsonFile = None,
    figures: Annotated[bool, typer.Option(help="Draw error against time.")] = True,
) -> None:
    """Measure error against time: waves, finite elements, rigid bars, general integrators.

    Prints tables; figures, and the numbers as JSON unless --json is given, go to out/accuracy.
    """
    from percussion_model.interface.commands.accuracy_tables import show_bars, show_study
    from percussion_model.scene.scene import Scene
    from percussion_model.verification.accuracy.ladders import chosen_ladders

    chosen = [(path.stem, common.load_scene(path, settings=settings)) for path in scenes or ()]
    if not chosen:
        title = "The reference scene"
        chosen = [("reference", Scene(title=title))]
        if settings:
            raise common.refusal("--set needs a SCENE to change")
    names = [name for name, _ in chosen]
    if len(set(names)) < len(names):
        raise common.refusal(
            f"{', '.join(names)}: results take the names of the scene files, which must differ"
        )
    words = None if methods is None else [word.strip() for word in methods.split(",")]
    chosen_ladders(words)  # refuses before anything is computed
    folder = out or Path("out") / "accuracy"
    common.check_json(json_file)
    if make_references:
        for _, scene in chosen:
            show_bars(_referenced(scene))
        return
    if figures or json_file is None:
        common.check_outputs(folder, None)
    found: dict[str, dict[str, Any]] = {}
    for name, scene in chosen:
        result = _studied(scene, full, words)
        found[name] = result.to_dict()
        if json_file != "-":
            show_study(result)
        if json_file is None:
            common.write_json(str(folder / f"{name}.json"), found[name])
        if figures:
            with common.if_drawable():
                from percussion_model.interface.plotting.accuracy import save_accuracy

                common.tell_files(save_accuracy(result, folder / name))
    common.write_json(json_file, found)


def _studied(scene: Scene, full: bool, methods: list[str] | None) -> Study:
    from percussion_model.verification.accuracy import study

    with _shares() as report:
        return study(scene, full, methods, report)


def _referenced(scene: Scene) -> Any:
    """Make the reference of a scene and keep it with the package."""
    from percussion_model.verification.accuracy.problems import pose
    from percussion_model.verification.accuracy.reference_store import (
        fingerprint,
        package_store,
        store,
        stored,
    )
    from percussion_model.verification.accuracy.references import make_reference

    with _shares() as report:
        made = make_reference(pose(scene), scene, say=lambda text: report(0.0, text))
    store(package_store(), {**stored(), fingerprint(scene): made})
    return made


@contextmanager
def _shares() -> Iterator[Report]:
    """Show on stderr how far the work is: a bar in a terminal, else a line for each part."""
    if not sys.stderr.isatty():
        said: set[str] = set()

        def line(share: float, text: str) -> None:
            if text not in said:
                said.add(text)
                print(f"{100 * share:3.0f} %  {text}", file=sys.stderr, flush=True)

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns: list[Any] = [BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}")]
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda share, text: bar.update(task, completed=share, description=text)
