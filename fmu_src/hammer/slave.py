"""The percussive hammer as a slave of a co-simulation."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

from fmu_src.hammer.inputs import DRIVE_INPUTS, NAMES_OUTSIDE, PLAIN_INPUTS, PRODUCT, SAME
from fmu_src.hammer.motion import Gauge, Motion
from fmu_src.hammer.outputs import OUTPUTS
from fmu_src.hammer.warnings import Warnings
from fmu_src.slave.slave import Read, Slave
from fmu_src.slave.states import (
    INTEGERS,
    STEPPING,
    Phase,
    Place,
    StateError,
    fingerprint,
    pack_values,
    unpack_values,
)
from percussion_model.engine.library import place_to_compile
from percussion_model.scene.inputs import INPUTS, PRESSURES, no_effect_reason
from percussion_model.scene.numbers import section_numbers
from percussion_model.scene.rows import refuse_value
from percussion_model.scene.scene import Scene
from percussion_model.solvers.base import Solver
from percussion_model.solvers.cells import find_cell

# Solvers hold no state: instances of equal parameters share one.
_SOLVERS: WeakValueDictionary[bytes, Solver] = WeakValueDictionary()

# Numbers of the motion in a saved state, besides its arrays.
NUMBERS = struct.Struct("<dQd")  # time, blows, step size
# An output is a whole number of FMI.
MOST_BLOWS = INTEGERS[1]
# The host's times come from sums and products of its own; a share of the time.
CLOCK_ROUNDING = 1e-12


class PercussiveHammer(Slave):
    """Percussive drill: drive, piston, bit and rock."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.folder = str(arguments["resources"])
        text = (Path(self.folder) / "scene.json").read_text(encoding="utf-8")
        scene = json.loads(text)
        self.baked = Scene(**scene["given"])
        self._identity = [scene["identity"], scene["given"]]
        names = ("drive_force", *PRESSURES.values())
        self._held = {name: self.baked[INPUTS[name].key] for name in names}
        self._drive_inputs = frozenset(DRIVE_INPUTS)
        self._warnings = Warnings()
        self.reset()

    def reset(self) -> None:
        """Make the solver anew when it is needed."""
        self.motion: Motion | None = None
        self.given_inputs: list[Any] = []  # values of the inputs when the solver was made
        self.acting: dict[str, float] = {}  # inputs as the solver has them

    # parameters and inputs

    def check(self, names: Iterable[str]) -> None:
        """Check bounds; before the first step the drive force and contradictions as well."""
        super().check(names)
        if self.phase < STEPPING:
            self._check_drive(self.drive_inputs(self.values))
            self.make_scene(self.values)

    def _check_drive(self, inputs: dict[str, float]) -> None:
        name = PRESSURES.get(self.choice("effects.drive"), "drive_force")
        row = self.baked.row_of(INPUTS[name].key)
        if not row.allows(inputs[name]):
            shown = PRODUCT if name == "drive_force" else "supply_pressure"
            raise ValueError(refuse_value(row, shown, inputs[name]))

    def drive_inputs(self, values: dict[str, Any]) -> dict[str, float]:
        """Inputs of the drive as the solver takes them."""
        on, pressure, area, force = (values[name] for name in DRIVE_INPUTS)
        acting, name = pressure if on else 0.0, PRESSURES.get(self.choice("effects.drive"))
        taken = {name: acting} if name else {"drive_force": acting * area}
        return {**self._held, **taken, "external_force": force if on else 0.0}

    def solver_inputs(self, values: dict[str, Any]) -> dict[str, float]:
        """Inputs as the solver takes them."""
        found = {inner: values[name] for name, inner in PLAIN_INPUTS.items()}
        return found | self.drive_inputs(values)

    def make_scene(self, values: dict[str, Any]) -> Scene:
        """Scene of these inputs and the parameters; `SceneError` if they contradict each other."""
        given: dict[str, Any] = {}
        for one in self.parameters:
            if one.key is None:
                continue
            value = self.values[one.name]
            if value == one.left_out:
                value = None
            elif one.type == "Enumeration":
                value = self.choice(one.name)
            given[one.key] = value
        given |= {INPUTS[name].key: value for name, value in self.solver_inputs(values).items()}
        changes = {key: value for key, value in given.items() if value != self.baked[key]}
        return self.baked.replace(**changes)

    # stepping

    def foretell(self) -> None:
        """Log that kernels are going to be compiled, where they are not kept yet."""
        solver = self.make_scene(self.values).solver_name
        place = place_to_compile(solver)
        if place is not None:
            self.note(f"compiling the solver {solver}: once, for about a minute; kept in {place}")

    def initialise(self) -> Motion:
        """Solver and state; made at time zero for the present values where there are none."""
        if self.motion is None:
            self._take_motion(self._make_motion(self.values), self.values)
            self.acting = self.solver_inputs(self.values)
            self.new.clear()
        assert self.motion is not None
        return self.motion

    def _make_motion(self, values: dict[str, Any]) -> Motion:
        """Motion from time zero under these inputs and the parameters."""
        scene = self.make_scene(values)
        key = fingerprint(self.fingerprint().hex(), [values[one.name] for one in self.inputs])
        motion = Motion(scene, _SOLVERS.get(key))
        _SOLVERS[key] = motion.solver
        motion.gauge = self._find_gauge(scene, motion.solver)
        return motion

    def _take_motion(self, motion: Motion, inputs: dict[str, Any]) -> None:
        self.motion = motion
        self.given_inputs = [inputs[one.name] for one in self.inputs]
        self._acts: dict[str, bool] = {}

    def _find_gauge(self, scene: Scene, solver: Solver) -> Gauge | None:
        """Cell at the place of the gauge, None in a bar without cells."""
        name = self.choice("gauge.bar")
        bar, place = scene.bars.get(name, scene.piston), self.values["gauge.position"]
        if place == self.by_name["gauge.position"].left_out:
            place = 0.5 * bar.length
        if place > bar.length:
            raise ValueError(
                f"gauge.position = {place!r} m: lies below the {name}, "
                f"which is {bar.length:g} m long"
            )
        grid = solver.grid_of(name)
        if grid is None:
            return None
        return Gauge(name, *find_cell(section_numbers(bar), grid.mass, float(place)))

    def step(self, time: float, step_size: float) -> None:
        """Pass on changed inputs, then advance."""
        motion = self.motion or self.initialise()
        motion.advance_to(time, step_size, self._changed_inputs(motion) if self.new else {})
        for text in self._warnings.new(motion, self.acting["loading_stiffness"]):
            self.warn(f"at t = {time:.6g} s: {text}")

    def _changed_inputs(self, motion: Motion) -> dict[str, float]:
        """Inputs of the solver that have changed, and act."""
        values, acting, new = self.values, self.acting, self.new
        wanted = {PLAIN_INPUTS[name]: values[name] for name in new if name in PLAIN_INPUTS}
        if not self._drive_inputs.isdisjoint(new):
            drive = self.drive_inputs(values)
            self._check_drive(drive)
            wanted |= drive
        new.clear()
        changed = {name: value for name, value in wanted.items() if value != acting[name]}
        vain = [name for name in changed if not self.acts(motion.scene, name)]
        for name in vain:
            if not math.isclose(changed.pop(name), acting[name], rel_tol=SAME):
                self.warn(f"a new {NAMES_OUTSIDE[name]} has no effect in this scene")
            acting[name] = wanted[name]
        acting |= changed
        return changed

    def acts(self, scene: Scene, name: str) -> bool:
        """Whether an input has an effect in the scene."""
        acts = self._acts.get(name)
        if acts is None:
            acts = self._acts[name] = not no_effect_reason(scene, name)
        return acts

    # outputs

    def reader(self, names: list[str]) -> Read:
        """What gives the present values of these outputs; 0 before there are any."""
        reads = [OUTPUTS[name].read for name in names]

        def read(hammer: PercussiveHammer) -> list[Any]:
            motion = hammer.motion
            if motion is None:
                if hammer.phase != Phase.INITIALISING:
                    return [0] * len(reads)
                motion = hammer.initialise()
            return [one(motion) for one in reads]

        return read

    # states

    def identity(self) -> Any:
        """Sources, names of the variables, and the scene with what no variable tells."""
        return self._identity

    def save(self) -> bytes:
        """Numbers of the motion, inputs that it was made with and that act, its arrays."""
        motion = self.motion or self.initialise()
        numbers = NUMBERS.pack(motion.time, motion.blow_count, motion.step_size)
        given = dict(zip((one.name for one in self.inputs), self.given_inputs, strict=True))
        acting = struct.pack(f"<{len(INPUTS)}d", *(self.acting[name] for name in INPUTS))
        return numbers + pack_values(self.inputs, given) + acting + motion.save()

    def restore(self, values: dict[str, Any], place: Place, saved: bytes, own: bool) -> None:
        """Go back to a motion; as in `Slave`."""
        begin = NUMBERS.size + 8 * len(self.inputs)
        given = unpack_values(self.inputs, saved, NUMBERS.size)
        if len(saved) < begin + 8 * len(INPUTS):
            raise StateError(f"the saved motion has {len(saved)} bytes, too few for its inputs")
        time, blows, step_size = NUMBERS.unpack_from(saved)
        acting = struct.unpack_from(f"<{len(INPUTS)}d", saved, begin)
        if not all(map(math.isfinite, (time, step_size, *acting))):
            raise StateError("the saved motion has a time or an input that is not finite")
        # the clock of the motion follows that of the host, within the rounding of a step
        late = abs(time - (place.now - place.start_time))
        if not late <= step_size + CLOCK_ROUNDING * abs(place.now):
            raise StateError(f"the saved motion is at {time!r} s, its instance at {place.now!r} s")
        if not 0 <= blows <= MOST_BLOWS:
            raise StateError(f"the saved motion has {blows} blows")
        arrays = saved[begin + 8 * len(INPUTS) :]
        if [given[one.name] for one in self.inputs] == self.given_inputs and self.motion:
            self.motion.restore(time, step_size, blows, arrays, own)
        else:  # the solver was made with other inputs
            motion = self._make_motion(self.values | given)
            motion.restore(time, step_size, blows, arrays, own)
            self._take_motion(motion, given)
        self.acting = dict(zip(INPUTS, acting, strict=True))
