"""State of the travelling-wave solver: quick to copy and to look into."""

from __future__ import annotations

import numpy as np

from percussion_model.solvers.wave.records import WAVE_STATE, Row

# Place of a field in a record, all of whose fields are words of eight bytes.
WORD = {name: int(place[1]) // 8 for name, place in (WAVE_STATE.fields or {}).items()}
_WHOLE = {name for name, place in (WAVE_STATE.fields or {}).items() if place[0].kind == "i"}


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

    @classmethod
    def zero(cls, piston: int, bit: int) -> WaveState:
        """A state all of zeros, for bars of so many cells."""
        words = np.zeros(WAVE_STATE.itemsize // 8, np.int64)
        workspace = np.zeros(len(Row) * (piston + bit + 2))
        return cls(_record(words), workspace, len(Row) * (piston + 1))

    def __setitem__(self, name: str, value: float) -> None:
        """Set a field of the record."""
        view = self.words if name in _WHOLE else self.numbers
        view[WORD[name]] = value

    def copy(self) -> WaveState:
        """An independent copy."""
        return WaveState(_record(self.words.copy()), self.workspace.copy(), self.cut_at)

    def take(self, other: WaveState) -> None:
        """Become a copy of another state of the same solver."""
        self.words[:] = other.words
        self.workspace[:] = other.workspace

    def __reduce__(self) -> tuple[object, ...]:
        return WaveState, (self.record, self.workspace, self.cut_at)


def _record(words: np.ndarray) -> np.ndarray:
    """The same memory as a record; a view does it too, but takes ten times as long."""
    return np.ndarray(1, WAVE_STATE, words)
