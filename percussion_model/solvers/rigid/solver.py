"""Rigid-body solver: for scenes with a rigid bit and a rigid or absent piston."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from percussion_model.physics.records import Piston, Status
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.rigid import advance as kernels
from percussion_model.solvers.rigid.records import RIGID_PAR, RIGID_STATE, ROWS_AN_EVENT
from percussion_model.solvers.setup import (
    REARM_TRANSITS,
    fill_parameters,
    fill_start,
    rock_numbers,
)
from percussion_model.solvers.state import State

# More events than this within a transit of the longer bar are a storm: the reference has
# no more than 13. What rigid bodies do within a transit is not theirs to tell anyway.
MOST_EVENTS = 200
SHORTEST_WINDOW = 1e-6  # of a very short bar [s]


def st_venant_restitution(
    piston_mass: float, piston_transit: float, bit_mass: float, bit_transit: float
) -> float:
    """Restitution of two free elastic bars after their first contact (docs/model.md, sec. 9).

    The shorter bar sends a rectangular wave of force Z_c v into the longer one for twice
    its own transit time. With equal impedances this is the ratio of the lengths.

    Parameters
    ----------
    piston_mass, bit_mass : float
        Masses [kg].
    piston_transit, bit_transit : float
        Times that a wave takes from end to end [s].

    Returns
    -------
    float
        Between 0 and 1.
    """
    z_p = piston_mass / piston_transit
    z_b = bit_mass / bit_transit
    impulse = 2.0 * min(piston_transit, bit_transit) * z_p * z_b / (z_p + z_b)
    e = impulse * (1.0 / piston_mass + 1.0 / bit_mass) - 1.0
    return min(max(e, 0.0), 1.0)


def restitution(scene: Scene) -> float:
    """Coefficient of restitution of piston and bit, NaN without a piston."""
    if scene.piston.model == "absent":
        return float("nan")
    if scene.bit.model == "rigid" and scene.contact.restitution is not None:
        return float(scene.contact.restitution)
    return st_venant_restitution(
        scene.piston.mass,
        scene.piston.transit_time,
        scene.bit.mass,
        scene.bit.transit_time,
    )


class RigidSolver(Solver):
    """Advance rigid bodies from event to event, in closed form.

    Parameters
    ----------
    scene : Scene
        With a rigid bit and a rigid or absent piston.
    """

    name = "rigid"
    COUNTS: ClassVar = ("events", "contacts", "blows", "cycles", "storms")

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        has_piston = scene.piston.model != "absent"
        self._par = np.zeros(1, RIGID_PAR)
        p: Any = self._par[0]
        fill_parameters(p, scene, with_piston=has_piston)
        p["piston"] = Piston.RIGID if has_piston else Piston.ABSENT
        p["restitution"] = self.restitution
        p["window"] = max(p["rearm_time"] / REARM_TRANSITS, SHORTEST_WINDOW)
        p["most_events"] = MOST_EVENTS

    @property
    def restitution(self) -> float:
        """Coefficient of restitution of piston and bit, NaN without a piston."""
        return restitution(self.scene)

    def new_state(self) -> State:
        """State at time zero."""
        scene = self.scene
        state = State(RIGID_STATE)
        s: Any = state.record[0]
        fill_start(s, scene, rock_numbers(scene))
        if scene.piston.model == "absent":
            s["gap"] = 0.0
        s["start_gap"] = s["gap"]
        s["ss_force"] = np.nan
        kernels.begin(self._par, state.record)
        return state

    def time(self, state: State) -> float:
        """Time of the last event of a state [s]."""
        return float(state.record["time"][0])

    def readable_until(self, state: State) -> float:
        """Time of the next event [s]."""
        s = state.record[0]
        return float(s["next_time"] if s["scheduled"] else s["time"])

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Process all events up to `t`; as in `Solver`, with room for 4 events at least."""
        if len(blows) < 1 or (record_events and len(events) < ROWS_AN_EVENT):
            raise ValueError(f"room for 1 blow and {ROWS_AN_EVENT} events is needed at least")
        s: Any = state.record[0]
        s["events_on"] = record_events
        status = kernels.advance(self._par, state.record, float(t), blows, events)
        return int(status), int(s["n_blows"]), int(s["n_events"])

    def commit(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Bring a state that was advanced to `t` there; nothing happens meanwhile."""
        if t < self.time(state) or self.readable_until(state) <= t:
            raise ValueError(f"advance the state to {t} s before committing it")
        kernels.commit(self._par, state.record, float(t))
        return int(Status.DONE), 0, 0

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; a copy at that time. As in `Solver`."""
        if spare is None:
            spare = state.copy()
        else:
            spare.take(state)
        t = max(t, self.time(state))
        status = kernels.read(
            self._par, spare.record, t, self._no_blows, self._no_events, reading
        )  # fmt: skip
        if status != Status.DONE:
            raise RuntimeError(f"the rigid solver stopped: {Status(status).name}")
        return spare
