"""Names of the solvers that a scene may ask for."""

from __future__ import annotations

from typing import Literal

# The choices of `solver.name`; the parameter table reads this list whenever it is asked.
# In FMUs they are numbers: new ones come last.
SOLVER_NAMES = ["auto", "wave", "fem", "rigid", "modal"]
# Bodies that a solver computes, where not both kinds.
BODIES: dict[str, Literal["elastic", "rigid"]] = {
    "wave": "elastic",
    "modal": "elastic",
    "fem": "elastic",
    "rigid": "rigid",
}


def register_name(name: str, bodies: Literal["elastic", "rigid"] | None = None) -> None:
    """Let scenes ask for one more solver.

    Parameters
    ----------
    name : str
        A name that is not taken.
    bodies : {"elastic", "rigid"}, optional
        What `bit.model` must be for this solver; either if left out.
    """
    if name in SOLVER_NAMES:
        raise ValueError(f"solver.name = {name!r}: there is a solver of this name")
    SOLVER_NAMES.append(name)
    if bodies is not None:
        BODIES[name] = bodies


def counted(solver: str) -> str:
    """What a solver divides elastic bars into: "cells", "modes" or "elements"."""
    return {"modal": "modes", "fem": "elements"}.get(solver, "cells")
