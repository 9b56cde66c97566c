"""Blow maps of scenes: built with progress, cached, inspected, and their cost."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from percussion_model.analysis.study.workers import Task, on_this_machine
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.scene.writing import own_prefix
from percussion_model.simulation.simulate import Simulation
from percussion_model.solvers.blow_map.builder import (
    build_table,
    cache_folder,
    get_table,
    kept_table,
    parts_folder,
    table_file,
)
from percussion_model.solvers.blow_map.records import Axis
from percussion_model.solvers.blow_map.refusals import notes_outside
from percussion_model.solvers.blow_map.single_blow import SingleBlow
from percussion_model.solvers.blow_map.solver import BlowMapSolver
from percussion_model.solvers.blow_map.table import BlowTable, Nodes

__all__ = [
    "MapCost",
    "cache_folder",
    "kept_map",
    "kept_parts",
    "make_map",
    "map_cost",
    "map_file",
    "node_count",
    "outside_map",
    "refused_run",
]

# The cost of a table is that of its blows at so many stiffnesses, so many at each.
SAMPLED_STIFFNESSES, SAMPLED_BLOWS = 5, 8
# A run is tried on a table of its own rock, feed and drive, which spans so much around each.
AROUND = 1.001
_TRIED = {
    "stiffness": "rock.loading_stiffness",
    "feed": "feed.force",
    "force": "drive.force",
}


class MapCost(NamedTuple):
    """What a table is going to cost."""

    blows: int
    processor_time: float  # of all of them [s]


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
        Processes; as many as there are processors if left out. More than one wants the
        guard `if __name__ == "__main__"` in a script, since they are spawned.

    Returns
    -------
    BlowTable

    Raises
    ------
    SceneError
        If no blow map can be made of the scene.
    """

    def compute(work: Callable[..., Any], tasks: list[Task]) -> Iterator[tuple[int, Any]]:
        processes = max(1, min(workers or os.cpu_count() or 1, len(tasks)))
        return on_this_machine(work, tasks, processes)

    return get_table(mapped(scene), progress, compute)


def kept_map(scene: Scene) -> BlowTable | None:
    """Table of a scene from the cache, None where it has not been made."""
    return kept_table(mapped(scene))


def kept_parts(scene: Scene) -> int:
    """Number of parts that are kept of a table which was interrupted."""
    return len(list(parts_folder(mapped(scene)).glob("*.npy")))


def map_file(scene: Scene) -> Path:
    """File that keeps the table of a scene, whether it is there or not."""
    return table_file(mapped(scene))


def outside_map(scene: Scene) -> list[str]:
    """What of a scene itself its table would not answer: a text for each such parameter."""
    return notes_outside(mapped(scene))


def refused_run(scene: Scene, duration: float) -> str:
    """Say why the table of a scene would not answer in a run; empty if it would.

    It is tried on a table of the rock, the feed and the drive of the scene alone: some hundred
    blows, a second, where the whole table takes minutes.

    Parameters
    ----------
    scene : Scene
    duration : float
        Simulated time [s].
    """
    scene = mapped(scene)
    if outside := notes_outside(scene):
        return outside[0]
    changes: dict[str, float] = {}
    for name, key in _TRIED.items():
        ends = sorted((scene[key] / AROUND, scene[key] * AROUND))
        changes |= {f"blow_map.{name}_from": ends[0], f"blow_map.{name}_to": ends[1]}
    try:
        small = scene.replace(**changes)
    except SceneError:  # of a feed of zero, say, there is nothing around
        return ""
    with tempfile.TemporaryDirectory(prefix=own_prefix()) as folder:
        table = build_table(small, Path(folder) / "table.part")
    run = Simulation(small, record_events=False, solver=BlowMapSolver(small, table))
    try:
        run.advance(duration)
    except SimulationError as error:
        return str(error)
    return ""


def node_count(scene: Scene) -> int:
    """Blows that have to be computed for the table of a scene."""
    nodes = Nodes.of(mapped(scene))
    return len(nodes.wanted()) * nodes.counts[0]


def map_cost(scene: Scene) -> MapCost:
    """Predict what the table of a scene costs, from a few of its blows; nothing is kept.

    The first blow is left out: kernels may have to be compiled for it.
    """
    scene = mapped(scene)
    nodes = Nodes.of(scene)
    places, stiffness = nodes.wanted(), nodes.values(Axis.STIFFNESS)
    chosen = [places[k] for k in _spread(len(places), SAMPLED_BLOWS)]
    SingleBlow(scene, float(stiffness[0])).entries(*nodes.blow(places[0]))
    setups, blows = [], []
    for k in _spread(len(stiffness), SAMPLED_STIFFNESSES):
        begin = time.perf_counter()
        single = SingleBlow(scene, float(stiffness[k]))
        ready = time.perf_counter()
        for place in chosen:
            single.entries(*nodes.blow(place))
        setups.append(ready - begin)
        blows.append((time.perf_counter() - ready) / len(chosen))
    count = len(places) * len(stiffness)
    return MapCost(count, float(np.mean(setups)) * len(stiffness) + float(np.mean(blows)) * count)


def _spread(count: int, most: int) -> list[int]:
    """At most so many places, evenly over all."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int)).tolist()
