"""Solver that takes blows out of a table and flies between them in closed form."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np

from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import READING, Status
from percussion_model.scene.numbers import kernel_numbers
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.solvers.base import Solver
from percussion_model.solvers.blow_map import advance as kernels
from percussion_model.solvers.blow_map import flight
from percussion_model.solvers.blow_map.builder import get_table
from percussion_model.solvers.blow_map.prepare import (
    NO_STAND,
    begin,
    fill_map_parameters,
    stands_on_rock,
)
from percussion_model.solvers.blow_map.records import ENTRIES, MAP_LIMITS, MAP_PAR, MAP_STATE
from percussion_model.solvers.blow_map.refusals import explain_refusal
from percussion_model.solvers.blow_map.table import BlowTable, fixed_values
from percussion_model.solvers.blow_map.words import FIXED_INPUTS, FLIGHT_INPUTS
from percussion_model.solvers.state import State, words_of

_WORD = words_of(MAP_STATE)
T, T_NEXT, EVENTS_ON = _WORD["t"], _WORD["t_next"], _WORD["events_on"]
N_BLOWS, N_EVENTS = _WORD["n_blows"], _WORD["n_events"]


class BlowMapSolver(Solver):
    """Blow map of a scene (docs/fidelity.md).

    Parameters
    ----------
    scene : Scene
        With `solver.fidelity = "blow-map"`.
    table : BlowTable
        Made for the scene.

    Raises
    ------
    SceneError
        If the table was made for another scene, or the scene does not start on the rock.
    """

    name = "blow-map"
    LIMITS: ClassVar = MAP_LIMITS

    def __init__(self, scene: Scene, table: BlowTable) -> None:
        super().__init__(scene)
        table.refuse_other(fixed_values(scene))
        self._numbers = kernel_numbers(scene)
        if not entry_of(stands_on_rock)(self._numbers):
            start = scene.start
            raise SceneError(
                NO_STAND.format(gap=repr(start.rock_gap), velocity=repr(start.bit_velocity))
            )
        self.table = table
        self.cells = dict(table.cells)
        self.wave_speed_error = table.wave_speed_error
        self._values = table.values
        self._par = np.zeros(1, MAP_PAR)
        entry_of(fill_map_parameters)(self._par[0], self._numbers, table.head)
        self._found = np.zeros(ENTRIES)
        self._advance: Callable[..., int] = kernels.advance
        self._read: Callable[..., None] = flight.read
        self._move: Callable[..., None] = flight.commit
        self._plan: Callable[..., None] = flight.plan_next
        self._load_kernels()

    def _load_kernels(self) -> None:
        """Have the kernels compiled, and called without a look at types that never change."""
        state = self.new_state()
        state.numbers[T_NEXT] = np.inf
        self._run(state, 0.0, self._no_blows, self._no_events)
        self._read(self._par, state.record, 0.0, np.zeros(1, READING))
        self._move(self._par, state.record, 0.0)
        self._plan(self._par, state.record)
        self._advance, self._read = entry_of(kernels.advance), entry_of(flight.read)
        self._move, self._plan = entry_of(flight.commit), entry_of(flight.plan_next)

    def new_state(self) -> State:
        """State at time zero: the bit stands on the rock, the piston flies."""
        state = State(MAP_STATE)
        entry_of(begin)(self._par[0], state.record[0], self._numbers)
        return state

    def _run(self, state: State, t: float, blows: np.ndarray, events: np.ndarray) -> int:
        return int(
            self._advance(self._par, state.record, self._values, self._found, t, blows, events)
        )

    def time(self, state: State) -> float:
        """Start of the present piece of flight [s]."""
        return float(state.numbers[T])

    def state_fault(self, state: State, t: float) -> str:
        """As in `Solver`; all events up to the present are behind."""
        fault = super().state_fault(state, t)
        if not fault and not state.numbers[T_NEXT] > t:
            return f"its next event at {float(state.numbers[T_NEXT])!r} s, at a present of {t!r} s"
        return fault

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Process all that happens up to `t`; as in `Solver`."""
        if state.numbers[T_NEXT] > t:
            return int(Status.DONE), 0, 0
        words = state.words
        words[EVENTS_ON] = record_events
        status = self._run(state, float(t), blows, events)
        return status, int(words[N_BLOWS]), int(words[N_EVENTS])

    def refusal(self, state: State) -> str:
        """Why the map did not answer."""
        return explain_refusal(self.table, state.record[0])

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; the state itself, since reading moves nothing. As in `Solver`."""
        self._read(self._par, state.record, t, reading)
        return state

    def commit(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Start a new piece of flight at `t`, so that inputs can change."""
        self._move(self._par, state.record, float(t))
        return int(Status.DONE), 0, 0

    def set_inputs(self, state: State, **inputs: float) -> None:
        """Change inputs of a committed state.

        The drive acts at once, feed and rock from the next blow on. The other numbers of
        the rock law are fixed in the table: `SceneError` if one of them differs.
        """
        for name, value in inputs.items():
            if name in FIXED_INPUTS and value != self.table.fixed[FIXED_INPUTS[name]]:
                raise SceneError(
                    f"{FIXED_INPUTS[name]} = {value!r}: the blow map was made for "
                    f"{self.table.fixed[FIXED_INPUTS[name]]!r} and holds for that alone"
                )
        super().set_inputs(state, **inputs)
        if not FLIGHT_INPUTS.isdisjoint(inputs):
            self._plan(self._par, state.record)

    def grid_point_after(self, state: State, t: float) -> float:
        """First time at or after `t` at which inputs can change: `t` itself [s]."""
        return t

    def readable_until(self, state: State) -> float:
        """Time up to which `read` answers without advancing the state [s]."""
        return float(np.nextafter(state.numbers[T_NEXT], 0.0))


def make_map_solver(scene: Scene) -> BlowMapSolver:
    """Solver on the table of a scene, which is made where it is not kept."""
    return BlowMapSolver(scene, get_table(scene))
