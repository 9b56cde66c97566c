"""Motion of the hammer, as a communication step sees it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_src.slave.states import StateError
from percussion_model.physics.ledger import unexplained
from percussion_model.physics.records import (
    BLOW,
    LEDGER_FIELDS,
    PEAK_FIELDS,
    READING,
    READING_FIELDS,
    STORED_FIELDS,
    Mode,
)
from percussion_model.physics.state import LARGEST, MOST
from percussion_model.scene.scene import Scene
from percussion_model.simulation.runner import Runner
from percussion_model.solvers.base import Solver
from percussion_model.solvers.state import State

COUNTS_OF_BLOW = tuple(name for name in BLOW.names or () if BLOW[name].kind == "i")
NUMBERS_OF_BLOW = tuple(name for name in BLOW.names or () if name not in COUNTS_OF_BLOW)
AT = {name: k for k, name in enumerate(READING_FIELDS)}
LEDGER = (*LEDGER_FIELDS, *STORED_FIELDS)  # the last fields of a reading
PEAKS = slice(AT[PEAK_FIELDS[0]], AT[PEAK_FIELDS[-1]] + 1)
IMPULSES = ("bit_impulse", "contact_impulse", "drive_impulse")
FORCES = tuple(AT[name] for name in ("bit_force", "contact_force", "drive_force"))
# An impulse below this in a communication step is no contact [N s].
NO_CONTACT = 1e-9
# A rate holds for this many periods after the last blow, then falls towards 0.
PERIODS_HELD = 2.0
# In a shorter step, about a tick of the solver, forces stay: means, and peaks at least, are those
# at its end. A difference of two impulses would have few digits left [s].
INSTANT = 1e-8


@dataclass(frozen=True)
class Gauge:
    """Where stress is read: a cell of a bar."""

    bar: str
    cell: int
    area: float


class Motion(Runner):
    """A state with what the last communication step left behind.

    Parameters
    ----------
    scene : Scene
    solver : Solver or None
        One that was made for an equal scene.
    """

    def __init__(self, scene: Scene, solver: Solver | None) -> None:
        super().__init__(scene, record_events=False, solver=solver)
        self.scene = scene
        self.gauge: Gauge | None = None
        self.row_of_blow = np.zeros(1, BLOW)  # the last whole one
        self.blow = self._numbers_of_blow()
        self.blow_count = 0
        self.step_size = 0.0
        self.reading = np.zeros(1, READING)
        self.row = self.reading.view(np.float64)
        self.numbers: list[float] = []  # the same as plain numbers
        self._is_read = self._has_peaks = False
        self._here: State | None = None  # copy of the state that belongs to `row`
        self._stress: float | None = None
        # impulses at the start of the last step, or the state from which they follow
        self._before = np.zeros(len(IMPULSES))
        self._left: tuple[State, float] | None = None
        # old copies to be used again
        self._spare: State | None = None
        self._spare_of_peaks: State | None = None
        self._other = np.zeros(1, READING)  # what is read beside the present

    def _keep(self, blows: np.ndarray, events: np.ndarray) -> None:
        if len(blows):
            self.row_of_blow[0] = blows[-1]
            self.blow = self._numbers_of_blow()
            self.blow_count += len(blows)

    def _numbers_of_blow(self) -> dict[str, float]:
        """Last row as plain numbers; what is undefined is 0."""
        names = BLOW.names or ()
        row = dict(zip(names, self.row_of_blow[0].item(), strict=True))
        return {name: float(value) if value == value else 0.0 for name, value in row.items()}

    def advance_to(self, t: float, step_size: float, inputs: dict[str, float]) -> None:
        """Change inputs, which are allowed and act, and advance to `t` [s]."""
        if self._is_read:
            self._before, self._left = self._impulses(self.row), None
        else:
            self._spare = self._state.copy(self._spare)
            self._left = (self._spare, self.time)
        self.solver.reset_peaks(self._state, self.time)
        if inputs:
            self._commit_inputs(inputs)
        t = max(t, self.time)
        self._advance_solver(t)
        self._time = t
        self.step_size = step_size
        self._is_read = False

    def save(self) -> bytes:
        """What `restore` needs beside times and the number of blows.

        What is read of a state is no part of it: the same state gives the same bits again.
        """
        return b"".join(map(np.ndarray.tobytes, self._arrays(self.before(), self.row_of_blow)))

    def restore(
        self, time: float, step_size: float, blow_count: int, saved: bytes, own: bool
    ) -> None:
        """Go back to a state: all of it or, with an error, nothing.

        Parameters
        ----------
        time, step_size : float
            Present time, and size of the last step [s].
        saved : bytes
        own : bool
            Whether it was made in this process; else nothing is known of it.
        """
        before, row_of_blow = np.zeros(len(IMPULSES)), np.zeros(1, BLOW)
        state = self._state.copy()
        arrays = self._arrays(before, row_of_blow, state)
        if sum(array.nbytes for array in arrays) != len(saved):
            raise StateError("the saved state does not fit the solver")
        start = 0
        for array in arrays:
            array.view(np.uint8)[:] = np.frombuffer(saved, np.uint8, array.nbytes, start)
            start += array.nbytes
        if not own:
            self._refuse_state(state, time)
            self._refuse_row(before, row_of_blow)
        self._state, self._before, self.row_of_blow = state, before, row_of_blow
        self._time, self.step_size, self.blow_count = time, step_size, blow_count
        self.blow = self._numbers_of_blow()
        self._left, self._is_read = None, False

    @staticmethod
    def _refuse_row(before: np.ndarray, row_of_blow: np.ndarray) -> None:
        row = row_of_blow[0]
        counts = [int(row[name]) for name in COUNTS_OF_BLOW]
        found = [float(row[name]) for name in NUMBERS_OF_BLOW]
        if not np.isfinite(before).all() or not all(abs(x) <= LARGEST or x != x for x in found):
            raise StateError("the saved state has an impulse or a last blow that is not finite")
        if not all(0 <= count <= MOST for count in counts):
            raise StateError(f"the saved state has a last blow with counts of {counts}")

    def _arrays(
        self, before: np.ndarray, row_of_blow: np.ndarray, state: State | None = None
    ) -> list[np.ndarray]:
        state = state or self._state
        return [before, row_of_blow, state.words, state.workspace]

    @staticmethod
    def _impulses(row: np.ndarray) -> np.ndarray:
        first = AT[IMPULSES[0]]  # they stand side by side
        return row[first : first + len(IMPULSES)].copy()

    def _evaluate(
        self, state: State, t: float, reading: np.ndarray, spare: State | None, peaks: bool
    ) -> State:
        # After a change of inputs a state may lie a step ahead.
        t = max(t, self.solver.time(state))
        return self.solver.read(state, t, reading, None if spare is state else spare, peaks)

    def read(self) -> list[float]:
        """What it is like now (`READING_FIELDS`) but for the peaks; 0 where undefined."""
        if not self._is_read:
            self._here = self._evaluate(self._state, self.time, self.reading, self._here, False)
            self._take_row()
            self._stress, self._has_peaks = None, False
        return self.numbers

    def peaks(self) -> list[float]:
        """Greatest bit and contact force in the last step [N]."""
        self.read()
        if not self._has_peaks:
            self._spare_of_peaks = self._evaluate(
                self._state, self.time, self._other, self._spare_of_peaks, True
            )
            found = self._other.view(np.float64)[PEAKS]
            if 0.0 < self.step_size < INSTANT:
                found = np.fmax(found, self.row[list(FORCES[: len(found)])])
            self.row[PEAKS] = found
            self.numbers[PEAKS] = found.tolist()
            self._has_peaks = True
        return self.numbers[PEAKS]

    def _take_row(self) -> None:
        # without a piston its numbers are undefined
        numbers = self.row.tolist()
        total = sum(numbers)
        if total != total:
            numbers = [value if value == value else 0.0 for value in numbers]
        self.numbers = numbers
        self._is_read = True

    def before(self) -> np.ndarray:
        """Impulses at the start of the last step [N s]."""
        if self._left is not None:
            self._evaluate(*self._left, self._other, None, False)
            self._before, self._left = self._impulses(self._other.view(np.float64)), None
        return self._before

    def mean_force(self, which: int) -> float:
        """Mean over the last step of the force behind one of IMPULSES [N]."""
        if self.step_size == 0.0:
            return 0.0
        if self.step_size < INSTANT:
            return self.read()[FORCES[which]]
        now = self.read()[AT[IMPULSES[which]]]
        return (now - float(self.before()[which])) / self.step_size

    def off_bottom(self) -> bool:
        """Whether the bit met no rock in the last step."""
        now = self.read()
        pushed = now[AT["bit_impulse"]] - self.before()[0]
        return bool(now[AT["drilling_mode"]] == Mode.FF and abs(pushed) < NO_CONTACT)

    def stress(self) -> float:
        """Stress at the gauge at the last grid point, positive in compression [Pa]."""
        self.read()
        if self._stress is None:
            self._stress = 0.0
            if self.gauge is not None and self._here is not None:
                force = self.solver.force_in(self._here, self.gauge.bar, self.gauge.cell)
                self._stress = force / self.gauge.area
        return self._stress

    def residual(self) -> float:
        """Share of the energy put in that the ledger leaves unexplained."""
        residual, scale = unexplained(self._entries())
        return residual / scale if scale > 0.0 else 0.0

    def numerical(self) -> float:
        """Share of the energy put in that the discretisation took."""
        entries = self._entries()
        scale = unexplained(entries)[1]
        return entries["numerical"] / scale if scale > 0.0 else 0.0

    def _entries(self) -> dict[str, float]:
        return dict(zip(LEDGER, self.read()[-len(LEDGER) :], strict=True))

    def rate_decay(self) -> float:
        """Share of the last blow's rate that holds now; falls when blows fail to come."""
        blow = self.blow
        if self.blow_count == 0 or blow["period"] <= 0.0:
            return 0.0
        since = self.time - (blow["time"] + blow["period"])
        late = since / blow["period"] - (PERIODS_HELD - 1.0)
        return min(1.0, 1.0 / late) if late > 0.0 else 1.0
