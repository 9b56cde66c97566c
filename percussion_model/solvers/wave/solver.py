"""The travelling-wave solver: packing, and its kernels on a state."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import (
    BLOW,
    EVENT,
    LEDGER_FIELDS,
    SAMPLE_FIELDS,
    Status,
)
from percussion_model.scene.scene import Scene
from percussion_model.solvers.wave.advance import GRID_ROUNDING, run
from percussion_model.solvers.wave.leaps.contact_leap import WATCHED
from percussion_model.solvers.wave.leaps.operators import LEVELS, leap_operators, padded
from percussion_model.solvers.wave.leaps.step_map import no_operators
from percussion_model.solvers.wave.packing import (
    INPUT_FIELDS,
    begin_state,
    pack_parameters,
    rock_numbers,
)
from percussion_model.solvers.wave.records import Row, Task
from percussion_model.solvers.wave.state import WORD, WaveState
from percussion_model.solvers.wave.totals import begin, lost_in_faces, resync, stored_energy
from percussion_model.solvers.wave.wave_bars import WaveBars

DONE = int(Status.DONE)
EVENTS_ON, LEAP_END, T_BASE = WORD["events_on"], WORD["leap_end"], WORD["t_base"]
N_BLOWS, N_EVENTS = WORD["n_blows"], WORD["n_events"]


class WaveSolver(WaveBars):
    """Method of characteristics for a scene with an elastic bit.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    time_step, cells, wave_speed_error
        As in `WaveBars`.
    """

    name = "wave"

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._par = pack_parameters(scene, self._bars)
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
