"""Logs of drill rigs, as they come.

The heading may stand in any of the first rows, with columns in any order; units stand in it, in a
row below it, or in a mapping file. A cell without a value, or with what is no number, is missing,
which is counted; a row with too few or too many cells, or that repeats the heading, is left out. A
log of which most is so ends in one line that names row and column.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from percussion_model.analysis.identify.cleaning import COLUMNS, Log
from percussion_model.analysis.identify.tabulate import IdentifyError
from percussion_model.interface.csv_tables import (
    COMMENTS,
    HEADING,
    MOST_HEADS,
    PLAIN,
    SEPARATOR,
    SEPARATORS,
    UNITS,
    factor_of,
    finite,
    has_no_number,
    plain_unit,
    read_lines,
    split_cells,
)
from percussion_model.scene.rows import said_among, shortened
from percussion_model.scene.text import read_toml

# What rigs call their columns, in small letters; the first is our own name.
NAMES = {
    "time": (
        "time", "timestamp", "time stamp", "datetime", "date time", "elapsed time", "clock",
        "datum",
    ),
    "depth": (
        "depth", "hole depth", "hole length", "bit depth", "drilled depth", "drilled length",
        "length", "measured depth", "md",
    ),
    "rate": (
        "rate", "rop", "penetration rate", "rate of penetration", "penetration speed",
        "penetr rate", "penetr speed", "pen rate", "drilling rate", "drill rate", "pr",
    ),
    "pressure": (
        "pressure", "percussion pressure", "percussive pressure", "hammer pressure",
        "impact pressure", "supply pressure", "air pressure", "perc press", "perc pressure", "hp",
    ),
    "feed": ("feed", "feed force", "thrust", "thrust force", "weight on bit", "wob"),
    "feed_pressure": (
        "feed pressure", "feeder pressure", "thrust pressure", "feed press", "fp",
        "pulldown pressure", "pressure pulldown",
    ),
    "speed": (
        "speed", "rotation speed", "rotary speed", "rotation rate", "rotation", "rpm",
        "rotation rpm",
    ),
    "frequency": ("frequency", "blow frequency", "percussion frequency", "impact frequency", "bpm"),
    "torque": ("torque", "rotation torque"),
    "rotation_pressure": (
        "rotation pressure", "rotary pressure", "torque pressure", "rot pressure", "rp",
    ),
}  # fmt: skip
_OWN = {word: name for name, words in NAMES.items() for word in words}
# Columns whose numbers are in these units where none is told.
USUAL = {"time": "s", "depth": "m"}
SAID = {"rpm": "rpm", "rotation rpm": "rpm", "bpm": "1/min"}
# Words and numbers of loggers for a value that is missing.
MISSING = frozenset((
    "", "nan", "null", "none", "-", "--", "n/a", "#n/a", "na", "inf", "-inf", "?",
    "err", "error", "fault", "bad", "invalid",
))  # fmt: skip
SENTINELS = frozenset((-999.0, -999.25, -9999.0, -99999.0))
# Spellings of rigs, by SI unit of the column.
SPELLED = {
    "N m": {"Nm": "N m", "kNm": "kN m"},
    "rad/s": dict.fromkeys(("1/min", "U/min", "min-1", "r/min"), "rpm"),
}
_MEAN = frozenset(("avg", "ave", "average", "mean", "mwd", "sample"))
_CLOCK = re.compile(
    r"(?:(?P<date>\S+)[ T])?(?P<h>\d{1,2}):(?P<m>\d\d)(?::(?P<s>\d\d(?:[.,]\d+)?))?Z?"
)
_DATES = ("%Y-%m-%d", "%d.%m.%Y", "%d/%m/%Y", "%Y/%m/%d")
DAY = 86400.0
# Share of a column's cells, or of the rows, that may be bad.
MOST_BAD = 0.5
_WANTED = "rate is wanted, or depth and time; and pressure, feed, speed, torque as far as there are"


class _Column(NamedTuple):
    name: str
    place: int
    unit: str | None
    factor: float
    offset: float
    is_mapped: bool


def read_log(path: Path, mapping: Path | None = None) -> Log:
    """Read a log.

    Parameters
    ----------
    path : Path
    mapping : Path, optional
        TOML with a table `columns`: by our name (`COLUMNS`) the heading in the log, or a table of
        `heading`, `unit`, `factor` and `offset`. The unit's SI value times the factor, which may
        be an area [m^2] where a pressure stands for a force, plus the offset is the column's.

    Raises
    ------
    IdentifyError
        With row and column, or the key of the mapping.
    FitError
        If it is no text file, or a unit is none of that quantity.
    """
    given = {} if mapping is None else _read_mapping(mapping)
    lines = read_lines(path)
    number, separator, titles = _heading(path, lines, given)
    columns = _columns(path, number, titles, given, mapping)
    table: list[tuple[int, list[str]]] = []
    wide: list[tuple[int, int]] = []
    cut = again = 0
    for at, line in enumerate(lines[number:], number + 1):
        if not line.strip() or line.lstrip().startswith(COMMENTS):
            continue
        cells = split_cells(line, separator)
        while len(cells) > len(titles) and not cells[-1]:
            cells.pop()
        if not any(cells):
            continue
        if cells == titles:
            again += 1
        elif not table and not cut and _is_of_units(cells):
            columns = [_with_unit(one, cells) for one in columns]
        elif len(cells) > len(titles):
            wide.append((at, len(cells)))
        elif len(cells) < len(titles):
            cut += 1
        else:
            table.append((at, cells))
    if len(wide) > MOST_BAD * (len(table) + len(wide)):
        at, count = wide[0]
        hint = "; a decimal comma needs another separator" if separator == "," else ""
        raise IdentifyError(
            f"{path}: row {at}, column {len(titles) + 1}: {count} cells, the heading in "
            f"row {number} has {len(titles)}{hint}"
        )
    if not table:
        raise IdentifyError(f"{path}: row {number}, column 1: no row of numbers is behind it")
    notes = [f"{cut} rows are cut off; dropped"] * bool(cut)
    if wide:
        notes.append(f"{len(wide)} rows have too many cells, the first row {wide[0][0]}; dropped")
    used = {one.place for one in columns}
    unused = [
        f"{k + 1} {shortened(one)!r}" for k, one in enumerate(titles) if k not in used and one
    ]
    notes += [f"columns not used: {', '.join(unused)}; give them by --columns"] * bool(unused)
    notes += [f"{again} rows repeat the heading; dropped"] * bool(again)
    found = {
        one.name: _values(path, one, number, titles, table, separator, notes) for one in columns
    }
    if "rate" not in found and not {"depth", "time"} <= found.keys():
        raise IdentifyError(
            f"{path}: row {number}, column 1: found {', '.join(found)} alone: {_WANTED}"
        )
    return Log(path.name, found, np.array([at for at, _ in table]), notes)


def _read_mapping(path: Path) -> dict[str, dict[str, Any]]:
    tree = read_toml(path)
    if set(tree) != {"columns"} or not isinstance(tree["columns"], dict):
        raise IdentifyError(f"{path}: must have one table, [columns]")
    found = {}
    for name, value in tree["columns"].items():
        if name not in COLUMNS:
            raise IdentifyError(f"{path}: columns.{name}: {said_among(name, COLUMNS)}")
        entry = {"heading": value} if isinstance(value, str) else value
        kinds = {"heading": str, "unit": str, "factor": (int, float), "offset": (int, float)}
        if not isinstance(entry, dict) or "heading" not in entry:
            raise IdentifyError(f"{path}: columns.{name}: must be a heading, or a table with one")
        for key, one in entry.items():
            if key not in kinds:
                raise IdentifyError(f"{path}: columns.{name}.{key}: {said_among(key, kinds)}")
            if not isinstance(one, kinds[key]) or isinstance(one, bool):  # type: ignore[arg-type]
                what = "a text" if kinds[key] is str else "a number"
                raise IdentifyError(f"{path}: columns.{name}.{key} = {one!r}: must be {what}")
        found[name] = entry
    return found


def _key(title: str) -> str:
    """A heading in small letters, its words apart, without what says that it is a mean."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])|[\s_.]+", " ", title).lower().split()
    return " ".join(word for word in words if word not in _MEAN)


