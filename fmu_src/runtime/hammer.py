"""The percussive hammer as a slave of a co-simulation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

from fmu_src.runtime import hammer_states
from fmu_src.runtime.blow_map import read_blow_map
from fmu_src.runtime.calls import STEPPING, Phase, guarded, plain_bounds
from fmu_src.runtime.motion import Gauge, Motion
from fmu_src.runtime.outputs import OUTPUTS
from fmu_src.runtime.slave import Slave
from fmu_src.runtime.states import fingerprint
from fmu_src.runtime.values import Read
from fmu_src.runtime.watch import Watch
from percussion_model.scene.inputs import INPUTS, why_without_effect
from percussion_model.scene.numbers import section_numbers
from percussion_model.scene.rows import refuse_value
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.blow_map.solver import BlowMapSolver
from percussion_model.solvers.wave.grid import cell_at

# Solvers hold no state: instances of equal parameters share one.
_SOLVERS: WeakValueDictionary[bytes, Solver] = WeakValueDictionary()

# The solver's inputs as hosts know them: by keys of the parameter table, but for these.
NAMES_OUTSIDE = {name: one.key for name, one in INPUTS.items()} | {
    "feed_force": "feed_force",
    "drive_force": "supply_pressure",
    "external_force": "piston_force",
}

# What the drive's forces follow from.
DRIVE_INPUTS = ("percussion_on", "supply_pressure", "drive.effective_area", "piston_force")


class PercussiveHammer(Slave):
    """Percussive drill: drive, piston, bit and rock."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.folder = str(arguments["resources"])
        text = (Path(self.folder) / "scene.json").read_text(encoding="utf-8")
        scene = json.loads(text)
        self.baked = Scene(**scene["given"])
        self._drive_row = self.baked.row_of("drive.force")
        self._drive_bounds = plain_bounds(self._drive_row)
        self.identity = scene["identity"]
        self.inputs = [one for one in self.known.values() if one.causality == "input"]
        self._readers = {self.by_name[name]: read for name, read in OUTPUTS.items()}
        self._forced = [self.by_name[name] for name in DRIVE_INPUTS]
        self._plain = {
            inner: self.by_name[name]
            for inner, name in NAMES_OUTSIDE.items()
            if name not in DRIVE_INPUTS
        }
        self._forces = frozenset(self._forced)
        self.motion: Motion | None = None
        self.given_inputs: list[Any] = []  # values of the inputs when the solver was made
        self.fingerprint = b""
        self.acting: dict[str, float] = {}  # inputs as the solver has them
        self._inner = {reference: inner for inner, reference in self._plain.items()}
        self._new: set[int] = set()  # inputs that were set, perhaps to what they were
        self._doubtful: list[int] = []  # inputs to be checked
        self._acts: dict[str, bool] = {}
        self._watch = Watch()

    # parameters and inputs

    def value(self, name: str) -> Any:
        """Value of a parameter or an input."""
        return self.values[self.by_name[name]]

    def changed(self, references: list[int]) -> None:
        """Note that inputs are new, or that the solver has to be made anew."""
        if self.phase < STEPPING:
            self.motion = None
        else:
            self._new.update(references)
            self._doubtful += references

    def take_late(self) -> None:
        """Take inputs that were set and not yet looked at."""
        held = self.values
        for references, values in self.late.items():
            plan = self._inputs_alone[references]
            for (reference, _, low, high), value in zip(plan, values, strict=True):
                if held[reference] != value:
                    held[reference] = value
                    self._new.add(reference)
                    if not low <= value <= high:
                        self._doubtful.append(reference)
        self.late.clear()

    def look_at_inputs(self) -> None:
        """Look at all inputs in the next step."""
        self._new.update(one.reference for one in self.inputs)
        self._doubtful = list(self._new)

    def check(self, references: Any) -> None:
        """Check bounds, the drive force, and contradictions between parameters."""
        super().check(references)
        if self.phase is STEPPING and self._forces.isdisjoint(references):
            return
        force = self.drive_force()
        if not self._drive_row.allows(force):
            name = "supply_pressure * drive.effective_area"
            raise ValueError(refuse_value(self._drive_row, name, force))
        if self.phase < STEPPING:
            self.make_scene()

    def drive_force(self) -> float:
        """F_0 of the pressure law [N]."""
        on, pressure, area, _ = (self.values[reference] for reference in self._forced)
        return pressure * area if on else 0.0

    def solver_inputs(self) -> dict[str, float]:
        """Inputs as the solver takes them."""
        values = self.values
        found = {inner: values[reference] for inner, reference in self._plain.items()}
        return found | self.drive_inputs()

    def drive_inputs(self) -> dict[str, float]:
        """Forces of the drive as the solver takes them [N]."""
        on, pressure, area, force = (self.values[reference] for reference in self._forced)
        return {
            "drive_force": pressure * area if on else 0.0,
            "external_force": force if on else 0.0,
        }

    def make_scene(self) -> Scene:
        """Scene of the present values; raises `SceneError` if they contradict each other."""
        changes: dict[str, Any] = {}
        for one in self.known.values():
            if one.key is None or one.causality != "parameter":
                continue
            value = self.values[one.reference]
            if value == one.left_out:
                value = None
            elif one.type == "Enumeration":
                value = self.choice(one.reference)
            if value != self.baked[one.key]:
                changes[one.key] = value
        for name, value in self.solver_inputs().items():
            key = INPUTS[name].key
            if value != self.baked[key]:
                changes[key] = value
        return self.baked.replace(**changes)

    # stepping

    def begin(self) -> None:
        """Make the solver, unless reading an output has made it already."""
        self.ready()

    def ready(self) -> Motion:
        """Solver and state; made at time zero for the present values where there are none."""
        if self.motion is None:
            scene = self.make_scene()
            self.given_inputs = [self.values[one.reference] for one in self.inputs]
            self.fingerprint = fingerprint(self.identity, self.parameters())
            key = fingerprint(self.identity, self.parameters(), self.given_inputs)
            self.motion = Motion(scene, _SOLVERS.get(key) or self.map_solver(scene))
            _SOLVERS[key] = self.motion.solver
            self.motion.gauge = self.find_gauge(scene, self.motion.solver)
            self.acting = self.solver_inputs()
            self._acts = {}
            self._new.clear()
        return self.motion

    def map_solver(self, scene: Scene) -> Solver | None:
        """Solver on the table that the FMU brings along, if the scene wants that."""
        if scene.solver_name != "blow-map":
            return None
        return BlowMapSolver(scene, read_blow_map(self.folder))

    def parameters(self) -> list[Any]:
        """Values of all parameters, in the order of their references."""
        return [
            self.values[one.reference]
            for one in self.known.values()
            if one.causality == "parameter"
        ]

    def find_gauge(self, scene: Scene, solver: Solver) -> Gauge | None:
        """Cell at the place of the gauge, None in a bar without cells."""
        name = ("piston", "bit")[self.value("gauge.bar") - 1]
        bar, place = scene[name], self.value("gauge.position")
        if place == self.known[self.by_name["gauge.position"]].left_out:
            place = 0.5 * bar.length
        if place > bar.length:
            raise ValueError(
                f"gauge.position = {place!r} m: lies below the {name}, "
                f"which is {bar.length!r} m long"
            )
        grid = solver.grid_of(name)
        return None if grid is None else Gauge(name, *cell_at(section_numbers(bar), grid, place))

    def step(self, time: float, step_size: float) -> None:
        """Pass on changed inputs, then advance."""
        motion = self.motion or self.ready()
        if self.late:
            self.take_late()
        changes = self.take_inputs(motion) if self._new else {}
        motion.go_on(time, step_size, changes)
        for text in self._watch.look(motion, self.acting["loading_stiffness"]):
            self.warn(f"{self.instance_name}: at t = {time:.6g} s: {text}")

    def take_inputs(self, motion: Motion) -> dict[str, float]:
        """Inputs of the solver that have changed, checked."""
        values, acting, new = self.values, self.acting, self._new
        if self._doubtful:
            self.check(self._doubtful)
            self._doubtful.clear()
        wanted = {self._inner[r]: values[r] for r in new if r in self._inner}
        if not self._forces.isdisjoint(new):
            drive = self.drive_inputs()
            if not self._drive_bounds[0] <= drive["drive_force"] <= self._drive_bounds[1]:
                self.check(self._forced)
            wanted |= drive
        new.clear()
        changed = {name: value for name, value in wanted.items() if value != acting[name]}
        acting |= changed
        return {name: value for name, value in changed.items() if self.acts(motion.scene, name)}

    def acts(self, scene: Scene, name: str) -> bool:
        """Whether an input has an effect in the scene; says so in the log where not."""
        acts = self._acts.get(name)
        if acts is None:
            acts = self._acts[name] = not why_without_effect(scene, name)
        if not acts:
            outside = NAMES_OUTSIDE[name]
            self.warn(f"{self.instance_name}: a new {outside} has no effect in this scene")
        return acts

    # outputs

    def reader(self, references: list[int]) -> Read:
        """What gives the present values of these outputs; 0 before there are any."""
        reads = [self._readers[reference] for reference in references]

        def read(hammer: PercussiveHammer) -> list[Any]:
            motion = hammer.motion
            if motion is None:
                if hammer.phase != Phase.INITIALISING:
                    return [0] * len(reads)
                motion = hammer.ready()
            return [one(motion) for one in reads]

        return read

    # states

    @guarded
    def _get_fmu_state(self) -> bytes:
        return hammer_states.save(self)

    @guarded
    def _set_fmu_state(self, state: bytes) -> None:
        hammer_states.restore(self, state)
