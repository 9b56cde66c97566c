"""Which effects of a scene can be turned off or on, and by what change."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from percussion_model.scene.scene import Scene

_NO_ROCK = "the bit meets no rock: it flies, and drills nothing"
_NO_DRIVE = "nothing throws the piston: what moves is left from the start and comes to rest"
_NO_CRUSHING = "a linear spring gives all back: nothing is crushed"


@dataclass(frozen=True)
class Turn:
    """One effect turned.

    Attributes
    ----------
    effect : str
        Its name; empty for the scene as it is.
    turned : str
        "off", "on", or what takes its place.
    changes : dict
        Values by dotted key.
    off : bool
        Whether something is left out, so that nothing may become dearer.
    no_penetration : str
        Why the rate of penetration means nothing then; may be empty.
    no_blows : str
        Why nothing that is counted by blows means anything; may be empty.
    """

    effect: str
    turned: str
    changes: dict[str, Any] = field(default_factory=dict)
    off: bool = False
    no_penetration: str = ""
    no_blows: str = ""

    def apply(self, scene: Scene) -> Scene:
        """Return the scene with the effect turned; `SceneError` where that is none."""
        if self.changes.get("solver.name") == "rigid":
            rest = {key: value for key, value in self.changes.items() if key != "solver.name"}
            return scene.computed_by("rigid", **rest)
        return scene.replace(**self.changes)


def turns(scene: Scene) -> Iterator[Turn]:
    """Go through the scene as it is, then one effect after the other."""
    effects = scene.effects
    yield Turn("", "as it is", no_penetration=_NO_CRUSHING if effects.rock == "spring" else "")
    for name in ("gravity", "feed"):
        is_on = getattr(effects, name)
        yield Turn(name, "off" if is_on else "on", {f"effects.{name}": not is_on}, off=is_on)
    yield from _drive(scene)
    yield from _rock(scene)
    yield from _bars(scene)
    if scene.solver_name == "wave":
        is_on = scene.solver.leaps
        # Leaps are no effect but an accelerator: a step without them is the same step.
        yield Turn("leaps", "off" if is_on else "on", {"solver.leaps": not is_on})


def _drive(scene: Scene) -> Iterator[Turn]:
    if scene.effects.drive != "none":
        yield Turn("drive", "off", {"effects.drive": "none"}, off=True, no_blows=_NO_DRIVE)
    elif scene.piston.model != "absent":
        yield Turn("drive", "on", {"effects.drive": "pressure"})


def _rock(scene: Scene) -> Iterator[Turn]:
    rock = scene.effects.rock
    if rock == "bilinear":
        if scene.barrier_on:
            yield Turn("barrier", "off", {"effects.barrier": False}, off=True)
        else:
            yield Turn("barrier", "on", {"effects.barrier": True, **_not_zero(scene, _BARRIER)})
        other = "paper" if scene.effects.standstill_tension == "release" else "release"
        yield Turn("standstill tension", other, {"effects.standstill_tension": other})
        yield Turn(
            "bilinear law",
            "spring",
            {"effects.rock": "spring", "effects.barrier": False},
            off=True,
            no_penetration=_NO_CRUSHING,
        )
    if rock == "none":
        yield Turn("rock", "on", {"effects.rock": "bilinear"})
    else:
        changes = {"effects.rock": "none", "effects.barrier": False}
        yield Turn("rock", "off", changes, off=True, no_blows=_NO_ROCK)


def _bars(scene: Scene) -> Iterator[Turn]:
    elastic = scene.bit.model == "elastic"
    if elastic:
        if scene.loss_on:
            yield Turn("loss", "off", {"effects.loss": False}, off=True)
        else:
            changes = {"effects.loss": True, **_not_zero(scene, ("loss.time",))}
            yield Turn("loss", "on", changes)
        if scene.piston.model == "elastic":
            yield Turn("elastic piston", "rigid", {"piston.model": "rigid"}, off=True)
        elif scene.piston.model == "rigid":
            yield Turn("elastic piston", "on", {"piston.model": "elastic"})
        yield Turn("elastic bars", "rigid", {"solver.name": "rigid"}, off=True)
        return
    changes = {"bit.model": "elastic", "solver.name": "auto"}
    if scene.piston.model == "rigid":
        changes["piston.model"] = "elastic"
    yield Turn("elastic bars", "on", changes)


_BARRIER = ("rock.barrier_energy", "rock.barrier_damping")


def _not_zero(scene: Scene, keys: tuple[str, ...]) -> dict[str, Any]:
    """Defaults for what the scene sets to zero, which would keep the effect off."""
    return {key: scene.row_of(key).default for key in keys if scene[key] == 0}