def _name_and_unit(title: str) -> tuple[str, str | None] | None:
    """Our name of a heading, and its unit if it has one."""
    for pattern in (HEADING, PLAIN):
        parts = pattern.fullmatch(title.strip())
        if parts and (name := _OWN.get(_key(parts["name"]))):
            if pattern is HEADING:
                unit = parts["bracketed"] or parts["behind"] or parts["said"]
                unit = None if unit and unit.lower() in _MEAN else unit
            else:
                unit = parts["unit"]
                if plain_unit(unit) not in UNITS[COLUMNS[name]]:
                    continue
            return name, unit or SAID.get(_key(parts["name"]))
    return None


def _is_mapped(title: str, given: Mapping[str, dict[str, Any]]) -> str | None:
    parts = HEADING.fullmatch(title.strip())
    keys = {_key(title), _key(parts["name"])} if parts else {_key(title)}
    return next((name for name, one in given.items() if _key(one["heading"]) in keys), None)


def _heading(
    path: Path, lines: Sequence[str], given: Mapping[str, dict[str, Any]]
) -> tuple[int, str, list[str]]:
    """Row with most of the names: its number, the separator and its cells."""
    marks: Sequence[str] = SEPARATORS
    best: tuple[int, int, str, list[str]] = (0, 0, "", [])
    for number, line in enumerate(lines[:MOST_HEADS], 1):
        if told := SEPARATOR.fullmatch(line.strip()):
            marks = (told["mark"],)
            continue
        for mark in marks:
            cells = split_cells(line, mark)
            count = sum(bool(_is_mapped(one, given) or _name_and_unit(one)) for one in cells)
            if count > best[0]:
                best = count, number, mark, cells
    if best[0] < 2:
        raise IdentifyError(
            f"{path}: row 1, column 1: {shortened(lines[0].strip(), 60)!r}: no row of the first "
            f"{MOST_HEADS} has two headings that are known: {_WANTED}; or give --columns"
        )
    _, number, mark, cells = best
    while cells and not cells[-1]:
        cells.pop()
    return number, mark, cells


