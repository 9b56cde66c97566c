"""State of a solver: one record and one flat workspace, quick to copy and to look into."""

from __future__ import annotations

from functools import lru_cache

import numpy as np


@lru_cache
def words_of(dtype: np.dtype) -> dict[str, int]:
    """Place of each field in a record whose fields are words of eight bytes."""
    return {name: int(place[1]) // 8 for name, place in (dtype.fields or {}).items()}


class State:
    """State of a simulation as plain data: saving is a copy, restoring is a copy.

    Parameters
    ----------
    dtype : dtype
        Of the record; all fields are words of eight bytes, or rows of them.
    shapes : tuple of (int, int)
        Of the arrays that the workspace holds one after the other.
    words, workspace : ndarray, optional
        Memory of both; zeros if left out.

    Attributes
    ----------
    record : ndarray of dtype, shape (1,)
    words, numbers : int64 and float64 array
        The record word by word: NumPy copies a record of many fields a hundred
        times slower, and takes its time to read one of them.
    workspace : float array
    arrays : tuple of float array
        The workspace in the given shapes.
    """

    __slots__ = ("arrays", "dtype", "numbers", "record", "shapes", "words", "workspace")

    def __init__(
        self,
        dtype: np.dtype,
        shapes: tuple[tuple[int, int], ...] = (),
        words: np.ndarray | None = None,
        workspace: np.ndarray | None = None,
    ) -> None:
        if words is None or workspace is None:
            words = np.zeros(dtype.itemsize // 8, np.int64)
            workspace = np.zeros(sum(rows * columns for rows, columns in shapes))
        self.dtype, self.shapes, self.words, self.workspace = dtype, shapes, words, workspace
        self.record = np.ndarray(1, dtype, words)  # a view does it too, but takes ten times as long
        self.numbers = words.view(np.float64)
        arrays, end = [], 0
        for rows, columns in shapes:
            start, end = end, end + rows * columns
            arrays.append(workspace[start:end].reshape(rows, columns))
        self.arrays = tuple(arrays)

    def copy(self, spare: State | None = None) -> State:
        """An independent copy, in the memory of an old one where that is given."""
        if spare is None:
            return State(self.dtype, self.shapes, self.words.copy(), self.workspace.copy())
        spare.words[:] = self.words
        spare.workspace[:] = self.workspace
        return spare

    def __reduce__(self) -> tuple[object, ...]:
        return State, (self.dtype, self.shapes, self.words, self.workspace)
