"""Stationary response at the points of a study; runs in worker processes too."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from percussion_model.analysis.stationary import Settled, settled
from percussion_model.analysis.study.points import whole_number
from percussion_model.scene.scene import Scene
from percussion_model.simulation.interruption import interruptible
from percussion_model.simulation.means import numbers_over
from percussion_model.solvers.sources import SOLVING

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
) -> tuple[np.ndarray, list[str]]:
    """Find the stationary response at some points.

    Linear algebra gets one thread: with more it would round otherwise, and the bits
    would depend on where a point is computed.

    Returns
    -------
    rows : ndarray of ROW
    failures : list of str
        What went wrong at each point, empty where nothing did.
    """
    from threadpoolctl import threadpool_limits

    rows, failures = np.zeros(len(values), ROW), []
    with threadpool_limits(1):
        for row, point in zip(rows, values.tolist(), strict=True):
            changes = {k: whole_number(k, value) for k, value in zip(keys, point, strict=True)}
            try:
                chosen = scene.replace(**changes)
                with interruptible():
                    _fill(row, settled(chosen, tolerance, most_blows, scatter=scatter))
                failures.append("")
            except Exception as error:
                for name in FOUND:
                    row[name] = math.nan
                row["kind"] = KINDS.index("failed")
                failures.append(f"{type(error).__name__}: {error}")
    return rows, failures


def _fill(row: Any, found: Settled) -> None:
    row["kind"] = KINDS.index(found.kind)
    row["order"], row["blows"] = found.order, len(found.blows)
    row["wall_time"] = found.wall_time
    for name, value in numbers_over(found.counted).items():
        if name in FOUND:
            row[name] = value
    row["rate_of_penetration"] = found.rate_of_penetration
    row["rate_of_penetration_error"] = found.rate_of_penetration_error
    row["blow_period"], row["multiplier"] = found.blow_period, found.multiplier
