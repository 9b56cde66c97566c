"""Files and words of measurements: separators, decimal commas, units."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np

from percussion_model.analysis.fitting import (
    QUANTITIES,
    SIGNALS,
    Curve,
    DropTest,
    FitError,
    Reading,
)
from percussion_model.scene.units import factor
from percussion_model.simulation.files import reason

# SI unit, and units that may stand for it.
UNITS = {
    "m": ("m", "mm", "um", "cm", "in"),
    "s": ("s", "ms", "us"),
    "N": ("N", "kN", "MN", "lbf"),
    "Pa": ("Pa", "kPa", "MPa", "GPa", "psi"),
    "m/s": ("m/s", "mm/s", "km/h", "m/h", "m/min", "mm/min", "ft/h"),
}
CURVE_COLUMNS = {"penetration": "m", "force": "N"}
DROP_COLUMNS = {"time": "s"} | {name: unit for name, (unit, _) in SIGNALS.items()}
HEADING = re.compile(r"^(?P<name>[^\[\(]+?)\s*(?:[\[\(](?P<unit>[^\]\)]*)[\]\)])?$")
MEASURED = re.compile(
    r"^(?P<name>\w+)\s*=\s*(?P<value>[^±@\s]+?)\s*(?:±|\+-|\+/-)\s*(?P<error>[^±@\s]+?)"
    r"\s*(?P<unit>[a-zA-Zµμ][a-zA-Z/]*)?\s*(?:@\s*(?P<speed>\S+))?$"
)


def factor_of(unit: str | None, si: str, where: str) -> float:
    """Factor from a unit to SI; none given is SI.

    Raises
    ------
    FitError
        If it is no unit of that quantity.
    """
    plain = (unit or si).strip().replace("µ", "u").replace("μ", "u")
    if plain not in UNITS[si]:
        raise FitError(f"{where}: unit {unit!r} must be one of {', '.join(UNITS[si])}")
    return 1.0 if plain == si else float(factor(plain, si))


def read_curve(path: Path) -> Curve:
    """Read a slow test: columns penetration and force, in any order."""
    columns = _columns(path, CURVE_COLUMNS)
    if set(columns) != set(CURVE_COLUMNS):
        raise FitError(f"{path}: the columns must be penetration, force, not {list(columns)}")
    return Curve(columns["penetration"], columns["force"], path.name)


def read_drop(word: str, gauge: float | None = None) -> DropTest:
    """Read a drop test, a word FILE@SPEED: columns time and one signal."""
    file, at, speed = word.rpartition("@")
    try:
        if not at:
            raise ValueError
        fast = float(speed)
    except ValueError:
        raise FitError(f"--drop {word}: must be CSV@SPEED, as in drop.csv@5.25") from None
    path = Path(file)
    columns = _columns(path, DROP_COLUMNS)
    if "time" not in columns or len(columns) != 2:
        raise FitError(f"{file}: the columns must be time and one signal, not {list(columns)}")
    (signal,) = (name for name in columns if name != "time")
    return DropTest(columns["time"], columns[signal], fast, signal, gauge, f"{path.name}@{speed}")


def read_reading(word: str) -> Reading:
    """Read a single number, as in `rebound_velocity=2.1+-0.05 m/s @5.25`."""
    found = MEASURED.match(word.strip())
    if found is None:
        raise FitError(
            f"--measured {word!r}: must be QUANTITY=VALUE+-ERROR [UNIT][@SPEED], "
            "as in 'rebound_velocity=2.1+-0.05 m/s @5.25'"
        )
    name = found["name"]
    if name not in QUANTITIES:
        raise FitError(f"--measured {word!r}: {name} must be one of {', '.join(QUANTITIES)}")
    factor = factor_of(found["unit"], QUANTITIES[name][0], f"--measured {word!r}")
    try:
        value, error = float(found["value"]), float(found["error"])
        speed = None if found["speed"] is None else float(found["speed"])
    except ValueError as wrong:
        raise FitError(f"--measured {word!r}: {wrong}") from None
    return Reading(name, factor * value, factor * error, speed)  # type: ignore[arg-type]


def _columns(path: Path, known: dict[str, str]) -> dict[str, np.ndarray]:
    """Columns of a file in SI by name; the separator is a comma, a semicolon or a tab."""
    heading, rows, separator = _table(path)
    columns: dict[str, np.ndarray] = {}
    for k, title in enumerate(heading):
        parts = HEADING.match(title)
        name = (parts["name"] if parts else title).strip().lower().replace(" ", "_")
        if name not in known:
            raise FitError(
                f"{path}: the columns must be of {', '.join(known)}, not {title!r}"
                + (f" (separated by {separator!r})" if len(heading) < 2 else "")
            )
        if name in columns:
            raise FitError(f"{path}: two columns are {name}")
        factor = factor_of(parts["unit"] if parts else None, known[name], f"{path}, {title!r}")
        numbers = [_number(path, n, row[k], separator) for n, row in enumerate(rows, 1)]
        columns[name] = factor * np.array(numbers)
    return columns


def _table(path: Path) -> tuple[list[str], list[list[str]], str]:
    """Heading, rows and separator of a file."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FitError(f"{path}: cannot be read: {reason(error)}") from None
    lines = [line for line in text.splitlines() if line.strip()]
    if not lines:
        raise FitError(f"{path}: is empty")
    separator = next((mark for mark in (";", "\t") if mark in lines[0]), ",")
    heading, *rows = [
        [word.strip() for word in row] for row in csv.reader(lines, delimiter=separator)
    ]
    for number, row in enumerate(rows, 1):
        if len(row) != len(heading):
            raise FitError(
                f"{path}: row {number} has {len(row)} columns, the heading {len(heading)}, "
                f"separated by {separator!r} as the heading is; row: {lines[number].strip()!r}"
            )
    return heading, rows, separator


def _number(path: Path, row: int, word: str, separator: str) -> float:
    """Read a number, with a decimal comma where commas do not separate columns."""
    try:
        return float(word if separator == "," else word.replace(",", "."))
    except ValueError:
        raise FitError(f"{path}: row {row}: {word!r} is no number") from None
