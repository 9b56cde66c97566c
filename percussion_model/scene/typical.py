"""Values far from what is usual, which are mostly slips of the unit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from percussion_model.scene.bar_groups import Bar
from percussion_model.scene.group import Parameters
from percussion_model.scene.parameters import find_row
from percussion_model.scene.rows import ParameterRow, unit_suffix
from percussion_model.scene.scene import Scene
from percussion_model.scene.units import QUANTITIES, factor

# A value this many times beyond the typical range deserves a hint. Prefixes differ by a thousand.
FAR = 10.0


def unusual_values(scene: Scene) -> Iterator[tuple[str, str]]:
    """Go through the given values of a scene that are far from what is usual.

    Yields
    ------
    key, hint : str
        The dotted key, and a line that names value, typical range and what was perhaps meant.
    """
    for key, value in _given(scene):
        if hint := hint_of(key, [value]):
            yield key, hint


def hint_of(key: str, values: Iterable[float]) -> str:
    """Say which of the values of a parameter is far from what is usual; empty if none is.

    Parameters
    ----------
    key : str
        Dotted.
    values : iterable of float
        SI; zero and the sign do not count.
    """
    row = find_row(key)
    if row is None or row.typical is None:
        return ""
    low, high = row.typical
    for value in values:
        if value != 0.0 and not low / FAR <= abs(value) <= high * FAR:
            unit = unit_suffix(row.unit)
            meant = _meant(row, value)
            ask = f": did you mean {meant}? " if meant else ": "
            return f"{key} = {value:g}{unit}{ask}{low:g} to {high:g}{unit} are usual"
    return ""


def _meant(row: ParameterRow, value: float) -> str:
    """The same number with a unit that makes it a usual value; empty if there is none."""
    low, high = row.typical or (0.0, 0.0)
    for unit in QUANTITIES[row.unit].usual if row.unit in QUANTITIES else ():
        if low <= abs(value) * factor(unit, row.unit) <= high:
            return f"{value:g} {unit}"
    return ""


def _given(scene: Scene) -> Iterator[tuple[str, float]]:
    """Keys and numbers that were given and matter, those of sections and rods too."""
    for key in sorted(scene.given):
        if scene.matters(key):
            yield from _numbers(key, scene[key])


def _numbers(key: str, value: Any) -> Iterator[tuple[str, float]]:
    if isinstance(value, float):
        yield key, value
    elif isinstance(value, tuple):
        for k, entry in enumerate(value):
            assert isinstance(entry, Parameters)
            for name, own in entry.given_values().items():
                if name in entry.telling or not isinstance(entry, Bar):
                    yield from _numbers(f"{key}.{k}.{name}", own)
