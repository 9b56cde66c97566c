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
from typing import Any, NamedTuple

from percussion_model.physics.kernel import composed


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


@composed
def _no_force(par: Any, s: Any) -> float:
    return 0.0


@composed
def _no_work(s: Any, path: float) -> None:
    pass


def _and_force(before: Callable, effect: Effect) -> Callable:
    force, held = effect.force, f"f_{effect.name}"

    @composed
    def hold(par: Any, s: Any) -> float:
        total = before(par, s)
        s[held] = force(par, s)
        return total + s[held]

    return hold


def _and_work(before: Callable, effect: Effect) -> Callable:
    held, entry = f"f_{effect.name}", f"e_{effect.name}"

    @composed
    def book(s: Any, path: float) -> None:
        before(s, path)
        s[entry] -= s[held] * path

    return book


# hold_forces(par, s): take the force of each effect now; their sum [N].
# book_forces(s, path): enter what the held forces take from the bit over a path [m].
hold_forces, book_forces = _no_force, _no_work
for _effect in EFFECTS:
    hold_forces, book_forces = _and_force(hold_forces, _effect), _and_work(book_forces, _effect)
