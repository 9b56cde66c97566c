"""State of a solver: one record and one flat workspace, quick to copy and to look into."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from percussion_model.physics.kernel import kernel
from percussion_model.physics.state import (
    COMMON_LIMITS,
    COMMON_STATE,
    COMMON_UNDEFINED,
    LARGEST,
    NUMBER,
)

# Bytes of a line of a processor's cache.
LINE = 64

# What is said of a number of a state: its field, value and limits.
BEYOND = "{} = {!r}, which must be from {:g} to {:g}"
WORKSPACE = f"a number of its workspace, which must be from {-LARGEST:g} to {LARGEST:g}"


@lru_cache
def words_of(dtype: np.dtype) -> dict[str, int]:
    """Place of each field in a record whose fields are words of eight bytes."""
    return {name: int(place[1]) // 8 for name, place in (dtype.fields or {}).items()}


def _lines(count: int) -> int:
    """Bytes of so many, in whole lines."""
    return (count + LINE - 1) // LINE * LINE


class State:
    """State of a simulation as plain data: saving is a copy, restoring is a copy.

    Parameters
    ----------
    dtype : dtype
        Of the record; all fields are words of eight bytes, or rows of them.
    shapes : tuple of (int, int)
        Of the arrays that follow the record, each from a whole line of a cache on.
    begin : int
        Place of the record in the memory [bytes].
    memory : bytes, optional
        Of all; zeros if left out.

    Attributes
    ----------
    memory : uint8 array
    address : int
        Of the memory.
    record : ndarray of dtype, shape (1,)
    words, numbers : int64 and float64 array
        The record word by word: NumPy copies a record of many fields a hundred
        times slower, and takes its time to read one of them.
    """

    __slots__ = ("address", "begin", "dtype", "memory", "numbers", "record", "shapes", "words")

    def __init__(
        self,
        dtype: np.dtype,
        shapes: tuple[tuple[int, int], ...] = (),
        begin: int = 0,
        memory: bytes | None = None,
    ) -> None:
        self.dtype, self.shapes, self.begin = dtype, shapes, begin
        size = _lines(begin + dtype.itemsize)
        for rows, columns in shapes:
            size += _lines(8 * rows * columns)
        # vectors load faster from the begin of a line
        room = np.zeros(size + LINE, np.uint8)
        there = room.ctypes.data
        self.address = _lines(there)
        self.memory = room[self.address - there :][:size]
        if memory is not None:
            self.memory[:] = np.frombuffer(memory, np.uint8)
        self.words = self.memory[begin : begin + dtype.itemsize].view(np.int64)
        self.record = np.ndarray(1, dtype, self.words)  # a view takes ten times as long
        self.numbers = self.words.view(np.float64)

    @property
    def workspace(self) -> np.ndarray:
        """All that follows the record, as numbers."""
        return self.memory[_lines(self.begin + self.dtype.itemsize) :].view(np.float64)

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """The workspace in the given shapes."""
        arrays, end = [], _lines(self.begin + self.dtype.itemsize)
        for rows, columns in self.shapes:
            size = 8 * rows * columns
            arrays.append(self.memory[end : end + size].view(np.float64).reshape(rows, columns))
            end += _lines(size)
        return tuple(arrays)

    def copy(self, spare: State | None = None) -> State:
        """An independent copy, in the memory of an old one where that is given."""
        copy = State(self.dtype, self.shapes, self.begin) if spare is None else spare
        copy.memory[:] = self.memory
        return copy

    def __reduce__(self) -> tuple[object, ...]:
        return State, (self.dtype, self.shapes, self.begin, self.memory.tobytes())


class LimitRows(NamedTuple):
    """What each word of a record may hold.

    Attributes
    ----------
    low, high : ndarray
    may_be_nan, whole : bool array
        Whether it may be undefined, and whether it is a whole number.
    """

    low: np.ndarray
    high: np.ndarray
    may_be_nan: np.ndarray
    whole: np.ndarray


@kernel
def first_beyond(words, numbers, low, high, may_be_nan, whole):
    """First word of a record, also given as numbers, that is beyond its limits; or -1."""
    for k in range(len(low)):
        value = float(words[k]) if whole[k] else numbers[k]
        if not (low[k] <= value <= high[k] or (may_be_nan[k] and value != value)):
            return k
    return -1


@kernel
def is_bounded(workspace):
    """Whether all numbers of a workspace are such, and not so large that products overflow."""
    for value in workspace:
        if not abs(value) <= LARGEST:
            return False
    return True


class Limits:
    """What the record and the workspace of a state from outside may hold.

    Attributes
    ----------
    names : list of str
        Of the field to which each word of the record belongs.
    rows : LimitRows

    Parameters
    ----------
    dtype : dtype
        Of the record.
    limits : mapping
        Lowest and highest value by field, beside those of `COMMON_LIMITS`.
    undefined : collection of str
        Numbers that may be undefined, beside those of `COMMON_UNDEFINED`.
    own : bool
        Whether fields that are in no list are looked at: whole numbers must be in one,
        other numbers have the limits NUMBER.
    """

    def __init__(
        self,
        dtype: np.dtype,
        limits: Mapping[str, tuple[float, float]],
        undefined: Collection[str] = (),
        own: bool = True,
    ) -> None:
        limits = {**COMMON_LIMITS, **limits}
        free = {name for name in dtype.names or () if not own} - {one[0] for one in COMMON_STATE}
        undefined = {*COMMON_UNDEFINED, *undefined, *free}
        size = dtype.itemsize // 8
        self.names = [""] * size
        low, high = np.full(size, -np.inf), np.full(size, np.inf)
        may_be_nan, whole = np.ones(size, bool), np.zeros(size, bool)
        for name, begin in words_of(dtype).items():
            end = begin + dtype[name].itemsize // 8
            self.names[begin:end] = [name] * (end - begin)
            if name not in free:
                low[begin:end], high[begin:end] = limits.get(name, NUMBER)
                may_be_nan[begin:end] = name in undefined
            whole[begin:end] = dtype[name].base.kind == "i"
        self.rows = LimitRows(low, high, may_be_nan, whole)

    def fault(self, state: State) -> str:
        """Which number of a state lies outside its limits; empty where none does."""
        k = first_beyond(state.words, state.numbers, *self.rows)
        if k >= 0:
            value = state.words[k] if self.rows.whole[k] else state.numbers[k]
            return BEYOND.format(self.names[k], float(value), self.rows.low[k], self.rows.high[k])
        workspace = state.workspace
        return "" if is_bounded(workspace) else WORKSPACE


@lru_cache
def common_limits(dtype: np.dtype) -> Limits:
    """Limits of the fields that all states have."""
    return Limits(dtype, {}, own=False)
