"""What every solver offers to the one time loop above it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from percussion_model.scene.parameters import Bar
from percussion_model.scene.scene import Scene

if TYPE_CHECKING:
    from percussion_model.solvers.wave.grid import Cells


class Solver(Protocol):
    """Advances states of one scene; a state is plain data with a method `copy`.

    Attributes
    ----------
    name : str
    scene : Scene
    time_step : float or None
        Distance of grid points [s]; None where there are none.
    cells : dict of int
        Cells in each elastic bar.
    wave_speed_error : float
        Largest relative error of a section's wave speed.
    """

    name: str
    scene: Scene
    cells: dict[str, int]

    @property
    def time_step(self) -> float | None:
        """Distance of grid points [s]."""

    @property
    def wave_speed_error(self) -> float:
        """Largest relative error of a section's wave speed."""

    def new_state(self) -> Any:
        """State at time zero."""

    def time(self, state: Any) -> float:
        """Time up to which a state is committed [s]."""

    def advance(
        self, state: Any, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Commit as far as `t` allows; return `Status` and the rows filled."""

    def sample(self, state: Any, times: np.ndarray, out: np.ndarray) -> None:
        """Evaluate without touching the state."""

    def look(
        self, state: Any, t: float, row: np.ndarray, here: Any = None, peaks: bool = True
    ) -> Any:
        """Evaluate at `t` into a row (`LONG_SAMPLE_FIELDS`); return a copy for `fields`.

        `here` is an old copy to be used again; without `peaks` those need not be right.
        """

    def fields(self, state: Any) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] in each cell of the elastic bars, top to bottom."""

    def force_in(self, state: Any, bar: str, cell: int) -> float:
        """Force in one cell of "piston" or "bit" [N], as `fields` reads it."""

    def grid_of(self, bar: str) -> Cells | None:
        """Cells of "piston" or "bit", None where it has none."""

    def watch_peaks(self, state: Any, t: float) -> None:
        """Count the peak forces of `look` from `t` on [s]."""

    def commit(
        self, state: Any, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Bring an advanced state to the first grid point at or after `t`; as `advance`."""

    def set_inputs(self, state: Any, **inputs: float) -> None:
        """Change inputs of a committed state."""

    def grid_point_after(self, state: Any, t: float) -> float:
        """First time at or after `t` at which inputs can change [s]."""

    def readable_until(self, state: Any) -> float:
        """Time up to which `sample` answers without advancing the state [s]."""

    def energy(self, state: Any, t: float) -> dict[str, float]:
        """Ledger [J] at the last grid point before `t`: LEDGER_FIELDS, start, stored."""

    def section_cells(self, bar: Bar) -> list[int]:
        """Cells or elements in each section of an elastic bar."""

    def statistics(self, state: Any) -> dict[str, int]:
        """Counts of what the solver did."""


def make_solver(scene: Scene) -> Solver:
    """Make the solver that computes a scene."""
    # Only the kernels that are needed are loaded: that is most of a start.
    if scene.solver_name == "fem":
        from percussion_model.solvers.fem.solver import FemSolver

        return FemSolver(scene)
    if scene.solver_name == "wave":
        from percussion_model.solvers.wave.solver import WaveSolver

        return WaveSolver(scene)
    if scene.solver_name == "blow-map":
        from percussion_model.solvers.blow_map.builder import get_table
        from percussion_model.solvers.blow_map.solver import BlowMapSolver

        return BlowMapSolver(scene, get_table(scene))
    from percussion_model.solvers.rigid.solver import RigidSolver

    return RigidSolver(scene)
