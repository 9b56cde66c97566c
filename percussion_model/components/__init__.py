"""Components that act on piston, bit and hole, one file each.

Each module of this folder defines `COMPONENT` and is found by itself. A force acts on the
body by mass, as weight and feed do. Parameters, switch in `[effects]`, inputs, state, the
columns that show it and entries of the ledger follow from the same definition
(CONTRIBUTING.md, "To add a component").
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from percussion_model.physics.kernel import DISABLED, Kernel

Side = Literal["work", "dissipated", "stored"]
# Kernels of a component, and how many arguments each takes.
_ARGUMENTS = {
    **dict.fromkeys(("on_piston", "on_bit", "pass_time", "gained", "end_loading", "kept"), 3),
    **dict.fromkeys(("lasts", "slope", "loading"), 2),
    "next_blow": 7,
}
# Units are products of these, and quotients of such, as "N s/m^2", "m^3/s/Pa" or "J/(kg K)".
UNITS = ("m", "s", "kg", "N", "J", "Pa", "W", "K", "Hz", "rad")
_FACTOR = rf"(?:{'|'.join(UNITS)})(?:\^[2-9])?"
_PRODUCT = rf"{_FACTOR}(?: {_FACTOR})*"
_UNIT = re.compile(rf"-?|(?:1|{_PRODUCT})(?:(?:/{_FACTOR})*|/\({_PRODUCT}\))")
_NOTHING: Mapping[str, Any] = MappingProxyType({})


class Component(NamedTuple):
    """What follows from the motion, and from a state of its own; all kernels but one may be None.

    Attributes
    ----------
    name : str
        Of the switch `effects.NAME` and of the table `[NAME]` that holds its parameters.
    description : str
        For the list of parameters.
    parameters : mapping of tuple
        Default, unit, description, least and greatest value by name; kernels find the
        parameter X as `par.NAME_X`. A default of None has to be given where the component is
        on; one that is true or false makes a flag, a least value of int a whole number. One
        named `step` is longer in runs that tell the error of this one.
    on_piston, on_bit : kernel or None
        on_...(par, s, h) -> mean force over the next time h in which the body moves on, down
        positive [N]. A mean that is off by h^2 makes a motion that is off by h^2. A force on
        the piston is part of the drive's.
    stores : bool
        It gives back what these forces take, as a spring: the ledger counts that as stored.
    state : mapping of tuple
        Unit, description and start of each field by name: a number, or the name of a parameter
        that holds it. Kernels find the field X as `s.NAME_X`, and it is a column `NAME_X`.
    pass_time : kernel or None
        pass_time(par, s, h): take the state on by a time h, at whose end the bodies are.
    inputs : tuple of str
        Parameters that may change during a run: kernels find X as `s.NAME_X`.
    loading : kernel or None
        loading(par, x) -> f(x), f'(x) and its integral from 0: rock is loaded by the force
        K_R P_0 f(P / P_0) of each button in place of the power, which it `needs`. f grows with f'
        and is 1 at 1.
    gained : kernel or None
        gained(par, s, deeper) -> part of what a loading crushes deeper [m] by which the hole
        advances; the bit climbs out of the rest where it turns.
    end_loading : kernel or None
        end_loading(par, s, gained): a drilling cycle is at its peak.
    kept : kernel or None
        kept(par, s, period) -> share of their depth that craters keep where the bit has turned
        for a time [s].
    next_blow : kernel or None
        next_blow(par, s, period, kept, rest, push, climb): a blow begins, a period [s] after
        the one before. Feed and weight of the bit are the force at `rest`, with the drive and
        the piston the mean one, `push` [N], against which the bit has climbed [m].
    of_blow : tuple of str
        Fields of the state whose value after a blow is a column of blows, `NAME_X`.
    entries : mapping of tuple
        Further entries of the ledger by name: "work", "dissipated" or "stored", and what it is.
        Kernels add to `s.e_ENTRY`.
    needs : mapping of tuple
        What must hold for it to be on: values that a key may have, by the key.
    is_drive : bool
        It is a choice of `effects.drive`, by its name, and no switch; its works are the drive's,
        and it sets `s.armed` where the next closure of the gap begins a blow.
    is_throttled : bool
        A drive that has less where the casing lifts off: it asks `throttle` of physics/feed.py.
    takes_feed : bool
        The feed acts on a body of it, `s.feed`, and no longer on the bit.
    lasts : kernel or None
        lasts(par, s) -> time above 0 for which its mean forces may be taken as constant [s].
        Without it modes make no leaps.
    slope : kernel or None
        slope(par, s) -> how fast the force on the piston changes while it lasts [N/s].
    hidden : tuple of str
        Further fields of the state, which start at 0 and are no columns.
    usual : mapping of tuple
        Least and greatest usual value of a parameter: one ten times beyond deserves a hint.
    """

    name: str
    description: str
    parameters: Mapping[str, tuple[float | bool | None, str, str, float, float]]
    on_piston: Callable[..., float] | None = None
    on_bit: Callable[..., float] | None = None
    state: Mapping[str, tuple[str, str, float | str]] = _NOTHING
    pass_time: Callable[..., None] | None = None
    inputs: tuple[str, ...] = ()
    gained: Callable[..., float] | None = None
    end_loading: Callable[..., None] | None = None
    kept: Callable[..., float] | None = None
    next_blow: Callable[..., None] | None = None
    of_blow: tuple[str, ...] = ()
    entries: Mapping[str, tuple[Side, str]] = _NOTHING
    needs: Mapping[str, tuple[Any, ...]] = _NOTHING
    is_drive: bool = False
    lasts: Callable[..., float] | None = None
    slope: Callable[..., float] | None = None
    hidden: tuple[str, ...] = ()
    usual: Mapping[str, tuple[float, float]] = _NOTHING
    stores: bool = False
    loading: Callable[..., tuple[float, float, float]] | None = None
    is_throttled: bool = False
    takes_feed: bool = False

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of its state's fields in the state of a solver, those that are columns."""
        return tuple(f"{self.name}_{field}" for field in self.state)

    @property
    def switch(self) -> tuple[str, Any]:
        """Key that turns it on, and the value for that."""
        return ("effects.drive", self.name) if self.is_drive else (f"effects.{self.name}", True)

    @property
    def pushes(self) -> tuple[str, ...]:
        """Bodies that it pushes."""
        forces = {"bit": self.on_bit, "piston": self.on_piston}
        return tuple(body for body, force in forces.items() if force is not None)

    @property
    def ledger(self) -> dict[str, tuple[Side, str]]:
        """Entries of the ledger, that of its force before others: side and meaning by name."""
        bodies = " and the ".join(self.pushes)
        side: Side = "stored" if self.stores else "work" if self.takes_feed else "dissipated"
        way = "given to" if side == "work" else "taken from"
        of_force = {self.name: (side, f"{way} the {bodies} by {self.description}")}
        if self.is_drive or not self.pushes:
            of_force = {}
        return {**of_force, **self.entries}

    @property
    def named(self) -> Iterator[tuple[str, str]]:
        """Files of its kernels, and names in them that begin as its parameters and fields do."""
        kernels = (getattr(self, port) for port in _ARGUMENTS)
        for file in {one.__module__ for one in kernels if one is not None}:
            around = vars(import_module(file))
            for code in (one.__code__ for one in around.values() if hasattr(one, "__code__")):
                names = (one for one in code.co_names if one.startswith(f"{self.name}_"))
                yield from ((file, name) for name in names if name not in around)

    @property
    def fault(self) -> str:
        """What is wrong with the definition; empty if nothing is."""
        for port, count in _ARGUMENTS.items():
            kernel = getattr(self, port)
            if kernel is None:
                continue
            if not (DISABLED or isinstance(kernel, Kernel)):
                return f"{port}: a kernel has a decorator, as `inlined`"
            if kernel.__code__.co_argcount != count:
                return f"{port} takes {kernel.__code__.co_argcount} arguments: must be {count}"
        if all(getattr(self, port) is None for port in _ARGUMENTS):
            return "it has no kernel"
        if self.is_drive and self.on_piston is None:
            return "a drive has a kernel on_piston"
        if self.loading and self.needs.get("effects.rock") != ("power",):
            return 'with loading it needs {"effects.rock": ("power",)}'
        for name, of in self.parameters.items():
            if len(of) != 5:
                return f"{name} has {len(of)} values: must be default, unit, description, limits"
            default, _, _, lower, upper = of
            if default is not None and not lower <= default <= upper:
                return f"{name} is {default!r} by default: must be from {lower!r} to {upper!r}"
        units = {name: of[1] for name, of in self.parameters.items()}
        for name, unit in (units | {name: of[0] for name, of in self.state.items()}).items():
            if not _UNIT.fullmatch(unit):
                must = f"must be -, or of {', '.join(UNITS)}, as N s/m^2"
                return f"{name} has the unit {unit!r}: {must}"
        starts = {start for *_, start in self.state.values() if isinstance(start, str)}
        for where, names, known in (
            ("state", starts, self.parameters),
            ("inputs", self.inputs, self.parameters),
            ("usual", self.usual, self.parameters),
            ("of_blow", self.of_blow, self.state),
        ):
            for name in sorted({*names} - {*known}):
                return f"{where}: {name} must be one of {', '.join(known) or 'none'}"
        return ""


def _component(name: str) -> Component:
    file = f"{name}.py of percussion_model/components"
    try:
        found = getattr(import_module(f"{__name__}.{name}"), "COMPONENT", None)
    except TypeError as error:
        told = str(error).replace("Component.__new__", "Component")
        if not told.startswith("Component()"):
            raise
        raise ValueError(f"{file}: {told}: it takes {', '.join(Component._fields)}") from None
    if not isinstance(found, Component):
        raise ValueError(f"{file}: it defines no COMPONENT")
    if fault := found.fault:
        raise ValueError(f"{file}: {fault}")
    return found


def _components() -> tuple[Component, ...]:
    return tuple(_component(name) for name in sorted(one.name for one in iter_modules(__path__)))


COMPONENTS = _components()
# Those that push.
FORCES = tuple(one for one in COMPONENTS if one.pushes)
# Those that are drives.
DRIVES = tuple(one for one in COMPONENTS if one.is_drive)


def entries_on(side: Side) -> tuple[str, ...]:
    """Names of the ledger's entries of components on a side."""
    return tuple(
        name for one in COMPONENTS for name, (found, _) in one.ledger.items() if found == side
    )
