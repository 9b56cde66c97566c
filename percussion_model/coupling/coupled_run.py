"""Result of a coupled run: its signals over time."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from percussion_model.simulation.files import staged_text


@dataclass
class CoupledRun:
    """Signals of a coupled run.

    Attributes
    ----------
    columns : dict of ndarray
        "time" [s] and the signals, each `component.variable`.
    step : float
        Communication step [s]; the longest one where steps are rejected.
    steps : int
        Steps that were done.
    error : str
        Why it ended before its time; empty if it did not.
    tried, rejected : int
        Steps that were computed beyond those, to know the error, and steps taken back.
    wall_time : float
        Of the stepping [s].
    interrupted : bool
        Whether it was Ctrl-C that ended it.
    """

    columns: dict[str, np.ndarray]
    step: float
    steps: int
    error: str = ""
    tried: int = 0
    rejected: int = 0
    wall_time: float = field(default=0.0, compare=False)
    interrupted: bool = False

    def __getitem__(self, signal: str) -> np.ndarray:
        return self.columns[signal]

    def write_csv(self, path: Path) -> Path:
        """Write time and signals as CSV, with all digits."""
        lines = [",".join(f'"{name}"' for name in self.columns)]
        for row in zip(*(column.tolist() for column in self.columns.values()), strict=True):
            lines.append(",".join(repr(value) for value in row))
        path.parent.mkdir(parents=True, exist_ok=True)
        staged_text(path, "\n".join(lines) + "\n")
        return path
