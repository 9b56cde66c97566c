"""Finite-element solver: the paper's own computational model."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from percussion_model.physics.blows import FASTEST
from percussion_model.physics.kernel import entry_of
from percussion_model.scene.bar_groups import Bar
from percussion_model.scene.numbers import kernel_numbers, section_numbers
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.fem.advance import run, time_of_blow
from percussion_model.solvers.fem.bars import force_in
from percussion_model.solvers.fem.mesh import (
    BarMesh,
    cut_bars,
    elements_wanted,
    mesh_of,
    section_count,
)
from percussion_model.solvers.fem.prepare import begin, fill_fem_parameters, refresh
from percussion_model.solvers.fem.records import (
    FEM_LIMITS,
    FEM_PAR,
    FEM_STATE,
    Column,
    Elements,
    Factor,
    FemTask,
    Key,
    Mesh,
    Node,
    Probe,
    Stage,
)
from percussion_model.solvers.setup import refuse_many
from percussion_model.solvers.state import State, words_of

CLOSED, GAP = (words_of(FEM_STATE)[name] for name in ("closed", "gap"))
# A state is no more than a step, and rounding, behind the present [steps].
MOST_BEHIND = 2.0
# Elements and contact stiffness of runs to compare with, by those of this one.
COARSER = 0.5


class FemSolver(Solver):
    """Linear finite elements, penalty contact, event-driven third-order steps.

    Parameters
    ----------
    scene : Scene
        With an elastic bit.

    Attributes
    ----------
    time_step : float
        Longest step [s]; an event ends a step early.
    cells : dict of int
        Elements in each elastic bar.
    loss_time : float
        Kelvin-Voigt time in force [s].
    """

    name = "fem"
    time_step: float
    COUNTS: ClassVar = ("steps", "trials", "events", "blows", "storms", "locked")
    LIMITS: ClassVar = FEM_LIMITS

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._numbers = numbers = kernel_numbers(scene)
        refuse_many("elements", entry_of(elements_wanted)(numbers))
        bars = entry_of(cut_bars)(numbers)
        self._element, self._piston, self._bit = bars
        self._mesh = entry_of(mesh_of)(bars)
        self._par = np.zeros(1, FEM_PAR)
        entry_of(fill_fem_parameters)(self._par[0], numbers, bars)
        self.time_step, self.loss_time = float(self._par[0]["dt"]), float(self._par[0]["eta"])
        grids = {name: self.grid_of(name) for name in ("piston", "bit")}
        self.cells = {name: grid.n for name, grid in grids.items() if grid is not None}
        n = self._mesh.shape[1]
        self._scratch = (
            np.zeros((2 * len(Factor), max(n, len(Key)))),
            np.zeros((len(Stage), n)),
            np.zeros((len(Probe), len(Column))),
        )

    def new_state(self) -> State:
        """State at time zero."""
        state = State(FEM_STATE, ((len(Node), self._mesh.shape[1]),))
        (w,) = state.arrays
        entry_of(begin)(self._par[0], state.record[0], w, self._mesh, self._numbers)
        return state

    def refresh(self, state: State) -> None:
        """Derive everything from the nodes, as at the start of a run."""
        refresh(self._par[0], state.record[0], state.arrays[0], self._mesh)

    def _run(
        self, task: FemTask, state: State, time: float, blows: np.ndarray, events: np.ndarray,
        reading: np.ndarray,
    ) -> tuple[int, int, int]:  # fmt: skip
        """Call the kernels; see `solvers.fem.advance.run`."""
        elements = Elements(state.arrays[0], self._mesh, *self._scratch)
        status = run(
            int(task), self._par, state.record, elements, time, blows, events, reading,
        )  # fmt: skip
        s = state.record[0]
        return status, int(s["n_blows"]), int(s["n_events"])

    def time(self, state: State) -> float:
        """Time up to which the state is committed [s]."""
        return float(state.record[0]["time"])

    def time_of_blow(self, state: State) -> float:
        """As in `Solver`: a step may be cut at a closure."""
        # as the kernel asks, in a tenth of the time
        if state.words[CLOSED] == 1 or state.numbers[GAP] > FASTEST * self.time_step:
            return 0.0
        return float(time_of_blow(self._par, state.record))

    def readable_until(self, state: State) -> float:
        """Time up to which `read` answers without advancing the state [s]."""
        return self.time(state) + self.time_step

    def state_fault(self, state: State, t: float) -> str:
        """As in `Solver`; the state is within a step of the present."""
        fault = super().state_fault(state, t)
        if not fault and not self.time(state) >= t - MOST_BEHIND * self.time_step:
            return f"its time of {self.time(state)!r} s, far before {t!r} s"
        return fault

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Commit the whole steps up to `t`; as in `Solver`."""
        state.record[0]["events_on"] = record_events
        return self._run(FemTask.ADVANCE, state, t, blows, events, self._no_reading)

    def commit(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Bring an advanced state to `t`, with a part of a step; as in `Solver`."""
        state.record[0]["events_on"] = record_events
        return self._run(FemTask.COMMIT, state, t, blows, events, self._no_reading)

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; a copy at that time. As in `Solver`."""
        spare = state.copy(spare)
        self._run(FemTask.READ, spare, t, self._no_blows, self._no_events, reading)
        return spare

    def set_inputs(self, state: State, **inputs: float) -> None:
        """Change inputs of a committed state; modes may have to follow."""
        super().set_inputs(state, **inputs)
        state.record[0]["inputs_changed"] = 1

    def grid_of(self, bar: str) -> BarMesh | None:
        """Elements of "piston" or "bit", None where it has none."""
        mesh = {"piston": self._piston, "bit": self._bit}[bar]
        return mesh if mesh.n else None

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] of each element, top to bottom, by bar."""
        (w,), n_p = state.arrays, int(self._par[0]["n_p"])
        out = {}
        for name, first, bar in (("piston", 0, self._piston), ("bit", n_p, self._bit)):
            if bar.n:
                nodes = w[:, first : first + bar.n + 1]
                stiffness = self._mesh[Mesh.STIFFNESS, first : first + bar.n]
                out[f"{name}_force"] = -stiffness * np.diff(nodes[Node.U])
                out[f"{name}_velocity"] = 0.5 * (nodes[Node.V, :-1] + nodes[Node.V, 1:])
        return out

    def force_in(self, state: State, bar: str, cell: int) -> float:
        """Force in one element of a bar [N], as `fields` reads it."""
        if self.grid_of(bar) is None:
            return 0.0
        first = 0 if bar == "piston" else int(self._par[0]["n_p"])
        return float(entry_of(force_in)(self._mesh, state.arrays[0], first, cell))

    def coarser_scenes(self) -> list[Scene] | None:
        """A coarser mesh with the same loss, and a softer contact: each has an error."""
        scene = self.scene
        if scene.fem.elements == 1:
            return None
        coarser: dict[str, Any] = {"fem.elements": int(COARSER * scene.fem.elements)}
        if scene.matters("fem.damping_ratio") and scene.fem.damping_ratio is not None:
            coarser |= {"fem.damping_ratio": None, "loss.time": self.loss_time}
        scenes = [scene.replace(**coarser)]
        if scene.matters("fem.contact_stiffness"):
            softer = COARSER * scene.fem.contact_stiffness
            scenes.append(scene.replace(**{"fem.contact_stiffness": softer}))
        return scenes

    def section_cells(self, bar: Bar) -> list[int]:
        """Elements in each section of an elastic bar."""
        return [section_count(section, self._element) for section in section_numbers(bar)]
