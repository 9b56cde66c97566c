"""Rigid-body solver: for scenes with a rigid bit and a rigid or absent piston."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import Status
from percussion_model.scene.numbers import kernel_numbers
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.rigid import advance as kernels
from percussion_model.solvers.rigid.prepare import begin, fill_rigid_parameters
from percussion_model.solvers.rigid.records import (
    RIGID_LIMITS,
    RIGID_PAR,
    RIGID_STATE,
    ROWS_AN_EVENT,
)
from percussion_model.solvers.state import State


class RigidSolver(Solver):
    """Advance rigid bodies from event to event, in closed form.

    Parameters
    ----------
    scene : Scene
        With a rigid bit and a rigid or absent piston.
    """

    name = "rigid"
    COUNTS: ClassVar = ("events", "contacts", "blows", "cycles", "storms")
    LIMITS: ClassVar = RIGID_LIMITS

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._numbers = kernel_numbers(scene)
        self._par = np.zeros(1, RIGID_PAR)
        entry_of(fill_rigid_parameters)(self._par[0], self._numbers)

    def new_state(self) -> State:
        """State at time zero."""
        state = State(RIGID_STATE)
        entry_of(begin)(self._par[0], state.record[0], self._numbers)
        return state

    def coarser_scenes(self) -> list[Scene]:
        """None: rigid bodies move in closed form."""
        return []

    def time(self, state: State) -> float:
        """Time of the last event of a state [s]."""
        return float(state.record["time"][0])

    def readable_until(self, state: State) -> float:
        """Time of the next event [s]."""
        s = state.record[0]
        return float(s["next_time"] if s["scheduled"] else s["time"])

    def state_fault(self, state: State, t: float) -> str:
        """As in `Solver`; all events up to the present are behind."""
        fault = super().state_fault(state, t)
        s: Any = state.record[0]
        if fault:
            return fault
        if not s["scheduled"]:  # its inputs have just been set, or it has not begun
            behind = f"its time of {float(s['time'])!r} s, before the present of {t!r} s"
            return "" if s["time"] >= t else behind
        if s["next_time"] != s["time"] + s["next_tau"] or not s["next_time"] > t:
            return f"its next event at {float(s['next_time'])!r} s, at a present of {t!r} s"
        return ""

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Process all events up to `t`; as in `Solver`, with room for 4 events at least."""
        if len(blows) < 1 or (record_events and len(events) < ROWS_AN_EVENT):
            raise ValueError(f"room for 1 blow and {ROWS_AN_EVENT} events is needed at least")
        s: Any = state.record[0]
        s["events_on"] = record_events
        status = kernels.advance(self._par, state.record, float(t), blows, events)
        return int(status), int(s["n_blows"]), int(s["n_events"])

    def commit(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Bring a state that was advanced to `t` there; nothing happens meanwhile."""
        if t < self.time(state) or self.readable_until(state) <= t:
            raise ValueError(f"advance the state to {t} s before committing it")
        kernels.commit(self._par, state.record, float(t))
        return int(Status.DONE), 0, 0

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; a copy at that time. As in `Solver`."""
        spare = state.copy(spare)
        t = max(t, self.time(state))
        status = kernels.read(
            self._par, spare.record, t, self._no_blows, self._no_events, reading
        )  # fmt: skip
        if status != Status.DONE:
            raise RuntimeError(f"the rigid solver stopped: {Status(status).name}")
        return spare
