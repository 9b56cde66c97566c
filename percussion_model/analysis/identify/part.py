"""The filter's table, prior and noise as plain numbers by name, for a part of a drilling system."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np

from percussion_model.analysis.identify.filter import Noise, RockFilter
from percussion_model.analysis.identify.observation import (
    SIGNALS,
    UNKNOWNS,
    Table,
)

# Polynomials of a part's table, and the axes and rows that it has.
DEGREE, POINTS = 2, 60
AXES = ("pressure", "feed", "unloading_ratio", "loading_stiffness")
ROWS = ("crushed_energy", "blow_frequency", "work", "force", "rubbing")
POWERS = np.array([p for p in product(range(DEGREE + 1), repeat=len(AXES)) if sum(p) <= DEGREE])


def to_numbers(filter_: RockFilter) -> dict[str, float]:
    """Return numbers of a filter whose table has the part's degree."""
    table = filter_.table
    found = {
        "hole_area": table.area, "mean_radius": table.radius, "buttons": table.buttons,
        "loading_exponent": table.exponent,
    }  # fmt: skip
    for k, axis in enumerate(AXES):
        found |= {f"middle.{axis}": table.middle[k], f"half.{axis}": table.half[k]}
    for k, row in enumerate(ROWS):
        found |= {f"{row}[{j + 1}]": one for j, one in enumerate(table.terms[k])}
    for k, name in enumerate(SIGNALS):
        found |= {f"error.{name}": table.errors[k], f"noise.{name}": filter_.noise[k]}
    found["noise.varies"] = filter_.varies
    for k, name in enumerate(UNKNOWNS):
        found |= {f"prior.{name}": filter_.mean[k], f"spread.{name}": filter_.spread[k]}
    return {name: float(value) for name, value in found.items()}


def from_numbers(values: Mapping[str, float]) -> RockFilter:
    """Return the filter of numbers, as `to_numbers` gives them."""

    def several(form: str, names: tuple[str, ...]) -> np.ndarray:
        return np.array([values[form.format(name)] for name in names])

    terms = [[values[f"{row}[{j + 1}]"] for j in range(len(POWERS))] for row in ROWS]
    table = Table(
        several("middle.{}", AXES), several("half.{}", AXES), POWERS, np.array(terms),
        several("error.{}", SIGNALS), values["hole_area"], values["mean_radius"],
        values["buttons"], values["loading_exponent"],
    )  # fmt: skip
    noise = Noise(*several("noise.{}", (*SIGNALS, "varies")).tolist())
    return RockFilter(table, several("prior.{}", UNKNOWNS), several("spread.{}", UNKNOWNS), noise)
