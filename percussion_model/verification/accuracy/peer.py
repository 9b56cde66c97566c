"""Base of the peers: solvers that advance and read by one kernel."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from percussion_model.solvers.base import Solver
from percussion_model.solvers.state import State


class PeerSolver(Solver):
    """Advances a state, or a copy of it to be read, by the same kernel."""

    @abstractmethod
    def _run(
        self, reads: int, state: State, t: float, blows: np.ndarray, events: np.ndarray,
        reading: np.ndarray,
    ) -> int:  # fmt: skip
        """Advance to `t` and, where `reads` is 1, fill the reading; a `Status`."""

    def time(self, state: State) -> float:
        """Time up to which the state is committed [s]."""
        return float(state.record[0]["time"])

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Advance as far as `t` allows; as in `Solver`."""
        s = state.record[0]
        s["events_on"] = record_events
        status = self._run(0, state, t, blows, events, self._no_reading)
        return status, int(s["n_blows"]), int(s["n_events"])

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; a copy at that time, or half a step off it. As in `Solver`."""
        spare = state.copy(spare)
        self._run(1, spare, t, self._no_blows, self._no_events, reading)
        return spare
