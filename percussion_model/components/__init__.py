"""Components that act on piston or bit, one file each.

Each module of this folder that defines `COMPONENT` is found by itself. Its force acts on the
body by mass, as weight and feed do. Its parameters, its switch in `[effects]`, its state, the
columns that show it and its entry of the ledger follow from the same definition
(CONTRIBUTING.md, "To add a component").
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType
from typing import Any, Literal, NamedTuple


class Component(NamedTuple):
    """A force on a body that follows from the motion, and from a state of its own.

    Attributes
    ----------
    name : str
        Of the switch `effects.NAME`, of the table `[NAME]` that holds its parameters,
        and of its entry of the ledger.
    description : str
        For the list of parameters.
    parameters : dict of tuple
        Default, unit, description, least and greatest value by name; kernels find the
        parameter X as `par.NAME_X`.
    force : kernel
        force(par, s, h) -> mean force over the next time h in which the body moves on, down
        positive [N]. A mean that is off by h^2 makes a motion that is off by h^2.
    body : {"bit", "piston"}
        That it acts on. A force on the piston is part of the drive's.
    state : dict of tuple
        Unit, description and start of each field by name: a number, or the name of a parameter
        that holds it. Kernels find the field X as `s.NAME_X`, and it is a column `NAME_X`.
    pass_time : kernel or None
        pass_time(par, s, h): take the state on by a time h, at whose end the bodies are.
    """

    name: str
    description: str
    parameters: dict[str, tuple[float, str, str, float, float]]
    force: Callable[..., float]
    body: Literal["bit", "piston"] = "bit"
    state: Any = MappingProxyType({})
    pass_time: Callable[..., None] | None = None

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of its state's fields in the state of a solver."""
        return tuple(f"{self.name}_{field}" for field in self.state)


def _components() -> tuple[Component, ...]:
    names = sorted(module.name for module in iter_modules(__path__))
    return tuple(import_module(f"{__name__}.{name}").COMPONENT for name in names)


COMPONENTS = _components()
