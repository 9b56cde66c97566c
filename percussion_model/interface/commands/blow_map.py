"""Command `blow-map`: the table of a blow map, made or described."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.scene.scene import Scene
    from percussion_model.solvers.blow_map.table import BlowTable


# Units of what a table is over, in its order.
_UNITS = {
    "loading_stiffness": "N/m",
    "impact_velocity": "m/s",
    "feed_force": "N",
    "drive_force": "N",
}


def blow_map(
    scene: common.SceneFile,
    action: Annotated[
        Literal["build", "show", "where"],
        typer.Argument(help="Make the table; tell about it; tell its file."),
    ] = "build",
    settings: common.Settings = None,
    rock: common.RockName = None,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Processes; left out: one a processor.")
    ] = None,
    json_file: common.JsonFile = None,
) -> None:
    """Make the table of blows that solver.fidelity = "blow-map" takes, and keep it."""
    from percussion_model.analysis.blow_maps import kept_map, map_file

    common.check_json(json_file)
    chosen = common.load_scene(scene, settings=settings, rock=rock)
    if action == "where":
        typer.echo(str(map_file(chosen)))
        return
    table = kept_map(chosen)
    if action == "build" and table is None:
        table = _made(chosen, workers)
    else:
        warn_of_outside(chosen)
    numbers = _numbers(chosen, table)
    if json_file != "-":
        _show(numbers)
    common.write_json(json_file, numbers)


def ready_map(scene: Scene, workers: int | None = None) -> BlowTable:
    """Table of a scene, made with a bar if it is not there yet.

    What of the scene lies outside is listed before it is made, which takes minutes.
    """
    from percussion_model.analysis.blow_maps import kept_map, make_map
    from percussion_model.interface.progress import count_bar

    kept = kept_map(scene)
    if kept is not None:
        return kept
    warn_of_outside(scene)
    with count_bar("parts of the blow map") as progress:
        return make_map(scene, progress, workers)


def prepare_map(scene: Scene, duration: float | None = None) -> None:
    """Make the table of a scene that asks for one; refuse first a run that it would not answer."""
    from percussion_model.analysis.blow_maps import kept_map, refused_run
    from percussion_model.interface.progress import progress
    from percussion_model.scene.inputs import SimulationError

    if scene.solver_name != "blow-map" or kept_map(scene) is not None:
        return
    with progress("trying the run before the blow map is made"):
        refused = refused_run(scene, scene.run.duration if duration is None else duration)
    if refused:
        raise SimulationError(
            f"the blow map was not made, since it would refuse the run: {refused}"
        )
    _made(scene)


def _made(scene: Scene, workers: int | None = None) -> BlowTable:
    """Table of a scene as `ready_map` makes it; Ctrl-C ends the command and says what is kept."""
    from percussion_model.analysis.blow_maps import kept_parts

    try:
        with common.interruptible():
            return ready_map(scene, workers)
    except KeyboardInterrupt:
        if not (count := kept_parts(scene)):
            raise
        parts = "1 part of the blow map is" if count == 1 else f"{count} parts of the blow map are"
        words = f"interrupted; {parts} kept, the same command continues"
        raise typer.Exit(common.print_message(words, common.INTERRUPTED)) from None


def warn_of_outside(scene: Scene) -> None:
    """Warn of what of a scene its table would not answer."""
    from percussion_model.analysis.blow_maps import outside_map

    for text in outside_map(scene):
        common.print_message(f"warning: {text}")


def _numbers(scene: Scene, table: BlowTable | None) -> dict[str, Any]:
    """Numbers of a table as plain values."""
    from percussion_model.analysis.blow_maps import map_file, node_count, outside_map

    found: dict[str, Any] = {
        "file": str(map_file(scene)),
        "nodes": node_count(scene),
        "made": table is not None,
        "outside": outside_map(scene),
    }
    if table is not None:
        ranges = zip(_UNITS, table.lowest, table.highest, strict=True)
        found["range"] = {name: [low, high] for name, low, high in ranges}
        found["restless_nodes"] = table.restless
        found["cells"] = table.cells
    return found


def _show(numbers: dict[str, Any]) -> None:
    typer.echo(f"{numbers['file']}: {'kept' if numbers['made'] else 'not made yet'}")
    typer.echo(f"{numbers['nodes']} blows")
    if numbers["made"]:
        for name, (low, high) in numbers["range"].items():
            typer.echo(f"{name.replace('_', ' ')} {low:g} to {high:g} {_UNITS[name]}")
        nodes = numbers["restless_nodes"]
        typer.echo(f"{nodes} of them refused: the bit does not come to rest")
