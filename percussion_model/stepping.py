"""`Simulation`: a scene that is advanced from time to time, saved and restored."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from percussion_model.core.records import BLOW, EVENT, SAMPLE_FIELDS, Status
from percussion_model.inputs import SimulationError, check_input, is_number
from percussion_model.result import Result, complete_ledger, make_result
from percussion_model.scene import Scene
from percussion_model.solvers import make_solver

# Rows that one call of a kernel can fill; a full buffer is read out.
_BLOW_ROOM = 64
_EVENT_ROOM = 4096


@dataclass(frozen=True)
class Snapshot:
    """A saved simulation; opaque, can be pickled."""

    scene: Scene
    time: float
    state: Any
    blows: tuple[np.ndarray, ...]
    events: tuple[np.ndarray, ...]


class Simulation:
    """A scene that is advanced from time to time.

    Reading is not touching: however an interval is divided into calls of
    `advance`, and whatever is read between them, the bits are the same. Only
    `set_inputs` commits the state, at the next grid point of the solver.

    Parameters
    ----------
    scene : Scene
    record_events : bool
        Whether to keep the event list.
    """

    def __init__(self, scene: Scene, record_events: bool = True) -> None:
        began = time.perf_counter()
        self.scene = scene
        self.record_events = record_events
        self.solver = make_solver(scene)
        self.wall_time = 0.0
        self._state = self.solver.new_state()
        self._time = 0.0
        self._blows: tuple[np.ndarray, ...] = ()
        self._events: tuple[np.ndarray, ...] = ()
        self._blow_room = np.zeros(_BLOW_ROOM, BLOW)
        self._event_room = np.zeros(_EVENT_ROOM, EVENT)
        self._can_sample = False
        self._compile()
        self.setup_time = time.perf_counter() - began

    def _compile(self) -> None:
        """Run the kernels once, so that their compilation is not taken for computing."""
        trial = self.solver.new_state()
        t = 2.0 * (self.solver.time_step or 1e-9)
        self.solver.advance(trial, t, self._blow_room, self._event_room, self.record_events)
        self.solver.energy(trial, t)

    @property
    def time(self) -> float:
        """Present time [s]."""
        return self._time

    @property
    def blows(self) -> np.ndarray:
        """Blows finished so far, rows of `BLOW`."""
        self._blows = _joined(self._blows)
        return self._blows[0].copy() if self._blows else np.zeros(0, BLOW)

    @property
    def events(self) -> np.ndarray:
        """Events so far in the order of time, rows of `EVENT`."""
        self._events = _joined(self._events)
        if not self._events:
            return np.zeros(0, EVENT)
        rows = self._events[0]
        return rows[np.argsort(rows["time"], kind="stable")]

    def advance(self, t: float) -> None:
        """Let the simulation run up to time `t` [s].

        Raises
        ------
        SimulationError
            If `t` lies in the past or is no time, or if the state does not
            stay finite.
        """
        self._check_time(t)
        began = time.perf_counter()
        self._commit_up_to(float(t))
        self._time = float(t)
        self.wall_time += time.perf_counter() - began

    def _check_time(self, t: float) -> None:
        if not is_number(t):
            raise SimulationError(f"t = {t!r}: must be a finite time in s")
        if t < self._time:
            raise SimulationError(f"t = {t!r} s: lies before the present time {self._time!r} s")

    def _commit_up_to(self, t: float) -> None:
        status = int(Status.BLOWS_FULL)
        while status in (Status.BLOWS_FULL, Status.EVENTS_FULL):
            status, n_blows, n_events = self.solver.advance(
                self._state, t, self._blow_room, self._event_room, self.record_events
            )
            if n_blows:
                self._blows = _with(self._blows, self._blow_room[:n_blows])
            if n_events:
                self._events = _with(self._events, self._event_room[:n_events])
        if status == Status.DONE:
            return
        where = f"at t = {self.solver.time(self._state)!r} s"
        if status == Status.NOT_FINITE:
            raise SimulationError(f"{where} the state is no longer finite: check the scene")
        raise SimulationError(f"{where} the solver found no way on ({Status(status).name.lower()})")

    def sample(self, times: Any) -> dict[str, np.ndarray]:
        """Advance through rising `times` and tell what it is like at each.

        Parameters
        ----------
        times : array_like
            Not falling, not in the past [s].

        Returns
        -------
        dict of ndarray
            An array for each of `SAMPLE_FIELDS`.
        """
        rows = self.sample_rows(np.atleast_1d(np.asarray(times, dtype=float)))
        return {name: rows[:, k].copy() for k, name in enumerate(SAMPLE_FIELDS)}

    def sample_rows(self, times: np.ndarray) -> np.ndarray:
        """Do the same as `sample`, a row for each time."""
        if np.any(np.diff(times) < 0):
            raise SimulationError("times must not fall")
        if len(times):
            self._check_time(float(times[0]))
            self._check_time(float(times[-1]))
        rows = np.empty((len(times), len(SAMPLE_FIELDS)))
        self._compile_sample()
        began = time.perf_counter()
        done = 0
        while done < len(times):
            self._commit_up_to(float(times[done]))
            horizon = self.solver.readable_until(self._state)
            end = max(done + 1, int(np.searchsorted(times, horizon, side="right")))
            self._read(times[done:end], rows[done:end])
            done = end
        if len(times):
            self._commit_up_to(float(times[-1]))
            self._time = float(times[-1])
        self.wall_time += time.perf_counter() - began
        return rows

    def _read(self, times: np.ndarray, rows: np.ndarray) -> None:
        # After a change of inputs the state may lie a step ahead of the present.
        here = np.maximum(times, self.solver.time(self._state))
        self.solver.sample(self._state, here, rows)
        rows[:, 0] = times

    def _compile_sample(self) -> None:
        if not self._can_sample:
            self._read(np.array([self._time]), np.empty((1, len(SAMPLE_FIELDS))))
            self._can_sample = True

    def observe(self) -> dict[str, float]:
        """Tell what it is like now: `SAMPLE_FIELDS`, SI units."""
        self._compile_sample()
        row = np.empty((1, len(SAMPLE_FIELDS)))
        self._read(np.array([self._time]), row)
        return {name: float(row[0, k]) for k, name in enumerate(SAMPLE_FIELDS)}

    def set_inputs(self, **inputs: float) -> None:
        """Change inputs at the first grid point from now on.

        Parameters
        ----------
        **inputs
            feed_force, drive_force, external_force [N] and reversal_distance
            [m] act at once; loading_stiffness [N/m], unloading_ratio,
            barrier_damping [N s/m] and barrier_energy [J] from the next
            drilling cycle on. Bounds are those of the parameter table.
        """
        values = {name: check_input(self.scene, name, value) for name, value in inputs.items()}
        if not values:
            return
        began = time.perf_counter()
        t = self.solver.grid_point_after(self._state, self._time)
        self._commit_up_to(t)
        self.solver.commit(self._state, t)
        self.solver.set_inputs(self._state, **values)
        self.wall_time += time.perf_counter() - began

    def save(self) -> Snapshot:
        """Return a snapshot to go back to; it can be pickled."""
        return Snapshot(self.scene, self._time, self._state.copy(), self._blows, self._events)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot; what follows repeats bit for bit."""
        if not isinstance(snapshot, Snapshot):
            raise SimulationError("not a snapshot made by Simulation.save")
        if snapshot.scene is not self.scene and snapshot.scene != self.scene:
            raise SimulationError("the snapshot is of another scene")
        self._time = snapshot.time
        self._state = snapshot.state.copy()
        self._blows, self._events = snapshot.blows, snapshot.events

    def energy(self) -> dict[str, float]:
        """Energy ledger [J] at the present grid point; see `Result.energy`."""
        now = max(self._time, self.solver.time(self._state))
        return complete_ledger(self.solver.energy(self._state, now))

    def fields(self) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] in each cell of the elastic bars, top to bottom.

        At the last grid point up to the present; empty where no bar is elastic.
        """
        read = getattr(self.solver, "fields", None)
        if read is None:
            return {}
        return dict(read(self._state, max(self._time, self.solver.time(self._state))))

    def statistics(self) -> dict[str, int]:
        """Counts of what the solver did."""
        return self.solver.statistics(self._state)

    def result(
        self, settle: float | None = None, trace: dict[str, np.ndarray] | None = None
    ) -> Result:
        """Everything found so far; means begin at `settle`, default that of the scene [s]."""
        return make_result(
            scene=self.scene,
            solver=self.solver,
            blows=self.blows,
            events=self.events,
            trace=trace,
            energy=self.energy(),
            statistics=self.statistics(),
            times=(self._time, self.scene.run.settle if settle is None else settle),
            wall_time=self.wall_time,
            setup_time=self.setup_time,
        )


def _with(parts: tuple[np.ndarray, ...], rows: np.ndarray) -> tuple[np.ndarray, ...]:
    """Add a copy of rows; parts halve in size from one to the next, so this stays cheap."""
    kept = [*parts, rows.copy()]
    while len(kept) > 1 and len(kept[-2]) <= len(kept[-1]):
        kept[-2:] = [np.concatenate(kept[-2:])]
    return tuple(kept)


def _joined(parts: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
    return parts if len(parts) < 2 else (np.concatenate(parts),)
