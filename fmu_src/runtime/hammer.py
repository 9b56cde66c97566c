"""The percussive hammer as a slave of a co-simulation."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

from fmu_src.runtime.blow_map import read_blow_map
from fmu_src.runtime.calls import STEPPING, Phase, guarded
from fmu_src.runtime.motion import Gauge, Motion
from fmu_src.runtime.outputs import OUTPUTS
from fmu_src.runtime.plain_scene import PlainScene, make_scene
from fmu_src.runtime.slave import Slave
from fmu_src.runtime.states import fill_solver, fingerprint, pack, solver_bytes, unpack
from fmu_src.runtime.watch import Watch
from percussion_model.inputs import INPUTS
from percussion_model.parameter_rows import Row, refuse_value
from percussion_model.scene_rules import SceneRules
from percussion_model.solvers import Solver
from percussion_model.solvers.blow_map import BlowMapSolver
from percussion_model.solvers.grid import cell_at

# Solvers hold no state: instances of equal parameters share one.
_SOLVERS: WeakValueDictionary[bytes, Solver] = WeakValueDictionary()

# Inputs of the FMU that are inputs of the solver as they are.
PLAIN_INPUTS = {
    "feed_force": "feed_force",
    "rock.loading_stiffness": "loading_stiffness",
    "rock.unloading_ratio": "unloading_ratio",
    "rock.barrier_damping": "barrier_damping",
    "rock.barrier_energy": "barrier_energy",
    "drive.reversal_distance": "reversal_distance",
}

# What the drive's forces follow from.
DRIVE_INPUTS = ("percussion_on", "supply_pressure", "drive.effective_area", "piston_force")

# The solver's inputs as hosts know them.
NAMES_OUTSIDE = {inner: name for name, inner in PLAIN_INPUTS.items()} | {
    "drive_force": "supply_pressure",
    "external_force": "piston_force",
}

# Numbers of an instance in a saved state.
NUMBERS = struct.Struct("<BBdddQd")  # phase, moving, start, now, time, blows, step size


class PercussiveHammer(Slave):
    """Percussive drill: drive, piston, bit and rock."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.folder = str(arguments["resources"])
        text = (Path(self.folder) / "scene.json").read_text(encoding="utf-8")
        scene = json.loads(text)
        self.baked: dict[str, Any] = scene["values"]
        self.given: set[str] = set(scene["given"])
        self.rows = {one.row.key: one.row for one in self.known.values() if one.row is not None}
        self.rows |= {key: _row(row) for key, row in scene["rows"].items()}
        self.identity = scene["identity"]
        self.inputs = [one for one in self.known.values() if one.causality == "input"]
        self._readers = {self.by_name[name]: read for name, read in OUTPUTS.items()}
        self._plain = {inner: self.by_name[name] for name, inner in PLAIN_INPUTS.items()}
        self._forced = [self.by_name[name] for name in DRIVE_INPUTS]
        self._forces = frozenset(self._forced)
        self.motion: Motion | None = None
        self.given_inputs: list[Any] = []  # values of the inputs when the solver was made
        self.fingerprint = b""
        self._acting: dict[str, float] = {}  # inputs as the solver has them
        self._dirty = False
        self._new: set[int] = set()  # inputs to be checked
        self._acts: dict[str, bool] = {}
        self._watch = Watch()

    # parameters and inputs

    def value(self, name: str) -> Any:
        """Value of a parameter or an input."""
        return self.values[self.by_name[name]]

    def changed(self, references: list[int]) -> None:
        """Note that inputs are new, or that the solver has to be made anew."""
        self._dirty = True
        if self.phase < STEPPING:
            self.motion = None
        else:
            self._new.update(references)

    def check(self, references: Any) -> None:
        """Check bounds, the drive force, and contradictions between parameters."""
        super().check(references)
        if self.phase is STEPPING and self._forces.isdisjoint(references):
            return
        force = self.drive_force()
        if not self.rows["drive.force"].allows(force):
            name = "supply_pressure * drive.effective_area"
            raise ValueError(refuse_value(self.rows["drive.force"], name, force))
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
        on, pressure, area, force = (values[reference] for reference in self._forced)
        found["drive_force"] = pressure * area if on else 0.0
        found["external_force"] = force if on else 0.0
        return found

    def make_scene(self) -> PlainScene:
        """Scene of the present values; raises `SceneError` if they contradict each other."""
        values = dict(self.baked)
        given = set(self.given)
        for one in self.known.values():
            if one.key is None or one.causality != "parameter":
                continue
            value = self.values[one.reference]
            if value == one.left_out:
                value = None
            elif one.type == "Enumeration":
                value = self.choice(one.reference)
            if value != values[one.key]:
                given.add(one.key)
            values[one.key] = value
        values |= {INPUTS[name]: value for name, value in self.solver_inputs().items()}
        return make_scene(values, given, self.rows)

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
            self._acting = self.solver_inputs()
            self._acts = {}
            self._dirty = False
        return self.motion

    def map_solver(self, scene: PlainScene) -> Solver | None:
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

    def find_gauge(self, scene: PlainScene, solver: Solver) -> Gauge | None:
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
        return None if grid is None else Gauge(name, *cell_at(bar, grid, place))

    def step(self, time: float, step_size: float) -> None:
        """Pass on changed inputs, then advance."""
        motion = self.motion or self.ready()
        changes = self.take_inputs(motion) if self._dirty else {}
        motion.go_on(time, step_size, changes)
        for text in self._watch.look(motion, self._acting["loading_stiffness"]):
            self.warn(f"{self.instance_name}: at t = {time:.6g} s: {text}")

    def take_inputs(self, motion: Motion) -> dict[str, float]:
        """Inputs of the solver that have changed, checked."""
        self.check(self._new)
        self._new.clear()
        acting, wanted = self._acting, self.solver_inputs()
        self._acting, self._dirty = wanted, False
        if wanted == acting:
            return {}
        return {
            name: value
            for name, value in wanted.items()
            if value != acting[name] and self.acts(motion.scene, name)
        }

    def acts(self, scene: SceneRules, name: str) -> bool:
        """Whether an input has an effect in the scene; says so in the log where not."""
        acts = self._acts.get(name)
        if acts is None:
            acts = scene.matters(INPUTS[name])
            if name.startswith("barrier"):
                acts = acts and scene.barrier_on
            self._acts[name] = acts
        if not acts:
            outside = NAMES_OUTSIDE.get(name, name)
            self.warn(f"{self.instance_name}: a new {outside} has no effect in this scene")
        return acts

    # outputs

    def asked(self, references: list[int]) -> list[Callable[[Motion], Any]]:
        """What reads these outputs."""
        return [self._readers[reference] for reference in references]

    def outputs(self, asked: list[Callable[[Motion], Any]]) -> list[Any]:
        """Present values of outputs; 0 before there are any."""
        if self.motion is None and self.phase != Phase.INITIALISING:
            return [0] * len(asked)
        motion = self.motion or self.ready()
        return [read(motion) for read in asked]

    # states

    @guarded
    def _get_fmu_state(self) -> bytes:
        if self.phase == Phase.INSTANTIATED or self.motion is None:
            raise ValueError("there is no state to save before the initialisation has ended")
        motion = self.motion
        motion.peaks()
        numbers = NUMBERS.pack(
            self.phase, 1, self.start_time, self.now, motion.time,
            motion.blow_count, motion.step_size,
        )  # fmt: skip
        inputs = [self.values[one.reference] for one in self.inputs]
        acting = [self._acting[name] for name in INPUTS]
        floats = np.array(
            [*self.given_inputs, *inputs, *acting, motion.stress(), *motion.before()], float
        )
        body = numbers + floats.tobytes() + motion.row.tobytes()
        body += motion.row_of_blow.view(np.uint8).tobytes() + solver_bytes(motion._state)
        return pack(self.fingerprint, body)

    @guarded
    def _set_fmu_state(self, state: bytes) -> None:
        if self.motion is None:
            self.check(self.values)
            self.ready()
        body = unpack(self.fingerprint, state)
        phase, _, start, now, time, blows, step_size = NUMBERS.unpack_from(body)
        at = NUMBERS.size
        count = len(self.inputs)
        floats = np.frombuffer(body, np.float64, 2 * count + len(INPUTS) + 4, at)
        at += floats.nbytes
        self._set_inputs(floats[:count])
        if [self.values[one.reference] for one in self.inputs] != self.given_inputs:
            self.motion = None  # the solver was made with other inputs
        motion = self.ready()
        self._set_inputs(floats[count : 2 * count])
        acting = floats[2 * count :][: len(INPUTS)]
        row = np.frombuffer(body, np.float64, len(motion.row), at)
        at += row.nbytes
        blow = np.frombuffer(body, np.uint8, motion.row_of_blow.nbytes, at)
        at += blow.nbytes
        fill_solver(motion._state, body[at:])
        motion.adopt((time, step_size), (blows, blow), row, floats[-4:])
        self._acting = dict(zip(INPUTS, acting.tolist(), strict=True))
        self.phase, self.start_time, self.now = Phase(phase), start, now
        self._dirty = True

    def _set_inputs(self, values: np.ndarray) -> None:
        for one, value in zip(self.inputs, values, strict=True):
            self.values[one.reference] = bool(value) if one.type == "Boolean" else float(value)


def _row(entry: dict[str, Any]) -> Row:
    needs = {key: tuple(values) for key, values in entry["needs"].items()}
    return Row(**{**entry, "choices": tuple(entry["choices"]), "needs": needs})
