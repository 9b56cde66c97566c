"""Hammers on the market by name: what makers tell of each, number by number, with sources.

They are data, no scenes: those of `percussion_model.scene.hammers` stand for some of them.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

from percussion_model.scene.hammers import hammers as scenes
from percussion_model.scene.rocks import Number
from percussion_model.scene.rows import SceneError, said_among, shortened, show_value
from percussion_model.scene.text import read_stored, read_toml, stored_names

_HERE = Path(__file__).parent
# Read in a source; computed from others of the hammer; a guess with its reason.
KINDS = ("published", "derived", "estimated")
# What drives a hammer: air and water down the hole, oil above it.
DRIVES = ("air", "water", "oil")
# Quantities: unit, and bounds beyond which a number is a slip of the unit.
QUANTITIES: dict[str, tuple[str, float, float]] = {
    "outer_diameter": ("m", 0.02, 1.0),
    "length": ("m", 0.1, 5.0),
    "weight": ("kg", 1.0, 5e3),
    "piston_mass": ("kg", 0.1, 600.0),
    "bore": ("m", 0.01, 0.6),
    "stroke": ("m", 0.005, 0.5),
    "working_pressure": ("Pa", 1e5, 5e7),
    "flow": ("m^3/s", 1e-4, 0.05),
    "air_consumption": ("m^3/s", 1e-3, 5.0),
    "frequency": ("Hz", 3.0, 300.0),
    "impact_energy": ("J", 5.0, 2e4),
    "impact_power": ("W", 500.0, 5e5),
    "input_power": ("W", 1e3, 5e5),
    "least_bit_diameter": ("m", 0.02, 1.5),
    "bit_diameter": ("m", 0.02, 1.5),
    "feed_force": ("N", 100.0, 5e5),
    "rotation_speed": ("rad/s", 0.1, 100.0),
}
# What follows from them.
COMPUTED = {
    "blow_power": "W", "blow_energy": "J", "impact_velocity": "m/s", "fluid_power": "W",
}  # fmt: skip
_GIVEN = ("value", "low", "high", "kind", "why", "source", "at")


@dataclass(frozen=True)
class Figure(Number):
    """A number of a hammer; a published range has its upper end as value.

    Attributes
    ----------
    source : str
        One of `sources()`; empty where it was not published.
    at : float or None
        Pressure of what drives the hammer, above that around it, at which it holds [Pa].
    """

    source: str = ""
    at: float | None = None


@dataclass(frozen=True)
class StoredHammer:
    """A hammer.

    Attributes
    ----------
    name, title : str
    kind : str
        One of `DRIVES`.
    figures : tuple of Figure
        What is known; one quantity may be known at several pressures.
    note : str
        What contradicts itself, or is told of all.
    scene : str
        Scene of `percussion_model.scene.hammers` that stands for it; empty where none does.
    """

    name: str
    title: str
    kind: str
    figures: tuple[Figure, ...]
    note: str = ""
    scene: str = ""

    def figure(self, key: str) -> Figure | None:
        """Return the first number of a quantity; None where it is not known."""
        return next((one for one in self.figures if one.key == key), None)

    @property
    def counts(self) -> dict[str, int]:
        """How many numbers there are of each kind."""
        return {kind: Counter(one.kind for one in self.figures)[kind] for kind in KINDS}

    @property
    def consistency(self) -> tuple[Number, ...]:
        """What follows from the numbers, by keys of `COMPUTED`; told, not tuned."""
        return tuple(_computed(self))


def _computed(hammer: StoredHammer) -> Iterator[Number]:
    """Go through what follows; low and high are those of the numbers, taken as independent."""
    energy, rate, power, mass, pressure, flow = map(
        hammer.figure,
        (
            "impact_energy", "frequency", "impact_power", "piston_mass", "working_pressure",
            "flow",
        ),
    )  # fmt: skip
    blow: Number | None = energy
    if energy and rate and "derived" not in (energy.kind, rate.kind):
        yield _product("blow_power", energy, rate, "energy times frequency")
    elif power and rate and not energy:
        blow = _quotient("blow_energy", power, rate, "power by frequency")
        yield blow
    if blow and mass:
        square = _quotient("impact_velocity", blow, mass, "by energy and mass of the piston")
        value, low, high = (math.sqrt(2.0 * v) for v in (square.value, square.low, square.high))
        yield replace(square, value=value, low=low, high=high)
    if pressure and flow:
        yield _product("fluid_power", pressure, flow, "pressure times flow")


def _product(key: str, one: Number, other: Number, why: str) -> Number:
    ends = one.value * other.value, one.low * other.low, one.high * other.high
    return Number(key, *ends, "derived", why)


def _quotient(key: str, one: Number, other: Number, why: str) -> Number:
    ends = one.value / other.value, one.low / other.high, one.high / other.low
    return Number(key, *ends, "derived", why)


def unit_of(key: str) -> str:
    """SI unit of a quantity, or of what follows."""
    return QUANTITIES[key][0] if key in QUANTITIES else COMPUTED[key]


@cache
def sources() -> dict[str, dict[str, Any]]:
    """What was read: `cited`, `read_in` and `second_hand`, by name."""
    return read_toml(_HERE / "_sources.toml")


def stored_hammers() -> list[str]:
    """Names of the hammers that are stored."""
    return stored_names(_HERE)


@cache
def stored_hammer(name: str) -> StoredHammer:
    """Return a hammer.

    Raises
    ------
    SceneError
        If there is none of that name.
    """
    return read_hammer(name, read_stored("hammer", name, stored_hammers(), _HERE))


def read_hammer(name: str, tree: Mapping[str, Any]) -> StoredHammer:
    """Return the hammer that a tree as of its file describes.

    Raises
    ------
    SceneError
        If a number is no number that can be, or does not say where it is from.
    """
    known = ("title", "kind", "note", "scene", "numbers")
    for key in tree:
        _check_name(name, key, key, known)
    for key in ("title", "kind", "numbers"):
        if not tree.get(key):
            _refuse(name, key, tree.get(key, ""), "given")
    if tree["kind"] not in DRIVES:
        _refuse(name, "kind", tree["kind"], f"one of {', '.join(DRIVES)}")
    if tree.get("scene", scenes()[0]) not in scenes():
        _refuse(name, "scene", tree["scene"], f"one of {', '.join(scenes())}")
    figures = []
    for key, given in tree["numbers"].items():
        _check_name(name, f"numbers.{key}", key, QUANTITIES)
        several = given if isinstance(given, list) else [given]
        figures += [_figure(name, key, one) for one in several]
    rest = {key: value for key, value in tree.items() if key != "numbers"}
    return StoredHammer(name, figures=tuple(figures), **rest)


def _figure(name: str, key: str, given: Mapping[str, Any]) -> Figure:
    """One number, checked."""
    place = f"numbers.{key}"
    for word in given:
        _check_name(name, f"{place}.{word}", word, _GIVEN)
    ends = {word: given.get(word, given.get("value")) for word in ("value", "low", "high")}
    for word, end in ends.items():
        _check_number(name, f"{place}.{word}", end, QUANTITIES[key])
    value, low, high = map(float, ends.values())
    if not low <= value <= high:
        _refuse(name, f"{place}.value", value, f"from its low {low:g} to its high {high:g}")
    if "at" in given:
        _check_number(name, f"{place}.at", given["at"], QUANTITIES["working_pressure"])
    kind, why, source = (str(given.get(word, "")) for word in ("kind", "why", "source"))
    if kind not in KINDS:
        _refuse(name, f"{place}.kind", kind, f"one of {', '.join(KINDS)}")
    if kind == "published":
        if source not in sources():
            _refuse(name, f"{place}.source", source, f"one of {', '.join(sources())}")
    elif not (why and low < high):
        _refuse(name, f"{place}.why", why, f"given, with low and high, as the number is {kind}")
    second = kind == "published" and bool(sources()[source]["second_hand"])
    return Figure(key, value, low, high, kind, why, second, source, given.get("at"))


def _check_number(name: str, place: str, given: Any, allowed: tuple[str, float, float]) -> None:
    unit, least, most = allowed
    if type(given) not in (int, float) or not least <= given <= most:
        _refuse(name, place, given, f"from {least:g} to {most:g} {unit}")


def _check_name(name: str, place: str, word: str, known: Any) -> None:
    if word not in known:
        raise SceneError(
            f"hammer {shortened(name)}: {place}: there is none of that name: "
            f"{said_among(word, known)}"
        )


def _refuse(name: str, place: str, value: Any, allowed: str) -> NoReturn:
    raise SceneError(f"hammer {shortened(name)}: {place} = {show_value(value)}: must be {allowed}")
