"""The table of settled responses that a filter asks, of a hammer, its bit and a range of settings.

Three settled runs a point, all of one motion: without friction, with twice the crushing energy,
and with friction. All of fresh rock, so that a blow breaks what it crushes beyond the threshold.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import product
from typing import Any

import numpy as np

from percussion_model.analysis.identify.observation import (
    BLOWS,
    RUBBING,
    WORK,
    Table,
    basis,
)
from percussion_model.analysis.stationary import settled
from percussion_model.scene.rows import SceneError
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import SimulationError

# Half the least range of a setting, by the logarithm, and standard deviations of an unknown.
LEAST_HALF, REACH = 0.02, 2.2
# What a run may be off by: two hundredths in the rate of a motion that does not settle.
TOLERANCE, SCATTER, MOST_BLOWS = 1e-3, 0.02, 150
# Errors of the table by those of points left out of it: they go together from point to point and
# from layer to layer, and motions of several kinds lie in one table.
DOUBT = 1.3
# Points that may fail, as where a hammer does not start, by their number.
MOST_FAILED = 0.25
GAMMA_KEY, STIFFNESS_KEY = "rock.unloading_ratio", "rock.loading_stiffness"
ENERGY, ETA = "breaking.crushing_energy", "breaking.efficiency"

Drive = Callable[[float], Mapping[str, Any]]


class IdentifyError(ValueError):
    """A log, a hammer or a request from which no rock can be told."""


def check_scene(scene: Scene) -> None:
    """Raise `IdentifyError` for a scene whose blows the equations of the table do not hold for."""
    if not (scene["effects.breaking"] and scene["effects.rotation"]):
        raise IdentifyError("rock is identified from a bit that breaks and turns: give --bit")
    for key, why in (
        ("rotation.old_line", "rock met again has to be crushed again"),
        ("breaking.flushed_volume", "flushing must not limit"),
        ("rotation.string_stiffness", "the string must not twist"),
    ):
        if scene[key]:
            raise IdentifyError(f"{key} = {scene[key]!r}: must be 0 or false here: {why}")


def tabulate(
    scene: Scene,
    drive: Drive,
    ranges: Mapping[str, tuple[float, float]],
    progress: Callable[[float], None] | None = None,
    points: int = 140,
    degree: int = 3,
) -> Table:
    """Run a hammer over ranges of its settings and of the rock, and fit polynomials.

    Parameters
    ----------
    scene : Scene
        With a bit; its solver is the one that runs.
    drive : callable
        Changes of the scene for a pressure [Pa].
    ranges : mapping of tuple
        Least and greatest "pressure" [Pa], "feed" [N], "unloading_ratio" and
        "loading_stiffness" [N/m].
    progress : callable, optional
        Called with the share that is done.
    points, degree : int
        Points that are run, and degree of the polynomials through them.

    Raises
    ------
    IdentifyError
        If the hammer does not drill in too many points.
    """
    check_scene(scene)
    ends = np.log([ranges[k] for k in ("pressure", "feed", "unloading_ratio", "loading_stiffness")])
    middle, half = ends.mean(axis=1), np.maximum(0.5 * np.ptp(ends, axis=1), LEAST_HALF)
    powers = np.array([p for p in product(range(degree + 1), repeat=4) if sum(p) <= degree])
    kept, rows, why = [], [], ""
    for k, place in enumerate(spread_points(points, 4)):
        if progress is not None:
            progress(k / points)
        try:
            rows.append(_blow(scene, drive, np.exp(middle + half * place)))
        except (SceneError, SimulationError, IdentifyError) as error:
            why = str(error)
        else:
            kept.append(place)
    if len(kept) < (1.0 - MOST_FAILED) * points:
        raise IdentifyError(
            f"the hammer drills in {len(kept)} of {points} points of the table alone: narrow the "
            f"range of pressure and feed, or correct its units; the last error: {why}"
        )
    x, y = basis(np.array(kept), powers), np.array(rows)
    terms, left_out = _fit(x, y)
    crushed, blows, work, _, rubbing = left_out.T
    climbing = np.exp(y[:, WORK] + y[:, BLOWS]) / scene["rotation.speed"]
    share = climbing / (climbing + scene["rotation.friction"] * np.exp(y[:, RUBBING]))
    torque = share * (work + blows) + (1.0 - share) * rubbing
    errors = np.array([_spread(one) for one in (crushed + blows, blows, torque)])
    return Table(
        middle, half, powers, terms.T, errors, hole_area(scene), scene["rotation.mean_radius"],
        float(scene["breaking.buttons"]), _exponent(scene),
    )  # fmt: skip


def spread_points(count: int, dimensions: int) -> np.ndarray:
    """Points that fill a cube from -1 to 1 evenly, shape (count, dimensions).

    The additive sequence of the generalised golden ratio (M. Roberts, 2018).
    """
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1)
    return 2.0 * ((0.5 + np.outer(np.arange(1, count + 1), steps)) % 1.0) - 1.0


def hole_area(scene: Scene) -> float:
    """Area of the hole [m^2]."""
    return 0.25 * math.pi * float(scene.hole_diameter or 0.0) ** 2


def _exponent(scene: Scene) -> float:
    return float(scene["rock.loading_exponent"]) if scene["effects.rock"] == "power" else 1.0


def _blow(scene: Scene, drive: Drive, values: np.ndarray) -> list[float]:
    """Logarithms of W, f, A, F and r F_0 at pressure, feed, unloading ratio and stiffness."""
    pressure, feed, gamma, stiffness = map(float, values)
    scene = scene.replace(
        **dict(drive(pressure)),
        **{
            "feed.force": feed, GAMMA_KEY: gamma, STIFFNESS_KEY: stiffness,
            "rotation.renewal_length": 0.0, "rotation.friction": 0.0,
            "rotation.stall_torque": 0.0, "rotation.response": 0.0, "breaking.wear_length": 0.0,
        },
    )  # fmt: skip
    energy = scene[ENERGY]
    plain = _means(scene)
    denser = _means(scene.replace(**{ENERGY: 2.0 * energy}))
    rubbed = _means(scene.replace(**{"rotation.friction": 1.0}))
    volume, blows, torque = plain
    area, speed = hole_area(scene), scene["rotation.speed"]
    crushed = volume * energy / scene[ETA] + scene["breaking.buttons"] * scene["breaking.threshold"]
    force = (denser[2] - torque) * speed * area / ((volume - denser[0]) * blows)
    work = torque * speed / blows + force * volume / area
    return [math.log(one) for one in (crushed, blows, work, force, rubbed[2] - torque)]


def _means(scene: Scene) -> tuple[float, float, float]:
    """Volume of a blow [m^3], blows in a second [Hz] and torque [N m] once settled."""
    found = settled(scene, TOLERANCE, MOST_BLOWS, scatter=SCATTER)
    if not found.rate_of_penetration > 0.0:
        raise IdentifyError("the hammer does not drill")
    rows = found.counted
    return (
        float(np.mean(rows["breaking_blow_volume"])),
        1.0 / found.blow_period,
        float(np.mean(rows["rotation_torque"])),
    )


def _fit(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least squares, and how far each point is off where it is left out."""
    inverse = np.linalg.pinv(x)
    terms = inverse @ y
    leverage = np.minimum(np.einsum("ij,ji->i", x, inverse), 0.95)
    return terms, (y - x @ terms) / (1.0 - leverage)[:, np.newaxis]


def _spread(values: np.ndarray) -> float:
    return DOUBT * float(np.sqrt(np.mean(values**2)))
