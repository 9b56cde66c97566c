"""Numbers with a unit, as in "5 kN": read as SI, and what is said of those that are none.

A scene holds SI numbers alone; text with a unit is converted where it is given. The factors
are those of pint, as exact fractions, so that a value is rounded once. It is imported when
there is such text, and given nothing but single names of units: it would evaluate expressions.
"""

from __future__ import annotations

import contextlib
import math
import re
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from percussion_model.physics.gas import FREE_AIR
from percussion_model.scene.rows import (
    REFUSED,
    ParameterRow,
    refuse_value,
    show_value,
    unit_suffix,
)

if TYPE_CHECKING:
    from fractions import Fraction

# No number with its unit is longer [characters].
LONGEST = 60
_NUMBER = r"[+-]?(?:[0-9]{1,25}(?:\.[0-9]{0,25})?|\.[0-9]{1,25})(?:[eE][+-]?[0-9]{1,3})?"
_NUMBER_ALONE = re.compile(_NUMBER)
# A name of a unit, and a power of it; most of them a force by length and time.
_FACTOR = r"(?:[A-Za-zµμ]{1,24}|%)(?:[²³]|\^?[1-9]|\^?-[1-9])?"
_SIGN = r"(?:[ ]?[*·/][ ]?|[ ])"
_UNIT = re.compile(rf"{_FACTOR}(?:{_SIGN}{_FACTOR}){{0,5}}")
_QUANTITY = re.compile(rf"[ ]*(?P<number>{_NUMBER})[ ]*(?P<unit>{_UNIT.pattern})[ ]*")
_FACTORS = re.compile(r"(?P<sign>^|[ *·/]+)(?P<name>[A-Za-zµμ]+|%)(?P<power>[²³]|\^?-?[1-9])?")
# Temperatures and bits are in no parameter.
_DIMENSIONS = {"[length]", "[mass]", "[time]", "[angle]", "[temperature]"}
# For pint these have no dimension: then a frequency were a speed of rotation.
_ANGLES = ("rad", "radian", "deg", "degree", "revolution", "turn")
_ROTATION = ("rpm",)
# People mean different masses by it.
_AMBIGUOUS = {"ton": "t or lb", "tons": "t or lb"}


class Quantity(NamedTuple):
    """What a number of an SI unit is.

    Attributes
    ----------
    name : str
    example : tuple of str
        The same value as a number in SI and with other units.
    usual : tuple of str
        Units in which people give it, those of a slip of the unit first.
    """

    name: str
    example: tuple[str, ...]
    usual: tuple[str, ...]


# By the unit of the parameter table.
QUANTITIES = {
    "N": Quantity("a force", ("5000", "5 kN", "1124 lbf"), ("kN", "MN", "mN", "lbf", "kgf")),
    "m": Quantity("a length", ("0.04", "40 mm", "1.575 in"), ("mm", "cm", "um", "in", "ft")),
    "m^2": Quantity("an area", ("0.0055", "55 cm^2", "8.525 in^2"), ("mm^2", "cm^2", "in^2")),
    "s": Quantity("a time", ("0.002", "2 ms"), ("ms", "us", "ns", "min", "h")),
    "kg": Quantity("a mass", ("150", "0.15 t", "330.7 lb"), ("g", "t", "lb")),
    "kg/m^3": Quantity(
        "a density", ("7850", "7.85 g/cm^3", "490.1 lb/ft^3"), ("g/cm^3", "t/m^3", "lb/ft^3")
    ),
    "Pa": Quantity(
        "a pressure or stress", ("2.4e6", "24 bar", "348.1 psi"), ("bar", "MPa", "GPa", "psi")
    ),
    "N/m": Quantity(
        "a stiffness", ("1e8", "100 kN/mm", "571 klbf/in"), ("GN/m", "kN/mm", "MN/m", "N/mm")
    ),
    "N s/m": Quantity("a damping", ("10000", "10 kN s/m"), ("kN s/m", "N s/mm", "kg/s")),
    "J": Quantity("an energy", ("0.05", "50 mJ", "0.03688 ft lbf"), ("kJ", "mJ", "ft lbf")),
    "m/s": Quantity("a velocity", ("10", "1000 cm/s", "32.81 ft/s"), ("mm/s", "km/h", "ft/s")),
    "m/s^2": Quantity("an acceleration", ("9.81", "32.19 ft/s^2"), ("mm/s^2", "ft/s^2")),
    "rad/s": Quantity("a speed of rotation", ("5.655", "54 rpm"), ("rpm", "deg/s")),
    "N m": Quantity("a torque", ("600", "0.6 kN m", "442.5 ft lbf"), ("kN m", "ft lbf")),
    "N m/rad": Quantity(
        "a stiffness of a twist", ("7000", "7 kN m/rad", "122.2 N m/deg"), ("kN m/rad", "N m/deg")
    ),
    "kg m^2": Quantity("a moment of inertia", ("0.2", "2000 kg cm^2"), ("kg cm^2", "g m^2")),
    "m^3": Quantity("a volume", ("5e-6", "5 cm^3"), ("cm^3", "l", "in^3")),
    "m^3/s": Quantity("a flow", ("0.001", "60 l/min"), ("l/min", "m^3/min", "cm^3/s")),
    "m^3/s/Pa": Quantity("a leakage", ("1.5e-12", "1.5 cm^3/s/MPa"), ("cm^3/s/MPa", "l/min/bar")),
    "J/m^3": Quantity("an energy per volume", ("5.5e7", "55 MJ/m^3"), ("MJ/m^3", "J/cm^3")),
    "kg/s": Quantity(
        "a mass flow, or one of free air",
        ("0.45", "27 kg/min", "20.89 m^3/min"),
        ("kg/min", "m^3/min", "g/s", "lb/min"),
    ),
    "K": Quantity("a temperature", ("300", "300000 mK"), ("mK",)),
    "W/K": Quantity("a conductance of heat", ("50", "0.05 kW/K"), ("kW/K",)),
    "-": Quantity("a pure number", ("0.01", "1 %"), ("%",)),
}  # fmt: skip


