"""The table of settled responses that a filter asks, of a hammer, its bit and a range of settings.

Two settled runs a point, without friction and with it, of fresh rock, so that a blow breaks what it
crushes beyond the threshold.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import product
from typing import Any

import numpy as np

from percussion_model.analysis.identify.observation import (
    AT,
    BLOWS,
    CRUSHED,
    RUBBING,
    WORK,
    Table,
    basis,
    splines,
)
from percussion_model.analysis.identify.part import AXES, POWERS, ROWS
from percussion_model.analysis.stationary import settled
from percussion_model.scene.rows import SceneError
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import SimulationError

# Half the least range of a setting, by the logarithm, and standard deviations of an unknown.
LEAST_HALF, REACH = 0.02, 2.2
# What a run may be off by: two hundredths in the rate of a motion that does not settle.
TOLERANCE, SCATTER, MOST_BLOWS = 1e-3, 0.02, 150
# Of polynomials alone: errors go together, as motions of several kinds lie in one table.
DOUBT = 1.3
# Points with which lengths of splines are sought.
MOST_SOUGHT = 150
# Rock that is asked is closer to nodes than one that is left out: 200 of a hammer were off by 0.50
# to 0.73 of what those told, 0.6 in the mean, with 300 and 400 nodes.
CLOSER = 0.6
# Points that may fail, as where a hammer does not start, by their number.
MOST_FAILED = 0.25
# Of splines, that they need not meet each point.
SMOOTH = 1e-4
AROUND = np.concatenate([np.eye(2), -np.eye(2)])
POWERS_OF_ROCK = np.array([p for p in product(range(3), repeat=2) if sum(p) <= 2])
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
    points: int = 400,
    with_splines: bool = True,
) -> Table:
    """Run a hammer over ranges of its settings and of the rock, and fit what comes out.

    Parameters
    ----------
    scene : Scene
        With a bit; its solver is the one that runs.
    drive : callable
        Changes of the scene for a pressure [Pa].
    ranges : mapping of tuple
        Least and greatest of each of `AXES`: "pressure" [Pa], "feed" [N], "unloading_ratio" and
        "loading_stiffness" [N/m].
    progress : callable, optional
        Called with the share that is done.
    points : int
        That are run: rocks at each of a few settings, or both at once.
    with_splines : bool
        Surfaces of splines; without, a part of a drilling system can take the table.

    Raises
    ------
    IdentifyError
        If the hammer does not drill in too many points.
    """
    check_scene(scene)
    ends = np.log([ranges[axis] for axis in AXES])
    middle, half = ends.mean(axis=1), np.maximum(0.5 * np.ptp(ends, axis=1), LEAST_HALF)
    if with_splines:
        rocks = np.repeat(spread_points(points, 2), len(AT), axis=0)
        places = np.hstack([np.tile(AT, (points, 1)), rocks])
    else:
        places = spread_points(points, 4)
    y, why = _run(scene, drive, middle + half * places, progress)
    y = y.reshape(points, -1)
    kept = np.all(np.isfinite(y), axis=1)
    if kept.sum() < (1.0 - MOST_FAILED) * points:
        raise IdentifyError(
            f"the hammer drills in {kept.sum()} of {points} points of the table alone: narrow the "
            f"range of pressure and feed, or correct its units; the last error: {why}"
        )
    x, y = places.reshape(points, -1, 4)[kept, 0], y[kept]
    exponent = scene["rock.loading_exponent"] if scene["effects.rock"] == "power" else 1.0
    area, radius = hole_area(scene), scene["rotation.mean_radius"]
    rest = area, radius, float(scene["breaking.buttons"]), float(exponent)
    if not with_splines:
        terms, _, off = _fit(x, y, POWERS)
        errors = DOUBT * _errors(scene, y, off, np.ones(len(x)))
        return Table(middle, half, POWERS, terms.T, errors, *rest)
    x = x[:, 2:]
    some = slice(MOST_SOUGHT)
    stretch = _stretch(x[some], y[some, CRUSHED :: len(ROWS)] + y[some, BLOWS :: len(ROWS)])
    terms, weights, off = _fit(x, y, POWERS_OF_ROCK, stretch)
    likely = np.repeat(np.exp(-0.5 * np.sum((REACH * x) ** 2, axis=1)), len(AT))
    rows = y.reshape(-1, len(ROWS)), off.reshape(-1, len(ROWS))
    errors = CLOSER * _errors(scene, *rows, likely)
    return Table(
        middle, half, POWERS_OF_ROCK, terms.T, errors, *rest, stretch, x * stretch, weights.T
    )


def _run(
    scene: Scene, drive: Drive, logs: np.ndarray, progress: Callable[[float], None] | None
) -> tuple[np.ndarray, str]:
    """Logarithms of a blow's numbers at points, NaN where none drills, and the last error."""
    found, why = np.full((len(logs), len(ROWS)), np.nan), ""
    for k, one in enumerate(logs):
        if progress is not None:
            progress(k / len(logs))
        try:
            found[k] = _numbers(_fresh(scene, drive, np.exp(one)))
        except (SceneError, SimulationError, IdentifyError) as error:
            why = str(error)
    return found, why


