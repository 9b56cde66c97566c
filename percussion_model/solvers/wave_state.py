"""State of the travelling-wave solver: quick to copy and to look into."""

from __future__ import annotations

import numpy as np

from percussion_model.core.wave_records import WAVE_STATE, Row

# Place of a field in a record, all of whose fields are words of eight bytes.
WORD = {name: int(place[1]) // 8 for name, place in (WAVE_STATE.fields or {}).items()}


class WaveState:
    """State of a simulation: one record and one flat workspace.

    Parameters
    ----------
    record : WAVE_STATE array of length 1
    workspace : float array
        Rows of the piston, then of the bit.
    cut_at : int
        Numbers of the piston.

    Attributes
    ----------
    words : int64 array
        The record word by word: NumPy copies a record of many fields a hundred
        times slower, and takes its time to read one of them.
    numbers : float64 array
        The same as numbers.
    bars : tuple of float arrays, shape (len(Row), cells + 1)
        Piston and bit in the workspace.
    """

    __slots__ = ("bars", "cut_at", "numbers", "record", "words", "workspace")

    def __init__(self, record: np.ndarray, workspace: np.ndarray, cut_at: int) -> None:
        self.record, self.workspace, self.cut_at = record, workspace, cut_at
        self.words, self.numbers = record.view(np.int64), record.view(np.float64)
        rows = len(Row)
        self.bars = workspace[:cut_at].reshape(rows, -1), workspace[cut_at:].reshape(rows, -1)

    def copy(self) -> WaveState:
        """An independent copy."""
        return WaveState(self.words.copy().view(WAVE_STATE), self.workspace.copy(), self.cut_at)

    def take(self, other: WaveState) -> None:
        """Become a copy of another state of the same solver."""
        self.words[:] = other.words
        self.workspace[:] = other.workspace

    def __reduce__(self) -> tuple[object, ...]:
        return WaveState, (self.record, self.workspace, self.cut_at)
