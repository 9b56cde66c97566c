"""A measured curve of force over penetration: its model, and the rock at first sight."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import geometric_mean
from typing import Any, NamedTuple

import numpy as np

from percussion_model.analysis.fitting.measurements import Curve, FitError, least_noise, named
from percussion_model.physics.indentation import weigh
from percussion_model.physics.kernel import entry_of
from percussion_model.physics.power_law import fresh_force, fresh_recovery, start_loading
from percussion_model.physics.records import RockKind
from percussion_model.physics.state import COMMON_PARAMETERS, COMMON_STATE
from percussion_model.scene.rock_law import fill_power
from percussion_model.scene.scene import Scene
from percussion_model.scene.values import values_of

# Data that each branch must have with force on the rock.
LEAST_BRANCH = 3
# Force below this share of the greatest does not count for the first guess of a slope.
CLEAR_FORCE = 0.1
# Datum and peak are found when a step would gain less than this share of the sum of squares, or
# after so many rounds. A step that does not lead down is cut to where a parabola has its lowest
# point, at least to this share, so often.
LEAST_GAIN, MOST_ROUNDS, LEAST_CUT, MOST_CUTS = 1e-7, 30, 0.1, 12
# The data tell datum and peak apart if the determinant is above this share of its greatest.
LEAST_DETERMINANT = 1e-12
# Exponents that the first sight of a loading branch tries.
TRIED_EXPONENTS = np.linspace(1.0, 4.0, 121)
# Unloading ratio of the first guess, at least.
LEAST_RATIO = 1.01
PARAMETERS, STATE = np.dtype(COMMON_PARAMETERS), np.dtype(COMMON_STATE)
# Sums that a comparison of forces gives, see `weigh`.
SUMS = 7


class SlowRock:
    """Fresh rock of a scene, which a slow test loads and unloads once.

    Parameters
    ----------
    scene : Scene
        With the bilinear law or the power law.
    """

    def __init__(self, scene: Scene) -> None:
        par, s = np.zeros(1, PARAMETERS)[0], np.zeros(1, STATE)[0]
        values: Any = values_of(scene)
        fill_power(par, values)
        par["rock"] = RockKind.BILINEAR
        s["k_r"] = par["buttons"] * values.rock_loading_stiffness
        s["gamma"] = values.rock_unloading_ratio
        start_loading(par, s, 0.0)
        self._records = par, s

    def given_back(self, depth: float) -> float:
        """Penetration that the rock gives back from a peak at a depth [m]."""
        force = fresh_force(*self._records, depth)
        return float(fresh_recovery(*self._records, depth, force))

    def weigh(
        self, p: np.ndarray, force: np.ndarray, first: int, datum: float, peak: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compare a measured curve with the rock: its forces, and sums of what is off.

        Parameters as those of the kernel `weigh`, results its `model` and `sums`.
        """
        model, sums = np.empty(len(p)), np.zeros(SUMS)
        entry_of(weigh)(*self._records, p, force, first, datum, peak, model, sums)
        return model, sums


def slow_force(
    penetration: Any, scene: Scene, datum: float = 0.0, peak: float | None = None
) -> np.ndarray:
    """Force of one slow loading and unloading (docs/model.md, table 1: FC, then BC).

    Parameters
    ----------
    penetration : array_like
        In the order of time: rising, then falling [m].
    scene : Scene
        With the rock, by the bilinear law or the power law.
    datum : float
        Penetration at which the rock is touched [m].
    peak : float, optional
        Penetration at which unloading begins [m]; default the greatest.

    Returns
    -------
    ndarray
        [N].
    """
    p = np.asarray(penetration, dtype=float)
    peak = float(p.max()) if peak is None else peak
    if not peak > datum:
        return np.zeros(len(p))
    return SlowRock(scene).weigh(p, np.zeros(len(p)), int(np.argmax(p)) + 1, datum, peak)[0]


class SlowFit(NamedTuple):
    """Where a curve fits a rock best [m], the force that is shown there [N], and the unknown
    zero of the force by the width of its prior, with its variance for this rock."""

    datum: float
    peak: float
    force: np.ndarray
    pull: float
    variance: float


