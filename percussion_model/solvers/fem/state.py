"""State of the finite-element solver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from percussion_model.solvers.fem.records import FEM_STATE


@dataclass
class FemState:
    """State of a simulation: one record and one flat workspace."""

    record: np.ndarray  # FEM_STATE, shape (1,)
    workspace: np.ndarray  # float64, shape (len(Node) * nodes,)

    def copy(self) -> FemState:
        """An independent copy."""
        words = self.record.view(np.int64).copy()  # a record of many fields copies slowly
        return FemState(words.view(FEM_STATE), self.workspace.copy())

    def take(self, other: FemState) -> None:
        """Become a copy of another state of the same solver."""
        self.record.view(np.int64)[:] = other.record.view(np.int64)
        self.workspace[:] = other.workspace
