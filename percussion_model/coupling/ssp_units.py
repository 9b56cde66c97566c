"""Units as SSP and FMI define them, and the conversion from one to another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from percussion_model.coupling.component import CouplingError
from percussion_model.coupling.ssp_xml import elements
from percussion_model.scene.rows import shortened
from percussion_model.scene.units import UnitError, factor

# What a pure number is called where nothing defines it.
PURE = ("1", "-")
BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


class Unit(NamedTuple):
    """A unit: the number in SI units is `factor * number + offset`.

    Attributes
    ----------
    name : str
    powers : tuple of int, optional
        Of `BASES`; None for one that is named and defined nowhere.
    """

    name: str
    powers: tuple[int, ...] | None = None
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Linear:
    """What a number becomes: `gain * number + shift`."""

    gain: float = 1.0
    shift: float = 0.0

    def __call__(self, number: float) -> float:
        """Return what a number becomes."""
        return self.gain * number + self.shift


def unit_named(name: str | None, known: Mapping[str, Unit]) -> Unit | None:
    """A unit by name, None without one."""
    if not name or name in known:
        return known.get(name or "")
    return Unit(name, (0,) * len(BASES) if name in PURE else None)


def units_of(node: Any, path: str) -> dict[str, Unit]:
    """Units that a file of SSP defines, by name."""
    found = {}
    for one in elements(node, path):
        name = one.get("name")
        if name in found:
            raise CouplingError(f"unit {shortened(name)}: is defined twice")
        found[name] = _defined(name, elements(one, "ssc:BaseUnit")[0].attrib)
    return found


def units_of_fmu(description: Any) -> dict[str, Unit]:
    """Units that an FMU defines, by name."""
    found = {}
    for one in description.unitDefinitions:
        base = one.baseUnit
        keys = (*BASES, "factor", "offset")
        given = None if base is None else {key: getattr(base, key) for key in keys}
        found[one.name] = Unit(one.name) if given is None else _defined(one.name, given)
    return found


def _defined(name: str, given: Mapping[str, Any]) -> Unit:
    powers = tuple(int(given.get(key, 0)) for key in BASES)
    found = Unit(name, powers, float(given.get("factor", 1.0)), float(given.get("offset", 0.0)))
    if found.factor == 0.0 or not math.isfinite(found.factor) or not math.isfinite(found.offset):
        raise CouplingError(
            f"unit {shortened(name)}: factor = {found.factor}, offset = {found.offset}: must be "
            "finite, and the factor not 0"
        )
    return found


def conversion(
    given: Unit | None, wanted: Unit | None, is_difference: bool = False
) -> Linear | None:
    """Return what converts numbers, None where they stay as they are.

    Parameters
    ----------
    given, wanted : Unit or None
        None where nothing says which.
    is_difference : bool
        Whether zero is zero in each unit.

    Raises
    ------
    UnitError
        If there is no conversion; says why.
    """
    if given is None or wanted is None:
        known = given or wanted
        if known is None or (known.powers is not None and known[2:] == (1.0, 0.0)):
            return None  # plain SI is what numbers without a unit are
        raise UnitError(f"is in {shortened(known.name)}, and no unit is known of the other")
    if given.name == wanted.name and None in (given.powers, wanted.powers):
        return None
    try:
        gain, shift = _factor_and_shift(given, wanted)
        if not (math.isfinite(gain) and math.isfinite(shift)):
            raise UnitError
    except (UnitError, OverflowError) as error:
        names = f"{shortened(given.name)} to {shortened(wanted.name)}"
        # a unit that is not known, and the one that is perhaps meant
        why = f", since {shortened(str(error))}" if "did you mean" in str(error) else ""
        raise UnitError(f"there is no conversion of {names}{why}") from None
    found = Linear(gain, 0.0 if is_difference else shift)
    return None if found == Linear() else found


def _factor_and_shift(given: Unit, wanted: Unit) -> tuple[float, float]:
    if given.powers is None or wanted.powers is None:  # known by no more than the name
        if given.offset or wanted.offset:
            raise UnitError
        by_name = float(factor(_text(given), _text(wanted)))
        return given.factor * by_name / wanted.factor, 0.0
    if given.powers != wanted.powers:
        raise UnitError
    return given.factor / wanted.factor, (given.offset - wanted.offset) / wanted.factor


def _text(unit: Unit) -> str:
    """A unit in words that `scene.units` reads."""
    if unit.powers is None:
        # as FMI writes products, and others all units
        return unit.name.removeprefix("[").removesuffix("]").replace(".", "*")
    if any(unit.powers[BASES.index("A") :]):
        raise UnitError
    powers = zip(BASES, unit.powers, strict=True)
    return "*".join(f"{base}^{power}" for base, power in powers if power) or "-"
