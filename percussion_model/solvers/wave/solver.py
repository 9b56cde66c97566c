"""Travelling-wave solver: the method of characteristics for stepped bars."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np

from percussion_model.physics.blows import FASTEST
from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import Status
from percussion_model.scene.bar_groups import Bar
from percussion_model.scene.numbers import kernel_numbers, numbers_of, section_numbers
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.state import State, words_of
from percussion_model.solvers.wave.advance import GRID_ROUNDING, run, sample, time_of_blow
from percussion_model.solvers.wave.cutting import Grid
from percussion_model.solvers.wave.grid import refuse, section_count
from percussion_model.solvers.wave.leaps.lookahead import LOOKAHEAD
from percussion_model.solvers.wave.leaps.operators import LEVELS
from percussion_model.solvers.wave.prepare import (
    can_leap,
    fill_wave_parameters,
    fill_wave_start,
    scratch_size,
    wanted_grid,
)
from percussion_model.solvers.wave.records import (
    WAVE_LIMITS,
    WAVE_PAR,
    WAVE_STATE,
    Bars,
    LeapKind,
    Row,
    Scratch,
    Task,
    no_operators,
)
from percussion_model.solvers.wave.resolution import coarser_cells
from percussion_model.solvers.wave.shared import cut_bars, leap_operators

_WORD = words_of(WAVE_STATE)
LEAP_END, STEP, T_BASE = _WORD["leap_end"], _WORD["step"], _WORD["t_base"]
EVENTS_ON, N_BLOWS, N_EVENTS = _WORD["events_on"], _WORD["n_blows"], _WORD["n_events"]
PARITY, PEAK_FROM = _WORD["parity"], _WORD["peak_from"]
CLOSED, GAP = _WORD["closed"], _WORD["gap"]
LEAP_WORDS = [
    _WORD[name] for name in ("step", "leap_end", "leap_kind", "dormant", "piston_step", "wake")
]


# So many samples at once are read by a kernel of its own, which takes ten seconds to compile.
MANY = 16
# A state without a leap is no more than a step, and rounding, behind the present [steps].
MOST_BEHIND = 2


class WaveSolver(Solver):
    """Method of characteristics for a scene with an elastic bit.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    time_step : float
        Transit time of a cell [s].
    cells : dict of int
        Cells in each elastic bar.
    wave_speed_error : float
        Largest relative error of a section's wave speed, from lengths that
        fit no common cell.
    """

    name = "wave"
    time_step: float
    COUNTS: ClassVar = ("steps", "leaps", "leap_steps", "wakes", "events", "blows", "locked")
    LIMITS: ClassVar = WAVE_LIMITS

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._numbers = kernel_numbers(scene)
        self.time_step, wish = entry_of(wanted_grid)(self._numbers)
        refuse(wish)
        bars = cut_bars(numbers_of(scene), self.time_step)
        piston, bit = bars.piston, bars.bit
        self._grids = {"piston": piston.grid if piston.grid.n else None, "bit": bit.grid}
        self.cells = {name: grid.n for name, grid in self._grids.items() if grid is not None}
        self.wave_speed_error = max(bar.grid.fit for bar in bars.both)
        self._cb, self._cp = bit.coefficients, piston.coefficients
        self._par = np.zeros(1, WAVE_PAR)
        entry_of(fill_wave_parameters)(self._par[0], self._numbers, bars)
        self._operators = no_operators()
        if entry_of(can_leap)(self._par[0], self._numbers, bars):
            found = leap_operators(self._par, bars)
            if found is not None:
                self._par["leaps"] = LEVELS
                self._operators = found
                self.operator_bytes = sum(part.nbytes for part in found)
        self._longest_leap = 4 ** int(self._par[0]["leaps"]) - 1
        self._scratch = Scratch(*np.zeros((3, scratch_size(self._par[0]))))
        self._entry: Callable[..., int] = entry_of(run)
        self._sample_entry: Callable[..., tuple[int, int]] = entry_of(sample)

    def _bars(self, state: State) -> Bars:
        wp, wb = state.arrays
        return Bars(wp, self._cp, wb, self._cb)

    def new_state(self) -> State:
        """State at time zero."""
        shapes = tuple((len(Row), self.cells.get(name, 0) + 1) for name in self._grids)
        state = State(WAVE_STATE, shapes)
        entry_of(fill_wave_start)(self._par, state.record, self._bars(state), self._numbers)
        return state

    @property
    def place_of_closure(self) -> float:
        """Share of a step after which a closure comes best (docs/numerics.md, eq. 14b)."""
        return float(self._par[0]["front"])

    def _run(
        self, task: Task, state: State, time: float, blows: np.ndarray, events: np.ndarray,
        reading: np.ndarray,
    ) -> int:  # fmt: skip
        """Call the kernels; see `solvers.wave.advance.run`."""
        status = self._entry(
            int(task), self._par, state.record, self._bars(state), self._operators,
            self._scratch, time, blows, events, reading,
        )  # fmt: skip
        if self._entry is run:  # compiled just now; the types of all these never change
            self._entry = entry_of(run)
        return int(status)

    def state_fault(self, state: State, t: float) -> str:
        """As in `Solver`; leaps and the waiting piston are within what the operators carry."""
        fault = super().state_fault(state, t)
        if fault:
            return fault
        step, end, kind, dormant, begin, wake = state.words[LEAP_WORDS].tolist()
        longest = self._longest_leap
        if end >= 0:
            most = min(longest, LOOKAHEAD) if kind == LeapKind.CONTACT else longest
            if not step < end <= step + most:
                return f"leap_end = {end}, at step {step} with leaps of {most} steps at most"
        if dormant:
            if not begin <= max(step, end) <= wake <= begin + longest or begin > step:
                return f"wake = {wake}, at step {step} of a piston that waits from {begin} on"
        behind = t - self._time_of(state, max(end, step + MOST_BEHIND))
        if not behind <= 0.0:
            return f"its time of {self.time(state)!r} s, far before {t!r} s"
        return ""

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Commit the whole steps and leaps up to `t`; as in `Solver`."""
        words = state.words
        leap_end = words[LEAP_END]
        if leap_end >= 0:
            # as the kernel would find out, at a tenth of the cost
            steps = (t - float(state.numbers[T_BASE])) / self.time_step + GRID_ROUNDING
            if steps < leap_end:
                words[N_BLOWS] = words[N_EVENTS] = 0
                return int(Status.DONE), 0, 0
        words[EVENTS_ON] = record_events
        status = self._run(Task.ADVANCE, state, t, blows, events, self._no_reading)
        return status, int(words[N_BLOWS]), int(words[N_EVENTS])

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; a copy with the waves of the last grid point. As in `Solver`."""
        spare = state.copy(spare)
        if not peaks:
            spare.numbers[PEAK_FROM] = np.inf
        self._run(Task.READ, spare, t, self._no_blows, self._no_events, reading)
        return spare

    def sample_ahead(
        self, state: State, times: np.ndarray, out: np.ndarray, blows: np.ndarray,
        events: np.ndarray, record_events: bool,
    ) -> tuple[int, int, int, int]:  # fmt: skip
        """As in `Solver`; where there are many, without going back to Python between them."""
        if len(times) < MANY:
            return super().sample_ahead(state, times, out, blows, events, record_events)
        words, spare, reading = state.words, state.copy(), self._no_reading.copy()
        words[EVENTS_ON] = record_events
        row = reading.view(np.float64)[: out.shape[1]]
        status, count = self._sample_entry(
            self._par, state.record, self._bars(state), (words, state.workspace),
            spare.record, self._bars(spare), (spare.words, spare.workspace),
            self._operators, self._scratch, times, blows, events, reading, row, out,
        )  # fmt: skip
        self._sample_entry = entry_of(sample)
        return int(status), int(words[N_BLOWS]), int(words[N_EVENTS]), int(count)

    def commit(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Bring the state to the first grid point at or after `t`; nothing happens meanwhile."""
        t = self.grid_point_after(state, t)
        return self._run(Task.COMMIT, state, t, blows, events, self._no_reading), 0, 0

    def time(self, state: State) -> float:
        """Time up to which the state is committed [s]."""
        return self._time_of(state, int(state.words[STEP]))

    def time_of_blow(self, state: State) -> float:
        """As in `Solver`: a step may be cut at a closure."""
        # as the kernel asks, in a tenth of the time
        if state.words[CLOSED] == 1 or state.numbers[GAP] > FASTEST * self.time_step:
            return 0.0
        return float(time_of_blow(self._par, state.record))

    def readable_until(self, state: State) -> float:
        """Time up to which `read` answers without advancing the state [s]."""
        return self._time_of(state, max(int(state.words[LEAP_END]), int(state.words[STEP]) + 1))

    def grid_point_after(self, state: State, t: float) -> float:
        """First grid point at or after `t` [s]."""
        base = float(state.numbers[T_BASE])
        return self._time_of(state, int(np.ceil((t - base) / self.time_step - GRID_ROUNDING)))

    def _time_of(self, state: State, step: int) -> float:
        return float(state.numbers[T_BASE]) + step * self.time_step

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] of each cell, top to bottom, by bar."""
        r = 2 * int(state.words[PARITY])
        out = {}
        for (name, grid), w in zip(self._grids.items(), state.arrays, strict=True):
            if grid is not None:
                d, u = w[r, : grid.n], w[r + 1, : grid.n]
                out[f"{name}_force"] = grid.impedance * (d - u)
                out[f"{name}_velocity"] = d + u
        return out

    def force_in(self, state: State, bar: str, cell: int) -> float:
        """Force in one cell of "piston" or "bit" [N], as `fields` reads it."""
        grid = self._grids[bar]
        if grid is None:
            return 0.0
        w = state.arrays[bar == "bit"]
        r = 2 * int(state.words[PARITY])
        return float(grid.impedance[cell] * (w[r, cell] - w[r + 1, cell]))

    def grid_of(self, bar: str) -> Grid | None:
        """Cells of "piston" or "bit", None where it has none."""
        return self._grids[bar]

    def coarser_scenes(self) -> list[Scene] | None:
        """One scene where lengths fit, else two that are off to either side."""
        counts = coarser_cells(numbers_of(self.scene), next(iter(self.cells.values())))
        changes = {"solver.accuracy": None, "run.check": False}
        return [
            self.scene.replace(**changes, **{"solver.cells": count}) for count in counts
        ] or None

    def section_cells(self, bar: Bar) -> list[int]:
        """Cells in each section of an elastic bar."""
        return [section_count(section, self.time_step) for section in section_numbers(bar)]
