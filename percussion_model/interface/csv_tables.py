"""Columns of text files as loggers write them, in SI.

Before the numbers there may be comments, `sep=;`, other rows, the row that names the columns and
one of units. Rows and columns count from 1 in messages, rows with all that a file has before.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from percussion_model.analysis.fitting import FitError
from percussion_model.scene.rows import shortened
from percussion_model.scene.units import factor
from percussion_model.simulation.files import reason

# SI unit, and units that may stand for it.
UNITS = {
    "m": ("m", "mm", "um", "cm", "in"),
    "s": ("s", "ms", "us"),
    "N": ("N", "kN", "MN", "lbf"),
    "Pa": ("Pa", "kPa", "MPa", "GPa", "psi", "bar"),
    "m/s": ("m/s", "mm/s", "km/h", "m/h", "m/min", "mm/min", "ft/h", "cm/min", "ft/min"),
    "rad/s": ("rad/s", "rpm"),
    "Hz": ("Hz", "kHz", "1/min"),
    "N m": ("N m", "kN m", "ft lbf"),
    "J": ("J", "kJ", "ft lbf"),
    "m^3": ("m^3", "cm^3", "mm^3", "in^3"),
}
SEPARATORS = (";", "\t", ",")
COMMENTS = ("#", "%", "//", "!")
# The names of the columns stand in one of so many rows.
MOST_HEADS = 100
SEPARATOR = re.compile(r'"?sep=(?P<mark>.)"?', re.IGNORECASE)
# A name and its unit: force [kN], force (kN), force / kN, force in kN.
HEADING = re.compile(
    r"(?P<name>[^\[(/]+?)\s*(?:[\[(](?P<bracketed>[^\])]*)[\])]|/\s*(?P<behind>\S+)"
    r"|\sin\s(?P<said>\S+))?"
)
# The same with less of a mark: force kN, force_kN, "force, kN".
PLAIN = re.compile(r"(?P<name>.+?)(?: |_|,\s*)(?P<unit>[^ _,]+)")

Row = tuple[int, list[str]]  # its number in the file, and its cells


class Heading(NamedTuple):
    """Name of a column that is known, its unit if it has one, and its place from 0."""

    name: str
    unit: str | None
    place: int


def factor_of(unit: str | None, si: str, where: str) -> float:
    """Factor from a unit to SI; none given is SI.

    Raises
    ------
    FitError
        If it is no unit of that quantity.
    """
    plain = plain_unit(unit or si)
    if plain not in UNITS[si]:
        near = [one for one in UNITS[si] if one.casefold() == plain.casefold()]
        meant = f"; did you mean {near[0]}?" if near else ""
        raise FitError(
            f"{where}: unit {shortened(str(unit))!r} must be one of {', '.join(UNITS[si])}{meant}"
        )
    return 1.0 if plain == si else float(factor(plain, si))


def plain_unit(unit: str) -> str:
    """Return a unit without brackets, and with a plain letter for micro."""
    return unit.strip().strip("[]()").strip().replace("µ", "u").replace("μ", "u")


def read_columns(
    path: Path, known: Mapping[str, str], wanted: str
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns that are known, in SI by name, and what other columns are called.

    Parameters
    ----------
    path : Path
    known : mapping
        SI units of the columns by their names.
    wanted : str
        Says which of them there have to be.

    Raises
    ------
    FitError
        If the file cannot be read so; the message names row and column.
    """
    lines = read_lines(path)
    number, separator, titles = _heading_row(path, lines, known, wanted)
    headings = [
        Heading(*found, place)
        for place, title in enumerate(titles)
        if (found := _name_and_unit(title, known))
    ]
    names = [one.name for one in headings]
    for one in headings:
        if names.count(one.name) > 1:
            raise FitError(f"{path}: row {number}: two columns are {one.name}")
    others = {place: title for place, title in enumerate(titles, 1) if title}
    for one in headings:
        del others[one.place + 1]
    rows = _rows(path, lines[number:], number, separator, titles)
    first = next(rows, None)
    if first is not None and has_no_number(first[1]):
        headings = [_with_unit(path, one, known[one.name], *first) for one in headings]
        first = next(rows, None)
    table = [*([first] if first else []), *rows]
    if not table:
        raise FitError(f"{path}: has no row of numbers behind row {number}")
    _refuse_two_marks(path, headings, table, separator)
    columns = {}
    for one in headings:
        where = f"{path}: row {number}, column {one.place + 1}, {titles[one.place]!r}"
        scale = factor_of(one.unit, known[one.name], where)
        numbers = [_number(path, row, one, separator) for row in table]
        columns[one.name] = scale * np.array(numbers)
        if one.name == "time":
            _refuse_steps_back(path, one, table, numbers)
    return columns, [f"column {place}, {shortened(title)!r}" for place, title in others.items()]


