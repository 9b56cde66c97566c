"""Finished points of a study on disk; none is computed twice."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from percussion_model.analysis.study.response import ROW
from percussion_model.simulation.files import ResultError, load_arrays, reason, staged, to_json
from percussion_model.simulation.result import REPORT

PLAN = "study.json"
PARTS = "parts"
# What a finished study has beside its parts.
WRITTEN = ("points.parquet", "points.nc", REPORT)
_WAYS_OUT = "--force replaces it, another --out keeps it"
# Entries of a plan that say which sources compute, not what.
OF_SOURCES = ("version", "sources")


class Store:
    """A folder with a plan, and a file for each finished part of the points.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    plan : dict
        What makes the study what it is, and the sources that compute it. A folder with
        another plan is refused.
    force : bool
        Remove another study instead. A folder that holds none is refused all the same.
    """

    def __init__(self, folder: Path, plan: dict[str, Any], force: bool = False) -> None:
        self.folder = folder
        path = folder / PLAN
        text = to_json(plan) + "\n"
        if path.exists():
            if path.read_text(encoding="utf-8") != text:
                if not force:
                    raise ResultError(f"{folder}: {_difference(path, plan)}")
                _remove(folder)
        elif folder.exists() and any(folder.iterdir()):
            raise ResultError(f"{folder}: is not empty and holds no study: give another --out")
        if not path.exists():
            with staged(folder) as draft:
                (draft / PLAN).write_text(text, encoding="utf-8")
        (folder / PARTS).mkdir(exist_ok=True)

    def keep(self, part: np.ndarray, rows: np.ndarray, failures: list[str]) -> None:
        """Write finished points; all of them or none.

        Parameters
        ----------
        part : ndarray of int
            Which points they are.
        """
        name = f"{int(part[0]):07d}-{len(part)}.npz"
        draft = self.folder / PARTS / f".{name}.part"
        with draft.open("wb") as file:
            np.savez(file, part=part, rows=rows, failures=np.array(json.dumps(failures)))
        draft.replace(self.folder / PARTS / name)

    def read(self, count: int) -> tuple[np.ndarray, list[str], np.ndarray]:
        """Collect what is finished.

        Returns
        -------
        rows : ndarray of ROW, shape (count,)
        failures : list of str
        done : ndarray of bool, shape (count,)
        """
        rows, failures = np.zeros(count, ROW), [""] * count
        done = np.zeros(count, bool)
        for path in sorted((self.folder / PARTS).glob("*.npz")):
            try:
                arrays = load_arrays(path)
                part, found = arrays["part"], arrays["rows"]
                words = json.loads(str(arrays["failures"]))
                rows[part], done[part] = found, True
            except (OSError, ValueError, LookupError, RecursionError) as error:
                raise ResultError(
                    f"{path}: cannot be read ({reason(error)}): delete it, and its points run again"
                ) from None
            for k, text in zip(part.tolist(), words, strict=True):
                failures[k] = text
        return rows, failures, done


def _remove(folder: Path) -> None:
    """Remove a study, its plan last: what an interruption leaves is still known as one."""
    for path in (folder / PARTS).glob("*.npz"):
        path.unlink()
    for name in (*WRITTEN, PLAN):
        (folder / name).unlink(missing_ok=True)


def _difference(path: Path, plan: dict[str, Any]) -> str:
    """Say in what a plan that was found differs, and what to do."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        wanted = json.loads(to_json(plan))
        same = all(found.get(key) == wanted[key] for key in wanted if key not in OF_SOURCES)
    except (ValueError, AttributeError):
        same = False
    if not same:
        return f"holds another study (see {PLAN} there): {_WAYS_OUT}"
    return (
        "its points were computed by other sources of percussion_model than those of now: "
        f"{_WAYS_OUT}"
    )
