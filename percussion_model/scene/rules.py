"""What follows from the values of a scene, however they are stored.

Standard library only. `Scene` and its groups are made of these classes, and so
is the plain scene that an exported simulation carries. Fields are declared to
type checkers alone, so that pydantic does not take them for its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from percussion_model.scene.rows import Row


class SceneError(ValueError):
    """A scene that cannot be read or makes no sense; the message says what to do."""


class SectionNumbers:
    """Numbers that follow from a section's length, area and material."""

    if TYPE_CHECKING:
        length: float
        area: float
        youngs_modulus: float
        density: float

    @property
    def wave_speed(self) -> float:
        """Speed of longitudinal waves, sqrt(E/rho) [m/s]."""
        return math.sqrt(self.youngs_modulus / self.density)

    @property
    def impedance(self) -> float:
        """Force per particle velocity of a wave, A sqrt(E rho) [N s/m]."""
        return self.area * math.sqrt(self.youngs_modulus * self.density)

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.density * self.area * self.length

    @property
    def transit_time(self) -> float:
        """Time a wave takes from end to end [s]."""
        return self.length / self.wave_speed


class BarNumbers:
    """Numbers that follow from the sections of a bar."""

    if TYPE_CHECKING:
        model: str
        sections: Sequence[SectionNumbers]

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return math.fsum(section.mass for section in self.sections)

    @property
    def length(self) -> float:
        """Length [m]."""
        return math.fsum(section.length for section in self.sections)

    @property
    def transit_time(self) -> float:
        """Time a wave takes from end to end [s]."""
        return math.fsum(section.transit_time for section in self.sections)


class SceneRules:
    """What follows from the groups of a scene."""

    if TYPE_CHECKING:
        effects: Any
        piston: Any
        bit: Any
        gravity: Any
        feed: Any
        drive: Any
        loss: Any
        rock: Any
        contact: Any
        start: Any
        solver: Any
        fem: Any
        blow_map: Any
        run: Any

    def row_of(self, key: str) -> Row:
        """Row of a dotted key in the parameter table; `SceneError` where there is none."""
        raise NotImplementedError

    @property
    def given(self) -> frozenset[str]:
        """Dotted keys that were given, not left to their defaults."""
        raise NotImplementedError

    def __getitem__(self, key: str) -> Any:
        """Return the value of a dotted key."""
        value: Any = self
        try:
            for part in key.split("."):
                value = value[int(part)] if part.isdigit() else getattr(value, part)
        except (AttributeError, IndexError):
            raise KeyError(f"unknown key {key}") from None
        return value

    def matters(self, key: str) -> bool:
        """Tell whether a parameter has any influence on this scene."""
        return all(self[need] in values for need, values in self.row_of(key).needs.items())

    @property
    def solver_name(self) -> str:
        """Solver that computes the scene: "wave", "fem", "rigid" or "blow-map"."""
        if self.bit.model == "elastic" and self.solver.fidelity != "wave":
            return str(self.solver.fidelity)
        if self.solver.name != "auto":
            return str(self.solver.name)
        return "wave" if self.bit.model == "elastic" else "rigid"

    @property
    def loss_on(self) -> bool:
        """Whether bars lose energy to structural loss."""
        return bool(self.effects.loss and self.solver_name != "rigid" and self.loss.time > 0)

    @property
    def barrier_on(self) -> bool:
        """Whether the rock law has an energy barrier (mode DFC)."""
        wanted = self.effects.barrier and self.effects.rock == "bilinear"
        return bool(wanted and self.rock.barrier_energy > 0 and self.rock.barrier_damping > 0)


def refuse_contradictions(scene: SceneRules) -> None:
    """Raise `SceneError` if parts of a scene contradict each other."""
    effects, piston, bit, run = scene.effects, scene.piston.model, scene.bit.model, scene.run
    if piston == "absent" and effects.drive != "none":
        raise SceneError(
            f'effects.drive = "{effects.drive}" needs a piston, but piston.model = "absent": '
            'set effects.drive = "none" or give a piston'
        )
    if piston == "elastic" and bit == "rigid":
        raise SceneError(
            'piston.model = "elastic" with bit.model = "rigid": no solver computes this; '
            'set bit.model = "elastic" or piston.model = "rigid"'
        )
    if scene.solver.name in ("wave", "fem") and bit == "rigid":
        raise SceneError(
            f'solver.name = "{scene.solver.name}" needs bit.model = "elastic": '
            'set that, or solver.name = "rigid" or "auto"'
        )
    if scene.solver.name == "rigid" and bit == "elastic":
        raise SceneError(
            'solver.name = "rigid" computes no elastic bars: set piston.model = "rigid" and '
            'bit.model = "rigid", or solver.name = "wave", "fem" or "auto"'
        )
    _refuse_fidelity(scene)
    _refuse_requests(scene)
    if effects.barrier and effects.rock != "bilinear" and "effects.barrier" in scene.given:
        raise SceneError(
            f'effects.barrier = true needs effects.rock = "bilinear", not "{effects.rock}": '
            "set effects.barrier = false"
        )
    if run.settle >= run.duration:
        raise SceneError(
            f"run.settle = {run.settle!r} s: must be below run.duration = {run.duration!r} s"
        )


# What the blow map is a table of, and the ranges that must rise.
_MAPPED = {"effects.drive": "pressure", "effects.rock": "bilinear", "bit.model": "elastic"}
_RANGES = ("velocity", "feed", "force", "stiffness")


def _refuse_fidelity(scene: SceneRules) -> None:
    """Raise `SceneError` if a scene asks for a fidelity that it cannot have."""
    fidelity = scene.solver.fidelity
    if fidelity == "wave":
        return
    if scene.solver.name != "auto":
        raise SceneError(
            f'solver.fidelity = "{fidelity}" and solver.name = "{scene.solver.name}": a name '
            'says how elastic waves are computed; leave it "auto"'
        )
    if fidelity != "blow-map":
        return
    for key, wanted in _MAPPED.items():
        if scene[key] != wanted:
            raise SceneError(
                f'solver.fidelity = "blow-map" needs {key} = "{wanted}", not "{scene[key]}"'
            )
    for name in _RANGES:
        low, high = scene[f"blow_map.{name}_from"], scene[f"blow_map.{name}_to"]
        if not low < high:
            raise SceneError(
                f"blow_map.{name}_from = {low!r}: must be below blow_map.{name}_to = {high!r}"
            )


def _refuse_requests(scene: SceneRules) -> None:
    """Refuse an accuracy that is said in two ways, or that no rule picks a mesh for."""
    accuracy, cells = scene.solver.accuracy, scene.solver.cells
    if accuracy is None:
        return
    if cells is not None:
        raise SceneError(
            f"solver.accuracy = {accuracy!r} and solver.cells = {cells!r} both choose the "
            "resolution: give one of them"
        )
    if scene.solver.name == "fem":
        raise SceneError(
            f"solver.accuracy = {accuracy!r} picks the cells of waves, no finite elements: set "
            "fem.elements, fem.courant and fem.contact_stiffness, or solver.name = "
            '"wave" or "auto"'
        )
    if scene.solver_name == "blow-map":
        raise SceneError(
            f"solver.accuracy = {accuracy!r}: a blow map is as accurate as its table "
            '(docs/fidelity.md); set blow_map.density, or solver.fidelity = "wave"'
        )
