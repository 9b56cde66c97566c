"""Results as files: all or nothing is written."""

from __future__ import annotations

import csv
import json
import math
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from percussion_model.physics.records import BLOW, EVENT, EventKind
from percussion_model.scene.scene import Scene

if TYPE_CHECKING:
    from percussion_model.simulation.result import Result

# A longer trace goes into a compressed NumPy file.
LONGEST_CSV = 100_000

# What tells a result from any other folder.
_MARKS = ("summary.json", "scene.toml")
_TRACES = ("trace.csv", "trace.npz")
# What is made of a result beside it: the page, and figures as PNG and SVG.
REPORT = "report.html"
FIGURES = ("overview", "bit_motion", "activation", "stress_waves")
_DERIVED = (REPORT, *(f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")))


class ResultError(ValueError):
    """Result files that cannot be written or read; the message says why."""


def check_writable(folder: str | Path) -> None:
    """Raise `ResultError` unless a folder can be written or made; leaves no trace."""
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise ResultError(f"{folder}: cannot be written: it is a file, not a folder")
    place = folder.absolute()
    try:
        while not place.exists():
            place = place.parent
        if not place.is_dir():
            raise ResultError(f"{folder}: cannot be written: {place} is a file, not a folder")
        os.rmdir(tempfile.mkdtemp(dir=place))
    except OSError as error:
        raise ResultError(f"{folder}: cannot be written: {error.strerror}") from None


@contextmanager
def staged(folder: Path) -> Iterator[Path]:
    """Give a draft folder whose files all move to `folder` at the end, or none.

    Yields
    ------
    Path
        An empty folder on the same disk.
    """
    check_writable(folder)
    folder = folder.absolute()
    try:
        if folder.exists():
            draft = folder / f".{os.getpid()}.part"
        else:
            folder.parent.mkdir(parents=True, exist_ok=True)
            draft = folder.with_name(f".{folder.name}.{os.getpid()}.part")
        draft.mkdir()
        try:
            yield draft
            _move(draft, folder)
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    except OSError as error:
        raise ResultError(f"{folder}: cannot be written: {error.strerror or error}") from None


def _move(draft: Path, folder: Path) -> None:
    if not folder.exists():
        draft.rename(folder)
        return
    for source in sorted(draft.rglob("*")):
        target = folder / source.relative_to(draft)
        if source.is_dir():
            target.mkdir(exist_ok=True)
        else:
            source.replace(target)


def staged_text(path: Path, text: str) -> None:
    """Write one file in one go, making its folder."""
    with staged(path.absolute().parent) as draft:
        (draft / path.name).write_text(text, encoding="utf-8")


def write_result(result: Result, folder: Path) -> list[Path]:
    """Write a result to a folder; see `Result.save`.

    What an earlier result left there goes: its trace, its figures and its report would
    stand beside numbers that they do not belong to.
    """
    was_result = all((folder / name).is_file() for name in _MARKS)
    left = (*_TRACES, *_DERIVED) if was_result else _TRACES
    with staged(folder) as draft:
        (draft / "summary.json").write_text(to_json(result.summary()) + "\n", encoding="utf-8")
        (draft / "scene.toml").write_text(result.scene.to_toml(), encoding="utf-8")
        blows = result.blows
        _write_csv(draft / "blows.csv", {name: blows[name] for name in BLOW.names or ()})
        events = {name: result.events[name] for name in EVENT.names or ()}
        _write_csv(
            draft / "events.csv",
            events | {"kind": [EventKind(k).name.lower() for k in events["kind"]]},
        )
        if result.trace is not None:
            _write_trace(draft, result.trace)
        names = sorted(path.name for path in draft.iterdir())
    for name in left:
        if name not in names:
            (folder / name).unlink(missing_ok=True)
    return [folder / name for name in names]


def to_json(summary: dict[str, Any]) -> str:
    """Write a summary as JSON."""
    return json.dumps(summary, indent=2, allow_nan=False)


def _write_trace(draft: Path, trace: dict[str, np.ndarray]) -> None:
    if len(trace["time"]) <= LONGEST_CSV:
        _write_csv(draft / "trace.csv", trace)
    else:
        arrays: dict[str, Any] = dict(trace)
        np.savez_compressed(draft / "trace.npz", **arrays)


def _write_csv(path: Path, columns: dict[str, Any]) -> None:
    """Write columns with a heading; numbers keep all their digits."""
    plain = [c.tolist() if isinstance(c, np.ndarray) else c for c in columns.values()]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*plain, strict=True))


def read_result(folder: Path) -> dict[str, Any]:
    """Read the fields of a `Result` that was saved in a folder."""
    if not folder.is_dir():
        raise ResultError(f"{folder}: there is no such result folder")
    missing = [name for name in _MARKS if not (folder / name).is_file()]
    if missing:
        raise ResultError(
            f"{folder}: no result folder, it has no {' and no '.join(missing)}; "
            "percussion run SCENE --out DIR writes one"
        )
    scene = Scene.from_toml(folder / "scene.toml")
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        fields = {name: summary[name] for name in _FROM_SUMMARY}
        fields["cells"] = fields["cells"] or {}
        for name, value in fields["energy"].items():
            fields["energy"][name] = math.nan if value is None else value
        error = summary.get(_ERROR)  # unknown to older files
        fields[_ERROR] = math.nan if error is None else error
        blows = _read_csv(folder / "blows.csv", float)
        events = _read_csv(folder / "events.csv", _number_or_kind)
        tables = {"blows": _rows(blows, BLOW), "events": _rows(events, EVENT)}
        return {"scene": scene, **fields, **tables, "trace": _read_trace(folder)}
    except OSError as error:
        raise ResultError(f"{error.filename}: cannot be read: {error.strerror}") from None
    except (KeyError, ValueError, TypeError, StopIteration) as error:
        raise ResultError(f"{folder}: not a complete result: {error!r}") from None


_FROM_SUMMARY = (
    "solver",
    "cells",
    "time_step",
    "wave_speed_error",
    "duration",
    "settle",
    "energy",
    "statistics",
    "wall_time",
    "setup_time",
    "warnings",
)


_ERROR = "rate_of_penetration_relative_error"


def _number_or_kind(text: str) -> float:
    kind = EventKind.__members__.get(text.upper())
    return float(text) if kind is None else float(kind)


def _read_csv(path: Path, convert: Callable[[str], float]) -> dict[str, Sequence[float]]:
    with path.open(encoding="utf-8", newline="") as file:
        reader = csv.reader(file)
        names = next(reader)
        rows = [[convert(text) for text in row] for row in reader]
    columns = list(zip(*rows, strict=True)) or [()] * len(names)
    return dict(zip(names, columns, strict=True))


def _rows(columns: dict[str, Sequence[float]], dtype: np.dtype) -> np.ndarray:
    rows = np.zeros(len(columns["time"]), dtype)
    for name in dtype.names or ():
        rows[name] = columns[name]
    return rows


def _read_trace(folder: Path) -> dict[str, np.ndarray] | None:
    if (folder / "trace.npz").exists():
        with np.load(folder / "trace.npz") as arrays:
            return {name: arrays[name] for name in arrays.files}
    if (folder / "trace.csv").exists():
        columns = _read_csv(folder / "trace.csv", float)
        return {name: np.array(column) for name, column in columns.items()}
    return None
