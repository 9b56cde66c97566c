"""Published rates, stored beside this file: a table for each case, with its source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from percussion_model.scene.text import read_toml
from percussion_model.scene.units import in_si

_FILE = Path(__file__).with_name("cases.toml")
TOP, DOWN = "top hammer", "down the hole"
# Units of what a case may have.
_UNITS = {
    "bit": "m", "power": "W", "frequency": "Hz", "pressure": "Pa", "piston": "m", "strength": "Pa",
}  # fmt: skip
_OF_CRATERS = {"strength": "Pa", "bit_energy": "J", "returned": "J", "volume": "m^3"}


@dataclass(frozen=True)
class Case:
    """One hole, or several that a prediction cannot tell apart. SI units."""

    id: str
    kind: str
    type: str  # `TOP` or `DOWN`
    bit: float  # diameter [m]
    rock: str
    site: str
    strength: float  # compressive [Pa]
    rates: tuple[float, ...]  # measured [m/s]; `rate` is their mean
    source: dict[str, str]  # `published`, `read_in` and `rate`
    assumed: str  # what is not published
    power: float | None = None  # of a top hammer [W]
    frequency: float | None = None  # of a top hammer [Hz]
    pressure: float | None = None  # at a hammer down the hole [Pa]
    piston: float | None = None  # diameter of its piston [m]
    hammer: str = ""
    remark: str = ""

    @property
    def rate(self) -> float:
        """Mean of the measured rates [m/s]."""
        return float(np.mean(self.rates))

    @property
    def blow_energy(self) -> float:
        """Power by frequency [J]; of top hammers alone."""
        assert self.power is not None
        assert self.frequency is not None
        return self.power / self.frequency


@dataclass(frozen=True)
class Crater:
    """Crater of one insert on flat rock. SI units."""

    rock: str
    kind: str
    read: str
    strength: float  # compressive [Pa]
    bit_energy: float  # energy of the bit as it comes [J]
    returned: float  # as it goes [J]
    volume: float  # [m^3]

    @property
    def crushing(self) -> float:
        """Energy that the rock kept [J]."""
        return self.bit_energy - self.returned


@dataclass(frozen=True)
class Stored:
    """All that is stored."""

    cases: tuple[Case, ...]
    unused: tuple[dict[str, str], ...]  # rates that are no cases, and what they lack
    wanted: tuple[dict[str, str], ...]  # what could not be read
    craters: tuple[Crater, ...]


@cache
def stored_cases() -> Stored:
    """Cases, other rates and craters; this file is our own, and a test reads it."""
    tree = read_toml(_FILE)
    return Stored(
        tuple(_case(row, tree) for row in tree["cases"]),
        tuple(tree["unused"]),
        tuple(tree["wanted"]),
        tuple(Crater(**_in_si(row, _OF_CRATERS)) for row in tree["craters"]),
    )


def _case(row: Mapping[str, Any], tree: Mapping[str, Any]) -> Case:
    found = _in_si(row, _UNITS)
    found["rates"] = tuple(in_si(one, "m/s") for one in row["rates"])
    found["source"] = tree["sources"][row["source"]]
    return Case(**found, assumed=tree["assumed"][row["type"]])


def _in_si(row: Mapping[str, Any], units: Mapping[str, str]) -> dict[str, Any]:
    return {key: in_si(one, units[key]) if key in units else one for key, one in row.items()}
