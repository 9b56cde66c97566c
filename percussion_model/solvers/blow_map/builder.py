"""Construction of the table of a blow map, kept on disk and found again."""

from __future__ import annotations

import io
import logging
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from percussion_model.physics.user_cache import cache_folder
from percussion_model.scene.scene import Scene
from percussion_model.scene.writing import write_whole
from percussion_model.solvers.blow_map.records import ENTRIES, Axis
from percussion_model.solvers.blow_map.single_blow import SingleBlow
from percussion_model.solvers.blow_map.table import (
    BlowTable,
    Nodes,
    TableError,
    fixed_values,
    table_key,
)

_log = logging.getLogger("percussion_model")

Progress = Callable[[int, int], None]
# Does work for each of many tasks; gives number and outcome of each as it ends.
Compute = Callable[[Callable[..., Any], list[tuple[Any, ...]]], Iterator[tuple[int, Any]]]


def one_by_one(work: Callable[..., Any], tasks: list[tuple[Any, ...]]) -> Iterator[tuple[int, Any]]:
    """Do the tasks in this process, one after the other; as in `Compute`."""
    for number, task in enumerate(tasks):
        yield number, work(*task)


def table_file(scene: Scene) -> Path:
    """File that keeps the table of a scene, whether it is there or not."""
    return cache_folder() / f"blow-map-{table_key(scene)}.npz"


def kept_table(scene: Scene) -> BlowTable | None:
    """Table of a scene from the cache; None where there is none, or a damaged one."""
    path = table_file(scene)
    try:
        table = BlowTable.from_bytes(path.read_bytes())
        table.refuse_other(fixed_values(scene))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        _log.warning("%s is not used: %s", path, error)
        return None
    return table


def parts_folder(scene: Scene) -> Path:
    """Folder that keeps the finished slabs of a table which is not finished."""
    return table_file(scene).with_suffix(".part")


def get_table(
    scene: Scene, progress: Progress | None = None, compute: Compute = one_by_one
) -> BlowTable:
    """Table of a scene: from the cache, or made and kept there.

    Parameters
    ----------
    scene : Scene
    progress : callable, optional
        Called with the slabs done and their number.
    compute : callable
        Makes the slabs, in any order.
    """
    found = kept_table(scene)
    if found is not None:
        return found
    path = table_file(scene)
    _log.info("making the blow map %s", path)
    table = build_table(scene, parts_folder(scene), progress, compute)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, table.to_bytes())
    except OSError as error:
        _log.warning("the blow map is not kept: %s: %s", path, error.strerror)
    return table


def build_table(
    scene: Scene, drafts: Path, progress: Progress | None = None, compute: Compute = one_by_one
) -> BlowTable:
    """Make the table of a scene, slab by slab of equal stiffness.

    Finished slabs lie in `drafts` until all are there, so that an interrupted build goes
    on where it was.
    """
    nodes = Nodes.of(scene)
    stiffness = nodes.values(Axis.STIFFNESS)
    values = np.full((*nodes.counts, ENTRIES), np.nan, np.float32)
    left = []
    for i in range(len(stiffness)):
        slab = _read_slab(drafts / f"{i}.npy", values.shape[1:])
        if slab is None:
            left.append(i)
        else:
            values[i] = slab
    if progress is not None:
        progress(len(stiffness) - len(left), len(stiffness))
    tasks = [(scene, float(stiffness[i])) for i in left]
    for done, (number, slab) in enumerate(compute(make_slab, tasks), 1):
        i = left[number]
        values[i] = slab
        _keep_slab(drafts / f"{i}.npy", slab)
        if progress is not None:
            progress(len(stiffness) - len(left) + done, len(stiffness))
    shutil.rmtree(drafts, ignore_errors=True)
    solver = SingleBlow(scene, float(stiffness[0])).solver
    return BlowTable(
        nodes,
        values.astype(np.float64),
        fixed_values(scene),
        dict(solver.cells),
        solver.wave_speed_error,
    )


def make_slab(scene: Scene, stiffness: float) -> np.ndarray:
    """All nodes of one stiffness [N/m].

    Returns
    -------
    ndarray, shape (nodes of velocity, load and drive, ENTRIES)
    """
    nodes = Nodes.of(scene)
    slab = np.full((*nodes.counts[1:], ENTRIES), np.nan, np.float32)
    single = SingleBlow(scene, stiffness)
    for place in nodes.wanted():
        slab[place] = single.entries(*nodes.blow(place))
    return slab


def _read_slab(path: Path, shape: tuple[int, ...]) -> np.ndarray | None:
    try:
        slab = np.load(io.BytesIO(path.read_bytes()), allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    return slab if slab.shape == shape else None


def _keep_slab(path: Path, slab: np.ndarray) -> None:
    out = io.BytesIO()
    np.save(out, slab, allow_pickle=False)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, out.getvalue())
    except OSError as error:  # then an interruption costs more
        _log.warning("a part of the blow map is not kept: %s", error)


__all__ = [
    "TableError",
    "build_table",
    "cache_folder",
    "get_table",
    "kept_table",
    "parts_folder",
    "table_file",
]
