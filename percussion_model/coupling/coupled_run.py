"""What a coupled run leaves behind."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


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
