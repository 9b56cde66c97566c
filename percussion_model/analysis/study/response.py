"""Stationary response at the points of a study; runs in worker processes too."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from percussion_model.analysis.stationary import MOST_TIME, Settled, settle, settled
from percussion_model.analysis.study.points import whole_number
from percussion_model.analysis.study.variants import Variants
from percussion_model.scene.scene import Scene
from percussion_model.simulation.interruption import interruptible
from percussion_model.simulation.means import numbers_of_each, numbers_over
from percussion_model.solvers.sources import SOLVING

# Makes a number of a point, a column of a user's own.
Metric = Callable[[Settled], float]

KINDS = ("periodic", "aperiodic", "stalled", "failed")

# What decides the numbers of a point: kernels, solvers, and the way from a scene to its blows.
COMPUTING = (
    *SOLVING,
    "scene/*.py",
    "scene/bits/*.py",
    "scene/rocks/*.py",
    "simulation/*.py",
    "analysis/stationary.py",
    "analysis/study/points.py",
    "analysis/study/response.py",
    "analysis/study/variants.py",
)

# What a study keeps of each point: name, and unit.
FOUND = {
    "rate_of_penetration": "m/s",
    "rate_of_penetration_error": "m/s",
    "blow_period": "s",
    "multiplier": "-",
    "impact_velocity": "m/s",
    "rebound_velocity": "m/s",
    "stroke": "m",
    "blow_energy": "J",
    "rock_energy": "J",
    "penetration_per_blow": "m",
    "peak_bit_force": "N",
    "peak_contact_force": "N",
    "contacts_per_blow": "-",
    "drilling_cycles_per_blow": "-",
    "rotation_torque": "N m",
    "breaking_blow_volume": "m^3",
    "pneumatic_air": "kg/s",
}
ROW = np.dtype(
    [
        *((name, "f8") for name in FOUND),
        ("kind", "i8"),  # index into KINDS
        ("order", "i8"),  # blows in a cycle
        ("blows", "i8"),  # run
        ("wall_time", "f8"),  # [s]
    ]
)


def run_points(
    scene: Scene,
    keys: tuple[str, ...],
    values: np.ndarray,
    tolerance: float,
    most_blows: int,
    scatter: float,
    metrics: Mapping[str, Metric] | None = None,
) -> tuple[np.ndarray, list[str]]:
    """Find the stationary response at some points.

    Linear algebra gets one thread: with more it would round otherwise, and the bits
    would depend on where a point is computed.

    Returns
    -------
    rows : ndarray of `row_type(metrics)`
    failures : list of str
        What went wrong at each point, empty where nothing did.
    """
    from threadpoolctl import threadpool_limits

    metrics = metrics or {}
    rows, failures = np.zeros(len(values), row_type(metrics)), []
    variants: Variants | None = None

    def run(point: list[float]) -> Settled:
        nonlocal variants
        if variants and (simulation := variants.simulation(point)):
            deadline = time.thread_time() + MOST_TIME
            return settle(simulation, tolerance, most_blows, scatter, deadline)
        changes = {k: whole_number(k, value) for k, value in zip(keys, point, strict=True)}
        chosen = scene.replace(**changes)
        found = settled(chosen, tolerance, most_blows, scatter=scatter)
        variants = variants or Variants(chosen, keys)
        return found

    single: list[tuple[int, np.ndarray]] = []  # points whose blows are all alike, and that blow
    with threadpool_limits(1):
        for k, (row, point) in enumerate(zip(rows, values.tolist(), strict=True)):
            try:
                with interruptible():
                    found = run(point)
                    _fill(row, found)
                    if found.order == 1:
                        single.append((k, found.cycle))
                    else:
                        means = numbers_over(found.counted)
                        _fill_means(row, means | {"blow_period": found.blow_period})
                failures.append(_add_metrics(row, metrics, found))
            except Exception as error:
                for name in (*FOUND, *metrics):
                    row[name] = math.nan
                row["kind"] = KINDS.index("failed")
                failures.append(f"{type(error).__name__}: {error}")
    if single:
        places, blows = zip(*single, strict=True)
        chosen = rows[list(places)]
        _fill_means(chosen, numbers_of_each(np.concatenate(blows)))
        rows[list(places)] = chosen
    return rows, failures


def _fill(row: Any, found: Settled) -> None:
    """What is not a mean over blows."""
    row["kind"] = KINDS.index(found.kind)
    row["order"], row["blows"] = found.order, len(found.blows)
    row["wall_time"] = found.wall_time
    row["rate_of_penetration"] = found.rate_of_penetration
    row["rate_of_penetration_error"] = found.rate_of_penetration_error
    row["multiplier"] = found.multiplier


def _fill_means(rows: Any, numbers: Mapping[str, Any]) -> None:
    """Means over blows: of a row, or of several."""
    for name, values in numbers.items():
        if name in FOUND:
            rows[name] = values


def row_type(metrics: Mapping[str, Metric]) -> np.dtype:
    """Type of the row of a point, with a number for each metric."""
    return np.dtype([*ROW.descr, *((name, "f8") for name in metrics)])


def _add_metrics(row: Any, metrics: Mapping[str, Metric], found: Settled) -> str:
    """Fill in the metrics; say what went wrong, which takes no other number from the point."""
    faults = []
    for name, function in metrics.items():
        try:
            row[name] = float(function(found))
        except Exception as error:
            row[name] = math.nan
            faults.append(f"metric {name}: {type(error).__name__}: {error}")
    return "; ".join(faults)
