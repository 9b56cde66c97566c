"""Solver for scenes with a rigid (or absent) piston and a rigid bit."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from percussion_model.physics.records import (
    BLOW,
    EVENT,
    LEDGER_FIELDS,
    SAMPLE_FIELDS,
    Status,
)
from percussion_model.solvers.rigid import advance as kernel
from percussion_model.solvers.rigid.packing import pack_rigid, restitution
from percussion_model.solvers.rigid.records import ROWS_AN_EVENT

if TYPE_CHECKING:
    from percussion_model.scene.parameters import Bar
    from percussion_model.scene.scene import Scene

# Input of `set_inputs`, the field it changes, and the scenes in which it has an effect.
_INPUTS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "feed_force": ("F_S", "feed"),
        "drive_force": ("F_0", "pressure"),
        "reversal_distance": ("D_1", "pressure"),
        "external_force": ("external", "external"),
        "loading_stiffness": ("K_R", "rock"),
        "unloading_ratio": ("gamma", "rock"),
        "barrier_damping": ("C_R", "rock"),
        "barrier_energy": ("W_R", "rock"),
    }
)


class RigidSolver:
    """Advance rigid bodies from event to event, in closed form.

    A state is one structured array (`new_state`); copying it saves a run.

    Parameters
    ----------
    scene : Scene
        With a rigid bit and a rigid or absent piston.
    """

    name = "rigid"
    time_step: float | None = None
    wave_speed_error = 0.0

    def __init__(self, scene: Scene) -> None:
        rigid = scene.bit.model == "rigid" and scene.piston.model != "elastic"
        if not (rigid or scene.solver_name == "rigid"):
            raise ValueError(
                "the rigid solver needs bit.model = 'rigid' and piston.model = 'rigid' or "
                f"'absent', not {scene.bit.model!r} and {scene.piston.model!r}"
            )
        self.scene = scene
        self.cells: dict[str, int] = {}

    @property
    def restitution(self) -> float:
        """Coefficient of restitution of piston and bit, NaN without a piston."""
        return restitution(self.scene)

    def new_state(self) -> np.ndarray:
        """Return the state at time zero, inputs and parameters included."""
        state = pack_rigid(self.scene)
        kernel.begin(state["par"], state["now"])
        return state

    def advance(
        self,
        state: np.ndarray,
        t: float,
        blows: np.ndarray,
        events: np.ndarray,
        record_events: bool = True,
    ) -> tuple[int, int, int]:
        """Let all events up to time t happen.

        Parameters
        ----------
        state : ndarray
            Changed in place; comes to rest at the last event.
        t : float
            Time [s].
        blows, events : ndarray
            Room for rows of BLOW and EVENT, filled from index 0; events at least 4 long.
        record_events : bool
            Whether to list events.

        Returns
        -------
        status, n_blows, n_events : int
            A `Status`, and the rows filled. After BLOWS_FULL or EVENTS_FULL call again.
        """
        if len(blows) < 1 or (record_events and len(events) < ROWS_AN_EVENT):
            raise ValueError(f"room for 1 blow and {ROWS_AN_EVENT} events is needed at least")
        n_blows = np.zeros(1, np.int64)
        n_events = np.zeros(1, np.int64)
        status = kernel.advance(
            state["par"],
            state["now"],
            float(t),
            blows,
            n_blows,
            events,
            n_events,
            bool(record_events),
        )
        return int(status), int(n_blows[0]), int(n_events[0])

    def sample(self, state: np.ndarray, times: np.ndarray, out: np.ndarray) -> None:
        """Evaluate the state without changing it.

        Parameters
        ----------
        state : ndarray
        times : ndarray
            Not falling, not before the state's last event [s].
        out : ndarray, shape (len(times), len(SAMPLE_FIELDS))
        """
        times = np.ascontiguousarray(times, dtype=float)
        if out.shape != (len(times), len(SAMPLE_FIELDS)):
            raise ValueError(f"out must have the shape {(len(times), len(SAMPLE_FIELDS))}")
        if len(times) == 0:
            return
        if np.any(np.diff(times) < 0) or times[0] < self.time(state):
            raise ValueError("times must not fall, nor lie before the last event of the state")
        copy = state.copy()
        room = self._room()
        status = kernel.sample(copy["par"], copy["now"], times, out, *room)
        self._require_done(status)

    def look(
        self,
        state: np.ndarray,
        t: float,
        row: np.ndarray,
        here: np.ndarray | None = None,
        peaks: bool = True,
    ) -> np.ndarray:
        """Evaluate at `t` into a row (`LONG_SAMPLE_FIELDS`, or their beginning).

        Returns
        -------
        ndarray
            A copy, carried to `t` where the row is long.
        """
        copy = state.copy()
        times = np.array([max(t, self.time(state))])
        self._require_done(
            kernel.sample(copy["par"], copy["now"], times, row[np.newaxis], *self._room())
        )
        return copy

    def fields(self, state: np.ndarray) -> dict[str, np.ndarray]:
        """Rigid bodies have no cells."""
        return {}

    def force_in(self, state: np.ndarray, bar: str, cell: int) -> float:
        """Rigid bodies have no cells, and no force in them."""
        return 0.0

    def grid_of(self, bar: str) -> None:
        """Rigid bodies have no cells."""

    def watch_peaks(self, state: np.ndarray, t: float) -> None:
        """Count the peak forces of `look` from `t` on [s]."""
        now = state["now"]
        now["peak_from"], now["peak_bit"], now["peak_contact"] = t, 0.0, 0.0

    def grid_point_after(self, state: np.ndarray, t: float) -> float:
        """First time at or after `t` at which inputs can change: `t` itself [s]."""
        return t

    def readable_until(self, state: np.ndarray) -> float:
        """A state can be read at any time: its copy runs on."""
        return float("inf")

    def energy(self, state: np.ndarray, t: float) -> dict[str, float]:
        """Energy ledger at time t [J], not before the state's last event.

        Returns
        -------
        dict
            Entries of LEDGER_FIELDS since the start, stored `kinetic`, `elastic` and
            `recoverable`, `start`, and `residual`: what no entry explains.
        """
        copy = state.copy()
        par, now = copy["par"], copy["now"]
        self._require_done(kernel.run_to(par, now, float(t), *self._room()))
        kernel.commit(par, now, float(t))
        entries = {name: float(now[name][0]) for name in LEDGER_FIELDS}
        kinetic, rock = kernel.stored_energy(par, now)
        entries |= {"kinetic": float(kinetic), "elastic": 0.0, "recoverable": float(rock)}
        entries["start"] = float(now["initial_energy"][0])
        given = sum(entries[name] for name in ("start", "drive", "feed", "gravity"))
        found = sum(
            value
            for name, value in entries.items()
            if name not in ("start", "drive", "feed", "gravity")
        )
        entries["residual"] = given - found
        return entries

    def commit(
        self,
        state: np.ndarray,
        t: float,
        blows: np.ndarray | None = None,
        events: np.ndarray | None = None,
        record_events: bool = False,
    ) -> tuple[int, int, int]:
        """Bring a state that was advanced to time t there; nothing happens meanwhile."""
        now = state["now"]
        if t < self.time(state) or (now["scheduled"][0] and now["next_time"][0] <= t):
            raise ValueError(f"advance the state to {t} s before committing it")
        kernel.commit(state["par"], now, float(t))
        return int(Status.DONE), 0, 0

    def set_inputs(self, state: np.ndarray, **inputs: float | None) -> None:
        """Change inputs of a committed state.

        Parameters
        ----------
        state : ndarray
            Changed in place.
        **inputs
            feed_force, drive_force, external_force [N] and reversal_distance [m] act at
            once; loading_stiffness [N/m], unloading_ratio, barrier_damping [N s/m] and
            barrier_energy [J] from the next drilling cycle on. None leaves a value alone.
        """
        changes = {}
        effects = self.scene.effects
        for name, value in inputs.items():
            if name not in _INPUTS:
                raise ValueError(f"unknown input {name!r}; known: {', '.join(_INPUTS)}")
            if value is None:
                continue
            field, needs = _INPUTS[name]
            on = {
                "feed": effects.feed,
                "rock": effects.rock == "bilinear" or name == "loading_stiffness",
            }.get(needs, effects.drive == needs)
            if not on:
                raise ValueError(f"{name} has no effect in this scene")
            changes[field] = float(value)
        for field, value in changes.items():
            state["par"][field] = value

    def time(self, state: np.ndarray) -> float:
        """Time of the last event of a state [s]."""
        return float(state["now"]["time"][0])

    def section_cells(self, bar: Bar) -> list[int]:
        """Rigid bodies have no cells."""
        return []

    def statistics(self, state: np.ndarray) -> dict[str, int]:
        """Counters of the run so far."""
        now = state["now"]
        return {
            name: int(now[f"count_{name}"][0])
            for name in ("events", "contacts", "blows", "cycles", "storms")
        }

    @staticmethod
    def _room() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Room that a read-only run needs."""
        count = np.zeros(1, np.int64)
        return np.zeros(1, BLOW), count, np.zeros(1, EVENT), count.copy()

    @staticmethod
    def _require_done(status: int) -> None:
        if status != Status.DONE:
            raise RuntimeError(f"the rigid solver stopped: {Status(status).name}")
