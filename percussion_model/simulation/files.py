"""Files that are written whole or not at all."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from percussion_model.scene.rows import shortened
from percussion_model.scene.writing import (
    draft_in,
    followed,
    is_special,
    move_whole,
    write_whole,
)
from percussion_model.simulation.one_writer import hold


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


def check_file(path: str | Path) -> None:
    """Raise `ResultError` unless a file can be written; its folder must be there. Leaves no trace.

    A device, a pipe or an open file, as /dev/stdout, is written through.
    """
    path = Path(path)
    try:
        if is_special(path):
            return
        target = followed(path)
    except OSError as error:
        raise ResultError(f"{path}: cannot be written: {error.strerror}") from None
    if target.is_dir():
        raise ResultError(f"{path}: is a folder; give the file to write")
    check_writable(target.parent)
    if not target.parent.is_dir():
        raise ResultError(f"{path}: cannot be written: there is no folder {target.parent}")


@contextmanager
def staged(folder: Path, outdated: Iterable[str] = ()) -> Iterator[Path]:
    """Give a draft folder whose files all move to `folder` at the end, or none.

    Of several processes that do so at once one is after the other.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    outdated : iterable of str
        Names of files that are removed from it unless they are in the draft.

    Yields
    ------
    Path
        An empty folder on the same disk.
    """
    check_writable(folder)
    folder = Path(os.path.realpath(folder))
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = draft_in(folder if folder.exists() else folder.parent)
        draft.mkdir()
        try:
            yield draft
            one = hold(folder / "moving", waits=True)
            _move(draft, folder, outdated)
            del one
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    except OSError as error:
        raise ResultError(f"{folder}: cannot be written: {error.strerror or error}") from None


def _move(draft: Path, folder: Path, outdated: Iterable[str]) -> None:
    if not folder.exists():
        draft.rename(folder)
        return
    sources = sorted(draft.rglob("*"))
    for source in sources:
        target = folder / source.relative_to(draft)
        if source.is_dir():
            target.mkdir(exist_ok=True)
        else:
            move_whole(source, target)
    for name in set(outdated) - {source.name for source in sources}:
        (folder / name).unlink(missing_ok=True)


def staged_file(path: Path, content: str | bytes) -> None:
    """Write one file whole or not at all, as `write_whole`; its folder must be there."""
    try:
        write_whole(path, content)
    except OSError as error:
        raise ResultError(f"{path}: cannot be written: {error.strerror or error}") from None


def staged_texts(folder: Path, texts: Mapping[str, str]) -> list[Path]:
    """Write texts by their names into a folder, all or none; it is made if it is not there."""
    with staged(folder) as draft:
        for name, text in texts.items():
            (draft / name).write_bytes(text.encode())
    return [folder / name for name in texts]


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


def damaged(path: Path, why: str) -> ResultError:
    """What is said of a file that is cut off, or holds something else."""
    return ResultError(f"{path}: not a complete result: {shortened(why)}")


def csv_text(columns: Mapping[str, Any], quoted: bool = False) -> str:
    """Columns as CSV with all digits, what is None empty; texts in quotation marks if asked for."""
    plain = [one.tolist() if isinstance(one, np.ndarray) else one for one in columns.values()]
    text = io.StringIO()
    writer = csv.writer(
        text, lineterminator="\n", quoting=csv.QUOTE_NONNUMERIC if quoted else csv.QUOTE_MINIMAL
    )
    writer.writerow(columns)
    writer.writerows(zip(*plain, strict=True))
    return text.getvalue()


def read_csv(path: Path, convert: Callable[[str], float]) -> dict[str, Sequence[float]]:
    """Columns of a table by their headings; all lines are whole."""
    try:
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - 1))
            end = file.read()
        with path.open(encoding="utf-8", newline="") as file:
            head, *lines = [*csv.reader(file)] or [[]]
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, csv.Error) as error:
        raise damaged(path, reason(error)) from None
    if not head:
        raise damaged(path, "it is empty")
    if end not in (b"\n", b"\r"):
        raise damaged(path, "its last line is cut off")
    rows = []
    for k, line in enumerate(lines, 2):
        if len(line) != len(head):
            raise damaged(path, f"line {k} has {len(line)} of {len(head)} columns")
        try:
            rows.append([convert(text) for text in line])
        except ValueError as error:
            raise damaged(path, f"line {k}: {error}") from None
    columns = list(zip(*rows, strict=True)) or [()] * len(head)
    return dict(zip(head, columns, strict=True))


def rows_of(path: Path, columns: dict[str, Sequence[float]], dtype: np.dtype) -> np.ndarray:
    """Rows of a table by its columns, which a file has."""
    names = dtype.names or ()
    if missing := [name for name in names if name not in columns]:
        raise damaged(path, f"has no column {missing[0]}")
    rows = np.zeros(len(columns[names[0]]), dtype)
    for name in names:
        try:
            rows[name] = columns[name]
        except (ValueError, OverflowError) as error:  # no whole number, or too large a one
            raise damaged(path, f"column {name}: {error}") from None
    return rows
