"""Units of the interface: SI on the wire, other ones for people to read."""

from __future__ import annotations

import re
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement


@dataclass(frozen=True)
class Unit:
    """A unit by its exponents of SI base units, and units to display it in.

    `displays` gives factors: displayed number = factor * number in the unit.
    """

    base: dict[str, int]
    displays: dict[str, float]


# Those that others are products of, and those with a display; what is met besides comes to them.
UNITS: dict[str, Unit] = {
    "1": Unit({}, {"%": 100.0}),
    "m": Unit({"m": 1}, {"mm": 1e3}),
    "m2": Unit({"m": 2}, {"mm2": 1e6}),
    "s": Unit({"s": 1}, {"ms": 1e3, "us": 1e6}),
    "Hz": Unit({"s": -1}, {"1/min": 60.0}),
    "m/s": Unit({"m": 1, "s": -1}, {"mm/s": 1e3, "m/h": 3600.0}),
    "N": Unit({"kg": 1, "m": 1, "s": -2}, {"kN": 1e-3}),
    "N/m": Unit({"kg": 1, "s": -2}, {"kN/mm": 1e-6}),
    "J": Unit({"kg": 1, "m": 2, "s": -2}, {}),
    "Pa": Unit({"kg": 1, "m": -1, "s": -2}, {"bar": 1e-5, "MPa": 1e-6}),
    "kg": Unit({"kg": 1}, {}),
    "K": Unit({"K": 1}, {}),
    "rad": Unit({"rad": 1}, {}),
    "rad/s": Unit({"rad": 1, "s": -1}, {"rpm": 9.549296585513721}),
    "W": Unit({"kg": 1, "m": 2, "s": -3}, {}),
}

# A symbol and its exponent, as in m3.
_FACTOR = re.compile(r"([A-Za-z]+)(\d*)")


def fmi_unit(unit: str) -> str:
    """Name of a unit of the parameter table in the interface: `N s/m^2` there is `N.s/m2` here.

    What is not among `UNITS` yet is added to them, where it is a product of such.

    Raises
    ------
    ValueError
        Where it is not.
    """
    name = unit.replace("^", "").replace(" ", ".") if unit not in ("", "-") else "1"
    above, *below = name.split("/")
    if len(below) > 1:  # which FMI writes as one divisor
        name = f"{above}/({'.'.join(below)})"
    if name not in UNITS:
        UNITS[name] = Unit(_exponents(name), {})
    return name


def _exponents(name: str) -> dict[str, int]:
    found: dict[str, int] = {}
    above, _, below = name.partition("/")
    for product, sign in ((above, 1), (below.strip("()"), -1)):
        for factor in filter(None, product.split(".")):
            read = _FACTOR.fullmatch(factor)
            if factor != "1" and (read is None or read[1] not in UNITS):
                must = f"one of {', '.join(UNITS)}, with a whole exponent"
                raise ValueError(f"unit {name!r}: {factor!r} must be {must}")
            if read:
                for base, power in UNITS[read[1]].base.items():
                    found[base] = found.get(base, 0) + sign * power * int(read[2] or 1)
    return {base: power for base, power in found.items() if power}


def write_units(names: set[str]) -> Element:
    """UnitDefinitions with the units of these names."""
    root = Element("UnitDefinitions")
    for name in sorted(map(fmi_unit, names)):
        node, unit = SubElement(root, "Unit", {"name": name}), UNITS[name]
        SubElement(node, "BaseUnit", {base: str(power) for base, power in unit.base.items()})
        for display, factor in unit.displays.items():
            SubElement(node, "DisplayUnit", {"name": display, "factor": repr(factor)})
    return root
