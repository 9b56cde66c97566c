"""A run of a scene: `Simulation`, advanced step by step, and `simulate`, from start to end."""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from types import FrameType
from typing import Any, Literal

import numpy as np

from percussion_model.physics.ledger import complete_ledger, energies
from percussion_model.physics.records import BLOW, EVENT, READING, SAMPLE_FIELDS
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.rows import is_number
from percussion_model.scene.scene import Scene, SceneError, refuse_other
from percussion_model.scene.solver_names import counted
from percussion_model.simulation.accuracy_control import (
    LONGEST,
    has_grid,
    planned_cells,
    run_to_accuracy,
    time_needed,
)
from percussion_model.simulation.error_estimate import with_error_estimate
from percussion_model.simulation.result import Result
from percussion_model.simulation.runner import Runner
from percussion_model.simulation.warnings import find_warnings
from percussion_model.solvers.base import Solver
from percussion_model.solvers.state import State

__all__ = ["Simulation", "SimulationError", "Snapshot", "simulate"]

# Between chunks a run reports progress and can be interrupted: short enough in
# wall time [s] to react at once, and at most so long in simulated time [s].
_WANTED_CHUNK_TIME = 0.05
_LONGEST_CHUNK = 50.0
# The first takes so many steps of a cell: even a very fine grid comes back soon.
_FIRST_STEPS = 1e5
_GROWTH = 4.0

# Rows of blows and events of a run: two hours of the reference with its events, a day without.
MOST_ROW_BYTES = 250_000_000
_LARGE_CHUNK = 16_000_000  # [bytes]
# More samples than this would fill the memory of a common computer.
_MOST_SAMPLES = 20_000_000
# Samples in a window where the solver has no time step.
_WINDOW_SAMPLES = 1000
# A sampling interval this close to dividing the duration does divide it.
_ROUNDING = 1e-9
# Share of the duration that settles where the scene's settling time is too long.
_SETTLING_SHARE = 0.25


@dataclass(frozen=True)
class Snapshot:
    """A saved simulation; opaque, can be pickled."""

    scene: Scene
    time: float
    state: State = field(repr=False)
    blows: tuple[np.ndarray, ...] = field(repr=False)
    events: tuple[np.ndarray, ...] = field(repr=False)
    settled_position: float


