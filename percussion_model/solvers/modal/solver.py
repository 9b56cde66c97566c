"""Modal solver: stepped bars of any lengths by their normal modes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import Piston, RockKind
from percussion_model.scene.bars import bar_mass, bar_transit_time
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.parameters import Bar
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.modal.advance import TICK_ROUNDING, run
from percussion_model.solvers.modal.fields import Places
from percussion_model.solvers.modal.modes import end_compliance
from percussion_model.solvers.modal.records import (
    LEVELS,
    MODAL_LIMITS,
    MODAL_PAR,
    MODAL_STATE,
    STEP,
    Bars,
    ModalBar,
    Move,
    Reply,
    Shape,
    Task,
)
from percussion_model.solvers.modal.standstill import POWERS, no_standstill, standstill_of
from percussion_model.solvers.modal.tables import modal_bar
from percussion_model.solvers.setup import (
    fill_parameters,
    fill_start,
    kelvin_voigt_time,
    rock_numbers,
)
from percussion_model.solvers.state import State

# Modes in the bar with the shortest transit time, where the scene names none.
DEFAULT_MODES = 20
# A coarser run has so many of them.
COARSER = 0.7
LONGEST_LEAP = ((1 << POWERS) - 1) << STEP


def no_bar() -> ModalBar:
    """Stand-in for a piston without modes."""
    reply = np.zeros((1, STEP + 1, len(Reply)))
    move = np.zeros((LEVELS, len(Move), 0))
    size, level = np.zeros(1, np.int64), np.full(1, STEP)
    return ModalBar(np.zeros((len(Shape), 0)), move, reply, size, np.ones((1, 2)), level)


class ModalSolver(Solver):
    """Normal modes for a scene with an elastic bit.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    time_step : float
        Longest step [s].
    cells : dict of int
        Modes of each elastic bar.
    """

    name = "modal"
    time_step: float
    COUNTS: ClassVar = ("steps", "leaps", "events", "blows", "locked")
    LIMITS: ClassVar = MODAL_LIMITS

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._numbers = numbers = numbers_of(scene)
        self._par = np.zeros(1, MODAL_PAR)
        p: Any = self._par[0]
        fill_parameters(p, numbers, True)
        elastic = p["piston"] == Piston.ELASTIC
        first = bar_transit_time(numbers.piston if elastic else numbers.bit)
        modes = numbers.values.solver_cells
        eta = kelvin_voigt_time(numbers)
        if math.isnan(modes):
            modes = math.ceil(DEFAULT_MODES * first / min(first, bar_transit_time(numbers.bit)))
        self.modes = int(modes)
        p["dt"] = self.time_step = first / self.modes
        p["tick"] = tick = self.time_step / (1 << STEP)
        highest = math.pi / self.time_step
        bit = modal_bar(numbers.bit, highest, eta, tick)
        piston = modal_bar(numbers.piston, highest, eta, tick) if elastic else no_bar()
        self._constant = piston, bit
        self.cells = {"piston": piston.shape.shape[1]} if elastic else {}
        self.cells["bit"] = bit.shape.shape[1]
        if p["piston"] == Piston.ABSENT:
            p["mass_p"] = 0.0
        else:
            p["start_gap"] = scene.start.gap
        p["bound_p"] = math.sqrt(end_compliance(numbers.piston)) if elastic else 0.0
        p["bound_b"] = math.sqrt(end_compliance(numbers.bit))
        p["bound_t"] = math.sqrt(end_compliance(numbers.bit[::-1]))
        last = int(bit.sizes[-1])
        p["end_speed"] = math.sqrt(
            1.0 / bar_mass(numbers.bit) + sum((bit.shape[Shape.LOW, :last] ** 2).tolist())
        )
        rock = rock_numbers(numbers)
        p["ss_stiffness"], p["ss_damping"] = rock.gamma * rock.k_r, rock.c_r
        self._standstill = no_standstill(bit.shape.shape[1])
        if numbers.values.solver_leaps and not p["effects"]:
            p["leaps"] = 1
            if p["rock"] == RockKind.BILINEAR and p["barrier"] == 1:
                self._standstill = standstill_of(
                    bit, float(p["mass_b"]), rock.gamma * rock.k_r, rock.c_r, self.time_step
                )
                self.operator_bytes = sum(part.nbytes for part in self._standstill)
        self._read_at: dict[str, Places] = {}
        self._entry: Callable[..., int] = entry_of(run)

    def _places(self, name: str) -> Places:
        if name not in self._read_at:
            sections = self._numbers.piston if name == "piston" else self._numbers.bit
            bar = self._constant[name == "bit"]
            self._read_at[name] = Places(sections, bar, self.time_step)
        return self._read_at[name]

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Elastic force [N] and velocity [m/s] of each cell, top to bottom, by bar."""
        s, out = state.record[0], {}
        for name in self.cells:
            w, bar = state.arrays[name == "bit"], self._constant[name == "bit"]
            if name == "bit":
                which, mean, top, low = int(s["set"]), s["v_b"], s["r_t"], s["r_b"]
            else:
                which, mean, top, low = 0, s["v_p"], 0.0, s["r_p"]
            beyond = bar.beyond[which]
            out[f"{name}_force"], out[f"{name}_velocity"] = self._places(name).read(
                w, float(mean), which, int(bar.sizes[which]), top / beyond[0], -low / beyond[1]
            )
        return out

    def grid_of(self, bar: str) -> Places | None:
        """Cells of "piston" or "bit" in which fields are read, None where it has none."""
        return self._places(bar) if bar in self.cells else None

    def section_cells(self, bar: Bar) -> list[int]:
        """Cells in each section of an elastic bar."""
        return self._places("bit" if bar is self.scene.bit else "piston").in_sections

    def coarser_scenes(self) -> list[Scene] | None:
        """The scene with fewer modes."""
        count = int(COARSER * (self.modes or 0))
        changes = {"solver.accuracy": None, "run.check": False, "solver.cells": count}
        return [self.scene.replace(**changes)] if count else None

    def _bars(self, state: State) -> Bars:
        wp, wb = state.arrays
        return Bars(wp, self._constant[0], wb, self._constant[1])

    def new_state(self) -> State:
        """State at time zero."""
        state = State(MODAL_STATE, tuple((2, bar.shape.shape[1]) for bar in self._constant))
        s: Any = state.record[0]
        fill_start(s, self._numbers)
        s["leap_end"] = -1
        s["v_low"] = s["v_b"]
        s["alert"] = 1
        if self._par[0]["piston"] != Piston.ABSENT:
            s["u_p"] = -s["gap"]
            s["u_r"] = s["u_p"]
        s["e_start"] = 0.5 * self._par[0]["mass_b"] * s["v_b"] ** 2
        s["e_start"] += 0.5 * self._par[0]["mass_p"] * s["v_p"] ** 2
        return state

    def _run(
        self, task: Task, state: State, time: float, blows: np.ndarray, events: np.ndarray,
        reading: np.ndarray,
    ) -> int:  # fmt: skip
        status = self._entry(
            int(task), self._par, state.record, self._bars(state), self._standstill, time,
            blows, events, reading,
        )  # fmt: skip
        if self._entry is run:
            self._entry = entry_of(run)
        return int(status)

    def state_fault(self, state: State, t: float) -> str:
        """As in `Solver`; leaps, the waiting piston and the set of modes are within bounds."""
        fault = super().state_fault(state, t)
        if fault:
            return fault
        s, sets = state.record[0], len(self._constant[1].sizes)
        now, end, begin = int(s["time"]), int(s["leap_end"]), int(s["piston_time"])
        if not s["set"] < sets:
            return f"set = {int(s['set'])}, of {sets} sets of modes"
        if end >= 0 and not now < end <= now + LONGEST_LEAP:
            return f"leap_end = {end}, at {now} with leaps of {LONGEST_LEAP} ticks at most"
        if s["parked"] and not begin <= now:
            return f"piston_time = {begin}, after {now}"
        most = max(now + (1 << STEP), end) * float(self._par[0]["tick"])
        return "" if t <= most else f"its time of {self.time(state)!r} s, far before {t!r} s"

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Commit the whole steps and leaps up to `t`; as in `Solver`."""
        s = state.record[0]
        s["events_on"] = record_events
        status = self._run(Task.ADVANCE, state, t, blows, events, self._no_reading)
        return status, int(s["n_blows"]), int(s["n_events"])

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; a copy at the last tick up to it. As in `Solver`."""
        spare = state.copy(spare)
        if not peaks:
            spare.record[0]["peak_from"] = np.inf
        self._run(Task.READ, spare, t, self._no_blows, self._no_events, reading)
        return spare

    def commit(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Bring the state to the first tick at or after `t`; as in `Solver`."""
        s = state.record[0]
        s["events_on"] = record_events
        end = self.grid_point_after(state, t)
        status = self._run(Task.COMMIT, state, end, blows, events, self._no_reading)
        return status, int(s["n_blows"]), int(s["n_events"])

    def time(self, state: State) -> float:
        """Time up to which the state is committed [s]."""
        return float(state.record[0]["time"]) * float(self._par[0]["tick"])

    def readable_until(self, state: State) -> float:
        """Time up to which `read` answers without advancing the state [s]."""
        s = state.record[0]
        level = int(self._constant[1].levels[int(s["set"])])
        end = max(int(s["leap_end"]), int(s["time"]) + (1 << level))
        return end * float(self._par[0]["tick"])

    def grid_point_after(self, state: State, t: float) -> float:
        """First tick at or after `t` [s]."""
        tick = float(self._par[0]["tick"])
        return math.ceil(t / tick - TICK_ROUNDING) * tick
