"""The solvers of this package, by their entries."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from percussion_model.components import COMPONENTS
from percussion_model.engine.solver import EngineSolver
from percussion_model.physics.judgement import longer_step
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene
from percussion_model.solvers.fem.records import FEM_PAR, FEM_STATE
from percussion_model.solvers.modal.records import MODAL_PAR, MODAL_STATE
from percussion_model.solvers.modal.resolution import COARSER, asked_modes, coarser_modes
from percussion_model.solvers.rigid.records import (
    RIGID_PAR,
    RIGID_STATE,
    ROWS_AN_EVENT,
)
from percussion_model.solvers.state import State
from percussion_model.solvers.wave.records import WAVE_PAR, WAVE_STATE
from percussion_model.solvers.wave.resolution import comparable_steps

# Elements and contact stiffness of runs to compare with, by those of this one.
COARSER_ELEMENTS = 0.5
# Of the directory of a motion by modes: how many each form has, that of the free bit first.
SIZES_ROW = 0


def longer_steps(scene: Scene) -> dict[str, float]:
    """Steps of components that are on, longer, so that runs with them tell what steps cost.

    A component has such a step as its parameter `step`.
    """
    steps = {one.name: one.parameters["step"] for one in COMPONENTS if "step" in one.parameters}
    found = {f"{name}.step": longest for name, (*_, longest) in steps.items()}
    return {
        key: longer_step(scene[key], longest)
        for key, longest in found.items()
        if scene.matters(key)
    }


class ModalSolver(EngineSolver):
    """Normal modes for a scene with an elastic bit: stepped bars of any lengths."""

    name = "modal"
    time_step: float
    PAR, STATE = MODAL_PAR, MODAL_STATE
    COUNTS: ClassVar = ("steps", "leaps", "events", "blows", "locked")

    @cached_property
    def modes(self) -> int:
        """Modes that the scene asks for, or its wanted accuracy."""
        return asked_modes(numbers_of(self.scene))

    @cached_property
    def cells(self) -> dict[str, int]:
        """Modes of each elastic bar, by its name."""
        of_forms = self._motion.array(SIZES_ROW, 1, np.int64)
        counts = {"piston": self._array_shapes[1][1], "bit": int(of_forms[0])}
        return {name: counts[name] for name in self._names}

    def coarser_scenes(self) -> list[Scene] | None:
        """The scene with fewer modes."""
        changes = {"solver.accuracy": None, "run.check": False, **longer_steps(self.scene)}
        counts = coarser_modes(self.modes, COARSER)
        return [
            self.scene.replace(**changes, **{"solver.cells": count}) for count in counts
        ] or None


class WaveSolver(EngineSolver):
    """Waves in the bars from the drive to the rock, two or a drill string."""

    name = "wave"
    time_step: float
    PAR, STATE = WAVE_PAR, WAVE_STATE
    COUNTS: ClassVar = ("steps", "events", "blows", "locked")

    def _elastic_bars(self) -> list[str]:
        rods = len(self.scene.string.rods) if self.scene.effects.string else 0
        piston = ["piston"] * (self.scene.piston.model == "elastic")
        return [*piston, *(f"rod {k}" for k in range(1, rods + 1)), "bit"]

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; the state itself, as `fields` reads it. As in `Solver`."""
        super().read(state, t, reading, None if spare is state else spare, peaks)
        return state

    def coarser_scenes(self) -> list[Scene] | None:
        """The scene with steps half as long again, or about that where loss refuses these."""
        changes = {"solver.accuracy": None, "run.check": False, **longer_steps(self.scene)}
        scenes = [
            self.scene.replace(**changes, **{"solver.cells": count})
            for count in comparable_steps(next(iter(self.cells.values())))
        ]
        if not scenes:
            return None
        # where all are refused, the run of the first tells why there is no error
        return [next((scene for scene in scenes if not self.refusal(scene)), scenes[0])]


class FemSolver(EngineSolver):
    """Linear finite elements, penalty contact, event-driven third-order steps.

    Attributes
    ----------
    loss_time : float
        Kelvin-Voigt time in force [s].
    """

    name = "fem"
    time_step: float
    PAR, STATE = FEM_PAR, FEM_STATE
    COUNTS: ClassVar = ("steps", "trials", "events", "blows", "storms", "locked")

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self.loss_time = float(self._par[0]["eta"])

    def set_inputs(self, state: State, **inputs: float) -> None:
        """Change inputs of a committed state; modes may have to follow."""
        super().set_inputs(state, **inputs)
        state.record[0]["inputs_changed"] = 1

    def coarser_scenes(self) -> list[Scene] | None:
        """A coarser mesh with the same loss, and a softer contact: each has an error."""
        scene = self.scene
        if scene.fem.elements == 1:
            return None
        coarser: dict[str, Any] = {"fem.elements": int(COARSER_ELEMENTS * scene.fem.elements)}
        coarser |= longer_steps(scene)
        if scene.matters("fem.damping_ratio") and scene.fem.damping_ratio is not None:
            coarser |= {"fem.damping_ratio": None, "loss.time": self.loss_time}
        scenes = [scene.replace(**coarser)]
        if scene.matters("fem.contact_stiffness"):
            softer = COARSER_ELEMENTS * scene.fem.contact_stiffness
            scenes.append(scene.replace(**{"fem.contact_stiffness": softer}))
        return scenes


class RigidSolver(EngineSolver):
    """Rigid bodies from event to event, in closed form."""

    name = "rigid"
    PAR, STATE = RIGID_PAR, RIGID_STATE
    COUNTS: ClassVar = ("events", "contacts", "blows", "cycles", "storms")

    def _elastic_bars(self) -> list[str]:
        return []

    def coarser_scenes(self) -> list[Scene]:
        """The scene with longer steps of components: rigid bodies move in closed form."""
        longer = longer_steps(self.scene)
        return [self.scene.replace(**longer)] if longer else []

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Process all events up to `t`; as in `Solver`, with room for 4 events at least."""
        if len(blows) < 1 or (record_events and len(events) < ROWS_AN_EVENT):
            raise ValueError(f"room for 1 blow and {ROWS_AN_EVENT} events is needed at least")
        return super().advance(state, float(t), blows, events, record_events)

    def commit(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Bring a state that was advanced to `t` there; nothing happens meanwhile."""
        if t < self.time(state) or self.readable_until(state) <= t:
            raise ValueError(f"advance the state to {t} s before committing it")
        return super().commit(state, float(t), blows, events, record_events)

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; a copy at that time. As in `Solver`."""
        return super().read(state, max(t, self.time(state)), reading, spare, peaks)
