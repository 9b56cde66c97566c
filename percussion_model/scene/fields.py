"""How a parameter is declared: a number or a choice with its unit, bounds and needs."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

Needs = dict[str, tuple[object, ...]]

# What must hold, key by key, for a parameter to have any influence.
HAS_PISTON: Needs = {"piston.model": ("elastic", "rigid")}
HAS_WAVES: Needs = {"bit.model": ("elastic",)}
SOLVER_WAVE: Needs = {"solver.name": ("auto", "wave"), **HAS_WAVES}
SOLVER_FEM: Needs = {"solver.name": ("fem",)}
BLOW_MAP: Needs = {"solver.fidelity": ("blow-map",), **HAS_WAVES}
ALL_RIGID: Needs = {"piston.model": ("rigid",), "bit.model": ("rigid",)}
GRAVITY_ON: Needs = {"effects.gravity": (True,)}
FEED_ON: Needs = {"effects.feed": (True,)}
DRIVE_PRESSURE: Needs = {"effects.drive": ("pressure",)}
DRIVE_EXTERNAL: Needs = {"effects.drive": ("external",)}
LOSS_ON: Needs = {"effects.loss": (True,), **HAS_WAVES}
ROCK_BILINEAR: Needs = {"effects.rock": ("bilinear",)}
ROCK_SPRINGY: Needs = {"effects.rock": ("bilinear", "spring")}
ROCK_PRESENT: Needs = {"effects.rock": ("bilinear", "spring", "wall")}
BARRIER_ON: Needs = {"effects.barrier": (True,), **ROCK_BILINEAR}


def quantity(
    default: Any,
    unit: str,
    description: str,
    needs: Needs | None = None,
    **bounds: Any,
) -> Any:
    """Declare a number with its unit, bounds (gt, ge, lt, le) and what it needs."""
    extra: Any = {"unit": unit, "needs": needs or {}}
    return Field(default, strict=True, description=description, json_schema_extra=extra, **bounds)


def choice(default: Any, description: str, needs: Needs | None = None) -> Any:
    """Declare one of several words, a flag or a list."""
    extra: Any = {"unit": "", "needs": needs or {}}
    return Field(default, description=description, json_schema_extra=extra)


def _refuse_look_alikes(value: object) -> object:
    """Keep True and 1.0, which compare equal to 1, from passing as the integer."""
    if type(value) is not int:
        raise ValueError("not a whole number")
    return value


Flag = Annotated[bool, Field(strict=True)]
Direction = Annotated[Literal[1, -1], BeforeValidator(_refuse_look_alikes)]


class Parameters(BaseModel):
    """What every group of parameters has in common."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
