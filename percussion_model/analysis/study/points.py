"""Points of a study: a grid, a Latin hypercube or a table of parameter values."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from percussion_model.scene.parameters import find_row, read_number
from percussion_model.scene.rows import ParameterRow, shortened, toml_value
from percussion_model.scene.scene import Scene, SceneError, refuse_other
from percussion_model.scene.units import with_point

__all__ = ["Points", "grid", "latin_hypercube", "read_axis", "table"]

# Scenes that differ in these alone share what is costly to set up (modes and their tables).
CHEAP_GROUPS = ("feed.", "drive.", "start.", "run.")
CHEAP_KEYS = ("rock.barrier_energy",)

# A computer has no room for the results of more, and nobody the time [points].
MOST_POINTS = 1_000_000

# A value that misses a whole number by this share is meant to be one.
ROUNDING = 1e-13


@dataclass(frozen=True)
class Points:
    """Values of some parameters at each point.

    Attributes
    ----------
    keys : tuple of str
        Dotted keys of the parameters.
    values : ndarray, shape (points, keys)
        SI units.
    shape : tuple of int
        Of the grid, by key; one number where the points are no grid.
    """

    keys: tuple[str, ...]
    values: np.ndarray = field(repr=False)
    shape: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.values)

    @property
    def is_grid(self) -> bool:
        """Whether the points are all combinations of values of each key."""
        return len(self.shape) == len(self.keys) and len(self.keys) > 1

    def changes(self, k: int) -> dict[str, float]:
        """What point k changes in the scene."""
        return dict(zip(self.keys, self.values[k].tolist(), strict=True))

    def digest(self) -> str:
        """Hash that identifies the points of a study."""
        words = "\n".join((*self.keys, repr(self.shape))).encode()
        return hashlib.sha256(words + np.ascontiguousarray(self.values).tobytes()).hexdigest()

    def in_cheap_order(self) -> np.ndarray:
        """Indices of the points, those next to each other that are quick to set up in turn."""
        dear = [
            k
            for k, key in enumerate(self.keys)
            if not key.startswith(CHEAP_GROUPS) and key not in CHEAP_KEYS
        ]
        columns = [self.values[:, k] for k in reversed(dear)]
        return np.lexsort(columns) if columns else np.arange(len(self))


def grid(axes: Mapping[str, Any]) -> Points:
    """All combinations of the values of each parameter.

    Parameters
    ----------
    axes : mapping of str to array_like
        Values by dotted key, in any order, each once; those of an axis will rise. The last
        key varies fastest.
    """
    columns = {key: _rising(key, _column(key, values)) for key, values in axes.items()}
    _refuse_empty(columns)
    _refuse_many(math.prod(len(column) for column in columns.values()))
    mesh = np.meshgrid(*columns.values(), indexing="ij")
    values = np.stack([part.ravel() for part in mesh], axis=1)
    return Points(tuple(columns), values, tuple(len(column) for column in columns.values()))


def table(columns: Mapping[str, Any]) -> Points:
    """One point for each row of a table, as of a pandas DataFrame.

    Parameters
    ----------
    columns : mapping of str to array_like
        Columns of one length by dotted key.
    """
    found = {str(key): _column(str(key), columns[key]) for key in columns}
    _refuse_empty(found)
    lengths = {len(column) for column in found.values()}
    if len(lengths) > 1:
        raise SceneError(f"columns of a table must be of one length, not {sorted(lengths)}")
    values = np.stack(list(found.values()), axis=1)
    return Points(tuple(found), values, (len(values),))


def latin_hypercube(
    ranges: Mapping[str, tuple[float, float]],
    count: int,
    seed: int = 0,
    logarithmic: Sequence[str] = (),
) -> Points:
    """Samples that fill a box evenly in each parameter.

    Parameters
    ----------
    ranges : mapping of str to (float, float)
        Lowest and highest value by dotted key.
    count : int
    seed : int
        The same seed gives the same points.
    logarithmic : sequence of str
        Keys whose logarithm is spread evenly.
    """
    if count < 1:
        raise SceneError(f"count = {count!r}: must be a whole number from 1 on")
    _refuse_many(count)
    ends = {key: _column(key, values) for key, values in ranges.items()}
    _refuse_empty(ends)
    for key, pair in ends.items():
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise SceneError(f"range of {key}: must be two rising numbers, not {pair.tolist()}")
        if key in logarithmic and pair[0] <= 0:
            raise SceneError(f"range of {key}: must be above 0 to be spread by its logarithm")
    from scipy.stats import qmc  # which takes its time

    share = qmc.LatinHypercube(len(ends), seed=seed).random(count)
    values = np.empty_like(share)
    for k, (key, (low, high)) in enumerate(ends.items()):
        if key in logarithmic:
            values[:, k] = low * (high / low) ** share[:, k]
        else:
            values[:, k] = low + (high - low) * share[:, k]
    return Points(tuple(ends), values, (count,))


def read_axis(text: str) -> tuple[str, np.ndarray]:
    """Read an axis of the command line.

    Parameters
    ----------
    text : str
        `KEY=FIRST:LAST:COUNT`, with `log` after the count for even steps of the
        logarithm, or `KEY=A,B,C`. Values are SI numbers, or all have their unit, as 0.5kN.

    Returns
    -------
    key : str
    values : ndarray
    """
    key, equals, right = text.partition("=")
    text = shortened(text)
    try:
        if not (key and equals and right):
            raise ValueError
        if row := find_row(key.strip()):
            _refuse_no_number(row, key)
        if ":" not in right:
            return key, np.array(_numbers(key, right.split(","), text))
        first, last, count = right.split(":")
        ends = _numbers(key, [first, last], text)
        return key, _spread(text, ends[0], ends[1], count)
    except SceneError:
        raise
    except ValueError:
        raise SceneError(
            f"--over {text}: must be KEY=FIRST:LAST:COUNT, KEY=FIRST:LAST:COUNTlog or KEY=A,B,C"
        ) from None


def _refuse_no_number(row: ParameterRow, key: str) -> None:
    """Raise `SceneError` for what is no number."""
    if row.kind in ("number", "whole number"):
        return
    said = f"{key}: a study varies numbers, and this must be {row.allowed}"
    if row.kind in ("choice", "flag"):
        said += f": make a study of each, as with --set {key}={toml_value(row.default)}"
    raise SceneError(said)


def _numbers(key: str, words: Sequence[str], text: str) -> list[float]:
    """Values of an axis. What has a unit beside what has none would be off by a factor."""
    with_unit = [not _is_float(word) and not with_point(word) for word in words]
    if any(with_unit) and not all(with_unit):
        raise SceneError(
            f"--over {text}: give each value its unit, or none (SI); decimals have a point"
        )
    found = [read_number(key.strip(), word) for word in words]
    if not np.isfinite(found).all():
        raise SceneError(f"--over {text}: values must be finite numbers")
    return found


def _is_float(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _spread(text: str, first: float, last: float, count: str) -> np.ndarray:
    """Values at even steps, of the logarithm where `count` says so."""
    number = int(count.removesuffix("log"))  # of values
    if not 1 <= number <= MOST_POINTS:
        raise SceneError(f"--over {text}: COUNT must be a whole number from 1 to {MOST_POINTS:,}")
    if not count.endswith("log"):
        return _snapped(np.linspace(first, last, number))
    if not min(first, last) > 0:
        raise SceneError(f"--over {text}: both ends must be above 0 for steps of the logarithm")
    return _snapped(np.geomspace(first, last, number))


def _snapped(values: np.ndarray) -> np.ndarray:
    """Values that miss a whole number by rounding alone are that number."""
    whole = np.round(values)
    return np.where(np.abs(values - whole) <= ROUNDING * np.abs(whole), whole, values)


def refuse_unknown(scene: Scene, points: Points) -> None:
    """Raise `SceneError` for what no point could set, before any of them is run."""
    refuse_other(scene)
    if not isinstance(points, Points):
        raise SceneError(f"points = {points!r:.40}: must be Points; grid(...) makes them")
    for key, column in zip(points.keys, points.values.T, strict=True):
        row = scene.row_of(key)
        _refuse_no_number(row, key)
        if not scene.matters(key):
            raise SceneError(f"{key} has no effect in this scene: it needs {row.effect}")
        broken = column[column != np.floor(column)]
        if row.kind == "whole number" and len(broken):
            raise SceneError(
                f"{key} = {float(broken[0])!r}: must be a whole number in all points; list its "
                f"values, as in {key}=10,20,40"
            )


def _column(key: str, values: Any) -> np.ndarray:
    if (
        np.iterable(values)
        and not isinstance(values, str)
        and any(isinstance(value, str) for value in values)
    ):
        values = [read_number(key, one) if isinstance(one, str) else one for one in values]
    try:
        column = np.atleast_1d(np.asarray(values, dtype=float))
    except (TypeError, ValueError):
        raise SceneError(f"{key}: values of a study must be numbers, not {values!r}") from None
    if column.ndim != 1 or not len(column) or not np.isfinite(column).all():
        raise SceneError(f"{key}: values of a study must be finite numbers in one row")
    return column


def _rising(key: str, column: np.ndarray) -> np.ndarray:
    """Sort the values of an axis; refuse one that is given twice."""
    column = np.sort(column)
    twice = column[1:][np.diff(column) == 0.0]
    if len(twice):
        raise SceneError(f"{key}: {float(twice[0])!r} is given twice among the values of the grid")
    return column


def _refuse_many(count: int) -> None:
    if count > MOST_POINTS:
        raise SceneError(f"a study of {count:.3g} points: must be at most {MOST_POINTS:,}")


def _refuse_empty(columns: Mapping[str, np.ndarray]) -> None:
    if not columns:
        raise SceneError("a study needs at least one parameter to vary")


def whole_number(key: str, value: float) -> float | int:
    """Return a value as its parameter wants it."""
    row = find_row(key)
    return int(value) if row is not None and row.kind == "whole number" else value
