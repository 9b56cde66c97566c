"""The finite-element solver: the paper's own computational model."""

from __future__ import annotations

import numpy as np

from percussion_model.physics.records import (
    BLOW,
    EVENT,
    LEDGER_FIELDS,
    SAMPLE_FIELDS,
)
from percussion_model.scene.parameters import Bar
from percussion_model.scene.scene import Scene
from percussion_model.solvers.fem.advance import run
from percussion_model.solvers.fem.bars import dissipated_in_nodes, read_all, stored_energy
from percussion_model.solvers.fem.mesh import (
    BarMesh,
    assemble,
    cut_bar,
    section_count,
)
from percussion_model.solvers.fem.packing import loss_time, pack_fem
from percussion_model.solvers.fem.records import (
    FEM_STATE,
    Column,
    Factor,
    FemTask,
    Key,
    Look,
    Mesh,
    Node,
    Trial,
)
from percussion_model.solvers.fem.state import FemState
from percussion_model.solvers.wave.packing import (
    INPUT_FIELDS,
    begin_state,
    rock_numbers,
)


class FemSolver:
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
    wave_speed_error = 0.0

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        elastic_piston = scene.piston.model == "elastic"
        first = scene.piston if elastic_piston else scene.bit
        element = self._element = first.length / scene.fem.elements
        self._bit = cut_bar(scene.bit, element)
        self._piston: BarMesh | None = None
        if scene.piston.model != "absent":
            self._piston = cut_bar(scene.piston, element, elastic_piston)
        bars = [bar for bar in (self._piston, self._bit) if bar is not None]
        self._mesh = assemble(bars)
        elastic = [bar for bar in bars if bar.n]
        shortest = min(float(bar.transit_time.min()) for bar in elastic)
        self.time_step: float = scene.fem.courant * shortest
        self.loss_time = loss_time(scene, self._bit)
        self.cells = {"bit": self._bit.n}
        if elastic_piston and self._piston is not None:
            self.cells = {"piston": self._piston.n, **self.cells}
        self._par = pack_fem(scene, self._piston, self._bit, self.time_step, self.loss_time)
        n = self._mesh.shape[1]
        self._factors = np.zeros((2 * len(Factor), max(n, len(Key))))
        self._trial = np.zeros((len(Trial), n))
        self._looks = np.zeros((len(Look), len(Column)))
        self._no_blows = np.zeros(1, BLOW)
        self._no_events = np.zeros(1, EVENT)
        self._no_row = np.zeros(len(SAMPLE_FIELDS))

    def new_state(self) -> FemState:
        """State at time zero."""
        scene, start = self.scene, self.scene.start
        record = np.zeros(1, FEM_STATE)
        s = record[0]
        rock = rock_numbers(scene)
        if scene.effects.rock == "wall":
            rock["k_r"] = scene.fem.contact_stiffness
        begin_state(s, scene, rock)
        s["fresh"] = 1
        state = FemState(record, np.zeros(len(Node) * self._mesh.shape[1]))
        w, n_p = self._nodes(state), int(self._par[0]["n_p"])
        w[Node.U] = -start.rock_gap
        w[Node.V, n_p:] = start.bit_velocity
        if n_p:
            w[Node.U, :n_p] -= start.gap
            w[Node.V, :n_p] = start.piston_velocity
        self.refresh(state)
        return state

    def refresh(self, state: FemState) -> None:
        """Derive everything from the nodes, as at the start of a run."""
        s = state.record[0]
        read_all(self._par[0], s, self._nodes(state), self._mesh)
        s["e_start"] = sum(self._stored(state))

    def _nodes(self, state: FemState) -> np.ndarray:
        return state.workspace.reshape(len(Node), -1)

    def _stored(self, state: FemState) -> tuple[float, float, float]:
        return stored_energy(self._par[0], state.record[0], self._nodes(state), self._mesh)

    def _run(
        self,
        task: FemTask,
        state: FemState,
        time: float,
        blows: np.ndarray | None = None,
        events: np.ndarray | None = None,
        row: np.ndarray | None = None,
    ) -> int:
        """Call the kernels; see `core.fem_advance.run`."""
        return run(
            int(task),
            self._par,
            state.record,
            self._nodes(state),
            self._mesh,
            self._factors,
            self._trial,
            self._looks,
            time,
            self._no_blows if blows is None else blows,
            self._no_events if events is None else events,
            self._no_row if row is None else row,
        )

    def _counted(
        self,
        task: FemTask,
        state: FemState,
        time: float,
        blows: np.ndarray | None,
        events: np.ndarray | None,
    ) -> tuple[int, int, int]:
        """Call the kernels; status, and the rows of blows and events that were filled."""
        status = self._run(task, state, time, blows, events)
        s = state.record[0]
        return status, int(s["n_blows"]), int(s["n_events"])

    def time(self, state: FemState) -> float:
        """Time up to which the state is committed [s]."""
        return float(state.record[0]["time"])

    def readable_until(self, state: FemState) -> float:
        """Time up to which `sample` answers without advancing the state [s]."""
        return self.time(state) + self.time_step

    def grid_point_after(self, state: FemState, t: float) -> float:
        """First time at or after `t` at which inputs can change: `t` itself [s]."""
        return max(t, self.time(state))

    def advance(
        self,
        state: FemState,
        t: float,
        blows: np.ndarray,
        events: np.ndarray,
        record_events: bool = False,
    ) -> tuple[int, int, int]:
        """Commit the whole steps up to `t`.

        Returns
        -------
        status, n_blows, n_events : int
        """
        state.record[0]["events_on"] = record_events
        return self._counted(FemTask.ADVANCE, state, t, blows, events)

    def sample(self, state: FemState, times: np.ndarray, out: np.ndarray) -> None:
        """Evaluate at `times` without touching the state (`SAMPLE_FIELDS`)."""
        for k, time in enumerate(times):
            self.look(state, float(time), out[k])

    def look(
        self,
        state: FemState,
        t: float,
        row: np.ndarray,
        here: FemState | None = None,
        peaks: bool = True,
    ) -> FemState:
        """Evaluate at `t` into a row (`LONG_SAMPLE_FIELDS`, or their beginning).

        Parameters
        ----------
        here : FemState, optional
            What an earlier call returned; it becomes the copy.

        Returns
        -------
        FemState
            A copy at `t`.
        """
        if here is None:
            here = state.copy()
        else:
            here.take(state)
        self._run(FemTask.SAMPLE, here, t, row=row)
        return here

    def grid_of(self, bar: str) -> BarMesh | None:
        """Elements of "piston" or "bit", None where it has none."""
        mesh = {"piston": self._piston, "bit": self._bit}[bar]
        return mesh if mesh is not None and mesh.n else None

    def watch_peaks(self, state: FemState, t: float) -> None:
        """Count the peak forces of `look` from `t` on [s]."""
        s = state.record[0]
        s["peak_from"], s["peak_bit"], s["peak_contact"] = t, 0.0, 0.0

    def commit(
        self,
        state: FemState,
        t: float,
        blows: np.ndarray | None = None,
        events: np.ndarray | None = None,
        record_events: bool = False,
    ) -> tuple[int, int, int]:
        """Bring an advanced state to `t`, with a part of a step.

        Returns
        -------
        status, n_blows, n_events : int
        """
        state.record[0]["events_on"] = record_events
        return self._counted(FemTask.BRING, state, t, blows, events)

    def set_inputs(self, state: FemState, **inputs: float) -> None:
        """Change inputs of a committed state; rock inputs wait for the next cycle."""
        for key, value in inputs.items():
            state.record[0][INPUT_FIELDS[key]] = value
        state.record[0]["fresh"] = 1

    def energy(self, state: FemState, t: float) -> dict[str, float]:
        """Ledger [J] at `t`."""
        here = state.copy()
        s = here.record[0]
        s["live"] = 0
        self._run(FemTask.BRING, here, t)
        entries = {name: float(s[f"e_{name}"]) for name in LEDGER_FIELDS}
        loss, numerical = dissipated_in_nodes(self._par[0], self._nodes(here))
        entries["loss"] += loss
        entries["numerical"] += numerical
        kinetic, elastic, rock = self._stored(here)
        entries |= {"start": float(s["e_start"]), "kinetic": kinetic, "elastic": elastic}
        entries["recoverable"] = rock
        return entries

    def fields(self, state: FemState) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] of each element, top to bottom, by bar."""
        w, n_p = self._nodes(state), int(self._par[0]["n_p"])
        out = {}
        for name, first, bar in (("piston", 0, self._piston), ("bit", n_p, self._bit)):
            if bar is not None and bar.n:
                nodes = w[:, first : first + bar.n + 1]
                stiffness = self._mesh[Mesh.STIFFNESS, first : first + bar.n]
                out[f"{name}_force"] = -stiffness * np.diff(nodes[Node.U])
                out[f"{name}_velocity"] = 0.5 * (nodes[Node.V, :-1] + nodes[Node.V, 1:])
        return out

    def force_in(self, state: FemState, bar: str, cell: int) -> float:
        """Force in one element of "piston" or "bit" [N], as `fields` reads it."""
        return float(self.fields(state)[f"{bar}_force"][cell])

    def section_cells(self, bar: Bar) -> list[int]:
        """Elements in each section of an elastic bar."""
        return [section_count(section, self._element) for section in bar.sections]

    def statistics(self, state: FemState) -> dict[str, int]:
        """Counts of what the solver did."""
        s = state.record[0]
        names = ("steps", "trials", "events", "blows", "storms")
        return {name: int(s[f"count_{name}"]) for name in names} | {"locked": int(s["locked"])}
