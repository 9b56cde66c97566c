"""A measured curve of force over penetration: its model, and the rock at first sight."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from percussion_model.analysis.fitting.measurements import Curve, FitError
from percussion_model.scene.scene import Scene

# Data that each branch must have with force on the rock.
LEAST_BRANCH = 3
# Force below this share of the greatest does not count for the first guess of a slope.
CLEAR_FORCE = 0.1
# Datum and peak are found when a step would gain less than this share of the sum of squares, or
# after so many rounds; a step that does not lead down is halved so often.
LEAST_GAIN, MOST_ROUNDS, MOST_HALVINGS = 1e-7, 30, 12
# The data tell datum and peak apart if the determinant is above this share of its greatest.
LEAST_DETERMINANT = 1e-12
# Exponents that the first sight of a loading branch tries.
TRIED_EXPONENTS = np.linspace(1.0, 4.0, 121)


class SlowLaw(NamedTuple):
    """What a slow test shows of a rock: eqs 15, 20b and 20c of docs/model.md, SI units.

    Attributes
    ----------
    stiffness : float
        K_R [N/m].
    ratio : float
        gamma.
    exponent, unloading_exponent : float
        n and q; 1 and 0 are the bilinear law.
    reference : float
        Penetration P_0 at which K_R and gamma hold [m].
    """

    stiffness: float
    ratio: float
    exponent: float = 1.0
    unloading_exponent: float = 0.0
    reference: float = 1e-3

    @classmethod
    def of(cls, scene: Scene) -> SlowLaw:
        """That of a scene."""
        rock = scene.rock
        if scene.effects.rock != "power":
            return cls(rock.loading_stiffness, rock.unloading_ratio)
        return cls(
            rock.loading_stiffness, rock.unloading_ratio, rock.loading_exponent,
            rock.unloading_exponent, rock.reference_penetration,
        )  # fmt: skip

    def loading(self, penetration: Any) -> Any:
        """Force at a penetration while loading [N]."""
        share = np.maximum(penetration, 0.0) / self.reference
        return self.stiffness * self.reference * share**self.exponent

    @property
    def bound(self) -> float:
        """Share of the penetration that is given back where nothing is crushed."""
        return 2.0 / (self.exponent + 1.0)

    def is_bound(self, force: float) -> bool:
        """Whether nothing is crushed at a peak force."""
        return self.recovered_share(force) == self.bound

    def recovered_share(self, force: float) -> float:
        """Share of the penetration that the rock gives back from a peak force."""
        bound = self.bound
        relative = force / (self.stiffness * self.reference)
        if self.unloading_exponent == 0.0 or not relative > 0.0:
            return min(1.0 / self.ratio, bound)
        logarithm = -math.log(self.ratio) - self.unloading_exponent * math.log(relative)
        return min(math.exp(min(logarithm, 0.0)), bound)


def slow_force(
    penetration: Any, law: SlowLaw, datum: float = 0.0, peak: float | None = None
) -> np.ndarray:
    """Force of one slow loading and unloading (docs/model.md, table 1: FC, then BC).

    Parameters
    ----------
    penetration : array_like
        In the order of time: rising, then falling [m].
    law : SlowLaw
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
    turn = int(np.argmax(p))
    peak = float(p[turn]) if peak is None else peak
    if not peak > datum:
        return np.zeros(len(p))
    force, slope = _peak_and_slope(law, peak - datum)
    unloading = force - slope * (peak - p)
    return np.maximum(np.where(np.arange(len(p)) <= turn, law.loading(p - datum), unloading), 0.0)


def bilinear_force(
    penetration: Any,
    stiffness: float,
    ratio: float,
    datum: float = 0.0,
    peak: float | None = None,
) -> np.ndarray:
    """Force of one slow loading and unloading by the bilinear law, as `slow_force`.

    Parameters
    ----------
    penetration : array_like
        In the order of time: rising, then falling [m].
    stiffness : float
        K_R [N/m].
    ratio : float
        gamma.
    datum : float
        Penetration at which the rock is touched [m].
    peak : float, optional
        Penetration at which unloading begins [m]; default the greatest.

    Returns
    -------
    ndarray
        [N].
    """
    return slow_force(penetration, SlowLaw(stiffness, ratio), datum, peak)


def _peak_and_slope(law: SlowLaw, depth: float) -> tuple[float, float]:
    """Force at the peak of a loading [N], and slope of the line on which it unloads [N/m]."""
    force = float(law.loading(depth))
    return force, force / (depth * law.recovered_share(force))


def best_datum_and_peak(
    curve: Curve, law: SlowLaw, guess: tuple[float, float]
) -> tuple[float, float]:
    """Find where the rock is touched and where unloading begins, for a given law.

    The zero of the gauge is rarely that of the rock, and the greatest reading rarely the
    peak. Gauss and Newton's steps; by the bilinear law force is linear in both as long as the
    same data carry load.

    Parameters
    ----------
    curve : Curve
        Checked.
    law : SlowLaw
    guess : (float, float)
        Datum and peak [m].

    Returns
    -------
    datum, peak : float
        [m]
    """
    best = guess
    here = _misfit(curve, law, *best)
    for _ in range(MOST_ROUNDS):
        step, gain = here.step()
        if gain <= LEAST_GAIN * here.squares:
            break
        for _ in range(MOST_HALVINGS):
            there = best[0] + step[0], best[1] + step[1]
            found = _misfit(curve, law, *there)
            if found.is_told and found.squares <= here.squares:
                best, here = there, found
                break
            step = 0.5 * step[0], 0.5 * step[1]
        else:
            break
    return best


