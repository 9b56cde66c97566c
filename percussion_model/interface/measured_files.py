"""Files and words of measurements."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
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
from percussion_model.interface.commands.common import print_message
from percussion_model.interface.csv_tables import factor_of, read_columns
from percussion_model.scene.units import with_point

CURVE_COLUMNS = {"penetration": "m", "force": "N"}
DROP_COLUMNS = {"time": "s"} | {name: unit for name, (unit, _) in SIGNALS.items()}
MEASURED = re.compile(
    r"^(?P<name>\w+)\s*=\s*(?P<value>[^±@\s]+?)\s*(?:±|\+-|\+/-)\s*(?P<error>[^±@\s]+?)"
    r"\s*(?P<unit>[a-zA-Zµμ][a-zA-Z/]*)?\s*(?:@\s*(?P<speed>\S+))?$"
)


def read_curve(path: Path) -> Curve:
    """Read a slow test: columns penetration and force, in any order."""
    wanted = "penetration and force are wanted"
    columns, others = read_columns(path, CURVE_COLUMNS, wanted)
    for name in CURVE_COLUMNS:
        if name not in columns:
            raise FitError(f"{path}: no column is {name}: {wanted}{_found(columns, others)}")
    _tell_of_others(path, others)
    return Curve(columns["penetration"], columns["force"], path.name)


def read_drop(word: str, gauge: float | None = None) -> DropTest:
    """Read a drop test, a word FILE@SPEED: columns time and one signal.

    What was recorded before time zero, as by a pre-trigger, is left out.
    """
    file, at, speed = word.rpartition("@")
    try:
        if not at:
            raise ValueError
        fast = float(speed)
    except ValueError:
        raise FitError(f"--drop {word}: must be CSV@SPEED, as in drop.csv@5.25") from None
    path = Path(file)
    wanted = f"time is wanted, and one of the signals {', '.join(SIGNALS)}"
    columns, others = read_columns(path, DROP_COLUMNS, wanted)
    signals = [name for name in columns if name != "time"]
    if "time" not in columns or len(signals) != 1:
        why = "no column is time"
        if "time" in columns:
            why = f"{len(signals)} columns are signals" if signals else "no column is a signal"
        raise FitError(f"{path}: {why}: {wanted}{_found(columns, others)}")
    _tell_of_others(path, others)
    kept = columns["time"] >= 0.0
    if not kept.all():
        print_message(f"{path}: {np.sum(~kept)} of {len(kept)} rows are before time 0: omitted")
    time, values = columns["time"][kept], columns[signals[0]][kept]
    return DropTest(time, values, fast, signals[0], gauge, f"{path.name}@{speed}")


def _found(columns: Iterable[str], others: Sequence[str]) -> str:
    """What a file has instead of what is wanted."""
    unknown = f"; unknown: {', '.join(others)}" if others else ""
    return f"; found: {', '.join(columns)}{unknown}"


def _tell_of_others(path: Path, others: Sequence[str]) -> None:
    if others:
        print_message(f"{path}: not read: {', '.join(others)}")


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
        numbers = [one for one in (found["value"], found["error"], found["speed"]) if one]
        pointed = next(filter(None, map(with_point, numbers)), "")
        why = f"write {pointed}, with a decimal point" if pointed else wrong
        raise FitError(f"--measured {word!r}: {why}") from None
    return Reading(name, factor * value, factor * error, speed)  # type: ignore[arg-type]
