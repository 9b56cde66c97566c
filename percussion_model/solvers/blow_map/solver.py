"""Solver that takes blows out of a table and flies between them in closed form."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from percussion_model.physics.kernel import entry_of
from percussion_model.physics.records import (
    BLOW,
    EVENT,
    LEDGER_FIELDS,
    LONG_SAMPLE_FIELDS,
    STORED_FIELDS,
    Status,
)
from percussion_model.scene.rules import SceneError
from percussion_model.solvers.blow_map import advance as kernel
from percussion_model.solvers.blow_map.flight import commit, plan_next
from percussion_model.solvers.blow_map.records import BLOW_PAR, BLOW_STATE, ENTRIES
from percussion_model.solvers.blow_map.refusals import explain_refusal
from percussion_model.solvers.blow_map.sample import read
from percussion_model.solvers.blow_map.table import BlowTable, fixed_values

if TYPE_CHECKING:
    from percussion_model.scene.rules import BarNumbers, SceneRules

# Place of a field in a state.
WORD = {name: int(place[1]) // 8 for name, place in (BLOW_STATE.fields or {}).items()}
T, T_NEXT, PEAK_FROM = WORD["t"], WORD["t_next"], WORD["peak_from"]
PEAK_BIT, PEAK_CONTACT = WORD["peak_bit"], WORD["peak_contact"]

# Inputs and the fields that hold them; the rest of the rock law is fixed in the table.
_INPUTS = {
    "feed_force": WORD["feed"],
    "drive_force": WORD["drive_force"],
    "reversal_distance": WORD["reversal"],
    "loading_stiffness": WORD["k_r"],
}
# Those that the flight follows; the others count at the next blow.
_FLIGHT = frozenset({"drive_force", "reversal_distance"})
_FIXED = {
    "unloading_ratio": "rock.unloading_ratio",
    "barrier_damping": "rock.barrier_damping",
    "barrier_energy": "rock.barrier_energy",
}
# A bit that hangs further above the rock at the start does not stand on it [m].
MOST_ROCK_GAP = 1e-3


class MapState:
    """State between blows: one record, which is quick to copy as numbers."""

    __slots__ = ("numbers", "record", "workspace")

    def __init__(self, numbers: np.ndarray) -> None:
        self.numbers = numbers
        self.record = numbers.view(BLOW_STATE)
        self.workspace = np.zeros(0)

    def copy(self) -> MapState:
        """An independent copy."""
        return MapState(self.numbers.copy())

    def take(self, other: MapState) -> None:
        """Become a copy of another state."""
        self.numbers[:] = other.numbers

    def __reduce__(self) -> tuple[object, ...]:
        return MapState, (self.numbers,)


class BlowMapSolver:
    """Blow map of a scene (docs/fidelity.md).

    Parameters
    ----------
    scene : SceneRules
        With `solver.fidelity = "blow-map"`.
    table : BlowTable
        Made for the scene.

    Raises
    ------
    SceneError
        If the table was made for another scene, or the scene does not start on the rock.
    """

    name = "blow-map"
    time_step: float | None = None

    def __init__(self, scene: SceneRules, table: BlowTable) -> None:
        table.refuse_other(fixed_values(scene))
        if not scene.start.rock_gap <= MOST_ROCK_GAP or scene.start.bit_velocity != 0.0:
            raise SceneError(
                f"start.rock_gap = {scene.start.rock_gap!r} m, start.bit_velocity = "
                f"{scene.start.bit_velocity!r} m/s: the blow map needs a bit that stands on "
                f"the rock, within {MOST_ROCK_GAP:g} m and at 0 m/s"
            )
        self.scene = scene
        self.table = table
        self.cells = dict(table.cells)
        self.wave_speed_error = table.wave_speed_error
        self._values = table.values
        self._par = self._parameters()
        self._found = np.zeros(ENTRIES)
        self._counts = np.zeros(2, np.int64)
        self._advance: Callable[..., int] = kernel.advance
        self._read: Callable[..., None] = read
        self._move: Callable[..., None] = commit
        self._plan_next: Callable[..., None] = plan_next
        self._load_kernels()

    def _load_kernels(self) -> None:
        """Have the kernels compiled, and called without a look at types that never change."""
        state = self.new_state()
        state.numbers[T_NEXT] = np.inf
        self._call(state, 0.0, np.zeros(1, BLOW), np.zeros(1, EVENT), False)
        self._read(self._par, state.record, 0.0, np.zeros(len(LONG_SAMPLE_FIELDS)))
        self.commit(state, 0.0)
        self._advance, self._read = entry_of(kernel.advance), entry_of(read)
        self._move, self._plan_next = entry_of(commit), entry_of(plan_next)

    def _parameters(self) -> np.ndarray:
        par = np.zeros(1, BLOW_PAR)
        p = par[0]
        scene = self.scene
        p["mass_p"], p["mass_b"] = scene.piston.mass, scene.bit.mass
        p["gravity"] = scene.gravity.acceleration if scene.effects.gravity else 0.0
        p["gamma"] = scene.rock.unloading_ratio
        p["gap"] = scene.start.gap
        p["lowest"], p["highest"] = self.table.lowest, self.table.highest
        p["origin"], p["step"] = self.table.origin, self.table.step
        return par

    def new_state(self) -> MapState:
        """State at time zero: the bit stands on the rock, the piston flies."""
        scene, start = self.scene, self.scene.start
        state = MapState(np.zeros(BLOW_STATE.itemsize // 8))
        s = state.record[0]
        s["feed"] = scene.feed.force if scene.effects.feed else 0.0
        s["drive_force"] = scene.drive.force
        s["reversal"] = scene.drive.reversal_distance
        s["k_r"] = scene.rock.loading_stiffness
        s["y"] = -start.gap
        s["v"] = start.piston_velocity
        s["alpha"] = start.drive_direction
        s["x_rest"] = start.rock_gap
        s["b_rebound"] = np.nan
        s["peak_from"] = np.inf
        par = self._par[0]
        static = s["feed"] + par["mass_b"] * par["gravity"]
        s["e_start"] = 0.5 * par["mass_p"] * s["v"] ** 2
        s["e_start"] += static**2 / (2.0 * par["gamma"] * s["k_r"])
        self._plan(state)
        return state

    def _plan(self, state: MapState) -> None:
        self._plan_next(self._par, state.record)

    def time(self, state: MapState) -> float:
        """Start of the present piece of flight [s]."""
        return float(state.numbers[T])

    def advance(
        self,
        state: MapState,
        t: float,
        blows: np.ndarray,
        events: np.ndarray,
        record_events: bool = False,
    ) -> tuple[int, int, int]:
        """Let all that happens up to `t` happen.

        Returns
        -------
        status, n_blows, n_events : int
        """
        if state.numbers[T_NEXT] > t:
            return Status.DONE, 0, 0
        status = self._call(state, t, blows, events, record_events)
        return status, int(self._counts[0]), int(self._counts[1])

    def _call(
        self, state: MapState, t: float, blows: np.ndarray, events: np.ndarray, events_on: bool
    ) -> int:
        return int(
            self._advance(
                self._par,
                state.record,
                self._values,
                self._found,
                float(t),
                blows,
                events,
                bool(events_on),
                self._counts,
            )
        )

    def refusal(self, state: MapState) -> str:
        """Say why the map did not answer."""
        return explain_refusal(self.table, state.record[0])

    def sample(self, state: MapState, times: np.ndarray, out: np.ndarray) -> None:
        """Evaluate at `times` without touching the state (`SAMPLE_FIELDS`)."""
        for k, time in enumerate(times):
            self.look(state, float(time), out[k])

    def look(
        self, state: MapState, t: float, row: np.ndarray, here: Any = None, peaks: bool = True
    ) -> MapState:
        """Evaluate at `t` into a row (`LONG_SAMPLE_FIELDS`, or their beginning).

        Returns
        -------
        MapState
            The state itself: reading moves nothing.
        """
        self._read(self._par, state.record, t, row)
        return state

    def fields(self, state: MapState) -> dict[str, np.ndarray]:
        """The table has no stress."""
        return {}

    def force_in(self, state: MapState, bar: str, cell: int) -> float:
        """The table has no stress."""
        return 0.0

    def grid_of(self, bar: str) -> None:
        """The table has no stress."""

    def watch_peaks(self, state: MapState, t: float) -> None:
        """Count the peak forces of `look` from `t` on [s]."""
        numbers = state.numbers
        numbers[PEAK_FROM] = t
        numbers[PEAK_BIT] = numbers[PEAK_CONTACT] = 0.0

    def commit(
        self,
        state: MapState,
        t: float,
        blows: np.ndarray | None = None,
        events: np.ndarray | None = None,
        record_events: bool = False,
    ) -> tuple[int, int, int]:
        """Start a new piece of flight at `t`, so that inputs can change."""
        self._move(self._par, state.record, float(t))
        return Status.DONE, 0, 0

    def set_inputs(self, state: MapState, **inputs: float) -> None:
        """Change inputs of a committed state.

        The drive acts at once, feed and rock from the next blow on. The other numbers of
        the rock law are fixed in the table: `SceneError` if one of them differs.
        """
        for name, value in inputs.items():
            if name in _FIXED and value != self.table.fixed[_FIXED[name]]:
                raise SceneError(
                    f"{_FIXED[name]} = {value!r}: the blow map was made for "
                    f"{self.table.fixed[_FIXED[name]]!r} and holds for that alone"
                )
        for name, value in inputs.items():
            if name in _INPUTS:
                state.numbers[_INPUTS[name]] = value
        if not _FLIGHT.isdisjoint(inputs):
            self._plan(state)

    def grid_point_after(self, state: MapState, t: float) -> float:
        """First time at or after `t` at which inputs can change: `t` itself [s]."""
        return t

    def readable_until(self, state: MapState) -> float:
        """Time up to which `sample` answers without advancing the state [s]."""
        return float(np.nextafter(state.numbers[T_NEXT], 0.0))

    def energy(self, state: MapState, t: float) -> dict[str, float]:
        """Ledger at `t` [J]: LEDGER_FIELDS, start, stored."""
        row = np.zeros(len(LONG_SAMPLE_FIELDS))
        self.look(state, t, row)
        found = dict(zip(LONG_SAMPLE_FIELDS, row.tolist(), strict=True))
        return {name: found[name] for name in (*LEDGER_FIELDS, *STORED_FIELDS)}

    def section_cells(self, bar: BarNumbers) -> list[int]:
        """Cells belong to the waves that made the table."""
        return []

    def statistics(self, state: MapState) -> dict[str, int]:
        """Counts of what the solver did."""
        s = state.record[0]
        return {name: int(s[f"count_{name}"]) for name in ("events", "blows")}
