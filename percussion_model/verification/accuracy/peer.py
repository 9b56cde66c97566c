"""Base of the peers: solvers that advance and read by one kernel, and what they refuse."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from percussion_model.components import COMPONENTS
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.solvers.base import Solver
from percussion_model.solvers.state import State


def _demands(scene: Any) -> Iterator[tuple[str, str, bool]]:
    """What not all peers carry: its name, what they demand, and whether the scene has it."""
    effects, has_string = scene.effects, scene.effects.string
    rigid = "rigid" in (scene.piston.model, scene.bit.model)
    yield "rigid", "bit.model and piston.model must not be 'rigid'", rigid
    absent = scene.piston.model == "absent"
    yield "absent", "piston.model must not be 'absent'", absent
    yield "string", "effects.string must be false", has_string
    is_open = has_string and scene.string.bottom == "open"
    yield "open end", "string.bottom must not be 'open'", is_open
    external = effects.drive == "external"
    yield "external", "effects.drive must not be 'external'", external
    for kind in ("power", "wall", "spring", "none"):
        yield kind, f"effects.rock must not be {kind!r}", effects.rock == kind
    yield "no barrier", "the rock must have a barrier", not scene.barrier_on
    pulls = effects.standstill_tension == "paper"
    yield "paper", "effects.standstill_tension must not be 'paper'", pulls
    left = effects.cuttings and scene.matters("effects.cuttings")
    yield "cuttings", "effects.cuttings must be false", left
    yield "casing", "feed.on must not be 'casing'", effects.feed and scene.feed.on == "casing"
    for one in COMPONENTS:
        key, value = one.switch
        demand = "be false" if value is True else f"not be {value!r}"
        yield one.name, f"{key} must {demand}", scene[key] == value


def refuse_uncarried(peer: str, scene: Scene, carried: Collection[str] = ()) -> None:
    """Raise `SceneError`, before anything is computed, for a scene that a peer does not carry.

    Parameters
    ----------
    peer : str
        What the message calls it.
    scene : Scene
    carried : collection of str
        Names of what the peer carries beyond bilinear rock under elastic bars; all else is refused.
    """
    asked = [what for name, what, has in _demands(scene) if has and name not in carried]
    if asked:
        raise SceneError(f"{peer}: {', '.join(asked)}")


class PeerSolver(Solver):
    """Advances a state, or a copy of it to be read, by the same kernel."""

    @abstractmethod
    def _run(
        self, reads: int, state: State, t: float, blows: np.ndarray, events: np.ndarray,
        reading: np.ndarray,
    ) -> int:  # fmt: skip
        """Advance to `t` and, where `reads` is 1, fill the reading; a `Status`."""

    def time(self, state: State) -> float:
        """Time up to which the state is committed [s]."""
        return float(state.record[0]["time"])

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Advance as far as `t` allows; as in `Solver`."""
        s = state.record[0]
        s["events_on"] = record_events
        status = self._run(0, state, t, blows, events, self._no_reading)
        return status, int(s["n_blows"]), int(s["n_events"])

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; a copy at that time, or half a step off it. As in `Solver`."""
        spare = state.copy(spare)
        self._run(1, spare, t, self._no_blows, self._no_events, reading)
        return spare
