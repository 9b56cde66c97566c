"""The travelling-wave solver: sizes, packing, saving and reading a state."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from percussion_model.core.advance import GRID_ROUNDING, run
from percussion_model.core.contact_leap import WATCHED
from percussion_model.core.kernel import entry_of
from percussion_model.core.records import (
    BLOW,
    EVENT,
    LEDGER_FIELDS,
    SAMPLE_FIELDS,
    Status,
)
from percussion_model.core.totals import begin, lost_in_faces, resync, stored_energy
from percussion_model.core.wave_records import Coef, Row, Task
from percussion_model.scene_rules import BarNumbers, SceneRules
from percussion_model.solvers.bar_cells import cut_bars
from percussion_model.solvers.grid import Grid, section_count
from percussion_model.solvers.operators import LEVELS, leap_operators, padded
from percussion_model.solvers.packing import (
    INPUT_FIELDS,
    begin_state,
    pack_parameters,
    rock_numbers,
)
from percussion_model.solvers.step_map import no_operators
from percussion_model.solvers.wave_state import WORD, WaveState

DONE = int(Status.DONE)
EVENTS_ON, LEAP_END, T_BASE = WORD["events_on"], WORD["leap_end"], WORD["t_base"]
N_BLOWS, N_EVENTS = WORD["n_blows"], WORD["n_events"]


class WaveSolver:
    """Method of characteristics for a scene with an elastic bit.

    Parameters
    ----------
    scene : SceneRules

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

    def __init__(self, scene: SceneRules) -> None:
        self.scene = scene
        bars = cut_bars(scene)
        self.time_step = bars.time_step
        self._bit, self._cb = bars.bit.grid, bars.bit.coefficients
        self._piston: Grid | None = None
        self._cp = np.zeros((len(Coef), 1))
        if bars.piston is not None:
            self._piston, self._cp = bars.piston.grid, bars.piston.coefficients
        self.cells = {"bit": self._bit.n}
        if self._piston is not None:
            self.cells = {"piston": self._piston.n, **self.cells}
        self.wave_speed_error = max(bar.grid.fit for bar in bars.both)
        self._par = pack_parameters(scene, bars)
        found = None
        if scene.solver.leaps:
            found = leap_operators(self._par, self._piston, self._cp, self._bit, self._cb)
        if found is not None:
            self._par["leaps"] = LEVELS
        self._operators = no_operators() if found is None else found.arrays
        size = padded(2 * max(self._bit.n, self._piston.n if self._piston else 0) + 1)
        self._scratch = np.zeros((3, max(size, WATCHED)))
        self._entry: Callable[..., int] = entry_of(run)
        self._no_row = np.zeros(len(SAMPLE_FIELDS))
        self._no_blows = np.zeros(1, BLOW)
        self._no_events = np.zeros(1, EVENT)

    def derive(self, state: WaveState) -> None:
        """Derive the mean velocities and u_r of a state whose gap and waves were set."""
        wp, wb = state.bars
        resync(self._par[0], state.record[0], wp, self._cp, wb, self._cb)

    @property
    def place_of_closure(self) -> float:
        """Share of a step after which a closure comes best (docs/numerics.md, eq. 14b)."""
        return float(self._par[0]["front"])

    @property
    def static_wave(self) -> np.ndarray:
        """Down-going wave of a bit at rest under unit body acceleration, by cell [s]."""
        return self._cb[Coef.STATIC, : self._bit.n]

    def new_state(self) -> WaveState:
        """State at time zero."""
        scene, start = self.scene, self.scene.start
        n_p = self._piston.n if self._piston is not None else 0
        state = WaveState.zero(n_p, self._bit.n)
        begin_state(state, scene, rock_numbers(scene))
        state["leap_end"] = -1
        state["v_p"] = start.piston_velocity if scene.piston.model != "absent" else 0.0
        state["v_b"] = start.bit_velocity
        wp, wb = state.bars
        wb[Row.DOWN : Row.UP + 1, : self._bit.n] = 0.5 * start.bit_velocity
        if n_p:
            wp[Row.DOWN : Row.UP + 1, :n_p] = 0.5 * start.piston_velocity
        entry_of(begin)(self._par, state.record, wp, self._cp, wb, self._cb)
        return state

    def _stored(self, state: WaveState) -> tuple[float, float, float]:
        wp, wb = state.bars
        return stored_energy(self._par[0], state.record[0], wp, self._cp, wb, self._cb)

    def _run(
        self,
        task: Task,
        state: WaveState,
        time: float,
        blows: np.ndarray | None = None,
        events: np.ndarray | None = None,
        row: np.ndarray | None = None,
    ) -> int:
        """Call the kernels; see `core.advance.run`."""
        wp, wb = state.bars
        status = self._entry(
            int(task),
            self._par,
            state.record,
            wp,
            self._cp,
            wb,
            self._cb,
            self._operators,
            *self._scratch,
            time,
            self._no_blows if blows is None else blows,
            self._no_events if events is None else events,
            self._no_row if row is None else row,
        )
        if self._entry is run:  # compiled just now; the types of all these never change
            self._entry = entry_of(run)
        return int(status)

    def time(self, state: WaveState) -> float:
        """Time up to which the state is committed [s]."""
        return self._time_of(state, int(state.words[WORD["step"]]))

    def readable_until(self, state: WaveState) -> float:
        """Time up to which `sample` answers without advancing the state [s]."""
        words = state.words
        return self._time_of(state, max(int(words[WORD["leap_end"]]), int(words[WORD["step"]]) + 1))

    def grid_point_after(self, state: WaveState, t: float) -> float:
        """First grid point at or after `t` [s]."""
        base = float(state.numbers[WORD["t_base"]])
        return self._time_of(state, int(np.ceil((t - base) / self.time_step - GRID_ROUNDING)))

    def _time_of(self, state: WaveState, step: int) -> float:
        return float(state.numbers[WORD["t_base"]]) + step * self.time_step

    def advance(
        self,
        state: WaveState,
        t: float,
        blows: np.ndarray,
        events: np.ndarray,
        record_events: bool = False,
    ) -> tuple[int, int, int]:
        """Commit the state up to `t`; see `core.advance.advance`.

        Returns
        -------
        status, n_blows, n_events : int
        """
        words = state.words
        leap_end = words[LEAP_END]
        if leap_end >= 0:
            # as the kernel would find out, at a tenth of the cost
            steps = (t - float(state.numbers[T_BASE])) / self.time_step + GRID_ROUNDING
            if steps < leap_end:
                words[N_BLOWS] = words[N_EVENTS] = 0
                return DONE, 0, 0
        words[EVENTS_ON] = record_events
        status = self._run(Task.ADVANCE, state, t, blows, events)
        return status, int(words[N_BLOWS]), int(words[N_EVENTS])

    def sample(self, state: WaveState, times: np.ndarray, out: np.ndarray) -> None:
        """Evaluate at `times` without touching the state (`SAMPLE_FIELDS`)."""
        for k, time in enumerate(times):
            self.look(state, float(time), out[k])

    def look(
        self,
        state: WaveState,
        t: float,
        row: np.ndarray,
        here: WaveState | None = None,
        peaks: bool = True,
    ) -> WaveState:
        """Evaluate at `t` into a row (`LONG_SAMPLE_FIELDS`, or their beginning).

        Parameters
        ----------
        here : WaveState, optional
            An old copy to be used again.
        peaks : bool
            Whether the peaks of a long row are wanted: in standstill they are dear.

        Returns
        -------
        WaveState
            A copy whose waves are those of the last grid point up to `t`, as
            `fields` reads them.
        """
        if here is None:
            here = state.copy()
        else:
            here.take(state)
        if not peaks:
            here.numbers[WORD["peak_from"]] = np.inf
        self._run(Task.SAMPLE, here, t, row=row)
        return here

    def watch_peaks(self, state: WaveState, t: float) -> None:
        """Count the peak forces of `look` from `t` on [s]."""
        numbers = state.numbers
        numbers[WORD["peak_from"]] = t
        numbers[WORD["peak_bit"]] = numbers[WORD["peak_contact"]] = 0.0

    def commit(
        self,
        state: WaveState,
        t: float,
        blows: np.ndarray | None = None,
        events: np.ndarray | None = None,
        record_events: bool = False,
    ) -> tuple[int, int, int]:
        """Bring the state to the first grid point at or after `t`; nothing happens meanwhile."""
        return self._run(Task.BRING, state, self.grid_point_after(state, t)), 0, 0

    def set_inputs(self, state: WaveState, **inputs: float) -> None:
        """Change inputs of a committed state; rock inputs wait for the next cycle."""
        for key, value in inputs.items():
            state.record[0][INPUT_FIELDS[key]] = value

    def energy(self, state: WaveState, t: float) -> dict[str, float]:
        """Ledger [J] at the last grid point before `t`."""
        here = state.copy()
        self._run(Task.BRING, here, t)
        s = here.record[0]
        wp, wb = here.bars
        entries = {name: float(s[f"e_{name}"]) for name in LEDGER_FIELDS}
        entries["loss"] += lost_in_faces(self._par[0], wp, wb)
        kinetic, elastic, rock = self._stored(here)
        entries |= {"start": float(s["e_start"]), "kinetic": kinetic, "elastic": elastic}
        entries["recoverable"] = rock
        return entries

    def fields(self, state: WaveState) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] of each cell, top to bottom, by bar."""
        wp, wb = state.bars
        r = 2 * int(state.record[0]["parity"])
        out = {}
        for name, w, grid in (("piston", wp, self._piston), ("bit", wb, self._bit)):
            if grid is not None:
                d, u = w[r, : grid.n], w[r + 1, : grid.n]
                out[f"{name}_force"] = grid.impedance * (d - u)
                out[f"{name}_velocity"] = d + u
        return out

    def force_in(self, state: WaveState, bar: str, cell: int) -> float:
        """Force in one cell of "piston" or "bit" [N], as `fields` reads it."""
        grid = self.grid_of(bar)
        if grid is None:
            return 0.0
        w = state.bars[bar == "bit"]
        r = 2 * int(state.words[WORD["parity"]])
        return float(grid.impedance[cell] * (w[r, cell] - w[r + 1, cell]))

    def grid_of(self, bar: str) -> Grid | None:
        """Cells of "piston" or "bit", None where it has none."""
        return {"piston": self._piston, "bit": self._bit}[bar]

    def section_cells(self, bar: BarNumbers) -> list[int]:
        """Cells in each section of an elastic bar."""
        return [section_count(section, self.time_step) for section in bar.sections]

    def statistics(self, state: WaveState) -> dict[str, int]:
        """Counts of what the solver did."""
        s = state.record[0]
        names = ("steps", "leaps", "leap_steps", "wakes", "events", "blows")
        return {name: int(s[f"count_{name}"]) for name in names} | {"locked": int(s["locked"])}
