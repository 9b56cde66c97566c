"""Effects that are one file each: forces on the bit that follow from its state.

Each module of this folder defines `EFFECT` and is found by itself. Its force is taken
at the start of a step and held over the step, as the feed force is; the work that it
takes from the bit is its entry of the ledger. Its parameters and its switch in
`[effects]` follow from the same definition (CONTRIBUTING.md, "To add an effect").
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pkgutil import iter_modules
from typing import NamedTuple


class Effect(NamedTuple):
    """A force on the bit.

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
        force(par, s) -> force on the bit in the present state, down positive [N].
    """

    name: str
    description: str
    parameters: dict[str, tuple[float, str, str, float, float]]
    force: Callable[..., float]


def _effects() -> tuple[Effect, ...]:
    names = sorted(module.name for module in iter_modules(__path__))
    return tuple(import_module(f"{__name__}.{name}").EFFECT for name in names)


EFFECTS = _effects()
