"""Variables of an FMU: what model description and instance need to know of them."""

from __future__ import annotations

import functools
import json
import math
import sys
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from percussion_model.scene.rows import ParameterRow

Causality = Literal["parameter", "input", "output"]
# Within the resources of an FMU.
FILE = "variables.json"
# Bounds that no number keeps.
EMPTY = (math.inf, -math.inf)


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU.

    Bounds are inclusive; those of a row that leave out the bound itself are checked
    when the value is used. `items` are those of an enumeration, by name. `at_start` tells
    of an output at the start of a simulation: the inputs that it depends on beside the
    parameters, or None where it is the same in every simulation.
    """

    name: str
    reference: int
    type: Literal["Real", "Integer", "Boolean", "Enumeration"]
    causality: Causality
    description: str
    variability: Literal["fixed", "continuous", "discrete"]
    unit: str | None = None
    display: str | None = None
    lower: float | None = None
    upper: float | None = None
    nominal: float | None = None
    start: Any = None
    row: ParameterRow | None = None  # bounds of a parameter or an input
    key: str | None = None  # of the scene
    left_out: Any = None  # value that stands for "left out"
    at_start: tuple[str, ...] | None = None
    enumeration: str | None = None
    items: tuple[tuple[str, int, str], ...] = ()  # name, value, description


def to_json(value: Any) -> str:
    """Text of a resource; the same value gives the same bytes."""
    return json.dumps(value, indent=1, sort_keys=True, allow_nan=False) + "\n"


def write_variables(variables: Iterable[Variable]) -> str:
    """Text from which an instance reads its variables."""
    return to_json([asdict(variable) for variable in variables])


@functools.cache
def read_variables(folder: str) -> tuple[Variable, ...]:
    """Variables of the FMU whose resources lie in a folder."""
    entries = json.loads((Path(folder) / FILE).read_text(encoding="utf-8"))
    return tuple(
        Variable(**entry | {"row": None if entry["row"] is None else read_row(entry["row"])})
        for entry in entries
    )


def read_row(entry: Mapping[str, Any]) -> ParameterRow:
    """A row of the parameter table from its plain values; JSON has no tuples."""
    needs = {key: tuple(values) for key, values in entry["needs"].items()}
    typical = None if entry["typical"] is None else tuple(entry["typical"])
    lists = {"choices": tuple(entry["choices"]), "typical": typical}
    return ParameterRow(**{**entry, **lists, "needs": needs})


def number_row(key: str, unit: str, lower: float, upper: float, description: str) -> ParameterRow:
    """Row of a number that only an FMU has."""
    return ParameterRow(
        key=key, kind="number", unit=unit, lower=lower, lower_open=False, upper=upper,
        upper_open=False, default=None, required=False, choices=(), description=description,
        needs={},
    )  # fmt: skip


def closed_bounds(row: ParameterRow | None) -> tuple[float, float]:
    """Between these, both included, a number is allowed without a closer look."""
    if row is None or row.kind != "number" or row.choices:
        return EMPTY
    low = -sys.float_info.max if row.lower is None else row.lower
    high = sys.float_info.max if row.upper is None else row.upper
    return (
        math.nextafter(low, math.inf) if row.lower_open else low,
        math.nextafter(high, -math.inf) if row.upper_open else high,
    )


def magnitude(value: float) -> float | None:
    """Power of ten near a value, for the attribute `nominal`; None for 0."""
    return None if value == 0 else float(f"1e{int(f'{abs(value):e}'.partition('e')[2])}")
