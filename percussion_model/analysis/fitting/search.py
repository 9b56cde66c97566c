"""Search of the whole range of parameters for all minima of the deviance."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from percussion_model.analysis.fitting.likelihood import Likelihood, Place
from percussion_model.analysis.fitting.measurements import is_rounding

# First and last steps of slopes, in the logarithm. Events move from cell to cell: far below a
# standard error there is noise, far above it the number of drilling cycles changes.
FIRST_STEP, LEAST_STEP, MOST_STEP = 2e-3, 5e-5, 0.05
STEP_SHARE = 0.3  # of a standard error
# A descent linearises anew up to so many times; in each so many places are tried.
ROUNDS, TRIALS = 4, 5
# Least squares have when a step gains this share of the sum of squares, about one a datum.
LEAST_GAIN = 1e-4
# It has arrived when a round gains less than this in the deviance.
ARRIVED = 0.1
# The search without derivatives: its longest first step, in the logarithm, which is the longest
# that tells how rough the deviance is too, and how long it is.
MOST_POLISH, POLISH_TRIALS = 0.3, 12  # trials a parameter
# Minima beside the best are looked for this far along a parameter, at so many places, of which the
# lowest are followed down; nearer to each other than this they are one.
BESIDE, BESIDE_POINTS, BESIDE_TRIED, APART = 0.25, 41, 5, 5e-3
# On a grid, parameters that a curve tells are moved by so many steps at most; the weights
# follow the residuals so often.
MOST_RELAXED, RELAXATIONS = 4.0, 6
# A bouncing bit may amplify any change: so many changes of this size, in the logarithm, and of
# about so many standard errors tell.
TINY, DIPS, CHANGES = 1e-5, 1.0, 8
# An undetermined direction has at most this standard error, in the logarithm.
MOST_ERROR = 20.0


def descend(
    like: Likelihood,
    start: np.ndarray,
    free: Sequence[int],
    steps: np.ndarray | None = None,
    rounds: int = ROUNDS,
) -> tuple[Place, np.ndarray]:
    """Go down from a place by least squares, weighted anew by the noise that they leave.

    Parameters
    ----------
    like : Likelihood
    start : ndarray
        Logarithms.
    free : sequence of int
        Parameters that move.
    steps : ndarray, optional
        Of the first slopes, for all parameters.
    rounds : int

    Returns
    -------
    place : Place
        The best that was met.
    spread : ndarray
        Covariance of the free parameters, in the logarithm.
    """
    free = list(free)
    best = like.at(start)
    size = np.full(len(start), FIRST_STEP) if steps is None else steps.copy()
    spread = np.zeros((len(free), len(free)))
    for _ in range(rounds):
        begun = best
        best, spread = _one_round(like, begun, free, size[free])
        size[free] = steps_of(spread)
        if begun.deviance - best.deviance < ARRIVED:
            break
    return best, spread


def steps_of(spread: np.ndarray) -> np.ndarray:
    """Steps of slopes, by the covariance of the parameters."""
    return np.clip(STEP_SHARE * np.sqrt(np.diag(spread)), LEAST_STEP, MOST_STEP)


def _one_round(
    like: Likelihood, begun: Place, free: list[int], size: np.ndarray
) -> tuple[Place, np.ndarray]:
    """Least squares with fixed weights; the best place met, and the covariance."""
    from scipy.optimize import least_squares

    weights = like.weights(begun.noise)
    low, high = like.low[free], like.high[free]
    met = [begun]

    def residuals(x: np.ndarray) -> np.ndarray:
        at = begun.at.copy()
        at[free] = x
        met.append(like.at(at))
        return np.concatenate(met[-1].residuals) * weights

    def slopes(x: np.ndarray) -> np.ndarray:
        here, columns = residuals(x), []
        for k, step in enumerate(np.where(x + size > high, -size, size)):
            there = x.copy()
            there[k] += step
            columns.append((residuals(there) - here) / step)
        return np.stack(columns, axis=1)

    inside = 1e-9 * (high - low)
    x = np.clip(begun.at[free], low + inside, high - inside)
    found = least_squares(
        residuals, x, slopes, (low, high), x_scale="jac", max_nfev=TRIALS, ftol=LEAST_GAIN
    )
    return min(met, key=lambda one: one.deviance), spread_of(found.jac)


def polish(like: Likelihood, start: Place, spread: np.ndarray) -> Place:
    """Search without derivatives, which steps over the small jumps that stop least squares."""
    from scipy.optimize import minimize

    variances, directions = np.linalg.eigh(spread)
    axes = directions * np.clip(np.sqrt(variances), LEAST_STEP, MOST_POLISH)
    met = [start]

    def deviance(shift: np.ndarray) -> float:
        met.append(like.at(start.at + axes @ shift))
        return met[-1].deviance

    corners = np.vstack([np.zeros(len(axes)), np.eye(len(axes))])
    options = {"initial_simplex": corners, "maxfev": POLISH_TRIALS * len(axes), "fatol": ARRIVED}
    minimize(deviance, corners[0], method="Nelder-Mead", options=options)
    return min(met, key=lambda one: one.deviance)


def roughness(like: Likelihood, best: Place, spread: np.ndarray) -> tuple[float, float]:
    """How rough the deviance is: over next to nothing, and over the size of the errors.

    Where bounces amplify rounding, places that nobody can tell apart differ in their deviance;
    and where it has many dips, the deepest of them is deeper by luck. Data without noise, which
    the best place explains to all digits, tell everything apart and say nothing of that.

    Returns
    -------
    tiny : float
        Range of the deviance over changes of `TINY`.
    dips : float
        Median departure from a parabola at about `DIPS` standard errors.
    """
    noisy = [
        k
        for k, (one, noise) in enumerate(zip(like.series, best.noise, strict=True))
        if one.error is not None or not is_rounding(noise, one.data)
    ]
    if not noisy:
        return 0.0, 0.0
    least = like.deviance_of(best.residuals, noisy)[0]

    def above(shift: np.ndarray) -> float:
        return like.deviance_of(like.at(best.at + shift).residuals, noisy)[0] - least

    normal = np.random.default_rng(0).normal(0.0, 1.0, (CHANGES, len(best.at)))
    seen = [0.0, *(above(TINY * one) for one in normal)]
    variances, directions = np.linalg.eigh(spread)
    errors = np.sqrt(variances)
    # far along a direction that is not told the deviance is no parabola, whether rough or not
    shares = np.minimum(DIPS, MOST_POLISH / errors)
    off = []
    for one in normal:
        change = above(directions @ (shares * errors * one))
        parabola = float((shares * one) @ (shares * one))
        # how much of it is that of data without noise is not known
        least_change = parabola if len(noisy) == len(like.series) else 0.0
        off.append(max(change - parabola, least_change - change, 0.0))
    return max(seen) - min(seen), float(np.median(off))


def spread_of(jacobian: np.ndarray) -> np.ndarray:
    """Covariance of parameters by the slopes of weighted residuals; large where there are none."""
    information = jacobian.T @ jacobian + np.eye(jacobian.shape[1]) / MOST_ERROR**2
    return np.asarray(np.linalg.inv(information))


def distinct(places: Sequence[Place], sizes: np.ndarray, most: int) -> list[Place]:
    """Return the best places, none within a size of a better one in all parameters."""
    kept: list[Place] = []
    for place in sorted(places, key=lambda one: one.deviance):
        if all(np.any(np.abs(place.at - one.at) > sizes) for one in kept):
            kept.append(place)
            if len(kept) == most:
                break
    return kept


def beside(like: Likelihood, best: Place, names: Sequence[str], limit: float) -> list[Place]:
    """Minima beside the best along single parameters, less than a limit above it.

    Where a sensor's zero and trigger are free, a rock with other bounces may do as well; its dip
    is too narrow and too near for a search of the whole range.
    """
    found = [best]
    for k in (like.names.index(name) for name in names if name in like.names):
        shifts = np.linspace(-BESIDE, BESIDE, BESIDE_POINTS)
        row = [like.at(best.at + shift * np.eye(len(best.at))[k]) for shift in shifts]
        heights = np.pad([one.deviance for one in row], 1, constant_values=np.inf)
        inner = heights[1:-1]
        dips = np.flatnonzero((inner <= heights[:-2]) & (inner <= heights[2:]))
        for dip in dips[np.argsort(inner[dips])][:BESIDE_TRIED]:
            found.append(descend(like, row[dip].at, range(len(best.at)), rounds=2)[0])
    lowest = min(one.deviance for one in found)
    near = [one for one in found if one.deviance < lowest + limit]
    return distinct(near, np.full(len(best.at), APART), len(near))


def grid(
    like: Likelihood,
    base: np.ndarray,
    axes: Mapping[int, np.ndarray],
    free: Sequence[int],
    steps: np.ndarray,
) -> list[np.ndarray]:
    """Places of a grid, each moved to where linear least squares lead over free parameters.

    Parameters
    ----------
    like : Likelihood
    base : ndarray
        Values of the parameters that are not on the grid.
    axes : mapping of int to ndarray
        Values of the others; the last axis varies fastest.
    free : sequence of int
        What is moved, by no more than `MOST_RELAXED` steps.
    steps : ndarray
        Of their slopes.

    Returns
    -------
    list of ndarray
        The likeliest first, as the straight model has it.
    """
    *outer, last = axes
    found = []
    for values in itertools.product(*(axes[k] for k in outer)):
        rows = []
        # neighbours in the last parameter share what is costly to prepare
        for shifted in (None, *free):
            row = np.tile(base, (len(axes[last]), 1))
            row[:, outer] = values
            row[:, last] = axes[last]
            if shifted is not None:
                row[:, shifted] += steps[shifted]
            rows.append([like.at(at) for at in row])
        for here, *others in zip(*rows, strict=True):
            found.append(_relaxed(like, here, others, list(free), steps[list(free)]))
    found.sort(key=lambda one: one[0])
    return [at for _, at in found]


def _relaxed(
    like: Likelihood, here: Place, shifted: Sequence[Place], free: list[int], steps: np.ndarray
) -> tuple[float, np.ndarray]:
    """Deviance and place that a straight model has after least squares over free parameters."""
    off = np.concatenate(here.residuals)
    columns = [np.concatenate(one.residuals) - off for one in shifted]
    if not columns:
        return here.deviance, here.at
    matrix = np.stack(columns, axis=1)
    move: np.ndarray = np.zeros(len(free))
    counts = [len(one) for one in here.residuals]
    deviance = here.deviance
    for _ in range(RELAXATIONS):
        left = np.split(off + matrix @ move, np.cumsum(counts)[:-1])
        deviance, noise = like.deviance_of(left)
        weights = like.weights(noise)
        information = (matrix * weights[:, None]).T @ (matrix * weights[:, None])
        information += np.eye(len(free)) / MOST_RELAXED**2
        move = -np.linalg.solve(information, (matrix * weights[:, None]).T @ (off * weights))
        move = np.clip(move, -MOST_RELAXED, MOST_RELAXED)
    at = here.at.copy()
    at[free] += move * steps
    return deviance, at


def design(box: np.ndarray, count: int, fine: int, levels: int) -> np.ndarray:
    """Places that fill a box: a Sobol sequence, and for each point of it a row of levels.

    Parameters
    ----------
    box : ndarray, shape (parameters, 2)
    count : int
        Of points of the sequence, a power of 2.
    fine : int
        Parameter that takes all levels at each point, the one that is cheap to change; -1: none.
    levels : int

    Returns
    -------
    ndarray, shape (places, parameters)
    """
    from scipy.stats.qmc import Sobol

    others = [k for k in range(len(box)) if k != fine]
    if not others:
        return np.linspace(box[fine, 0], box[fine, 1], levels)[:, None]
    unit = Sobol(len(others), seed=0).random(count)
    points = np.zeros((count, len(box)))
    points[:, others] = box[others, 0] + unit * np.diff(box[others], axis=1).T
    if fine < 0:
        return points
    rows = np.repeat(points, levels, axis=0)
    rows[:, fine] = np.tile(np.linspace(box[fine, 0], box[fine, 1], levels), count)
    return rows
