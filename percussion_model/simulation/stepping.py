"""`Simulation`: a scene that is advanced from time to time, saved and restored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from percussion_model.physics.ledger import complete_ledger, energies
from percussion_model.physics.records import BLOW, EVENT, READING, SAMPLE_FIELDS
from percussion_model.scene.inputs import SimulationError
from percussion_model.scene.scene import Scene
from percussion_model.simulation.result import Result, make_result
from percussion_model.simulation.runner import Runner
from percussion_model.solvers.state import State


@dataclass(frozen=True)
class Snapshot:
    """A saved simulation; opaque, can be pickled."""

    scene: Scene
    time: float
    state: Any
    blows: tuple[np.ndarray, ...]
    events: tuple[np.ndarray, ...]


class Simulation(Runner):
    """A scene that is advanced from time to time, with all that happened.

    Reading is not touching: however an interval is divided into calls of
    `advance`, and whatever is read between them, the bits are the same. Only
    `set_inputs` commits the state, at the next grid point of the solver.

    Parameters
    ----------
    scene : Scene
    record_events : bool
        Whether to keep the event list.
    """

    def __init__(self, scene: Scene, record_events: bool = True) -> None:
        super().__init__(scene, record_events)
        self.scene = scene
        self._blows: tuple[np.ndarray, ...] = ()  # bytes of the rows
        self._events: tuple[np.ndarray, ...] = ()

    def _keep(self, blows: np.ndarray, events: np.ndarray) -> None:
        if len(blows):
            self._blows = _with(self._blows, blows)
        if len(events):
            self._events = _with(self._events, events)

    @property
    def blows(self) -> np.ndarray:
        """Blows finished so far, rows of `BLOW`."""
        self._blows = _joined(self._blows)
        return self._blows[0].copy().view(BLOW) if self._blows else np.zeros(0, BLOW)

    @property
    def events(self) -> np.ndarray:
        """Events so far in the order of time, rows of `EVENT`."""
        self._events = _joined(self._events)
        if not self._events:
            return np.zeros(0, EVENT)
        rows = self._events[0].view(EVENT)
        return rows[np.argsort(rows["time"], kind="stable")]

    def sample(self, times: Any) -> dict[str, np.ndarray]:
        """Advance through rising `times` and tell what it is like at each.

        Parameters
        ----------
        times : array_like
            Not falling, not in the past [s].

        Returns
        -------
        dict of ndarray
            An array for each of `SAMPLE_FIELDS`.
        """
        rows = self.sample_rows(np.atleast_1d(np.asarray(times, dtype=float)))
        return {name: rows[:, k].copy() for k, name in enumerate(SAMPLE_FIELDS)}

    def observe(self) -> dict[str, float]:
        """Tell what it is like now: `SAMPLE_FIELDS`, SI units."""
        self._compile_sample()
        row = np.empty((1, len(SAMPLE_FIELDS)))
        self._read(np.array([self._time]), row)
        return {name: float(row[0, k]) for k, name in enumerate(SAMPLE_FIELDS)}

    def save(self) -> Snapshot:
        """Return a snapshot to go back to; it can be pickled."""
        return Snapshot(self.scene, self._time, self._state.copy(), self._blows, self._events)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot; what follows repeats bit for bit."""
        if not isinstance(snapshot, Snapshot):
            raise SimulationError("not a snapshot made by Simulation.save")
        if snapshot.scene is not self.scene and snapshot.scene != self.scene:
            raise SimulationError("the snapshot is of another scene")
        self._time = snapshot.time
        self._state = snapshot.state.copy()
        self._blows, self._events = snapshot.blows, snapshot.events

    def energy(self) -> dict[str, float]:
        """Energy ledger [J] at the present grid point; see `Result.energy`."""
        return complete_ledger(energies(self._read_state()[0]))

    def fields(self) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] in each cell of the elastic bars, top to bottom.

        At the last grid point up to the present; empty where no bar is elastic.
        """
        return self.solver.fields(self._read_state()[1])

    def _read_state(self) -> tuple[np.ndarray, State]:
        """Reading at the present time, and the copy of the state that it was made of."""
        here = max(self._time, self.solver.time(self._state))
        reading = np.zeros(1, READING)
        return reading, self.solver.read(self._state, here, reading, peaks=False)

    def statistics(self) -> dict[str, int]:
        """Counts of what the solver did."""
        return self.solver.statistics(self._state)

    def result(
        self, settle: float | None = None, trace: dict[str, np.ndarray] | None = None
    ) -> Result:
        """Everything found so far; means begin at `settle`, default that of the scene [s]."""
        return make_result(
            scene=self.scene,
            solver=self.solver,
            blows=self.blows,
            events=self.events,
            trace=trace,
            energy=self.energy(),
            statistics=self.statistics(),
            times=(self._time, self.scene.run.settle if settle is None else settle),
            wall_time=self.wall_time,
            setup_time=self.setup_time,
        )


def _with(parts: tuple[np.ndarray, ...], rows: np.ndarray) -> tuple[np.ndarray, ...]:
    """Add a copy of rows, as bytes; parts halve in size from one to the next.

    NumPy copies records field by field, which took a fifth of a whole run.
    """
    kept = [*parts, rows.view(np.uint8).copy()]
    while len(kept) > 1 and len(kept[-2]) <= len(kept[-1]):
        kept[-2:] = [np.concatenate(kept[-2:])]
    return tuple(kept)


def _joined(parts: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
    return parts if len(parts) < 2 else (np.concatenate(parts),)
