"""Finite-element solver: the paper's own computational model."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from percussion_model.physics.records import Piston, RockKind
from percussion_model.scene.bar_groups import Bar
from percussion_model.scene.numbers import Numbers, numbers_of, section_numbers
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.fem.advance import run
from percussion_model.solvers.fem.bars import read_all, stored_energy
from percussion_model.solvers.fem.mesh import (
    BarMesh,
    BarMeshes,
    assemble,
    critical_frequency,
    cut_bars,
    section_count,
)
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
    Trial,
)
from percussion_model.solvers.setup import (
    MOST_CHANGES,
    PISTONS,
    ROCKS,
    fill_parameters,
    fill_start,
    kelvin_voigt_time,
)
from percussion_model.solvers.state import State

# Steps cut short by events within the length of a whole one; more are a storm. The
# reference has no more than 5.
MOST_EVENTS = 64


def loss_time(numbers: Numbers, bit: BarMesh) -> float:
    """Kelvin-Voigt time [s]: that of the scene, or 2 zeta_K / omega_cr (eq. 55 of the paper)."""
    values = numbers.values
    if not values.effects_loss or math.isnan(values.fem_damping_ratio):
        return kelvin_voigt_time(numbers)
    return 2.0 * float(values.fem_damping_ratio) / critical_frequency(bit)


def eigenvalue(spectral_radius: float) -> complex:
    """Complex eigenvalue of the scheme's matrix (docs/numerics.md, section 10)."""
    p = (2.0 + spectral_radius) / (3.0 * (1.0 + spectral_radius))
    q = 1.0 / (6.0 * (1.0 + spectral_radius))
    return complex(0.5 * p, math.sqrt(q - 0.25 * p * p))


def defect(spectral_radius: float) -> float:
    """Defect of the scheme's energy identity (docs/numerics.md, section 10)."""
    return (1.0 - spectral_radius) / (36.0 * (1.0 + spectral_radius))


def fem_parameters(numbers: Numbers, bars: BarMeshes) -> np.ndarray:
    """Parameter record of a scene on its mesh.

    Returns
    -------
    FEM_PAR array of length 1
    """
    values = numbers.values
    par = np.zeros(1, FEM_PAR)
    p: Any = par[0]
    fill_parameters(p, numbers, with_piston=PISTONS[values.piston_model] == Piston.ELASTIC)
    shortest = min([float(bar.transit_time.min()) for bar in bars.both if bar.n])
    p["dt"] = values.fem_courant * shortest
    mu = eigenvalue(values.fem_spectral_radius)
    p["mu_re"], p["mu_im"] = mu.real, mu.imag
    p["dissipation"] = defect(values.fem_spectral_radius)
    p["k_c"] = values.fem_contact_stiffness
    p["eta"] = loss_time(numbers, bars.bit)
    p["q_tol"], p["t_tol"] = values.fem_event_tolerance, values.fem_time_tolerance
    p["start_gap"] = values.start_gap
    p["n_p"] = 0 if bars.piston is None else bars.piston.n + 1
    p["n_b"] = bars.bit.n + 1
    if p["rock"] == RockKind.WALL:
        p["rock"] = RockKind.SPRING  # a wall is met like the piston: by a penalty
    p["most_changes"], p["most_events"] = MOST_CHANGES, MOST_EVENTS
    return par


def fill_fem_start(state: np.ndarray, w: np.ndarray, n_p: int, numbers: Numbers) -> None:
    """Fill record and nodes at time zero, but for what `read_all` derives of them.

    Parameters
    ----------
    state : FEM_STATE array of length 1
    w : float array, shape (len(Node), n)
    n_p : int
        Nodes of the piston.
    numbers : Numbers
    """
    s: Any = state[0]
    values = numbers.values
    fill_start(s, numbers)
    if ROCKS[values.effects_rock] == RockKind.WALL:
        s["k_r"] = s["next_k_r"] = values.fem_contact_stiffness
    s["inputs_changed"] = 1
    w[Node.U] = -values.start_rock_gap
    w[Node.U, :n_p] -= values.start_gap
    w[Node.V, :n_p] = values.start_piston_velocity
    w[Node.V, n_p:] = values.start_bit_velocity


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
        self._numbers = numbers = numbers_of(scene)
        bars = cut_bars(numbers)
        self._element, self._piston, self._bit = bars
        self._mesh = assemble(bars.both)
        self._par = fem_parameters(numbers, bars)
        self.time_step, self.loss_time = float(self._par[0]["dt"]), float(self._par[0]["eta"])
        grids = {name: self.grid_of(name) for name in ("piston", "bit")}
        self.cells = {name: grid.n for name, grid in grids.items() if grid is not None}
        n = self._mesh.shape[1]
        self._scratch = (
            np.zeros((2 * len(Factor), max(n, len(Key)))),
            np.zeros((len(Trial), n)),
            np.zeros((len(Probe), len(Column))),
        )

    def new_state(self) -> State:
        """State at time zero."""
        state = State(FEM_STATE, ((len(Node), self._mesh.shape[1]),))
        (w,), n_p = state.arrays, int(self._par[0]["n_p"])
        fill_fem_start(state.record, w, n_p, self._numbers)
        self.refresh(state)
        return state

    def refresh(self, state: State) -> None:
        """Derive everything from the nodes, as at the start of a run."""
        s, (w,) = state.record[0], state.arrays
        read_all(self._par[0], s, w, self._mesh)
        s["e_start"] = sum(stored_energy(self._par[0], s, w, self._mesh))

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
        return mesh if mesh is not None and mesh.n else None

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] of each element, top to bottom, by bar."""
        (w,), n_p = state.arrays, int(self._par[0]["n_p"])
        out = {}
        for name, first, bar in (("piston", 0, self._piston), ("bit", n_p, self._bit)):
            if bar is not None and bar.n:
                nodes = w[:, first : first + bar.n + 1]
                stiffness = self._mesh[Mesh.STIFFNESS, first : first + bar.n]
                out[f"{name}_force"] = -stiffness * np.diff(nodes[Node.U])
                out[f"{name}_velocity"] = 0.5 * (nodes[Node.V, :-1] + nodes[Node.V, 1:])
        return out

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