def _errors(scene: Scene, y: np.ndarray, off: np.ndarray, likely: np.ndarray) -> np.ndarray:
    """Errors of rate, frequency and torque by those of points, each as likely as it is."""
    climbing = np.exp(y[:, WORK] + y[:, BLOWS]) / scene["rotation.speed"]
    share = climbing / (climbing + scene["rotation.friction"] * np.exp(y[:, RUBBING]))
    turned = share * (off[:, WORK] + off[:, BLOWS]) + (1.0 - share) * off[:, RUBBING]
    each = np.stack([off[:, CRUSHED] + off[:, BLOWS], off[:, BLOWS], turned])
    return np.asarray(np.sqrt(each**2 @ likely / likely.sum()))


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


def _fresh(scene: Scene, drive: Drive, values: np.ndarray) -> Scene:
    """The scene at pressure, feed, unloading ratio and stiffness, of fresh rock."""
    pressure, feed, gamma, stiffness = map(float, values)
    return scene.replace(
        **dict(drive(pressure)),
        **{
            "feed.force": feed, GAMMA_KEY: gamma, STIFFNESS_KEY: stiffness,
            "rotation.renewal_length": 0.0,
            "rotation.stall_torque": 0.0, "rotation.response": 0.0, "breaking.wear_length": 0.0,
        },
    )  # fmt: skip


def _numbers(scene: Scene) -> np.ndarray:
    """Logarithms of the numbers of a blow once settled, by the rows of the table.

    The mean force on the rock is that of its impulses; a second run, which takes little as its bars
    are known, has the same motion with friction.
    """
    plain, rubbed = (
        settled(scene.replace(**{"rotation.friction": mu}), TOLERANCE, MOST_BLOWS, scatter=SCATTER)
        for mu in (0.0, 1.0)
    )
    if not plain.rate_of_penetration > 0.0:
        raise IdentifyError("the hammer does not drill")
    torque, rubbing = (float(np.mean(one.counted["rotation_torque"])) for one in (plain, rubbed))
    volume, impulse = (
        float(np.mean(plain.counted[name])) for name in ("breaking_blow_volume", "bit_impulse")
    )
    crushed = volume * scene[ENERGY] / scene[ETA]
    crushed += scene["breaking.buttons"] * scene["breaking.threshold"]
    period = plain.blow_period
    work = torque * scene["rotation.speed"] * period + impulse / period * volume / hole_area(scene)
    return np.log([crushed, 1.0 / period, work, impulse / period, rubbing - torque])


def _fit(
    points: np.ndarray, y: np.ndarray, powers: np.ndarray, stretch: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients, weights of splines, and how far points are off where they are left out.

    The last by S. Rippa (Adv. Comput. Math. 11 (1999) 193); without splines, least squares.
    """
    x = basis(points, powers)
    count, terms = x.shape
    kernel = np.eye(count)
    if stretch is not None:
        kernel = splines(points * stretch, points * stretch) + SMOOTH * kernel
    inverse = np.linalg.inv(np.block([[kernel, x], [x.T, np.zeros((terms, terms))]]))
    found = inverse[:, :count] @ y
    left_out = found[:count] / np.diag(inverse)[:count, np.newaxis]
    return found[count:], found[:count], left_out


def _stretch(points: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Stretch with which points that are left out are best told by the others."""

    def size(stretch: np.ndarray) -> float:
        return float(np.mean(_fit(points, y, POWERS_OF_ROCK, stretch)[2] ** 2))

    best, factor = np.full(2, 3.0), 3.0
    least = size(best)
    while factor > 1.2:
        before = least
        for tried in np.exp(math.log(factor) * AROUND):
            if (found := size(best * tried)) < least:
                best, least = best * tried, found
        if not least < before:
            factor = math.sqrt(factor)
    return best