class UnitError(ValueError):
    """A number with a unit that is none of what is wanted; the message says why, if more is
    to be said than what is wanted."""


class NoQuantityError(UnitError):
    """A text that is no number with a unit."""


def read_value(row: ParameterRow, value: Any) -> Any:
    """Return a value as a scene keeps it, `REFUSED` if it is not allowed.

    As `ParameterRow.read`, which it goes beyond by numbers with their unit as text.
    """
    found = row.read(value)
    if found is REFUSED and isinstance(value, str) and row.kind == "number":
        try:
            return row.read(in_si(value, row.unit))
        except UnitError:
            return REFUSED
    return found


def refuse(row: ParameterRow, key: str, value: Any) -> str:
    """Say in one line that a value is not allowed, and what is."""
    if not (isinstance(value, str) and row.kind == "number"):
        return refuse_value(row, key, value)
    begin = f"{key} = {show_value(value)}"
    found = QUANTITIES.get(row.unit, Quantity(f"a number in {row.unit}", (), ()))
    number, *texts = found.example or ("",)
    quoted = [f'"{text}"' for text in texts]
    try:
        shown = f"{in_si(value, row.unit):g}{unit_suffix(row.unit)}"
        return f"{begin} ({shown}): must be {row.allowed}"
    except NoQuantityError as error:
        why = f"{error}: " if str(error) else ""
        text = f", or text as {' or '.join(quoted)}" if quoted else ""
        return f"{begin}: {why}must be {row.allowed}{text}"
    except UnitError as error:
        why = f"{error}: " if str(error) else ""
        examples = " or ".join([", ".join([number, *quoted[:-1]]), *quoted[-1:]])
        instance = f", for instance {examples}" if quoted else ""
        return f"{begin}: {why}{found.name} is wanted{instance}"


def in_si(text: str, unit: str) -> float:
    """Convert a number with its unit, correctly rounded; infinite where it is beyond all floats.

    Parameters
    ----------
    text : str
        As "5 kN", "0.75 kN/um", "1e4 N*s/m"; units with prefixes and powers, their products
        and quotients.
    unit : str
        The SI unit that is wanted, as the parameter table has it.

    Raises
    ------
    UnitError
        If it is no such number, or one of another dimension.
    """
    if len(text) > LONGEST:
        raise NoQuantityError(f"is longer than {LONGEST} characters")
    found = _QUANTITY.fullmatch(text)
    if found is None:
        pointed = with_point(text)
        raise NoQuantityError(f'write "{pointed}", with a decimal point' if pointed else "")
    from fractions import Fraction

    value = Fraction(found["number"]) * factor(found["unit"], unit)
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def has_unit(text: str) -> bool:
    """Whether a text is a number with a unit, of whatever dimension."""
    return len(text) <= LONGEST and _QUANTITY.fullmatch(text) is not None


