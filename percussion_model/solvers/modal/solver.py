"""Modal solver: stepped bars of any lengths by their normal modes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import TURNS
from percussion_model.scene.bar_groups import Bar
from percussion_model.scene.numbers import Numbers, numbers_of
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.modal.advance import TICK_ROUNDING, run, time_of_blow
from percussion_model.solvers.modal.faults import FAULTS, find_fault
from percussion_model.solvers.modal.fields import Places, loads_of, take_rest
from percussion_model.solvers.modal.laws import laws_of
from percussion_model.solvers.modal.prepare import (
    Request,
    Tables,
    begin,
    fill_modal_parameters,
    modes_wanted,
)
from percussion_model.solvers.modal.records import (
    JOINED,
    LONGEST_STRIDE,
    MODAL_LIMITS,
    MODAL_PAR,
    MODAL_STATE,
    SCAN,
    STEP,
    Bars,
    Forms,
    Laws,
    Task,
)
from percussion_model.solvers.modal.resolution import (
    COARSER,
    MOST_MODES,
    asked_modes,
    coarser_modes,
)
from percussion_model.solvers.modal.tables import forms_of, piston_tables
from percussion_model.solvers.setup import elastic_piston, refuse_many
from percussion_model.solvers.state import State, aligned, words_of

_WORD = words_of(MODAL_STATE)
ARMED, CLOSED, LEAP_END = _WORD["armed"], _WORD["closed"], _WORD["leap_end"]

# Tables that were made last; so many are kept.
_kept: dict[tuple[Any, ...], Tables] = {}
MOST_KEPT = 4


def _tables(numbers: Numbers, piston: np.ndarray, request: Request) -> Tables:
    """Make the tables of a scene, whose elastic piston has such sections, or find them."""
    key = (numbers.bit.tobytes(), piston.tobytes(), *request)
    if key not in _kept:
        while len(_kept) >= MOST_KEPT:
            del _kept[next(iter(_kept))]
        *_, count = modes_wanted(numbers, request)
        refuse_many("modes", count, MOST_MODES, ', or take waves (solver.name = "wave")')
        # in parts, as `tables_of` together: compiled with all that it calls that takes long
        forms, modes, free = forms_of(
            numbers.bit, piston, request.piston_mass, request.springs,
            request.highest, request.eta, request.tick,
        )  # fmt: skip
        parts = piston_tables(free, request.eta, request.tick)
        laws = laws_of(forms, request.dashpot, request.eta, request.tick)
        shape_p, move_p = map(aligned, parts)
        forms, laws = Forms(*map(aligned, forms)), Laws(*map(aligned, laws))
        _kept[key] = Tables(forms, modes, free, shape_p, move_p, laws)
    return _kept[key]


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
        numbers = numbers_of(scene)
        self._numbers = numbers
        self._par = np.zeros(1, MODAL_PAR)
        p: Any = self._par[0]
        request = fill_modal_parameters(p, self._numbers)
        self.time_step = float(p["dt"])
        self.modes = asked_modes(numbers)
        self._tables = made = _tables(self._numbers, elastic_piston(numbers), request)
        elastic = len(made.free.frequency) > 0
        self.cells = {"piston": made.shape_p.shape[1]} if elastic else {}
        self.cells["bit"] = int(made.forms.sizes[0])
        self.operator_bytes = sum(part.nbytes for part in (*made.forms, *made.laws))
        self._rows = aligned(np.zeros((8, max(made.forms.shape.shape[2], 2 * SCAN))))
        self._must_arm = TURNS[numbers.values.effects_drive]
        self._read_at: dict[str, Places] = {}
        self._entry: Callable[..., int] = entry_of(run)

    def _places(self, name: str) -> Places:
        if name not in self._read_at:
            sections = self._numbers.piston if name == "piston" else self._numbers.bit
            self._read_at[name] = Places(sections, self.time_step)
        return self._read_at[name]

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Elastic force [N] and velocity [m/s] of each cell, top to bottom, by bar."""
        s, (w, wp), out, made = state.record[0], state.arrays, {}, self._tables
        form, par = int(s["form"]), self._par[0]
        joined = form >= JOINED
        moving = np.zeros((2, w.shape[1]))
        take_rest(w, made.forms.shape[form], int(s["active"]), moving)
        loads = dict(zip(("piston", "bit"), loads_of(par, s, made.forms.stiff[form]), strict=True))
        for name in self.cells:
            first, modes, own, mean, held = 0, made.modes[form], moving, 0.0, 0.0
            if name == "piston" and not joined:
                own = np.concatenate([np.zeros((2, 1)), wp], axis=1)
                modes, mean = made.free, float(s["v_p"])
            elif name == "bit" and joined:
                first = len(self._numbers.piston) if "piston" in self.cells else 0
                held = float(par["mass_p"]) * loads["piston"]
            force, velocity = self._places(name).read(modes, first, own)
            mass = self._places(name).mass
            force += held + loads[name] * (np.cumsum(mass) - 0.5 * mass)
            out[f"{name}_force"], out[f"{name}_velocity"] = force, velocity + mean
        return out

    def grid_of(self, bar: str) -> Places | None:
        """Cells of "piston" or "bit" in which fields are read, None where it has none."""
        return self._places(bar) if bar in self.cells else None

    def section_cells(self, bar: Bar) -> list[int]:
        """Cells in each section of an elastic bar."""
        return self._places("bit" if bar is self.scene.bit else "piston").in_sections

    def coarser_scenes(self) -> list[Scene] | None:
        """The scene with fewer modes."""
        changes = {"solver.accuracy": None, "run.check": False}
        counts = coarser_modes(self.modes, COARSER)
        return [
            self.scene.replace(**changes, **{"solver.cells": count}) for count in counts
        ] or None

    def _bars(self, state: State) -> Bars:
        w, wp = state.arrays
        made = self._tables
        return Bars(w, wp, made.forms, made.laws, made.shape_p, made.move_p, self._rows)

    def new_state(self) -> State:
        """State at time zero."""
        made = self._tables
        n, n_p = made.forms.shape.shape[2], made.shape_p.shape[1]
        state = State(MODAL_STATE, ((8, n), (2, n_p)))
        active = int(made.forms.sizes[0])
        begin(self._par[0], state.record[0], state.arrays[0], active, self._numbers)
        return state

    def _run(
        self, task: Task, state: State, time: float, blows: np.ndarray, events: np.ndarray,
        reading: np.ndarray,
    ) -> int:  # fmt: skip
        status = self._entry(
            int(task), self._par, state.record, self._bars(state), time,
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
        sizes, tick = self._tables.forms.sizes, float(self._par[0]["tick"])
        k, *facts = find_fault(state.record[0], sizes, self._tables.laws.sizes, tick, float(t))
        return FAULTS[k].format(*facts)

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

    def time_of_blow(self, state: State) -> float:
        """As in `Solver`: pairs of numbers carry the bars over many steps at once."""
        words = state.words  # as the kernel asks, in a tenth of the time
        waits = self._must_arm and words[ARMED] == 0
        if waits or words[CLOSED] == 1 or words[LEAP_END] >= 0:
            return 0.0
        return float(time_of_blow(self._par, state.record, self._bars(state)))

    def time(self, state: State) -> float:
        """Time up to which the state is committed [s]."""
        return float(state.record[0]["time"]) * float(self._par[0]["tick"])

    def readable_until(self, state: State) -> float:
        """Time up to which `read` answers without advancing the state [s]."""
        s = state.record[0]
        go = LONGEST_STRIDE if s["law"] >= 0 else 1
        end = max(int(s["leap_end"]), int(s["time"]) + (go << STEP))
        return end * float(self._par[0]["tick"])

    def grid_point_after(self, state: State, t: float) -> float:
        """First tick at or after `t` [s]."""
        tick = float(self._par[0]["tick"])
        return math.ceil(t / tick - TICK_ROUNDING) * tick
