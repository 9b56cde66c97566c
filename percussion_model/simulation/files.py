"""Files that are written whole or not at all."""

from __future__ import annotations

import json
import math
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from percussion_model.scene.rows import shortened


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


# Files of results that are read [bytes]; arrays as they are unpacked.
LARGEST_TEXT, LARGEST_TABLE = 10_000_000, 1_000_000_000


def reason(error: Exception) -> str:
    """Why a file could not be read or written, without the number of the error and its name."""
    if isinstance(error, FileNotFoundError):
        return "no such file"
    if isinstance(error, UnicodeDecodeError):
        return "not a text file in UTF-8"
    return (isinstance(error, OSError) and error.strerror) or str(error)


def refuse_large(path: Path, largest: int) -> None:
    """Raise `ResultError` for a file that is there, and none or larger than that [bytes]."""
    if path.exists() and not path.is_file():
        raise ResultError(f"{path}: cannot be read: it is no file")
    size = path.stat().st_size if path.exists() else 0
    if size > largest:
        raise ResultError(f"{path}: cannot be read: {size} bytes are more than {largest}")


def load_arrays(path: Path) -> dict[str, np.ndarray]:
    """Arrays of a file of NumPy (.npz); nothing in it is run, and its size is bounded.

    Raises
    ------
    ResultError
        If it cannot be read.
    """
    refuse_large(path, LARGEST_TABLE)
    try:
        with ZipFile(path) as archive:
            size = sum(one.file_size for one in archive.infolist())
        if size > LARGEST_TABLE:
            raise ResultError(f"{path}: unpacks to {size} bytes, more than {LARGEST_TABLE}")
        with np.load(path, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except ResultError:
        raise
    except Exception as error:  # a damaged archive fails in many ways
        text = f"{type(error).__name__}: {shortened(str(error))}"
        raise ResultError(f"{path}: cannot be read: {text}") from error


def to_json(summary: dict[str, Any]) -> str:
    """Write a summary as JSON; numbers that are not finite become null."""
    return json.dumps(plain(summary), indent=2, allow_nan=False)


def plain(value: Any) -> Any:
    """Return a value for JSON: numbers that are not finite are None, in tables and lists too."""
    if isinstance(value, dict):
        return {str(name): plain(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