class _Misfit(NamedTuple):
    """Sum of squares of measured less computed force, and its normal equations.

    For datum and peak: `matrix` has its first row and the end of its second.
    """

    squares: float
    is_told: bool
    matrix: tuple[float, float, float] = (0.0, 0.0, 0.0)
    right: tuple[float, float] = (0.0, 0.0)

    def step(self) -> tuple[tuple[float, float], float]:
        """Step of least squares, and what it would gain; none where the data do not tell it."""
        (a, b, c), (x, y) = self.matrix, self.right
        determinant = a * c - b * b
        if not determinant > LEAST_DETERMINANT * a * c:
            return (0.0, 0.0), 0.0
        datum, peak = (c * x - b * y) / determinant, (a * y - b * x) / determinant
        return (datum, peak), x * datum + y * peak


def _misfit(curve: Curve, law: SlowLaw, datum: float, peak: float) -> _Misfit:
    """How far off a curve is; not told where too few data carry load."""
    p, force = curve.penetration, curve.force
    first = int(np.argmax(p)) + 1
    depth = peak - datum
    if not depth > 0.0:
        return _Misfit(float(force @ force), False)
    top, slope = _peak_and_slope(law, depth)
    n = law.exponent
    ahead, behind = p[:first] - datum, peak - p[first:]
    rising, falling = law.loading(ahead), top - slope * behind
    carries = falling > 0.0
    off_rising, off_falling = force[:first] - rising, force[first:] - carries * falling
    squares = float(off_rising @ off_rising + off_falling @ off_falling)
    if min(np.count_nonzero(rising), np.count_nonzero(carries)) < LEAST_BRANCH:
        return _Misfit(squares, False)
    # slope of the slope by the depth of the peak
    power = n - 1.0 + (0.0 if law.is_bound(top) else n * law.unloading_exponent)
    by_depth = carries * (n * top / depth - power * slope / depth * behind)
    by_datum = np.divide(-n * rising, ahead, out=np.zeros(first), where=ahead > 0.0)
    by_peak = by_depth - slope * carries
    return _Misfit(
        squares,
        True,
        (
            float(by_datum @ by_datum + by_depth @ by_depth),
            -float(by_depth @ by_peak),
            float(by_peak @ by_peak),
        ),
        (float(by_datum @ off_rising - by_depth @ off_falling), float(by_peak @ off_falling)),
    )


class Sight(NamedTuple):
    """A rock at first sight, and datum and peak of each curve [m]."""

    law: SlowLaw
    places: list[tuple[float, float]]


def first_sight(curves: Sequence[Curve], scene: Scene) -> Sight:
    """Find the rock of curves by straight lines through both branches of each.

    By the power law the lines are of a root of the force, with the exponent that leaves the
    least; unloading at several peaks tells gamma and q. One peak leaves q as the scene has it.

    Raises
    ------
    FitError
        If the data are no loading and unloading.
    """
    lines = [_lines(curve) for curve in curves]
    if scene.effects.rock != "power":
        stiffness, ratio = (
            math.exp(math.fsum(map(math.log, row)) / len(row))
            for row in zip(*((one[0], one[2] / one[0]) for one in lines), strict=True)
        )
        peaks = (float(curve.penetration.max()) for curve in curves)
        places = [(-one[1] / one[0], peak) for one, peak in zip(lines, peaks, strict=True)]
        return Sight(SlowLaw(stiffness, ratio), places)
    return _first_sight_by_power(curves, [one[2] for one in lines], SlowLaw.of(scene))


def _first_sight_by_power(
    curves: Sequence[Curve], slopes: Sequence[float], given: SlowLaw
) -> Sight:
    """By the power law; slopes of unloading of each curve [N/m]."""
    tried = [[_by_root(curve, n) for n in TRIED_EXPONENTS] for curve in curves]
    left = sum(np.array([one[2] for one in row]) for row in tried)
    k = int(np.argmin(left))
    n = float(TRIED_EXPONENTS[k])
    data = [row[k][:2] for row in tried]
    stiffness = math.exp(sum(math.log(factor) for factor, _ in data) / len(data))
    stiffness *= given.reference ** (n - 1.0)
    law = given._replace(stiffness=stiffness, exponent=n)
    places = [
        (datum, float(curve.penetration.max()))
        for curve, (_, datum) in zip(curves, data, strict=True)
    ]
    rows = []
    for slope, (datum, peak) in zip(slopes, places, strict=True):
        force = float(law.loading(peak - datum))
        ratio = slope * (peak - datum) / force
        rows.append((math.log(force / (stiffness * given.reference)), math.log(max(ratio, 1.01))))
    x, y = np.array(rows).T
    q = given.unloading_exponent
    if np.ptp(x) > 0.0:
        q = max(float(np.polyfit(x, y, 1)[0]), 0.0)
    ratio = math.exp(float(np.mean(y - q * x)))
    return Sight(law._replace(ratio=max(ratio, 1.01), unloading_exponent=q), places)


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
