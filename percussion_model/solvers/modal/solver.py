"""Modal solver: stepped bars of any lengths by their normal modes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import numpy as np

from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import Piston, RockKind
from percussion_model.scene.bar_groups import Bar
from percussion_model.scene.bars import bar_transit_time
from percussion_model.scene.numbers import Numbers, numbers_of
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.modal.advance import TICK_ROUNDING, run
from percussion_model.solvers.modal.fields import Places
from percussion_model.solvers.modal.lanes import WIDTH
from percussion_model.solvers.modal.laws import laws_of
from percussion_model.solvers.modal.leaps import LONGEST
from percussion_model.solvers.modal.modes import Modes
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
    Shape,
    Task,
)
from percussion_model.solvers.modal.resolution import (
    COARSER,
    asked_modes,
    coarser_modes,
    default_modes,
)
from percussion_model.solvers.modal.tables import end_compliance, forms_of, piston_tables
from percussion_model.solvers.setup import (
    PISTONS,
    fill_parameters,
    fill_start,
    kelvin_voigt_time,
    rock_numbers,
)
from percussion_model.solvers.state import State, aligned


class Tables(NamedTuple):
    """What scenes of the same bars and rock share."""

    forms: Forms
    modes: list[Modes]
    free_piston: Modes | None
    shape_p: np.ndarray
    move_p: np.ndarray
    laws: Laws


# Tables that were made last; so many are kept.
_kept: dict[tuple[Any, ...], Tables] = {}
MOST_KEPT = 4


def _tables(
    numbers: Numbers, mass: float, springs: tuple[float, float], c_r: float, highest: float,
    tick: float,
) -> Tables:  # fmt: skip
    """Make the tables of a scene, or find them."""
    elastic = mass > 0.0 and PISTONS[numbers.values.piston_model] == Piston.ELASTIC
    piston, bit, eta = numbers.piston if elastic else None, numbers.bit, kelvin_voigt_time(numbers)
    bytes_ = bit.tobytes(), None if piston is None else piston.tobytes()
    key = (*bytes_, mass, springs, c_r, highest, tick, eta)
    if key not in _kept:
        while len(_kept) >= MOST_KEPT:
            del _kept[next(iter(_kept))]
        forms, modes, free = forms_of(bit, piston, mass, springs, highest, eta, tick)
        laws = Laws(*map(aligned, laws_of(forms, c_r, eta, tick)))
        shape_p, move_p = map(aligned, piston_tables(free, eta, tick))
        forms = Forms(*map(aligned, forms))
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
        self._numbers = numbers = numbers_of(scene)
        self._par = np.zeros(1, MODAL_PAR)
        p: Any = self._par[0]
        fill_parameters(p, numbers, True)
        elastic = p["piston"] == Piston.ELASTIC
        first = bar_transit_time(numbers.piston if elastic else numbers.bit)
        eta = kelvin_voigt_time(numbers)
        self.modes = asked_modes(numbers)
        p["dt"] = self.time_step = first / self.modes
        p["tick"] = tick = self.time_step / (1 << STEP)
        # a period of the highest of few modes; a rigid piston pushes hardest at once
        p["window"] = (2.0 if elastic else 1.0) * first / default_modes(numbers)
        highest = math.pi / self.time_step
        rock = rock_numbers(numbers)
        kind = p["rock"]
        springs = (
            rock.k_r if kind in (RockKind.BILINEAR, RockKind.SPRING) else 0.0,
            rock.gamma * rock.k_r if kind == RockKind.BILINEAR else 0.0,
        )
        mass = 0.0 if p["piston"] == Piston.ABSENT else float(p["mass_p"])
        leaps = bool(numbers.values.solver_leaps and not p["effects"])
        self._tables = made = _tables(numbers, mass, springs, rock.c_r, highest, tick)
        p["transit"] = int(bar_transit_time(numbers.bit) / tick)
        self.cells = {} if made.free_piston is None else {"piston": made.shape_p.shape[1]}
        self.cells["bit"] = int(made.forms.sizes[0])
        if p["piston"] == Piston.ABSENT:
            p["mass_p"] = 0.0
        else:
            p["start_gap"] = scene.start.gap
        p["bound_p"] = math.sqrt(end_compliance(numbers.piston)) if elastic else 0.0
        p["bound_b"] = math.sqrt(end_compliance(numbers.bit))
        p["bound_t"] = math.sqrt(end_compliance(numbers.bit[::-1]))
        p["k_r"], p["gamma"], p["c_r"] = rock.k_r, rock.gamma, rock.c_r
        p["eta"] = eta
        p["leaps"] = leaps
        self.operator_bytes = sum(part.nbytes for part in (*made.forms, *made.laws))
        self._rows = aligned(np.zeros((8, max(made.forms.shape.shape[2], 2 * SCAN))))
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
        shape = made.forms.shape[form]
        # about rest, whose force is known in closed form
        moving = w[:2].copy()
        moving[0, : s["active"]] -= (shape[Shape.SOFT] * w[2])[: s["active"]]
        loads = {"piston": float(s["a_p"]), "bit": float(s["a_b"])}
        whole = float(par["mass_b"]) + (float(par["mass_p"]) if joined else 0.0)
        if made.forms.stiff[form] == 0.0:
            pull = float(par["mass_b"]) * loads["bit"]
            pull += float(par["mass_p"]) * loads["piston"] if joined else 0.0
            loads = {name: a - pull / whole for name, a in loads.items()}
        for name in self.cells:
            first, modes, own, mean, held = 0, made.modes[form], moving, 0.0, 0.0
            if name == "piston" and not joined:
                free = made.free_piston
                assert free is not None
                own = np.concatenate([np.zeros((2, 1)), wp], axis=1)
                modes, mean, loads["piston"] = free, float(s["v_p"]), 0.0
            elif name == "bit" and joined:
                first = 0 if made.free_piston is None else len(self._numbers.piston)
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
        s: Any = state.record[0]
        fill_start(s, self._numbers)
        s["leap_end"] = s["law"] = -1
        s["v_low"] = s["v_b"]
        s["alert"] = 1
        s["active"] = made.forms.sizes[0]
        w, root = state.arrays[0], math.sqrt(self._par[0]["mass_b"])
        w[1, 0] = root * s["v_b"]
        if self._par[0]["piston"] != Piston.ABSENT:
            s["u_p"] = -s["gap"]
            s["u_r"] = s["u_p"]
        # as kernels add it up, to the last bit
        s["e_start"] = 0.5 * (w[1, 0] * w[1, 0])
        s["e_start"] += 0.5 * self._par[0]["mass_p"] * s["v_p"] * s["v_p"]
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
        s, sizes = state.record[0], self._tables.forms.sizes
        now, end, begin = int(s["time"]), int(s["leap_end"]), int(s["piston_time"])
        modes = int(sizes[int(s["form"])])
        if not 0 < s["active"] <= modes or s["active"] % WIDTH:
            return f"active = {int(s['active'])}, of {modes} modes"
        if (s["form"] >= JOINED) != (s["closed"] == 1):
            return f"form = {int(s['form'])}, with closed = {int(s['closed'])}"
        law, pairs = int(s["law"]), int(s["pairs"])
        if law >= 0 and law // 2 != s["form"]:
            return f"law = {law}, in form {int(s['form'])}"
        if law >= 0 and not 0 < pairs <= self._tables.laws.sizes[law]:
            return f"pairs = {pairs}, in law {law}"
        if pairs % WIDTH:
            return f"pairs = {pairs}, which is no multiple of {WIDTH}"
        if end >= 0 and law < 0:
            return f"leap_end = {end}, with law = {law}"
        if end >= 0 and not now < end <= now + LONGEST:
            return f"leap_end = {end}, at {now} with leaps of {LONGEST} ticks at most"
        if s["parked"] and not begin <= now:
            return f"piston_time = {begin}, after {now}"
        most = max(now + (LONGEST_STRIDE << STEP), end) * float(self._par[0]["tick"])
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
        go = LONGEST_STRIDE if s["law"] >= 0 else 1
        end = max(int(s["leap_end"]), int(s["time"]) + (go << STEP))
        return end * float(self._par[0]["tick"])

    def grid_point_after(self, state: State, t: float) -> float:
        """First tick at or after `t` [s]."""
        tick = float(self._par[0]["tick"])
        return math.ceil(t / tick - TICK_ROUNDING) * tick
