"""`Runner`: a state that is advanced in time, without tables of blows and events."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from percussion_model.physics.records import BLOW, EVENT, READING, SAMPLE_FIELDS, Status
from percussion_model.physics.settling import REQUEST, Verdict
from percussion_model.scene.inputs import SimulationError, check_input
from percussion_model.scene.rows import is_number
from percussion_model.scene.scene import Scene, refuse_other
from percussion_model.solvers.base import Solver, make_solver
from percussion_model.solvers.state import State

# Rows that one call of a kernel can fill; a full buffer is read out.
_BLOW_ROOM = 64
_EVENT_ROOM = 4096

# Solvers whose kernels are compiled in this process; a scene does not change them.
_compiled: set[str] = set()

# Steps of a cell after which a run that is to settle is looked at.
CELL_STEPS = 5e7
_OPEN = int(Verdict.OPEN)
_DONE, _FULL = int(Status.DONE), (int(Status.BLOWS_FULL), int(Status.EVENTS_FULL))


class Runner:
    """A state of a scene that is advanced from time to time.

    Reading is not touching: however an interval is divided into calls of
    `advance`, and whatever is read between them, the bits are the same. Only
    `set_inputs` commits the state, at the next grid point of the solver.

    Parameters
    ----------
    scene : Scene
    record_events : bool
        Whether the kernels list events.
    solver : Solver, optional
        One that was made for an equal scene; solvers hold no state.
    """

    def __init__(
        self, scene: Scene, record_events: bool = True, solver: Solver | None = None
    ) -> None:
        began = time.perf_counter()
        refuse_other(scene)
        self.record_events = record_events
        self.solver = solver or make_solver(scene)
        self.wall_time = 0.0
        self.scene = scene
        self._state = self.solver.new_state()
        self._time = 0.0
        self._blow_room = np.zeros(_BLOW_ROOM, BLOW)
        self._event_room = np.zeros(_EVENT_ROOM if record_events else 1, EVENT)
        self._settling: np.ndarray | None = None  # blows of a run until they repeat
        self._ahead: State | None = None  # an old copy of the state, to be used again
        self._can_sample = False
        if solver is None and self.solver.name not in _compiled:
            self._compile()
            _compiled.add(self.solver.name)
        self.setup_time = time.perf_counter() - began

    def _compile(self) -> None:
        """Run the kernels once, so that their compilation is not taken for computing."""
        trial = self.solver.new_state()
        t = 2.0 * (self.solver.time_step or 1e-9)
        self.solver.advance(trial, t, self._blow_room, self._event_room, self.record_events)
        self.solver.read(trial, t, np.zeros(1, READING))

    def begin_again(self) -> None:
        """Go back to time zero of what the solver computes now, with nothing kept."""
        self._state = self.solver.new_state()
        self._time = self.wall_time = 0.0

    @property
    def time(self) -> float:
        """Present time [s]."""
        return self._time

    def _refuse_state(self, state: State, t: float) -> None:
        """Raise SimulationError if kernels cannot go on from a state of time `t` [s]."""
        here = self._state
        if state.dtype != here.dtype or state.shapes != here.shapes:
            raise SimulationError("the saved state does not fit the solver")
        if not (is_number(t) and t >= 0.0):
            raise SimulationError(f"the saved state has the time {t!r} s: must be 0 s or later")
        if fault := self.solver.state_fault(state, t):
            raise SimulationError(f"the saved state has {fault}")

    def _keep(self, blows: np.ndarray, events: np.ndarray) -> None:
        """Take what the kernels have listed; the rows are overwritten afterwards."""

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
        self._advance_solver(float(t))
        self._time = float(t)
        self.wall_time += time.perf_counter() - began

    def advance_blows(self, count: int, t: float) -> None:
        """Let the simulation run until so many more blows have ended, or else up to `t` [s].

        It stops at the end of the solver's step in which the last of them ends. What
        follows has the same bits as if it had not stopped there.

        Parameters
        ----------
        count : int
            At least 1.
        t : float
            As for `advance`, which raises the same errors.
        """
        self._check_time(t)
        began = time.perf_counter()
        while count > 0:
            room = self._blow_room[:count]
            status, found = self._call(self.solver.advance, float(t), room)
            if status == _DONE and found < count:
                ahead = self._find_blow(float(t))
                if ahead is None:
                    break
                found += ahead
            count -= found
        reached = float(t) if count > 0 else self.solver.time(self._state)
        self._time = max(self._time, reached)
        self.wall_time += time.perf_counter() - began

    def settle(
        self, asked: np.ndarray, progress: Callable[[int], None] | None, deadline: float
    ) -> None:
        """Let a simulation that has not begun run until its blows repeat, or are enough.

        Parameters
        ----------
        asked : ndarray of REQUEST, shape (1,)
            What is asked and found; a further call goes on.
        progress : callable, optional
            Called with the blows done.
        deadline : float
            As `time.thread_time` tells it [s].

        Raises
        ------
        SimulationError
            If the run cannot continue, or comes to the deadline.
        """
        began, one = time.perf_counter(), asked.view(REQUEST)[0]
        if self._settling is None or len(self._settling) != one["most"]:
            self._settling = np.zeros(one["most"], BLOW)
        # in pieces that depend on the scene alone, so that it can be given up
        piece = self.solver.time_of_steps(CELL_STEPS)
        while one["verdict"] == _OPEN:
            before, one["until"] = int(one["blows"]), one["time"] + piece
            if time.thread_time() > deadline:
                raise SimulationError(
                    f"at t = {self.time:.6g} s, after {before} blows: the run has taken all the "
                    "time that it may (--most-time, most_time) and has not settled: `percussion "
                    "explain` shows what a blow costs; take fewer cells"
                )
            status = self.solver.settle(self._state, asked, self._settling)
            self._time, found = float(one["time"]), int(one["blows"])
            self._take(status, found - before, 0, self._settling[before:])
            if progress is not None:
                progress(found)
        self.wall_time += time.perf_counter() - began

    def _check_time(self, t: float) -> None:
        if not is_number(t):
            raise SimulationError(f"t = {t!r}: must be a finite time in s")
        if t < self._time:
            raise SimulationError(f"t = {t!r} s: lies before the present time {self._time!r} s")

    def _advance_solver(self, t: float) -> None:
        self._call_until_done(self.solver.advance, t)
        while self._find_blow(t) is not None:
            self._call_until_done(self.solver.advance, t)

    def _find_blow(self, t: float) -> int | None:
        """Do what is pending at `t` if it comes to its end before, as at a blow; blows that ended.

        None: nothing was done, since no blow starts up to `t`. The bits stay the same: what is
        pending would be done later otherwise, and blows be known late.
        """
        end = self.solver.time_of_blow(self._state)
        if not end > t:
            return None
        ahead = self._ahead = self._state.copy(self._ahead)
        room = self._blow_room[:1]
        found = self.solver.advance(ahead, end, room, self._event_room, self.record_events)
        before, now = self.solver.time(self._state), self.solver.time(ahead)
        if now > t:
            return None
        self._state, self._ahead = ahead, self._state
        blows = self._take(*found, room)[1]
        return blows if now > before or blows > 0 else None

    def _call_until_done(self, method: Callable[..., tuple[int, int, int]], t: float) -> None:
        """Call the solver until it has reached `t`; its rows are kept whenever they are full."""
        while self._call(method, t, self._blow_room)[0] != _DONE:
            pass

    def _call(
        self, method: Callable[..., tuple[int, int, int]], t: float, room: np.ndarray
    ) -> tuple[int, int]:
        """Call the solver and keep its rows; `Status`, and how many blows."""
        found = method(self._state, t, room, self._event_room, self.record_events)
        return self._take(*found, room)

    def _take(self, status: int, n_blows: int, n_events: int, room: np.ndarray) -> tuple[int, int]:
        """Keep the rows of a call, and raise what went wrong; as `_call`."""
        if n_blows or n_events:
            self._keep(room[:n_blows], self._event_room[:n_events])
        if status == _DONE or (status in _FULL and (n_blows or n_events)):
            return status, n_blows
        where = f"at t = {self.solver.time(self._state)!r} s"
        if status == Status.NOT_FINITE:
            raise SimulationError(f"{where} the state is no longer finite: check the scene")
        reason = Status(status).name.lower()
        raise SimulationError(f"{where} the solver could not continue ({reason})")

    def sample_rows(self, times: np.ndarray) -> np.ndarray:
        """Advance through rising `times` and read the sample at each.

        Returns
        -------
        ndarray, shape (len(times), len(SAMPLE_FIELDS))
        """
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
            self._advance_solver(float(times[done]))
            end = max(done + 1, int(np.searchsorted(times, self._next_stop(), side="right")))
            done += self._sample_ahead(times[done:end], rows[done:end])
        rows[:, 0] = times
        if len(times):
            self._advance_solver(float(times[-1]))
            self._time = float(times[-1])
        self.wall_time += time.perf_counter() - began
        return rows

    def _next_stop(self) -> float:
        """Time beyond which `_advance_solver` has to be asked [s]."""
        return math.inf

    def _sample_ahead(self, times: np.ndarray, rows: np.ndarray) -> int:
        """Fill rows of the first of rising times; how many."""
        status, n_blows, n_events, filled = self.solver.sample_ahead(
            self._state, times, rows, self._blow_room, self._event_room, self.record_events
        )
        self._take(status, n_blows, n_events, self._blow_room)
        return filled

    def _read(self, times: np.ndarray, rows: np.ndarray) -> None:
        # After a change of inputs the state may lie a step ahead of the present.
        here = np.maximum(times, self.solver.time(self._state))
        self.solver.sample(self._state, here, rows)
        rows[:, 0] = times

    def _compile_sample(self) -> None:
        if not self._can_sample:
            self._read(np.array([self._time]), np.empty((1, len(SAMPLE_FIELDS))))
            self._can_sample = True

    def set_inputs(self, **inputs: float) -> None:
        """Change inputs at the next grid point.

        Parameters
        ----------
        **inputs
            Those of `percussion_model.scene.inputs.INPUTS`: forces and the reversal
            distance act at once, the rock from the next drilling cycle on. Units
            and bounds are those of the parameter table.
        """
        values = {name: check_input(self.scene, name, v) for name, v in inputs.items()}
        if not values:
            return
        began = time.perf_counter()
        self._commit_inputs(values)
        self.wall_time += time.perf_counter() - began

    def _commit_inputs(self, values: dict[str, float]) -> None:
        """Commit the state at its next grid point, and give it inputs that are checked."""
        reached, t = -math.inf, self.solver.grid_point_after(self._state, self._time)
        while t > reached:  # a step that is cut moves the grid: inputs never act before now
            self._advance_solver(t)
            reached, t = t, self.solver.grid_point_after(self._state, self._time)
        self._call_until_done(self.solver.commit, t)
        self.solver.set_inputs(self._state, **values)
