"""The table of settled responses that a filter asks, of a hammer, its bit and a range of settings.

A settled run a point, without friction, and for some two more of the same motion: with twice the
crushing energy, and with friction. All of fresh rock, so that a blow breaks what it crushes beyond
the threshold.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from percussion_model.analysis.identify.observation import (
    BLOWS,
    CRUSHED,
    WORK,
    Table,
    basis,
    splines,
)
from percussion_model.analysis.identify.part import AXES, POWERS
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
# Points of which one has forces, which are even, and with which lengths of splines are sought.
EVERY, MOST_SOUGHT = 4, 150
# Points that may fail, as where a hammer does not start, by their number.
MOST_FAILED = 0.25
# Of splines, that they need not meet each point.
SMOOTH = 1e-4
AROUND = np.concatenate([np.eye(4), -np.eye(4)])
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
        That are run.
    with_splines : bool
        Splines beside polynomials; without, a part of a drilling system can take the table.

    Raises
    ------
    IdentifyError
        If the hammer does not drill in too many points.
    """
    check_scene(scene)
    ends = np.log([ranges[axis] for axis in AXES])
    middle, half = ends.mean(axis=1), np.maximum(0.5 * np.ptp(ends, axis=1), LEAST_HALF)
    kept: list[np.ndarray] = []
    blows, few, pushes, why = [], [], [], ""
    for k, place in enumerate(spread_points(points, 4)):
        if progress is not None:
            progress(k / points)
        fresh = _fresh(scene, drive, np.exp(middle + half * place))
        try:
            one = _means(fresh)
            if k % EVERY == 0 or not with_splines:
                pushes.append(_forces(fresh, one))
                few.append(len(kept))
        except (SceneError, SimulationError, IdentifyError) as error:
            why = str(error)
        else:
            kept.append(place)
            blows.append(one)
    if len(kept) < (1.0 - MOST_FAILED) * points:
        raise IdentifyError(
            f"the hammer drills in {len(kept)} of {points} points of the table alone: narrow the "
            f"range of pressure and feed, or correct its units; the last error: {why}"
        )
    x, (volume, frequency, torque) = np.array(kept), np.array(blows).T
    stretch = np.ones(4)
    if with_splines:
        some = slice(MOST_SOUGHT)
        stretch = _stretch(x[some], np.log(frequency * volume)[some, np.newaxis])
    area, speed = hole_area(scene), scene["rotation.speed"]
    buttons = float(scene["breaking.buttons"])
    fit = partial(_fit, stretch=stretch, with_splines=with_splines)
    forces, force_weights, rubbing_off = fit(x[few], np.log(pushes))
    rows = basis(x, POWERS) @ forces + splines(x * stretch, x[few] * stretch) @ force_weights
    crushed = volume * scene[ENERGY] / scene[ETA] + buttons * scene["breaking.threshold"]
    work = torque * speed / frequency + np.exp(rows[:, 0]) * volume / area
    terms, weights, off = fit(x, np.log(np.stack([crushed, frequency, work], axis=1)))
    every = np.zeros((len(x), 2))
    every[few] = force_weights
    climbing = (work * frequency / speed)[few]
    share = climbing / (climbing + scene["rotation.friction"] * np.array(pushes)[:, 1])
    turned = share * (off[few, WORK] + off[few, BLOWS]) + (1.0 - share) * rubbing_off[:, 1]
    sizes = [_spread(one) for one in (off[:, CRUSHED] + off[:, BLOWS], off[:, BLOWS], turned)]
    errors = np.array(sizes) * (1.0 if with_splines else DOUBT)
    added = (stretch, x * stretch, np.hstack([weights, every]).T) if with_splines else ()
    return Table(
        middle, half, POWERS, np.hstack([terms, forces]).T, errors, area,
        scene["rotation.mean_radius"], buttons, _exponent(scene), *added,
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


def _fresh(scene: Scene, drive: Drive, values: np.ndarray) -> Scene:
    """The scene at pressure, feed, unloading ratio and stiffness, of fresh rock, frictionless."""
    pressure, feed, gamma, stiffness = map(float, values)
    return scene.replace(
        **dict(drive(pressure)),
        **{
            "feed.force": feed, GAMMA_KEY: gamma, STIFFNESS_KEY: stiffness,
            "rotation.renewal_length": 0.0, "rotation.friction": 0.0,
            "rotation.stall_torque": 0.0, "rotation.response": 0.0, "breaking.wear_length": 0.0,
        },
    )  # fmt: skip


def _forces(scene: Scene, plain: tuple[float, float, float]) -> tuple[float, float]:
    """Mean force F on the rock [N], and r F_0 [N m], by rock twice as hard and by friction."""
    denser = _means(scene.replace(**{ENERGY: 2.0 * scene[ENERGY]}))
    rubbed = _means(scene.replace(**{"rotation.friction": 1.0}))
    power = (denser[2] - plain[2]) * scene["rotation.speed"] * hole_area(scene)
    return power / ((plain[0] - denser[0]) * plain[1]), rubbed[2] - plain[2]


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


def _fit(
    points: np.ndarray, y: np.ndarray, stretch: np.ndarray, with_splines: bool = True
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients, weights of splines, and how far points are off where they are left out.

    The last by S. Rippa (Adv. Comput. Math. 11 (1999) 193); splines without weight leave least
    squares.
    """
    x = basis(points, POWERS)
    count, terms = x.shape
    nodes = points * stretch
    kernel = splines(nodes, nodes) + SMOOTH * np.eye(count) if with_splines else np.eye(count)
    inverse = np.linalg.inv(np.block([[kernel, x], [x.T, np.zeros((terms, terms))]]))
    found = inverse[:, :count] @ y
    left_out = found[:count] / np.diag(inverse)[:count, np.newaxis]
    return found[count:], found[:count] * with_splines, left_out


def _stretch(points: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Stretch with which points that are left out are best told by the others."""

    def size(stretch: np.ndarray) -> float:
        return _spread(_fit(points, y, stretch)[2])

    best, factor = np.full(4, 3.0), 3.0
    least = size(best)
    while factor > 1.2:
        before = least
        for tried in np.exp(math.log(factor) * AROUND):
            if (found := size(best * tried)) < least:
                best, least = best * tried, found
        if not least < before:
            factor = math.sqrt(factor)
    return best


def _spread(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