class Simulation(Runner):
    """A scene that is advanced from time to time, with its blows and events.

    Reading is not touching: however an interval is divided into calls of
    `advance`, and whatever is read between them, the bits are the same. Only
    `set_inputs` commits the state, at the next grid point of the solver.

    Parameters
    ----------
    scene : Scene
    record_events : bool
        Whether to keep the event list.
    solver : Solver, optional
        One that was made for an equal scene; solvers hold no state.
    """

    def __init__(
        self, scene: Scene, record_events: bool = True, solver: Solver | None = None
    ) -> None:
        super().__init__(scene, record_events, solver)
        # of the mean bit when blows begin to count [m], NaN before
        self._settled_position = math.nan
        self._blows: tuple[np.ndarray, ...] = ()  # bytes of the rows
        self._events: tuple[np.ndarray, ...] = ()

    def begin_again(self) -> None:
        """As in `Runner`."""
        super().begin_again()
        self._settled_position, self._blows, self._events = math.nan, (), ()

    def _advance_solver(self, t: float) -> None:
        settle = self.scene.run.settle
        if self._time <= settle <= t and math.isnan(self._settled_position):
            super()._advance_solver(settle)
            self._settled_position = self._bit_position(settle)
        super()._advance_solver(t)

    def _next_stop(self) -> float:
        return self.scene.run.settle if math.isnan(self._settled_position) else math.inf

    def _bit_position(self, t: float) -> float:
        """Mean bit displacement since the start at a time that the solver has reached [m]."""
        return float(self._reading_at(t)[0]["bit_position"][0])

    def _keep(self, blows: np.ndarray, events: np.ndarray) -> None:
        if len(blows):
            self._blows = _appended(self._blows, blows)
        if len(events):
            self._events = _appended(self._events, events)
        if self.row_bytes > MOST_ROW_BYTES:
            n_events = sum(map(len, self._events)) // EVENT.itemsize
            raise SimulationError(
                f"at t = {self.solver.time(self._state):.6g} s the rows of {self.blow_rows} blows "
                f"and {n_events} events take more than {MOST_ROW_BYTES} bytes: shorten "
                "run.duration, or omit the events (record_events = False)"
            )

    @property
    def blow_rows(self) -> int:
        """Number of blows finished so far."""
        return sum(map(len, self._blows)) // BLOW.itemsize

    @property
    def row_bytes(self) -> int:
        """Size of the rows of blows and events so far; a run ends at `MOST_ROW_BYTES`."""
        return sum(map(len, self._blows)) + sum(map(len, self._events))

    @property
    def blows(self) -> np.ndarray:
        """Blows finished so far, rows of `BLOW`."""
        self._blows = _joined(self._blows)
        return self._blows[0].copy().view(BLOW) if self._blows else np.zeros(0, BLOW)

    @property
    def events(self) -> np.ndarray:
        """Events so far in the order of time, rows of `EVENT`."""
        self._events = _joined(self._events)
        if not self._events:
            return np.zeros(0, EVENT)
        rows = self._events[0].view(EVENT)
        return rows[np.argsort(rows["time"], kind="stable")]

    def sample(self, times: Any) -> dict[str, np.ndarray]:
        """Advance through rising `times` and read the sample at each.

        Parameters
        ----------
        times : array_like
            Not falling, not in the past [s].

        Returns
        -------
        dict of ndarray
            An array for each of `SAMPLE_FIELDS`.
        """
        return _columns(self.sample_rows(np.atleast_1d(np.asarray(times, dtype=float))))

    def observe(self) -> dict[str, float]:
        """Sample at the present time: `SAMPLE_FIELDS`, SI units."""
        self._compile_sample()
        row = np.empty((1, len(SAMPLE_FIELDS)))
        self._read(np.array([self._time]), row)
        return {name: float(row[0, k]) for k, name in enumerate(SAMPLE_FIELDS)}

    def save(self) -> Snapshot:
        """Return a snapshot to go back to; it can be pickled."""
        return Snapshot(
            self.scene,
            self._time,
            self._state.copy(),
            self._blows,
            self._events,
            self._settled_position,
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot; what follows repeats bit for bit.

        Raises
        ------
        SimulationError
            If it is of another scene, or holds what no run can have; nothing has changed then.
        """
        if not isinstance(snapshot, Snapshot):
            raise SimulationError("not a snapshot made by Simulation.save")
        if snapshot.scene is not self.scene and snapshot.scene != self.scene:
            raise SimulationError("the snapshot is of another scene")
        self._refuse_state(snapshot.state, snapshot.time)
        self._time = snapshot.time
        self._state = snapshot.state.copy()
        self._blows, self._events = snapshot.blows, snapshot.events
        self._settled_position = snapshot.settled_position

    def energy(self) -> dict[str, float]:
        """Energy ledger [J] at the present grid point; see `Result.energy`."""
        return complete_ledger(energies(self._read_state()[0]))

    def fields(self) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] in each cell of the elastic bars, top to bottom.

        At the last grid point up to the present; empty where no bar is elastic.
        """
        return self.solver.fields(self._read_state()[1])

    def _read_state(self) -> tuple[np.ndarray, State]:
        """Reading at the present time, and the copy of the state that it was made of."""
        return self._reading_at(self._time)

    def _reading_at(self, t: float) -> tuple[np.ndarray, State]:
        # after a change of inputs the state may lie a step ahead of the present
        here = max(t, self.solver.time(self._state))
        reading = np.zeros(1, READING)
        return reading, self.solver.read(self._state, here, reading, peaks=False)

    def statistics(self) -> dict[str, int]:
        """Counts of what the solver did."""
        return self.solver.statistics(self._state)

    def result(
        self, settle: float | None = None, trace: dict[str, np.ndarray] | None = None
    ) -> Result:
        """Everything found so far; means begin at `settle`, default that of the scene [s]."""
        result = self._found(settle, trace)
        result.warnings.extend(find_warnings(result))
        return result

    def _found(
        self, settle: float | None = None, trace: dict[str, np.ndarray] | None = None
    ) -> Result:
        """Everything found so far, without warnings."""
        return Result(
            scene=self.scene,
            solver=self.solver.name,
            cells=dict(self.solver.cells),
            time_step=self.solver.time_step,
            wave_speed_error=self.solver.wave_speed_error,
            duration=self._time,
            settle=self.scene.run.settle if settle is None else settle,
            blows=self.blows,
            events=self.events,
            trace=trace,
            energy=self.energy(),
            statistics=self.statistics(),
            wall_time=self.wall_time,
            setup_time=self.setup_time,
            warnings=[],
            rate_of_penetration_fixed_window=self._fixed_window_rate(settle),
            end=self.observe() | {"peak_bit_force": float(self._state.record[0]["b_peak_bit"])},
        )

    def _fixed_window_rate(self, settle: float | None) -> float:
        """Advance of the bit from settling to the present by that time [m/s]; NaN if unknown."""
        begin = self.scene.run.settle
        if settle not in (None, begin) or not self._time > begin:
            return math.nan
        advance = self._bit_position(self._time) - self._settled_position
        return advance / (self._time - begin)


def _appended(chunks: tuple[np.ndarray, ...], rows: np.ndarray) -> tuple[np.ndarray, ...]:
    """Add a copy of rows, as bytes; chunks halve in size from one to the next.

    NumPy copies records field by field, which took a fifth of a whole run. Large chunks
    stay apart, since for a moment joining takes as much memory again.
    """
    kept = [*chunks, rows.view(np.uint8).copy()]
    while len(kept) > 1 and len(kept[-2]) <= len(kept[-1]) < _LARGE_CHUNK:
        kept[-2:] = [np.concatenate(kept[-2:])]
    return tuple(kept)


def _joined(chunks: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
    return chunks if len(chunks) < 2 else (np.concatenate(chunks),)


def _columns(rows: np.ndarray) -> dict[str, np.ndarray]:
    """Samples as an array for each of `SAMPLE_FIELDS`."""
    return {name: rows[:, k].copy() for k, name in enumerate(SAMPLE_FIELDS)}


def simulate(
    scene: Scene,
    duration: float | None = None,
    settle: float | None = None,
    trace: float | None = None,
    windows: Iterable[tuple[float, float]] = (),
    record_events: bool = True,
    progress: Callable[[float], None] | None = None,
    on_interrupt: Literal["raise", "keep"] = "raise",
    accuracy: float | None = None,
    check: bool | None = None,
    error_estimate: bool | None = None,
    stage: Callable[[str, float], None] | None = None,
) -> Result:
    """Run a scene from its start.

    Parameters
    ----------
    scene : Scene
    duration, settle : float, optional
        Simulated time, and the time before blows count [s]; default those of
        the scene.
    trace : float, optional
        Sampling interval of a trace [s].
    windows : iterable of (float, float)
        Intervals in which the trace has every time step [s].
    record_events : bool
        Whether to keep the event list.
    progress : callable, optional
        Called now and then with the time reached [s].
    on_interrupt : {"raise", "keep"}
        What Ctrl-C does: raise KeyboardInterrupt, or return what is finished,
        with a warning.
    accuracy : float, optional
        Wanted relative error of the rate of penetration, in place of cells;
        default that of the scene, which may be none. Where motion is aperiodic
        it is the standard error, and the run lasts up to a hundred times as
        long as its duration.
    check : bool, optional
        Whether to verify it by a finer run; default that of the scene.
    error_estimate : bool, optional
        Whether to estimate the error of the rate of penetration, where no accuracy is
        wanted, by short runs on coarser cells. They take about a quarter of the work
        again for a hundred blows, more for fewer, since ten are the least; default that of
        the scene.
    stage : callable, optional
        Called with a name and the simulated time [s] of each run that begins, where an
        accuracy or an estimate takes several; `progress` tells of the last one.

    Returns
    -------
    Result

    Raises
    ------
    SceneError, SimulationError
        If the arguments make no sense or the run cannot continue.
    """
    scene, notes = _requested(scene, duration, settle, accuracy, check, error_estimate)
    windows = tuple(windows)
    sampling_times(scene.run.duration, None, trace, windows)  # refuses before anything is compiled
    wanted = scene.solver.accuracy
    several = wanted is not None and has_grid(scene)
    named = _Stages(stage, progress, len(planned_cells(scene)) if several else 1)
    stopped: list[bool] = []

    def run_once(chosen: Scene, extend: bool) -> Result:
        """Run a scene as it is; longer, until the standard error is as wanted, to `extend`."""
        end = chosen.run.duration
        longest = LONGEST * end
        if wanted is not None:
            named.next(chosen)
        simulation = Simulation(chosen, record_events)
        times = sampling_times(end, simulation.solver.time_step, trace, windows)
        with stop_on_interrupt(on_interrupt == "keep") as stop:
            rows = run_in_chunks(simulation, end, times, progress, stop)
            while extend and wanted is not None and not stop():
                end = min(time_needed(simulation.result(), wanted), longest)
                if end <= simulation.time:
                    break
                named.longer(end)
                run_in_chunks(simulation, end, np.zeros(0), progress, stop)
            result = simulation.result(trace=_columns(rows) if len(times) else None)
            if wanted is None and chosen.run.error_estimate and not result.cut_short:
                result = _with_error_estimate(result, simulation.solver, stop, named)
            stopped.append(stop())
        if result.cut_short:
            result.warnings.append(f"interrupted at t = {simulation.time:.6g} s")
        return result

    result = run_once(scene, False) if wanted is None else run_to_accuracy(scene, run_once)
    result.warnings.extend(notes)
    return replace(result, interrupted=any(stopped))


class _Stages:
    """Names of the runs that a request takes, told as they begin.

    Parameters
    ----------
    stage, progress : callable, optional
        As in `simulate`.
    planned : int
        Runs that there will be, if no doubt adds one.
    """

    def __init__(
        self,
        stage: Callable[[str, float], None] | None,
        progress: Callable[[float], None] | None,
        planned: int,
    ) -> None:
        self.stage, self.progress, self.planned = stage, progress, planned
        self.begun, self.name = 0, ""

    def next(self, scene: Scene, purpose: str = "") -> None:
        """Tell of the next run."""
        self.begun += 1
        if purpose or self.planned > 1:
            count = scene.fem.elements if scene.solver_name == "fem" else scene.solver.cells
            of = f"{self.begun} of {max(self.planned, self.begun)}"
            what = counted(scene.solver_name)
            self.name = f"{purpose}run {of}" + (f" with {count} {what}" if count else "")
        self.longer(scene.run.duration)

    def longer(self, end: float) -> None:
        """Tell that a run lasts until `end` [s]."""
        if self.stage is not None:
            self.stage(self.name, end)


def _with_error_estimate(
    result: Result, solver: Solver, stop: Callable[[], bool], named: _Stages
) -> Result:
    """Add the estimated errors of rate and means."""
    scenes = solver.coarser_scenes()
    named.planned = len(scenes or ())

    def run(scene: Scene) -> Result:
        named.next(scene, "error of the means, ")
        # of what falls, events tell when and how fast
        simulation = Simulation(scene, record_events=bool(result.fall))
        run_in_chunks(simulation, scene.run.duration, np.zeros(0), named.progress, stop)
        return simulation._found()

    return with_error_estimate(result, scenes, run)


def _requested(
    scene: Scene,
    duration: float | None,
    settle: float | None,
    accuracy: float | None,
    check: bool | None,
    error_estimate: bool | None,
) -> tuple[Scene, list[str]]:
    """Return the scene with the request of a run in it, and what to warn of."""
    refuse_other(scene)
    changes = {
        "run.duration": duration,
        "run.settle": settle,
        "solver.accuracy": accuracy,
        "run.check": check,
        "run.error_estimate": error_estimate,
    }
    given = {key: value for key, value in changes.items() if value is not None}
    notes = []
    longest = scene.run.settle
    if settle is None and isinstance(duration, (int, float)) and 0 < duration <= longest:
        given["run.settle"] = _SETTLING_SHARE * duration
        notes.append(
            f"run.settle = {longest!r} s is not below the duration of {duration!r} s: "
            f"blows count from {_SETTLING_SHARE * duration!r} s on"
        )
    scene = scene.replace(**given) if given else scene
    if scene.run.check and scene.solver.accuracy is None:
        raise SceneError("run.check = true verifies solver.accuracy: set that too")
    if error_estimate is False and scene.solver.accuracy is not None:
        notes.append(
            "run.error_estimate = false has no effect: the runs for solver.accuracy show the error"
        )
    return scene, notes


def run_in_chunks(
    run: Simulation,
    end: float,
    times: np.ndarray,
    progress: Callable[[float], None] | None,
    stop: Callable[[], bool],
) -> np.ndarray:
    """Advance a run to `end` and sample it at `times`.

    Chunks change no bit of the run, since reading is not touching.

    Returns
    -------
    ndarray, shape (m, len(SAMPLE_FIELDS))
        Samples; fewer than `times` after an interruption.
    """
    rows = np.empty((len(times), len(SAMPLE_FIELDS)))
    done = 0
    chunk = first = run.solver.time_of_steps(_FIRST_STEPS)
    while run.time < end and not stop():
        began = time.perf_counter()
        t = min(run.time + chunk, end)
        until = int(np.searchsorted(times, t, side="right"))
        if until > done:
            rows[done:until] = run.sample_rows(times[done:until])
        done = until
        run.advance(t)
        if progress is not None:
            progress(t)
        taken = time.perf_counter() - began
        if taken < _WANTED_CHUNK_TIME / _GROWTH:
            chunk = min(chunk * _GROWTH, _LONGEST_CHUNK)
        elif taken > _WANTED_CHUNK_TIME * _GROWTH:
            chunk = max(chunk / _GROWTH, first)
    return rows[:done]


def sampling_times(
    end: float,
    time_step: float | None,
    interval: float | None,
    windows: Iterable[tuple[float, float]],
) -> np.ndarray:
    """Times of a trace: every `interval`, and each step within the windows [s]."""
    parts = [np.zeros(0)]
    if interval is not None:
        if not is_number(interval) or not interval > 0:
            raise SimulationError(f"trace = {interval!r}: must be a sampling interval above 0 s")
        _refuse_too_many(end / interval)
        count = int(np.floor(end / interval * (1.0 + _ROUNDING)))
        parts.append(np.minimum(np.arange(count + 1) * interval, end))
    for window in windows:
        start, stop = _checked_window(window, end)
        if time_step is None:
            parts.append(np.linspace(start, stop, _WINDOW_SAMPLES))
            continue
        _refuse_too_many((stop - start) / time_step)
        first, last = np.ceil(start / time_step), np.floor(stop / time_step)
        parts.append(np.arange(first, last + 1) * time_step)
    return np.unique(np.concatenate(parts))


def _checked_window(window: tuple[float, float], end: float) -> tuple[float, float]:
    start, stop = window
    if not (is_number(start) and is_number(stop) and 0 <= start < stop <= end):
        raise SimulationError(
            f"window {start!r} to {stop!r} s: must rise and lie within the {end!r} s of the run"
        )
    return float(start), float(stop)


def _refuse_too_many(count: float) -> None:
    if count > _MOST_SAMPLES:
        raise SimulationError(
            f"the trace would have {count:.3g} samples, more than {_MOST_SAMPLES:.0g}: "
            "sample less often or in shorter windows"
        )


@contextmanager
def stop_on_interrupt(keep: bool) -> Iterator[Callable[[], bool]]:
    """Turn Ctrl-C into a wish to stop at the end of a chunk; a second one raises.

    Yields
    ------
    callable
        Whether to stop.
    """
    if not keep or threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    wishes: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        if wishes:
            raise KeyboardInterrupt
        wishes.append(number)

    previous = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(wishes)
    finally:
        signal.signal(signal.SIGINT, previous)
