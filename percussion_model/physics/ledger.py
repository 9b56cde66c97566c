"""Sums and residual of the energy ledger."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Iterable

import numpy as np

from percussion_model.components import entries_on
from percussion_model.physics.kernel import plain
from percussion_model.physics.records import LEDGER_FIELDS, STORED_FIELDS

WORKS = ("drive", "feed", "gravity", "climb", "refill", *entries_on("work"))
DISSIPATED = (
    *("crushing", "barrier", "standstill", "loss", "contact", "joints", "ends"),
    *entries_on("dissipated"),
)
NUMERICAL = ("numerical", "overshoot")
STORED = ("kinetic", "elastic", "recoverable", *entries_on("stored"))

# They stand at the end of a reading.
ENERGIES = (*LEDGER_FIELDS, *STORED_FIELDS)
START_AT, NUMERICAL_AT = ENERGIES.index("start"), ENERGIES.index("numerical")
WORKS_AT = tuple(map(ENERGIES.index, WORKS))


def energies(reading: np.ndarray) -> dict[str, float]:
    """Entries of the ledger and stored energies [J] in a READING array of length 1."""
    return dict(zip(ENERGIES, reading.view(np.float64)[-len(ENERGIES) :].tolist(), strict=True))


@plain
def put_in(energies):
    """Energy put in, in the order of `ENERGIES`, that what is unexplained is compared with [J]."""
    works = 0.0
    for k in WORKS_AT:
        works += abs(energies[k])
    return abs(energies[START_AT]) + works


def complete_ledger(entries: dict[str, float]) -> dict[str, float]:
    """Add sums, residual and relative figures to the entries of a reading [J]."""
    ledger = {"initial": entries["start"]}
    ledger |= {name: entries[name] for name in (*WORKS, *DISSIPATED, *NUMERICAL, *STORED)}
    for name, parts in (("input", WORKS), ("stored", STORED), ("dissipated", DISSIPATED)):
        ledger[name] = total(entries[part] for part in parts)
    ledger["residual"], scale = unexplained(entries)
    for name in (*NUMERICAL, "residual"):
        ledger[f"{name}_relative"] = ledger[name] / scale if scale > 0 else math.nan
    return {name: float(value) for name, value in ledger.items()}


def unexplained(entries: dict[str, float]) -> tuple[float, float]:
    """What no entry explains, and the energy put in that it is to be compared with [J]."""
    works = [entries[name] for name in WORKS]
    stored = total(entries[name] for name in STORED)
    dissipated = total(entries[name] for name in DISSIPATED)
    start = entries["start"]
    apart = total(entries[name] for name in NUMERICAL)
    residual = start + total(works) - stored - dissipated - apart
    return residual, put_in([entries[name] for name in ENERGIES])


def total(values: Iterable[float]) -> float:
    """Sum, rounded as in the library of FMUs; `sum` has no roundings from Python 3.12 on."""
    return functools.reduce(operator.add, values, 0.0)
