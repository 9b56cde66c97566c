"""CVODE of SUNDIALS on the semi-discrete bars: the general integrator among the peers.

Compiled right-hand side, banded Jacobian, hard contact, a restart at each event. It needs
the package scikit-sundae (`pip install percussion_model[peers]`).
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any, ClassVar

import numpy as np

from percussion_model.physics.records import READING, SAMPLE_FIELDS, Status
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.solvers.fem.records import Mesh
from percussion_model.solvers.state import State
from percussion_model.verification.accuracy.cvode_step import (
    arrive,
    event_functions,
    gather,
    right_hand_side,
    spread,
)
from percussion_model.verification.accuracy.exact_flow import ExactFlowSolver
from percussion_model.verification.accuracy.exact_flow_step import (
    change_contact,
    change_mode,
    contact_event,
    drive_event,
    read_here,
    rock_event,
    turn,
)

__all__ = ["CvodeSolver", "missing"]

# Error allowed in a step, by the tolerance: displacement [m], velocity [m/s], work [J]. All of
# it absolute: of a piston 90 mm up a relative one would allow ten times the stretch of a bar.
ABSOLUTE = (1e-5, 10.0, 1e-2)
RELATIVE = 1e-12
# Steps of at most so many transits of the bit do not pass over a contact.
LONGEST = 2.0
# Formulas of higher order ring where bars do: they make more steps.
ORDER = 2
MOST_STEPS = 1_000_000
# After an event the state moves on by so much, off the zero of its function [s].
NUDGE = 1e-9
# What CVODE says where it stopped at an event.
EVENT = 2
# Entries of y beside the diagonal that y' depends on much: by the inverse of the mass matrix
# an influence falls to a tenth with each node; half as many make it three times as slow.
BAND = 15


def missing() -> str:
    """Why there is no CVODE; empty where it can be used."""
    return "" if find_spec("sksundae") else "the package scikit-sundae is not installed"


class CvodeSolver(ExactFlowSolver):
    """CVODE's backward differentiation formulas between events.

    Some ten microseconds of each call of the right-hand side are Python's and the wrapper's,
    a fraction of one is the equations.

    Parameters
    ----------
    scene : Scene
        As for `ExactFlowSolver`.
    elements : int
        In the piston, or in the bit without one.
    tolerance : float
        Of a step, by `ABSOLUTE`.
    """

    name, title = "cvode", "CVODE"
    COUNTS: ClassVar = ("events", "blows")
    levels = 1

    def __init__(self, scene: Scene, elements: int, tolerance: float = 1e-4) -> None:
        super().__init__(scene, elements)
        if missing():
            raise SceneError(f"CVODE: {missing()}: pip install percussion_model[peers]")
        n = self._mesh.shape[1]
        self._coefficients = np.array([self._mesh[Mesh.STIFFNESS], *self._pivots()])
        limits = np.r_[np.tile(ABSOLUTE[:2], n), ABSOLUTE[2]]
        self._options = {
            "method": "BDF",
            "max_order": ORDER,
            "linsolver": "band",
            "lband": BAND,
            "uband": BAND,
            "rtol": RELATIVE,
            "atol": tolerance * limits,
            "max_step": LONGEST * scene.bit.transit_time,
            "max_num_steps": MOST_STEPS,
            "num_events": 4,
        }

    def _pivots(self) -> tuple[np.ndarray, np.ndarray]:
        """Pivots of the tridiagonal mass matrix, and what is next to them [kg]."""
        share, next_to = self._mesh[Mesh.SHARE], self.consistent * self._mesh[Mesh.COUPLING]
        pivots = share + self.consistent * (self._mesh[Mesh.MASS] - share)
        for i in range(1, len(pivots)):
            pivots[i] -= next_to[i - 1] ** 2 / pivots[i - 1]
        return pivots, next_to

    def _integrator(self, states: np.ndarray) -> Any:
        """Integrator of a state's equations, in the modes that it has at each call."""
        from sksundae.cvode import CVODE

        pars, flow, bars = self._par, self._flow, self._coefficients
        x = np.zeros(2 * bars.shape[1] + 2)

        def rhs(t: float, y: np.ndarray, out: np.ndarray) -> None:
            right_hand_side(pars, states, flow, bars, y, out)

        def event_values(t: float, y: np.ndarray, out: np.ndarray) -> None:
            event_functions(pars, states, flow, x, y, out)

        event_values.terminal = [True] * 4  # type: ignore[attr-defined]
        event_values.direction = [-1] * 4  # type: ignore[attr-defined]
        return CVODE(rhs, eventsfn=event_values, **self._options)

    def _integrate(
        self, state: State, times: np.ndarray, blows: np.ndarray, events: np.ndarray,
        at: Callable[[int], None] = lambda k: None,
    ) -> int:  # fmt: skip
        """Bring a state from time to time, and call `at` there; a `Status`."""
        par, flow, s = self._par[0], self._flow, state.record[0]
        x, ahead = state.arrays[0]
        y, rate = np.zeros((2, 2 * self._coefficients.shape[1] + 1))
        s["n_blows"] = s["n_events"] = 0
        cvode, fresh, booked, k = self._integrator(state.record), True, 0.0, 0
        while k < len(times):
            if s["live"] and s["n_blows"] >= len(blows):
                return int(Status.BLOWS_FULL)
            if s["live"] and s["events_on"] and s["n_events"] + 3 >= len(events):
                return int(Status.EVENTS_FULL)
            if times[k] <= s["time"]:
                at(k)
                k += 1
                continue
            if fresh:
                gather(par, x, y)
                cvode.init_step(float(s["time"]), y)
                fresh, booked = False, 0.0
            found = cvode.step(float(times[k]))
            if found.status < 0:
                raise RuntimeError(f"CVODE: {found.message}")
            time, here = float(found.t), found.y.copy()
            fresh = found.status == EVENT
            if fresh:
                right_hand_side(self._par, state.record, flow, self._coefficients, here, rate)
                time, here = time + NUDGE, here + NUDGE * rate
            spread(par, here, ahead)
            ahead[-2:] = x[-2:]
            arrive(par, s, flow, x, ahead, time, here[-1] - booked)
            booked = here[-1]
            if fresh:
                self._process(s, x, blows, events)
        return int(Status.DONE)

    def _process(self, s: Any, x: np.ndarray, blows: np.ndarray, events: np.ndarray) -> None:
        par, flow = self._par[0], self._flow
        if contact_event(par, s, flow, x):
            change_contact(par, s, flow, x, blows, events)
        if drive_event(par, s, flow, x):
            turn(par, s, flow, x, events)
        if rock_event(par, s, flow, x, x, 0.0):
            change_mode(par, s, flow, x, events)

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Advance to `t`; as in `Solver`."""
        s = state.record[0]
        s["events_on"] = record_events
        status = self._integrate(state, np.array([t]), blows, events)
        return status, int(s["n_blows"]), int(s["n_events"])

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; a copy at that time. As in `Solver`."""
        spare = state.copy(spare)
        self._read(spare, np.array([t]), reading, lambda k: None)
        return spare

    def sample(self, state: State, times: np.ndarray, out: np.ndarray) -> None:
        """Evaluate at `times` into rows of `SAMPLE_FIELDS`."""
        reading = np.zeros(1, READING)
        row = reading.view(np.float64)[: len(SAMPLE_FIELDS)]

        def keep(k: int) -> None:
            out[k] = row

        self._read(state.copy(), times, reading, keep)

    def _read(
        self, spare: State, times: np.ndarray, reading: np.ndarray, at: Callable[[int], None]
    ) -> None:
        s, x = spare.record[0], spare.arrays[0][0]
        s["live"] = 0

        def look(k: int) -> None:
            read_here(self._par[0], s, self._flow, x, float(times[k]), reading[0])
            at(k)

        self._integrate(spare, times, self._no_blows, self._no_events, look)