def _columns(
    path: Path,
    number: int,
    titles: Sequence[str],
    given: Mapping[str, dict[str, Any]],
    mapping: Path | None,
) -> list[_Column]:
    found: dict[str, _Column] = {}
    for place, title in enumerate(titles):
        if name := _is_mapped(title, given):
            entry, own = given[name], _name_and_unit(title)
            unit = entry.get("unit") or (own[1] if own else None) or _unit_of(title)
            one = _Column(name, place, unit, entry.get("factor", 1.0), entry.get("offset", 0.0),
                          "factor" in entry)  # fmt: skip
        elif (told := _name_and_unit(title)) and told[0] not in given:
            one = _Column(told[0], place, told[1], 1.0, 0.0, False)
        else:
            continue
        if one.name in found:
            raise IdentifyError(
                f"{path}: row {number}, column {place + 1}: {shortened(title)!r} is {one.name}, as "
                f"column {found[one.name].place + 1} is: choose one by --columns"
            )
        found[one.name] = one
    if lacking := [name for name in given if name not in found]:
        told_heading = given[lacking[0]]["heading"]
        raise IdentifyError(
            f"{mapping}: columns.{lacking[0]}: no column of {path}, row {number}, is headed "
            f"{told_heading!r}"
        )
    return list(found.values())


