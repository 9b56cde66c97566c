"""The stationary response of a scene."""

from __future__ import annotations

from percussion_model.interface.commands.common import (
    Cells,
    JsonFile,
    SceneFile,
    Settings,
    SolverName,
    Tolerance,
    check_json,
    load_scene,
    write_json,
)


def settled(
    scene: SceneFile,
    solver: SolverName = None,
    cells: Cells = None,
    settings: Settings = None,
    tolerance: Tolerance = 1e-4,
    json_file: JsonFile = None,
) -> None:
    """Run until the blows repeat: rate, period, order and stability of the cycle."""
    from percussion_model.analysis.stationary import settled as settle
    from percussion_model.interface.terminal import show_settled, waiting_bar

    check_json(json_file)
    chosen = load_scene(scene, solver, cells, settings)
    with waiting_bar():
        found = settle(chosen, tolerance)
    write_json(json_file, found.summary())
    if json_file != "-":
        show_settled(found)
