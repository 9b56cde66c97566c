"""Blow maps of scenes: made with progress, kept, found again, looked at."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from percussion_model.scene import Scene
from percussion_model.solvers.blow_builder import cache_folder, get_table, kept_table, table_file
from percussion_model.solvers.blow_refusals import notes_outside
from percussion_model.solvers.blow_table import BlowTable, Nodes

__all__ = ["cache_folder", "kept_map", "make_map", "map_file", "node_count", "outside_map"]


def mapped(scene: Scene) -> Scene:
    """The scene on its blow map.

    Raises
    ------
    SceneError
        If no blow map can be made of it.
    """
    return scene if scene.solver_name == "blow-map" else scene.computed_by("blow-map")


def make_map(
    scene: Scene,
    progress: Callable[[int, int], None] | None = None,
    workers: int | None = None,
) -> BlowTable:
    """Table of blows of a scene: from the cache, or made and kept there.

    Parameters
    ----------
    scene : Scene
        Of any fidelity.
    progress : callable, optional
        Called with the parts done and their number.
    workers : int, optional
        Processes; as many as there are processors if left out. Where processes are
        spawned, more than one wants the guard `if __name__ == "__main__"` in a script.

    Returns
    -------
    BlowTable

    Raises
    ------
    SceneError
        If no blow map can be made of the scene.
    """
    return get_table(mapped(scene), progress, workers or os.cpu_count() or 1)


def kept_map(scene: Scene) -> BlowTable | None:
    """Table of a scene from the cache, None where it has not been made."""
    return kept_table(mapped(scene))


def map_file(scene: Scene) -> Path:
    """File that keeps the table of a scene, whether it is there or not."""
    return table_file(mapped(scene))


def outside_map(scene: Scene) -> list[str]:
    """What of a scene itself its table would not answer: a text for each such parameter."""
    return notes_outside(mapped(scene))


def node_count(scene: Scene) -> int:
    """Blows that have to be computed for the table of a scene."""
    nodes = Nodes.of(mapped(scene))
    return len(nodes.wanted()) * nodes.counts[0]