def _unit_of(title: str) -> str | None:
    parts = HEADING.fullmatch(title.strip())
    return (parts["bracketed"] or parts["behind"] or parts["said"]) if parts else None


def _is_of_units(cells: Sequence[str]) -> bool:
    units = sum(any(plain_unit(cell) in known for known in UNITS.values()) for cell in cells)
    return units > 1 or (units == 1 and has_no_number(cells))


def _with_unit(one: _Column, cells: Sequence[str]) -> _Column:
    cell = cells[one.place] if one.place < len(cells) else ""
    return one._replace(unit=plain_unit(cell)) if cell and not one.unit else one


def _values(
    path: Path,
    one: _Column,
    heading: int,
    titles: Sequence[str],
    table: Sequence[tuple[int, list[str]]],
    separator: str,
    notes: list[str],
) -> np.ndarray:
    """Numbers of a column, SI."""
    where = f"row {heading}, column {one.place + 1}, {shortened(titles[one.place])!r}"
    numbers, bad = np.empty(len(table)), []
    for k, (at, cells) in enumerate(table):
        value = _number(cells[one.place], one.name == "time", separator)
        numbers[k] = np.nan if value is None else value
        bad += [f"row {at}, column {one.place + 1} ({one.name}): {shortened(cells[one.place])!r}"
                ] * (value is None)  # fmt: skip
    if len(bad) > MOST_BAD * len(table):
        raise IdentifyError(f"{path}: {bad[0]} is no number")
    if bad:
        notes.append(f"{one.name}: {len(bad)} cells are no numbers, the first in {bad[0]}; dropped")
    lost = int(np.isnan(numbers).sum()) - len(bad)
    if lost:
        notes.append(f"{one.name}: {lost} of {len(table)} cells have no value")
    if one.name == "time" and any(_CLOCK.fullmatch(cells[one.place]) for _, cells in table):
        return _over_midnight(numbers)
    unit = one.unit or USUAL.get(one.name)
    if unit is None:
        raise IdentifyError(
            f"{path}: {where}: has no unit: give it in the heading, in a row below it, or in a "
            f"mapping file, as one of {', '.join(UNITS[COLUMNS[one.name]])}"
        )
    scale = _factor(unit, one, f"{path}: {where}")
    return scale * one.factor * numbers + one.offset


def _factor(unit: str, one: _Column, where: str) -> float:
    """Factor to SI; where a mapping has a factor the unit may be one of any quantity."""
    unit = SPELLED.get(COLUMNS[one.name], {}).get(unit.strip(), unit)
    if one.is_mapped:
        for si, units in UNITS.items():
            if plain_unit(unit) in units:
                return factor_of(unit, si, where)
    return factor_of(unit, COLUMNS[one.name], where)


def _number(word: str, is_time: bool, separator: str) -> float | None:
    """Value of a cell; NaN where it is missing, None where it is no number."""
    if word.lower() in MISSING or set(word) == {"*"}:
        return float("nan")
    clock = _CLOCK.fullmatch(word) if is_time else None
    if clock and (seconds := _seconds(clock)) is not None:
        return seconds
    value = finite(word if separator == "," else word.replace(",", "."))
    return float("nan") if value in SENTINELS else value


def _seconds(clock: re.Match[str]) -> float | None:
    """Seconds of a time of day, from the first day of calendars where a date stands before it."""
    day = 0.0
    if clock["date"]:
        for form in _DATES:
            try:
                day = float(datetime.strptime(clock["date"], form).toordinal())
                break
            except ValueError:
                continue
        else:
            return None
    rest = float((clock["s"] or "0").replace(",", "."))
    return DAY * day + 3600.0 * int(clock["h"]) + 60.0 * int(clock["m"]) + rest


def _over_midnight(seconds: np.ndarray) -> np.ndarray:
    """Times that go on behind midnight, where they have no dates."""
    step = np.diff(seconds, prepend=seconds[:1])
    return seconds + DAY * np.cumsum(np.nan_to_num(step) < -0.5 * DAY)