def best_datum_and_peak(curve: Curve, scene: Scene, guess: tuple[float, float]) -> SlowFit:
    """Find where the rock is touched and where unloading begins, for a given rock.

    The zero of the gauge is rarely that of the rock, and the greatest reading rarely the
    peak; the zero of the force has a prior. Gauss and Newton's steps; by the bilinear law force
    is linear in all as long as the same data carry load.

    Parameters
    ----------
    curve : Curve
        Checked.
    scene : Scene
        With the rock.
    guess : (float, float)
        Datum and peak [m].

    Returns
    -------
    SlowFit
        At the guess where too few data carry load there.
    """
    rock, first = SlowRock(scene), int(np.argmax(curve.penetration)) + 1
    width, count = curve.offset or 0.0, len(curve.force)
    floor = least_noise(curve.force) ** 2

    def at(place: np.ndarray, more: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        force = curve.force - width * (place[2] - more)
        return rock.weigh(curve.penetration, force, first, *place[:2])

    best = np.array([*guess, 0.0])
    model, sums = at(best)
    own = 1.0
    for _ in range(MOST_ROUNDS):
        variance = max(sums[0] / count, floor)
        across = at(best, 1.0)[1] - sums if width > 0.0 else np.zeros_like(sums)
        off = width * float((curve.force - width * best[2] - model).sum()) - variance * best[2]
        step, gain, own = _step(sums, across, count * width**2, off, variance)
        if gain <= LEAST_GAIN * sums[0]:
            break
        limit, slope = sums[0] + variance * best[2] ** 2, gain
        for _ in range(MOST_CUTS):
            there, share = best + step, 0.5
            if there[1] > there[0]:
                found, others = at(there)
                above = others[0] + variance * there[2] ** 2 - limit
                if others[6] >= LEAST_BRANCH:
                    if above <= 0.0:
                        gain, best, model, sums = -above, there, found, others
                        break
                    share = max(slope / (above + 2.0 * slope), LEAST_CUT)
            step, slope = share * step, share * slope
        else:
            break
        if gain <= LEAST_GAIN * sums[0]:  # at a datum where other data begin to carry load
            break
    datum, peak, pull = best.tolist()
    return SlowFit(datum, peak, model + width * pull, pull, min(own, 1.0))


def _step(
    sums: np.ndarray, across: np.ndarray, own: float, off: float, variance: float
) -> tuple[np.ndarray, float, float]:
    """Step of least squares of datum, peak and the zero of the force, and what it gains.

    None if the data tell no datum and peak. `across`: what the sums have more with all forces a
    width greater; `own`, `off`: matrix and right-hand side of the zero; `variance`: of noise.
    The last result is the variance of the zero.
    """
    _, a, b, c, x, y, least = sums.tolist()
    determinant = a * c - b * b
    if least < LEAST_BRANCH or not determinant > LEAST_DETERMINANT * a * c:
        return np.zeros(3), 0.0, variance / (own + variance)
    with_datum, with_peak = across[4:6].tolist()
    datum, peak = (c * x - b * y) / determinant, (a * y - b * x) / determinant
    # what a pull of the zero takes from both
    of_datum = (c * with_datum - b * with_peak) / determinant
    of_peak = (a * with_peak - b * with_datum) / determinant
    own = max(own - with_datum * of_datum - with_peak * of_peak, 0.0) + variance
    pull = (off - with_datum * datum - with_peak * peak) / own
    step = np.array([datum - of_datum * pull, peak - of_peak * pull, pull])
    return step, float(np.dot((x, y, off), step)), variance / own


class Sight(NamedTuple):
    """A rock at first sight by key, and datum and peak of each curve [m]."""

    rock: dict[str, float]
    places: list[tuple[float, float]]


def first_sight(curves: Sequence[Curve], scene: Scene) -> Sight:
    """Find the rock of curves by straight lines through both branches of each.

    By the power law the lines are of a root of the force, with the exponent that leaves the
    least; unloading at several peaks tells gamma and q. One peak leaves q as the scene has it.
    Chipping is overlooked.

    Raises
    ------
    FitError
        If the data are no loading and unloading.
    """
    lines = []
    for curve in curves:
        with named(curve.name):
            lines.append(_lines(curve))
    peaks = [float(curve.penetration.max()) for curve in curves]
    if scene.effects.rock == "power":
        return _first_sight_by_power(curves, peaks, [one[2] for one in lines], scene)
    rock = {
        "rock.loading_stiffness": geometric_mean([one[0] for one in lines]),
        "rock.unloading_ratio": geometric_mean([one[2] / one[0] for one in lines]),
    }
    return Sight(rock, [(-one[1] / one[0], peak) for one, peak in zip(lines, peaks, strict=True)])


def _first_sight_by_power(
    curves: Sequence[Curve], peaks: Sequence[float], slopes: Sequence[float], scene: Scene
) -> Sight:
    """By the power law; slopes of unloading of each curve [N/m]."""
    tried = [[_by_root(curve, n) for n in TRIED_EXPONENTS] for curve in curves]
    left = sum(np.array([one[2] for one in row]) for row in tried)
    k = int(np.argmin(left))
    n, place = float(TRIED_EXPONENTS[k]), scene.rock.reference_penetration
    factor = geometric_mean([row[k][0] for row in tried])
    places = [(row[k][1], peak) for row, peak in zip(tried, peaks, strict=True)]
    forces, ratios = [], []
    for slope, (datum, peak) in zip(slopes, places, strict=True):
        forces.append((peak - datum) ** n / place**n)  # by that at the reference penetration
        ratios.append(max(slope / (factor * (peak - datum) ** (n - 1.0)), LEAST_RATIO))
    x, y = np.log(forces), np.log(ratios)
    q = scene.rock.unloading_exponent
    if np.ptp(x) > 0.0:
        q = max(float(np.polyfit(x, y, 1)[0]), 0.0)
    rock = {
        "rock.loading_stiffness": factor * place ** (n - 1.0) / scene.rock.buttons,
        "rock.loading_exponent": n,
        "rock.unloading_ratio": max(math.exp(float(np.mean(y - q * x))), LEAST_RATIO),
        "rock.unloading_exponent": q,
    }
    return Sight(rock, places)


def _by_root(curve: Curve, n: float) -> tuple[float, float, float]:
    """Loading as factor (p - datum)^n: factor, datum, and what it leaves of the force squared."""
    x, force = _clear(curve)[0]
    slope, intercept = np.polyfit(x, force ** (1.0 / n), 1)
    if not slope > 0.0:
        return 1.0, float(x[0]), math.inf
    off = force - np.maximum(slope * x + intercept, 0.0) ** n
    return float(slope**n), float(-intercept / slope), float(off @ off)


def _clear(curve: Curve) -> list[tuple[np.ndarray, np.ndarray]]:
    """Penetration and force of loading and of unloading, where the force is clear."""
    p, force = curve.penetration, curve.force
    turn = int(np.argmax(p))
    clear = force > CLEAR_FORCE * force.max()
    return [
        (p[part][clear[part]], force[part][clear[part]])
        for part in (slice(0, turn + 1), slice(turn, None))
    ]


def _lines(curve: Curve) -> tuple[float, float, float]:
    """Slope and intercept of a straight line through the loading, slope of unloading."""
    lines = []
    for name, (x, y) in zip(("loading", "unloading"), _clear(curve), strict=True):
        if len(np.unique(x)) < LEAST_BRANCH:
            raise FitError(
                f"penetration: {len(np.unique(x))} data of {name} under force, at least "
                f"{LEAST_BRANCH} are needed; the rows must be in the order of time, one "
                "loading and one unloading"
            )
        slope, intercept = np.polyfit(x, y, 1)
        if not slope > 0:
            raise FitError(f"force: does not rise with penetration while {name}")
        lines.append((float(slope), float(intercept)))
    (loading, intercept), (unloading, _) = lines
    if not unloading > loading:
        raise FitError(
            f"force: unloads less stiffly ({unloading:.3g} N/m) than it loads ({loading:.3g} N/m): "
            "the rows must be in the order of time"
        )
    return loading, intercept, unloading
