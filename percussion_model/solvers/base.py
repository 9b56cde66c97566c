"""Base of all solvers, and the registry by which scenes name them.

A solver moves states of one scene through time. It has to give a first state, to
advance it and to read it; the rest has defaults that fit a solver without grid and
cells. `register` makes it known by name (CONTRIBUTING.md, "To add a solver").
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property
from importlib import import_module
from typing import Any, ClassVar, Literal, NamedTuple, Protocol

import numpy as np

from percussion_model.physics import settling
from percussion_model.physics.records import BLOW, EVENT, READING, SAMPLE_FIELDS, Status
from percussion_model.scene.inputs import INPUTS
from percussion_model.scene.scene import Scene
from percussion_model.scene.solver_names import register_name
from percussion_model.solvers.state import State, common_limits, words_of

# A state lies ahead of the present after a step that failed half-way, and after a change of
# inputs; no further than this [s].
MOST_AHEAD = 1e6
# A step of a cell, in simulated time, where there are none [s]: events take about as long.
USUAL_STEP = 1e-7


class Cells(Protocol):
    """Cells or elements of one bar."""

    @property
    def mass(self) -> np.ndarray:
        """Mass of each, top to bottom [kg]."""

    @property
    def n(self) -> int:
        """How many there are."""


class Solver(ABC):
    """Advances states of one scene; holds no state itself.

    Attributes
    ----------
    name : str
    scene : Scene
    time_step : float or None
        Distance of grid points [s]; None where there are none. A solver that has it
        counts its steps.
    wave_speed_error : float
        Largest relative error of a section's wave speed.
    operator_bytes : int
        Memory of matrices that were made for it.
    COUNTS : tuple of str
        Counts of what was done that a state carries, without their `count_`.
    """

    name: str
    time_step: float | None = None
    wave_speed_error = 0.0
    operator_bytes = 0
    COUNTS: ClassVar[tuple[str, ...]] = ("events", "blows")

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._no_blows = np.zeros(1, BLOW)
        self._no_events = np.zeros(1, EVENT)
        self._no_reading = np.zeros(1, READING)

    @cached_property
    def cells(self) -> dict[str, int]:
        """Modes, cells or elements of each elastic bar, by its name."""
        return {}

    # what every solver gives

    @abstractmethod
    def new_state(self) -> State:
        """State at time zero; its record has the fields of `COMMON_STATE`."""

    @abstractmethod
    def time(self, state: State) -> float:
        """Time up to which a state is committed [s]."""

    @abstractmethod
    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Commit as far as `t` allows.

        Parameters
        ----------
        blows, events : BLOW and EVENT array
            Filled from index 0.

        Returns
        -------
        status, n_blows, n_events : int
            `Status`, and rows filled. Where it tells of a full list the next call goes on
            as if there had been no interruption.
        """

    @abstractmethod
    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t` without touching the state.

        Parameters
        ----------
        reading : READING array of length 1
            Filled.
        spare : State, optional
            An old copy to be used again.
        peaks : bool
            Whether the peaks have to be right: in standstill they are dear.

        Returns
        -------
        State
            What `fields` reads: a copy at the last grid point up to `t`, or the state itself.
        """

    # what a solver may leave as it is

    def time_of_steps(self, count: float) -> float:
        """Simulated time that about so many steps of a cell take, at least one of all cells [s]."""
        if self.time_step is None:
            return count * USUAL_STEP
        return self.time_step * max(1.0, count / max(1, sum(self.cells.values())))

    def settle(self, state: State, asked: np.ndarray, blows: np.ndarray) -> int:
        """Run until the blows of a state at time zero repeat (`physics.settling`).

        Parameters
        ----------
        state : State
        asked : ndarray of REQUEST, shape (1,)
            A record with what is asked and found; a further call goes on.
        blows : ndarray of BLOW
            Filled from the first on.

        Returns
        -------
        int
            `Status` of a run that cannot continue, else DONE.
        """
        one, rows = asked[0], blows.view(float).reshape(len(blows), -1)
        n, judged = int(one.blows), int(one.judged)
        one.wanted = wanted = settling.blows_wanted(judged, int(one.most))
        stalled = max(settling.stalls_at(rows, judged), one.time)
        end, events = min(stalled, one.until), np.zeros(1, EVENT)
        status, more, _ = self.advance(state, end, blows[n:wanted], events, False)
        one.blows = n + more
        if status not in (Status.DONE, Status.BLOWS_FULL):
            return status
        one.time = end if status == Status.DONE else max(one.time, self.time(state))
        if one.blows >= wanted or one.time >= stalled:
            settling.judge(rows, asked)
        return int(Status.DONE)

    def commit(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Bring an advanced state to the first grid point at or after `t`; as `advance`."""
        return self.advance(state, t, blows, events, record_events)

    def set_inputs(self, state: State, **inputs: float) -> None:
        """Change inputs of a committed state; those of the rock wait for the next cycle."""
        for name, value in inputs.items():
            state.record[0][INPUTS[name].field] = value

    def state_fault(self, state: State, t: float) -> str:
        """What is wrong with a state that comes from outside, of time `t` [s]; empty: nothing.

        Kernels look at no index and bound no loop again.
        """
        fault = common_limits(state.dtype).fault(state)
        if not fault and not self.time(state) <= t + MOST_AHEAD:
            return f"its time of {self.time(state)!r} s, far after {t!r} s"
        return fault

    def grid_point_after(self, state: State, t: float) -> float:
        """First time at or after `t` at which inputs can change [s]."""
        return max(t, self.time(state))

    def readable_until(self, state: State) -> float:
        """Time up to which `read` answers without advancing the state far [s]."""
        return self.time(state)

    def time_of_blow(self, state: State) -> float:
        """Time by which what is pending is over, if a blow may start in it [s]; 0 if none may.

        What ends at the closure that starts it is over before.
        """
        return 0.0

    def reset_peaks(self, state: State, t: float) -> None:
        """Count the peak forces of `read` from `t` on [s]."""
        words, numbers = words_of(state.dtype), state.numbers
        numbers[words["peak_from"]] = t
        numbers[words["peak_bit_force"]] = numbers[words["peak_contact_force"]] = 0.0

    def sample(self, state: State, times: np.ndarray, out: np.ndarray) -> None:
        """Evaluate at `times` into rows of `SAMPLE_FIELDS`."""
        reading, spare = np.zeros(1, READING), None
        row = reading.view(np.float64)[: len(SAMPLE_FIELDS)]
        for k, time in enumerate(times):
            spare = self.read(state, float(time), reading, spare, False)
            if spare is state:
                spare = None
            out[k] = row

    def sample_ahead(
        self, state: State, times: np.ndarray, out: np.ndarray, blows: np.ndarray,
        events: np.ndarray, record_events: bool,
    ) -> tuple[int, int, int, int]:  # fmt: skip
        """Advance through rising `times` and evaluate at each, as far as one call does it.

        Returns
        -------
        status, n_blows, n_events : int
            As of `advance`.
        count : int
            Rows of `out` that were filled.
        """
        status, n_blows, n_events = self.advance(
            state, float(times[0]), blows, events, record_events
        )
        if status != Status.DONE:
            return status, n_blows, n_events, 0
        end = max(1, int(np.searchsorted(times, self.readable_until(state), side="right")))
        self.sample(state, np.maximum(times[:end], self.time(state)), out[:end])
        return status, n_blows, n_events, end

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] in each cell of the elastic bars, top to bottom."""
        return {}

    def force_in(self, state: State, bar: str, cell: int) -> float:
        """Force in one cell of "piston" or "bit" [N], as `fields` reads it."""
        found = self.fields(state).get(f"{bar}_force")
        return 0.0 if found is None else float(found[cell])

    def grid_of(self, bar: str) -> Cells | None:
        """Cells of "piston" or "bit", None where it has none."""
        return None

    def coarser_scenes(self) -> list[Scene] | None:
        """The scene on coarser grids, to tell by runs of them how far off this one may be.

        Empty where there is no grid to coarsen; None where none are known.
        """
        return None

    def section_cells(self, bar: Any) -> list[int]:
        """Cells or elements in each section of an elastic bar."""
        return []

    def statistics(self, state: State) -> dict[str, int]:
        """Counts of what the solver did."""
        s = state.record[0]
        return {name: int(s[f"count_{name}"]) for name in self.COUNTS}


class Entry(NamedTuple):
    """Where a solver is made.

    Attributes
    ----------
    module, factory : str
        A class or a function of the scene.
    """

    module: str
    factory: str


_PACKAGE = __name__.rpartition(".solvers.")[0]
_ENGINE = f"{_PACKAGE}.engine.solvers"
_REGISTRY = {
    "wave": Entry(_ENGINE, "WaveSolver"),
    "modal": Entry(_ENGINE, "ModalSolver"),
    "fem": Entry(_ENGINE, "FemSolver"),
    "rigid": Entry(_ENGINE, "RigidSolver"),
}


def register(
    name: str, module: str, factory: str, bodies: Literal["elastic", "rigid"] | None = None
) -> None:
    """Let scenes name one more solver, in this process and in FMUs that are built in it.

    Parameters
    ----------
    name : str
        Value of `solver.name`.
    module, factory : str
        Where it is made, as in `Entry`.
    bodies : {"elastic", "rigid"}, optional
        What `bit.model` must be for it; either if left out.
    """
    register_name(name, bodies)
    _REGISTRY[name] = Entry(module, factory)


def added_solvers() -> dict[str, Entry]:
    """Solvers that are not a part of this package, by name."""
    return {k: entry for k, entry in _REGISTRY.items() if entry.module != _ENGINE}


def make_solver(scene: Scene) -> Solver:
    """Make the solver that computes a scene."""
    entry = _REGISTRY[scene.solver_name]
    factory: Callable[[Scene], Solver] = getattr(import_module(entry.module), entry.factory)
    return factory(scene)