def with_point(text: str) -> str:
    """The same number with a decimal point, if it has a decimal comma; else nothing."""
    pointed = text.strip().replace(",", ".", 1)
    is_number = _NUMBER_ALONE.fullmatch(pointed) is not None or has_unit(pointed)
    return pointed if "," in text and len(pointed) <= LONGEST and is_number else ""


@lru_cache(maxsize=256)
def factor(unit: str, si: str) -> Fraction:
    """Exact factor from a unit to an SI unit of the same dimension, or of free air to its mass.

    Raises
    ------
    UnitError
        If there is none: for what is written otherwise, an unknown unit, another dimension,
        and units whose zero is another one or that are logarithms.
    """
    from fractions import Fraction

    if not all(len(one) <= LONGEST and _UNIT.fullmatch(one) for one in (unit, si) if one != "-"):
        raise UnitError
    if si == "-":
        if unit == "%":
            return Fraction(1, 100)
        raise UnitError
    wanted, kind = _factor_and_dimension(si, si)
    try:
        given, own = _factor_and_dimension(unit, si)
    except UnitError as error:
        if str(error):
            raise
        own = None
    if own != kind and si == "kg/s":  # a flow of free air
        return factor(unit, "m^3/s") * Fraction(str(FREE_AIR))
    if own != kind:
        meant = _meant(unit, si)
        raise UnitError(f"{unit} is another quantity{meant}" if meant else "")
    return given / wanted


def _factor_and_dimension(unit: str, si: str) -> tuple[Fraction, dict[str, int]]:
    """Factor of a unit to that of its dimension, and powers of length, mass, time, angle."""
    from fractions import Fraction

    product, powers = Fraction(1), dict.fromkeys(_DIMENSIONS, 0)
    for part in _FACTORS.finditer(unit):
        power = int({"²": "2", "³": "3", None: "1"}.get(part["power"], part["power"]).strip("^"))
        power = -power if "/" in part["sign"] else power
        own, dimension = _single(part["name"], si, unit)
        product *= own**power
        for name, exponent in dimension:
            powers[name] += power * exponent
    return product, powers


@cache
def _registry() -> Any:
    """Units of pint, with exact factors."""
    from fractions import Fraction

    import pint  # only what reads units needs it, and it takes its time

    return pint.UnitRegistry(non_int_type=Fraction)


@lru_cache(maxsize=256)
def _single(name: str, si: str, whole: str) -> tuple[Fraction, tuple[tuple[str, int], ...]]:
    """Factor and dimension of a unit that is a single name.

    Parameters
    ----------
    name : str
    si, whole : str
        Wanted, and all that was given, for what is said of an unknown one.
    """
    from fractions import Fraction

    if name in _AMBIGUOUS:
        raise UnitError(f"{name} has several meanings, write {_AMBIGUOUS[name]}")
    known = _registry()
    try:
        unit = known.parse_units(name)
    except Exception:  # pint has many, and names of others may be anything
        raise UnitError(f"{name} is no known unit{_meant(whole, si)}") from None
    try:
        found = known.Quantity(Fraction(1), unit).to_root_units()
        nothing = known.Quantity(Fraction(0), unit).to_root_units()
    except Exception:  # of logarithms
        raise UnitError from None
    dimension = tuple((key, int(power)) for key, power in found.dimensionality.items())
    if name in (*_ANGLES, *_ROTATION):
        dimension = (*dimension, ("[angle]", 1))
    if nothing.magnitude != 0 or not dimension or not {key for key, _ in dimension} <= _DIMENSIONS:
        raise UnitError
    return Fraction(found.magnitude), dimension


def _meant(unit: str, si: str) -> str:
    """Ask for a unit of the same quantity that is written with other letters, small or large."""
    usual = (*QUANTITIES[si].usual, si) if si in QUANTITIES else (si,)
    near = [one for one in usual if one.casefold() == unit.casefold()]
    if not near and unit != unit.lower():  # BAR, Newton
        with contextlib.suppress(UnitError):
            factor(unit.lower(), si)
            near = [unit.lower()]
    return f" (did you mean {near[0]}?)" if near else ""
