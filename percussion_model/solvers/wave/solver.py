"""Travelling-wave solver: delay lines of any length, joints, damper."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

import numpy as np

from percussion_model.physics.blows import FASTEST
from percussion_model.physics.kernel import entry_of
from percussion_model.scene.bar_groups import Bar as SceneBar
from percussion_model.scene.numbers import Numbers, kernel_numbers
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.solvers.base import Solver
from percussion_model.solvers.setup import MOST_CELLS, refuse_many
from percussion_model.solvers.state import State, words_of
from percussion_model.solvers.wave.advance import GRID_ROUNDING, run, sample, time_of_blow
from percussion_model.solvers.wave.network import TOO_FINE, Network, Plan, network_of, plan_of
from percussion_model.solvers.wave.prepare import begin, fill_wave_parameters
from percussion_model.solvers.wave.records import (
    WAVE_LIMITS,
    WAVE_PAR,
    WAVE_STATE,
    Bar,
    Body,
    Chain,
    Has,
    Place,
    Steel,
    Task,
    Waves,
)
from percussion_model.solvers.wave.resolution import coarser_steps
from percussion_model.solvers.wave.sections import CAME_ROWS, cell_masses, fill_cells, force_in

_WORD = words_of(WAVE_STATE)
STEP, EVENTS_ON, PEAK_FROM = _WORD["step"], _WORD["events_on"], _WORD["peak_from"]
T_BASE, N_BLOWS, N_EVENTS = _WORD["t_base"], _WORD["n_blows"], _WORD["n_events"]
CLOSED, GAP = _WORD["closed"], _WORD["gap"]
# So many samples at once are read by a kernel of its own, which takes ten seconds to compile.
MANY = 16
# A state is no more than a step, and rounding, behind the present [steps].
MOST_BEHIND = 2.0


def _network(numbers: Numbers) -> tuple[Plan, Network]:
    """Cut the bars of a scene, or refuse."""
    plan = entry_of(plan_of)(numbers)
    refuse_many("cells", plan.cells, MOST_CELLS)
    network = entry_of(network_of)(numbers, plan)
    if network.too_fine > 0.0:
        numbers_in_text = {
            "eta": f"{plan.eta:.3g}", "length": f"{network.too_fine:g}",
            "step": f"{plan.time_step:.2g}",
        }  # fmt: skip
        raise SceneError(TOO_FINE.format(**numbers_in_text))
    return plan, network


class Cells:
    """Cells of one bar, in which its waves are read.

    Attributes
    ----------
    mass, impedance : float array, shape (n,)
        Of each, top to bottom [kg, N s/m].
    in_sections : list of int
    """

    def __init__(self, chain: Chain, bar: int, sections: slice) -> None:
        self.in_sections = chain.places[sections, Place.CELLS].tolist()
        self.mass = entry_of(cell_masses)(chain, bar)
        self.impedance = np.repeat(chain.steel[sections, Steel.IMPEDANCE], self.in_sections)

    @property
    def n(self) -> int:
        """How many there are."""
        return len(self.mass)


class WaveSolver(Solver):
    """Waves in the bars from the drive to the rock, two or a drill string.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    time_step : float
        [s]
    cells : dict of int
        Of each bar, as many as a wave takes steps.
    wave_speed_error : float
        Largest relative error of a section's transit time.
    """

    name = "wave"
    time_step: float
    COUNTS: ClassVar = ("steps", "events", "blows", "locked")
    LIMITS: ClassVar = WAVE_LIMITS

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._numbers = numbers = kernel_numbers(scene)
        plan, network = _network(numbers)
        piston, rods = ["piston"] * network.struck, range(1, len(numbers.rod_counts) + 1)
        self._chain, self._names = network.chain, [*piston, *(f"rod {k}" for k in rods), "bit"]
        self.time_step, self.wave_speed_error = plan.time_step, network.misfit
        bodies = network.chain.bodies[:, Body.FIRST : Body.LAST + 1].astype(int)
        self._sections = {
            name: slice(first, last + 1)
            for name, (first, last) in zip(self._names, bodies.tolist(), strict=True)
        }
        self._cells = {
            name: Cells(network.chain, bar, where)
            for bar, (name, where) in enumerate(self._sections.items())
        }
        self.cells = {name: cells.n for name, cells in self._cells.items()}
        self._par = np.zeros(1, WAVE_PAR)
        entry_of(fill_wave_parameters)(self._par[0], numbers, plan, network)
        self.operator_bytes = sum(part.nbytes for part in network.chain)
        self._shapes = (
            (len(Bar), len(self._names)),
            (len(Has), max(1, len(network.chain.fits))),
            (CAME_ROWS, max(len(network.chain.places), len(self._names))),
            (1, network.rings),
        )
        self._entry: Callable[..., int] = entry_of(run)
        self._sample_entry: Callable[..., tuple[int, int]] = entry_of(sample)

    def _waves(self, state: State, rings: np.ndarray | None = None) -> Waves:
        bars, joints, came, own = state.arrays
        return Waves(own if rings is None else rings, bars, joints, came)

    def new_state(self) -> State:
        """State at time zero."""
        state = State(WAVE_STATE, self._shapes)
        waves = self._waves(state)
        entry_of(begin)(self._par[0], state.record[0], self._chain, waves, self._numbers)
        return state

    def _run(
        self, task: Task, state: State, waves: Waves, time: float, blows: np.ndarray,
        events: np.ndarray, reading: np.ndarray,
    ) -> int:  # fmt: skip
        status = self._entry(
            int(task), self._par, state.record, self._chain, waves, time, blows, events, reading
        )
        if self._entry is run:
            self._entry = entry_of(run)
        return int(status)

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Commit the whole steps up to `t`; as in `Solver`."""
        words = state.words
        words[EVENTS_ON] = record_events
        waves = self._waves(state)
        status = self._run(Task.ADVANCE, state, waves, t, blows, events, self._no_reading)
        return status, int(words[N_BLOWS]), int(words[N_EVENTS])

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; the state itself, as `fields` reads it. As in `Solver`."""
        copy, waves = self._spoilable(state)
        if not peaks:
            copy.numbers[PEAK_FROM] = np.inf
        self._run(Task.READ, copy, waves, t, self._no_blows, self._no_events, reading)
        return state

    def _spoilable(self, state: State) -> tuple[State, Waves]:
        """A copy of a state but for its rings, far larger than the rest, which reading leaves."""
        small = sum(rows * columns for rows, columns in self._shapes[:-1])
        copy = State(
            WAVE_STATE, self._shapes[:-1], state.words.copy(), state.workspace[:small].copy()
        )
        return copy, Waves(state.arrays[-1], *copy.arrays)

    def sample_ahead(
        self, state: State, times: np.ndarray, out: np.ndarray, blows: np.ndarray,
        events: np.ndarray, record_events: bool,
    ) -> tuple[int, int, int, int]:  # fmt: skip
        """As in `Solver`; where there are many, without going back to Python between them."""
        if len(times) < MANY:
            return super().sample_ahead(state, times, out, blows, events, record_events)
        words, reading = state.words, self._no_reading.copy()
        spare, spare_waves = self._spoilable(state)
        words[EVENTS_ON] = record_events
        row = reading.view(np.float64)[: out.shape[1]]
        status, count = self._sample_entry(
            self._par, state.record, self._chain, self._waves(state), (words, state.workspace),
            spare.record, spare_waves, (spare.words, spare.workspace),
            times, blows, events, reading, row, out,
        )  # fmt: skip
        self._sample_entry = entry_of(sample)
        return int(status), int(words[N_BLOWS]), int(words[N_EVENTS]), int(count)

    def state_fault(self, state: State, t: float) -> str:
        """As in `Solver`; the state is within a step of the present."""
        fault = super().state_fault(state, t)
        if not fault and not self.time(state) >= t - MOST_BEHIND * self.time_step:
            return f"its time of {self.time(state)!r} s, far before {t!r} s"
        return fault

    def time_of_blow(self, state: State) -> float:
        """As in `Solver`: a step may be cut at a closure."""
        # as the kernel asks, in a tenth of the time
        if state.words[CLOSED] == 1 or state.numbers[GAP] > FASTEST * self.time_step:
            return 0.0
        return float(time_of_blow(self._par, state.record))

    def time(self, state: State) -> float:
        """Time up to which the state is committed [s]."""
        return float(state.numbers[T_BASE]) + int(state.words[STEP]) * self.time_step

    def readable_until(self, state: State) -> float:
        """Time up to which `read` answers without advancing the state [s]."""
        return float(state.numbers[T_BASE]) + (int(state.words[STEP]) + 1) * self.time_step

    def grid_point_after(self, state: State, t: float) -> float:
        """First grid point at or after `t` [s]."""
        base = float(state.numbers[T_BASE])
        return base + math.ceil((t - base) / self.time_step - GRID_ROUNDING) * self.time_step

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] of each cell, top to bottom, by bar."""
        out = {}
        bars, _, _, rings = state.arrays
        step = int(state.words[STEP])
        for i, name in enumerate(self._names):
            d, u = np.zeros((2, self._cells[name].n))
            entry_of(fill_cells)(self._chain, rings, step, i, d, u)
            out[f"{name}_force"] = self._cells[name].impedance * (d - u)
            out[f"{name}_velocity"] = d + u + 2.0 * bars[Bar.GIVEN, i]
        return out

    def force_in(self, state: State, bar: str, cell: int) -> float:
        """Force in one cell of a bar [N], as `fields` reads it."""
        if bar not in self._cells:
            return 0.0
        rings, step = state.arrays[-1], int(state.words[STEP])
        return float(entry_of(force_in)(self._chain, rings, step, self._names.index(bar), cell))

    def grid_of(self, bar: str) -> Cells | None:
        """Cells of a bar, None where it has none."""
        return self._cells.get(bar)

    def section_cells(self, bar: SceneBar) -> list[int]:
        """Cells in each section of an elastic bar."""
        name = next(name for name, one in self.scene.bars.items() if one is bar)
        return list(self._cells[name].in_sections)

    def coarser_scenes(self) -> list[Scene] | None:
        """The scene with steps half as long again."""
        first = next(iter(self.cells.values()))
        count = coarser_steps(first)
        if count == first:
            return None
        changes = {"solver.accuracy": None, "run.check": False, "solver.cells": count}
        return [self.scene.replace(**changes)]
