"""Solver of chains: waves in sections of any length, joints, damper."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import Piston
from percussion_model.scene.bar_groups import Bar as SceneBar
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.chain.advance import GRID_ROUNDING, begin, run
from percussion_model.solvers.chain.network import network_of, parameters_of
from percussion_model.solvers.chain.records import (
    CHAIN_LIMITS,
    CHAIN_PAR,
    CHAIN_STATE,
    Bar,
    Body,
    Has,
    Place,
    Steel,
    Task,
    Waves,
)
from percussion_model.solvers.chain.resolution import coarser_steps
from percussion_model.solvers.chain.sections import CAME_ROWS, kept_of
from percussion_model.solvers.setup import MOST_CHANGES, PISTONS, fill_parameters, fill_start
from percussion_model.solvers.state import State, words_of

_WORD = words_of(CHAIN_STATE)
STEP, EVENTS_ON, PEAK_FROM = _WORD["step"], _WORD["events_on"], _WORD["peak_from"]
N_BLOWS, N_EVENTS = _WORD["n_blows"], _WORD["n_events"]


class Cells:
    """Cells of one bar, in which its waves are read.

    Attributes
    ----------
    mass, impedance : float array, shape (n,)
        Of each, top to bottom [kg, N s/m].
    in_sections : list of int
    """

    def __init__(self, places: np.ndarray, steel: np.ndarray) -> None:
        self.in_sections = places[:, Place.CELLS].tolist()
        self.mass = np.repeat(steel[:, Steel.CELL_MASS], self.in_sections)
        self.impedance = np.repeat(steel[:, Steel.IMPEDANCE], self.in_sections)

    @property
    def n(self) -> int:
        """How many there are."""
        return len(self.mass)


class ChainSolver(Solver):
    """Waves in a chain of bars from the drive to the rock.

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

    name = "chain"
    time_step: float
    COUNTS: ClassVar = ("steps", "events", "blows", "locked")
    LIMITS: ClassVar = CHAIN_LIMITS

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._numbers = numbers = numbers_of(scene)
        self._network = network = network_of(numbers)
        self._chain, self._names = network.chain, network.names
        self.time_step, self.wave_speed_error = network.time_step, network.misfit
        bodies = network.chain.bodies[:, Body.FIRST : Body.LAST + 1].astype(int)
        self._sections = {
            name: slice(first, last + 1)
            for name, (first, last) in zip(network.names, bodies.tolist(), strict=True)
        }
        self._cells = {
            name: Cells(network.chain.places[where], network.chain.steel[where])
            for name, where in self._sections.items()
        }
        self.cells = {name: cells.n for name, cells in self._cells.items()}
        self._par = np.zeros(1, CHAIN_PAR)
        fill_parameters(self._par[0], numbers, True)
        parameters_of(network, numbers, self._par)
        p: Any = self._par[0]
        p["most_changes"] = MOST_CHANGES
        self.operator_bytes = sum(part.nbytes for part in network.chain)
        self._shapes = (
            (len(Bar), len(network.names)),
            (len(Has), max(1, len(network.chain.fits))),
            (CAME_ROWS, max(len(network.chain.places), len(network.names))),
            (1, network.rings),
        )
        self._entry: Callable[..., int] = entry_of(run)

    def _waves(self, state: State, rings: np.ndarray | None = None) -> Waves:
        bars, joints, came, own = state.arrays
        return Waves(own if rings is None else rings, bars, joints, came)

    def new_state(self) -> State:
        """State at time zero."""
        state = State(CHAIN_STATE, self._shapes)
        s: Any = state.record[0]
        numbers, network = self._numbers, self._network
        fill_start(s, numbers)
        bars, joints, _, rings = state.arrays
        places = network.chain.places
        for i, name in enumerate(network.names):
            v = s["v_p"] if name == "piston" else numbers.values.start_bit_velocity
            bars[Bar.VELOCITY, i] = v
            for k in range(self._sections[name].start, self._sections[name].stop):
                first, count = places[k, Place.RING], 4 * places[k, Place.SIZE]
                rings[0, first : first + count] = 0.5 * v
                rings[0, first + count : first + count + 2] = kept_of(self._chain, k) * 0.5 * v
        if len(numbers.joints):
            joints[Has.GAP] = numbers.joints[:, 3]
            joints[Has.CLOSED] = numbers.joints[:, 3] == 0.0
        s["end_start"] = s["x_r"] + s["p"]
        if PISTONS[numbers.values.piston_model] != Piston.ABSENT:
            s["u_r"] = s["u_0"] = -s["gap"]
        entry_of(begin)(self._par, state.record, self._chain, self._waves(state))
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
        # the rings, which are far larger than the rest, are looked at where they are
        small = sum(rows * columns for rows, columns in self._shapes[:-1])
        copy = State(
            CHAIN_STATE, self._shapes[:-1], state.words.copy(), state.workspace[:small].copy()
        )
        if not peaks:
            copy.numbers[PEAK_FROM] = np.inf
        waves = Waves(state.arrays[-1], *copy.arrays)
        self._run(Task.READ, copy, waves, t, self._no_blows, self._no_events, reading)
        return state

    def time(self, state: State) -> float:
        """Time up to which the state is committed [s]."""
        return int(state.words[STEP]) * self.time_step

    def readable_until(self, state: State) -> float:
        """Time up to which `read` answers without advancing the state [s]."""
        return (int(state.words[STEP]) + 1) * self.time_step

    def grid_point_after(self, state: State, t: float) -> float:
        """First grid point at or after `t` [s]."""
        return math.ceil(t / self.time_step - GRID_ROUNDING) * self.time_step

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] of each cell, top to bottom, by bar."""
        out = {}
        bars, _, _, rings = state.arrays
        step = int(state.words[STEP])
        for i, name in enumerate(self._names):
            down, up = [], []
            for k in range(self._sections[name].start, self._sections[name].stop):
                ring, size, cells = self._chain.places[k, [Place.RING, Place.SIZE, Place.CELLS]]
                ages = (step - np.arange(cells)) & (size - 1)
                down.append(rings[0, ring + ages])
                up.append(rings[0, ring + 2 * size + ages][::-1])
            d, u = np.concatenate(down), np.concatenate(up)
            out[f"{name}_force"] = self._cells[name].impedance * (d - u)
            out[f"{name}_velocity"] = d + u + 2.0 * bars[Bar.GIVEN, i]
        return out

    def force_in(self, state: State, bar: str, cell: int) -> float:
        """Force in one cell of a bar [N], as `fields` reads it."""
        if bar not in self._cells:
            return 0.0
        cells = self._cells[bar]
        k, step = self._sections[bar].start, int(state.words[STEP])
        for count in cells.in_sections:
            if cell < count:
                break
            cell, k = cell - count, k + 1
        ring, size = self._chain.places[k, [Place.RING, Place.SIZE]].tolist()
        rings, last = state.arrays[-1][0], cells.in_sections[k - self._sections[bar].start] - 1
        down = rings[ring + ((step - cell) & (size - 1))]
        up = rings[ring + 2 * size + ((step - (last - cell)) & (size - 1))]
        return float(self._chain.steel[k, Steel.IMPEDANCE] * (down - up))

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
