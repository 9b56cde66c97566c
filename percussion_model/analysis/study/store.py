"""Finished points of a study on disk; none is computed twice."""

from __future__ import annotations

import hashlib
import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from percussion_model.analysis.study.response import ROW
from percussion_model.simulation.files import (
    LARGEST_TEXT,
    ResultError,
    load_arrays,
    reason,
    refuse_large,
    staged_file,
    staged_texts,
    to_json,
)
from percussion_model.simulation.one_writer import IS_HELD, hold
from percussion_model.simulation.result import REPORT

PLAN = "study.json"
PARTS = "parts"
# What a finished study has beside its parts.
WRITTEN = ("points.csv", "points.parquet", "points.nc", REPORT)
# What writes the one that is left out without it.
PARQUET = "pyarrow"
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
    row : dtype
        Of the numbers of a point.
    """

    def __init__(
        self, folder: Path, plan: dict[str, Any], force: bool = False, row: np.dtype = ROW
    ) -> None:
        self.folder, self.row = folder, row
        self._hold = hold(folder)
        if self._hold is None:
            raise ResultError(f"{folder} {IS_HELD}: wait until it has ended, or give another --out")
        text = to_json(plan) + "\n"
        self._digest = hashlib.sha256(text.encode()).hexdigest()[:32]
        path, wanted = folder / PLAN, json.loads(text)
        refuse_large(path, LARGEST_TEXT)
        found = _read_plan(path)
        if found is None:
            self._refuse_others(force)
        elif found != wanted:
            if not force:
                raise ResultError(f"{folder}: {_difference(found, wanted)}")
            _remove(folder)
        if found is None or not path.exists():
            staged_texts(folder, {PLAN: text})
        try:
            (folder / PARTS).mkdir(exist_ok=True)
        except OSError as error:
            raise ResultError(f"{folder}: cannot be written: {error.strerror}") from None

    def _refuse_others(self, force: bool) -> None:
        """Refuse a folder without a plan that can be read, unless all its parts are of this one."""
        parts = sorted((self.folder / PARTS).glob("*.npz"))
        others = sum(not self._is_own(path) for path in parts)
        is_study = parts or (self.folder / PLAN).exists()
        if not is_study and self.folder.exists() and any(self.folder.iterdir()):
            raise ResultError(f"{self.folder}: is not empty and holds no study: give another --out")
        if others and not force:
            raise ResultError(
                f"{self.folder / PLAN}: is damaged or missing, and {others} of {len(parts)} files "
                f"in {PARTS} are not known to be of this study: the command that made them mends "
                "it, another --out keeps them"
            )
        if others:
            _remove(self.folder)

    def _is_own(self, path: Path) -> bool:
        try:
            return str(load_arrays(path)["plan"]) == self._digest
        except (OSError, ValueError, LookupError):
            return False

    def keep(self, part: np.ndarray, rows: np.ndarray, failures: list[str]) -> None:
        """Write finished points; all of them or none.

        Parameters
        ----------
        part : ndarray of int
            Which points they are.
        """
        content = io.BytesIO()
        words = np.array(json.dumps(failures))
        np.savez(content, part=part, rows=rows, failures=words, plan=np.array(self._digest))
        path = self.folder / PARTS / f"{int(part[0]):07d}-{len(part)}.npz"
        try:
            staged_file(path, content.getvalue())
        except ResultError as error:
            raise ResultError(
                f"{error}; finished points before it are kept, the same command continues"
            ) from None

    def read(self, count: int) -> tuple[np.ndarray, list[str], np.ndarray]:
        """Collect what is finished.

        Returns
        -------
        rows : ndarray, shape (count,)
        failures : list of str
        done : ndarray of bool, shape (count,)
        """
        rows, failures = np.zeros(count, self.row), [""] * count
        done = np.zeros(count, bool)
        damaged = []
        for path in sorted((self.folder / PARTS).glob("*.npz")):
            try:
                part, found, words = _read_part(path, count, self.row)
            except (OSError, ValueError, LookupError, RecursionError) as error:
                why = reason(error).removeprefix(f"{path}: cannot be read: ")
                damaged.append(f"{path.name}: cannot be read ({why})")
                continue
            rows[part], done[part] = found, True
            for k, text in zip(part.tolist(), words, strict=True):
                failures[k] = text
        if damaged:
            raise ResultError(
                f"{self.folder / PARTS}: {', '.join(damaged)}: delete "
                f"{'it, and its' if len(damaged) == 1 else 'them, and their'} points run again"
            )
        return rows, failures, done


def _read_part(path: Path, count: int, row: np.dtype) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Points, rows and failures of a part of a study of so many points."""
    arrays = load_arrays(path)
    missing = {"part", "rows", "failures"} - arrays.keys()
    if missing:
        raise ResultError(f"has no {' and no '.join(sorted(missing))}")
    part, rows, words = arrays["part"], arrays["rows"], json.loads(str(arrays["failures"]))
    if part.dtype.kind not in "iu" or part.ndim != 1 or np.any((part < 0) | (part >= count)):
        raise ResultError(f"names points that are not among the {count}")
    if rows.dtype != row or rows.shape != part.shape:
        raise ResultError("its rows are not those of its points")
    if not isinstance(words, list) or [type(one) for one in words] != [str] * len(part):
        raise ResultError("its failures are not those of its points")
    return part, rows, words


def _read_plan(path: Path) -> dict[str, Any] | None:
    """Plan that a folder holds; None where there is none, or a damaged one."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) and "scene" in found else None


def _remove(folder: Path) -> None:
    """Remove a study, its plan last: what an interruption leaves is still known as one."""
    for path in (folder / PARTS).glob("*.npz"):
        path.unlink()
    for name in (*WRITTEN, PLAN):
        (folder / name).unlink(missing_ok=True)


def _difference(found: dict[str, Any], wanted: dict[str, Any]) -> str:
    """Say in what a plan that was found differs, and what to do."""
    if any(found.get(key) != wanted[key] for key in wanted if key not in OF_SOURCES):
        return f"holds another study (see {PLAN} there): {_WAYS_OUT}"
    return (
        "its points were computed by other sources of percussion_model than those of now: "
        f"{_WAYS_OUT}"
    )