def read_lines(path: Path) -> list[str]:
    """Lines of a file, whatever its encoding."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FitError(f"{path}: cannot be read: {reason(error)}") from None
    wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        text = content.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        # of older loggers, whose numbers are ASCII as well
        text = content.decode("cp1252", "replace")
    if "\0" in text or (wide and not text):
        raise FitError(f"{path}: cannot be read: not a text file in UTF-8")
    if not text.strip():
        raise FitError(f"{path}: is empty")
    return re.split(r"\r\n|\r|\n", text)


def split_cells(line: str, separator: str) -> list[str]:
    """Cells of a line without its mark of a comment."""
    bare = line.strip(" ").lstrip("".join(COMMENTS)) if line.startswith(COMMENTS) else line
    try:
        (row,) = csv.reader([bare], delimiter=separator, skipinitialspace=True)
    except (csv.Error, ValueError):  # a quoted text that does not end
        return bare.split(separator)
    return [cell.strip() for cell in row]


def _heading_row(
    path: Path, lines: Sequence[str], known: Mapping[str, str], wanted: str
) -> tuple[int, str, list[str]]:
    """Row with most of the names: its number, the separator and its cells."""
    marks: Sequence[str] = SEPARATORS
    best: tuple[int, int, str, list[str]] = (0, 0, "", [])
    seen: Row | None = None
    for number, line in enumerate(lines[:MOST_HEADS], 1):
        if given := SEPARATOR.fullmatch(line.strip()):
            marks = (given["mark"],)
            continue
        for mark in marks:
            cells = split_cells(line, mark)
            found = sum(_name_and_unit(cell, known) is not None for cell in cells)
            if found > best[0]:
                best = found, number, mark, cells
            if seen is None and len(cells) > 1:
                seen = number, cells
    if not best[0]:
        number, cells = seen or (1, [lines[0].strip()])
        raise FitError(
            f"{path}: row {number}, column 1: {shortened(cells[0])!r} is none of the columns: "
            f"{wanted}"
        )
    _, number, mark, cells = best
    while cells and not cells[-1]:  # a separator at the end
        cells.pop()
    return number, mark, cells


def _name_and_unit(title: str, known: Mapping[str, str]) -> tuple[str, str | None] | None:
    """Name of a column that is known, and its unit where it has one."""
    parts = HEADING.fullmatch(title)
    if parts and (name := _key(parts["name"])) in known:
        return name, parts["bracketed"] or parts["behind"] or parts["said"]
    parts = PLAIN.fullmatch(title)
    if parts and (name := _key(parts["name"])) in known:
        is_unit = plain_unit(parts["unit"]) in UNITS[known[name]]
        return (name, parts["unit"]) if is_unit else None
    return None


def _key(title: str) -> str:
    return title.strip().lower().replace(" ", "_")


def _rows(
    path: Path, lines: Sequence[str], before: int, separator: str, titles: Sequence[str]
) -> Iterator[Row]:
    """Rows behind the heading that are no comments, each with as many cells."""
    for number, line in enumerate(lines, before + 1):
        if not line.strip() or line.lstrip().startswith(COMMENTS):
            continue
        cells = split_cells(line, separator)
        if not any(cells):
            continue
        while len(cells) > len(titles) and not cells[-1]:
            cells.pop()
        if len(cells) != len(titles):
            hint = "; a decimal comma needs another one" if separator == "," else ""
            raise FitError(
                f"{path}: row {number} has {len(cells)} columns, the heading {len(titles)}, "
                f"separated by {separator!r} as the heading is{hint}; "
                f"row: {shortened(line.strip(), 60)!r}"
            )
        yield number, cells


def has_no_number(cells: Sequence[str]) -> bool:
    """Whether a row has no number."""
    return not any(finite(cell.replace(",", ".")) is not None for cell in cells)


def _with_unit(path: Path, one: Heading, si: str, number: int, cells: Sequence[str]) -> Heading:
    """The heading with the unit that a row of units has for it."""
    unit = cells[one.place] or one.unit
    factor_of(unit, si, f"{path}: row {number}, column {one.place + 1} ({one.name})")
    if one.unit and unit and plain_unit(unit) != plain_unit(one.unit):
        raise FitError(
            f"{path}: row {number}, column {one.place + 1}: {shortened(unit)!r} is another unit "
            f"than {one.unit!r} above"
        )
    return one._replace(unit=unit)


def finite(word: str) -> float | None:
    """A finite number; Python would take 1_0 as well."""
    try:
        found = float(word.replace("−", "-"))
    except ValueError:
        return None
    return found if "_" not in word and np.isfinite(found) else None


def _number(path: Path, row: Row, one: Heading, separator: str) -> float:
    """Number of a cell, with a decimal comma where commas do not separate columns."""
    word = row[1][one.place]
    found = finite(word if separator == "," else word.replace(",", "."))
    if found is None:
        said = f"{shortened(word)!r} is no number" if word else "is empty"
        comma = ": commas separate the columns, decimals have a point" if "," in word else ""
        raise FitError(f"{path}: {_place(row, one)}: {said}{comma}")
    return found


def _place(row: Row, one: Heading) -> str:
    return f"row {row[0]}, column {one.place + 1} ({one.name})"


def _refuse_two_marks(
    path: Path, headings: Sequence[Heading], table: Sequence[Row], separator: str
) -> None:
    """Refuse decimal commas and points in one file: either may stand between thousands."""
    first = ""
    for row in table:
        for one in headings:
            word = row[1][one.place]
            mark = "".join(mark for mark in ",." if mark in word)
            if separator != "," and mark and mark != (first := first or mark):
                raise FitError(
                    f"{path}: {_place(row, one)}: {shortened(word)!r} has {mark!r} where numbers "
                    f"before have {first!r}: marks between thousands are not read"
                )


def _refuse_steps_back(
    path: Path, one: Heading, table: Sequence[Row], numbers: Sequence[float]
) -> None:
    for row, (before, now) in zip(table[1:], pairwise(numbers), strict=True):
        if now <= before:
            why = ": more digits are wanted" if now == before else ""
            raise FitError(
                f"{path}: {_place(row, one)}: {now:g} is not after {before:g} of the row before"
                f"{why}"
            )
