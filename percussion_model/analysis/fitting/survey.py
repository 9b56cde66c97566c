"""Search of the whole range of a rock's parameters: where its minima are."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from percussion_model.analysis.fitting.curve import Sight
from percussion_model.analysis.fitting.found import TOLD, Source
from percussion_model.analysis.fitting.likelihood import (
    DAMPING,
    ENERGY,
    EXPONENT,
    EXPONENTS,
    RATIO,
    SLOW,
    STIFFNESS,
    UNLOADING,
    Likelihood,
    Place,
    Series,
    coordinates,
    curve_series,
    drop_series,
    reading_series,
)
from percussion_model.analysis.fitting.measurements import LEAST_DATA, Curve, DropTest, FitError
from percussion_model.analysis.fitting.search import (
    APART,
    LEAST_STEP,
    descend,
    design,
    distinct,
    grid,
)

# With a curve, a grid of C_R and W_R is computed for its K_R and gamma and for those this share
# of their standard errors beside, or this much, and so many of the best places with K_R and gamma
# moved.
CURVE_ERRORS, MOST_CURVE_STEP, RELAXED = 0.3, 0.05, 48
VALUES = {DAMPING: 11, ENERGY: 16}
# Without, so many points with K_R and gamma within this factor of the scene's, with so many
# values of W_R at each: it decides on the number of drilling cycles. They are enough for so many
# parameters beside W_R; each further one doubles them.
POINTS, OF_POINTS, FACTOR, LEVELS = 128, 3, 10.0, 20
SLOW_STEP = 3e-3
# Around so many of the best places finer grids follow, these shares of `ZOOM` to each side, in
# the logarithm; of each so many of the best places are computed.
ZOOMS, ZOOMED, ZOOM_RELAXED = (1.0, 0.3), 3, 8
ZOOM_VALUES = {DAMPING: 6, ENERGY: 6}
# The search goes down from so many places, in so many samples of each drop, then from the best
# few in all samples. Places nearer to each other than this are one, in the logarithm.
SEARCH_SAMPLES = 50
STARTS, FINALISTS = 8, 4
ZOOM = {STIFFNESS: 0.5, EXPONENT: 0.3, RATIO: 0.3, UNLOADING: 0.3, DAMPING: 1.0, ENERGY: 0.6}
# The last of these grids is of all samples.
LAST_ZOOM, LAST_STEP = 0.12, 2e-4
# Of one unknown of a drop that a curve would tell, dips are some thousandths wide, and others
# beside them are nearly as deep: all of its range is scanned by the first step, in the logarithm,
# what is beside so many of the lowest places by the second, and so many dips are followed.
SCAN_STEP, SCAN_FINE, SCANNED, DIPS_FOLLOWED = 5e-3, 5e-4, 24, 12
# Later bounces tell the exponents of the power law so well that nothing nearby fits them: the
# search begins with these shares of each drop, and so many of the best places of each go on. From
# each of these, and from so many of a grid with so many values, it goes down.
SHARES, CARRIED, TRIED = (1 / 16, 1 / 8, 1 / 4, 1 / 2), 3, 3
# Residuals that are this share of how far a signal varies, or follow from each other so much, make
# one ask for its sign; it is the wrong one if the other leaves residuals smaller by this factor.
LITTLE, ALIKE, SMALLER = 0.2, 0.5, 2.0


def series_of(
    sources: Sequence[Source], sight: Sight | None, most: int | None = None
) -> list[Series]:
    """Series of measurements, of each drop at most so many samples."""
    places = iter(sight.places if sight is not None else ())
    series = []
    for source in sources:
        if isinstance(source, Curve):
            series.append(curve_series(source, next(places)))
        elif isinstance(source, DropTest):
            series.append(drop_series(source, most))
        else:
            series.append(reading_series(source))
    return series


def seen(sight: Sight, names: Sequence[str], like: Likelihood) -> np.ndarray:
    """Coordinates of what curves show at first sight, for parameters that a slow test tells."""
    kept = [k for k, name in enumerate(like.names) if name in names]
    at = coordinates(names, [sight.rock[name] for name in names])
    return np.clip(at, like.low[kept], like.high[kept])


def _sizes(like: Likelihood) -> np.ndarray:
    """How far the first finer grid goes to each side, of each parameter."""
    return np.array([ZOOM[name] for name in like.names])


class Counter:
    """Computations done and stages that begin, passed on."""

    def __init__(
        self,
        progress: Callable[[int], None] | None,
        stage: Callable[[str, int], None] | None,
    ) -> None:
        self.done, self._progress, self._stage = 0, progress, stage

    def begin(self, name: str, most: int = 0) -> None:
        """Tell what begins, and how many computations it takes at most; 0: that is not known."""
        if self._stage is not None:
            self._stage(name, most)

    def tick(self) -> None:
        """Count one more."""
        self.done += 1
        if self._progress is not None:
            self._progress(self.done)


def minima_of(
    whole: Likelihood, sources: Sequence[Source], sight: Sight | None, counter: Counter
) -> list[Place]:
    """Find minima that may be the best, the deepest first."""
    thin = whole.with_series(series_of(sources, sight, SEARCH_SAMPLES))
    simple = all(isinstance(one, Curve) for one in sources)
    every = range(len(whole.names))
    sizes = _sizes(whole)
    most = 0 if lengthens(whole.names, sources) else _most_surveyed(whole.names, sources)
    counter.begin("search of the whole range", most)
    found = _searched(thin, sources, sight, counter)
    # few samples tell less: what is far above the best in them is so in all
    near = [one for one in found if one.deviance - found[0].deviance < TOLD]
    places = distinct([whole.at(one.at) for one in near], 0.0 * sizes, FINALISTS)
    deep = [descend(whole, one.at, every, rounds=2)[0] for one in places]
    if not simple:
        best = min(deep, key=lambda one: one.deviance)
        steps = np.array([0.0 if name in ZOOM_VALUES else LAST_STEP for name in whole.names])
        closer = _zoom(whole, best.at, LAST_ZOOM * sizes, steps)
        deep += [descend(whole, one.at, every, rounds=2)[0] for one in closer[:1]]
    found = distinct(deep, 0.1 * sizes, FINALISTS)
    if not simple and len(whole.names) == 1 and whole.names[0] in (STIFFNESS, RATIO):
        found = distinct([*deep, *_scanned(whole, counter)], np.array([APART]), DIPS_FOLLOWED)

    def searched(others: Sequence[Source]) -> tuple[Likelihood, Place]:
        like = thin.with_series(series_of(others, sight, SEARCH_SAMPLES))
        counter.begin("search with the sign reversed")
        return like, _searched(like, others, sight, counter)[0]

    check_signs(thin, found, sources, searched)
    return found


def _scanned(whole: Likelihood, counter: Counter) -> list[Place]:
    """Dips of one unknown that explain the data nearly as well as the deepest."""
    (name,), rest = whole.names, math.log(FACTOR)
    guess = float(coordinates([name], [whole.scene[name]])[0])
    low, high = max(whole.low[0], guess - rest), min(whole.high[0], guess + rest)
    row = np.arange(low, high, SCAN_STEP)
    beside = SCAN_FINE * np.arange(-9, 10)
    counter.begin("scan of the whole range", len(row) + SCANNED * len(beside))
    places = [whole.at(np.array([at])) for at in row]
    for one in sorted(places, key=lambda place: place.deviance)[:SCANNED]:
        places += [whole.at(one.at + step) for step in beside]
    places.sort(key=lambda place: float(place.at[0]))
    dips = [
        here
        for before, here, after in zip(places, places[1:], places[2:], strict=False)
        if here.deviance <= min(before.deviance, after.deviance)
    ]
    dips.sort(key=lambda place: place.deviance)
    steps = np.array([LAST_STEP])
    return [
        descend(whole, one.at, [0], steps, rounds=2)[0]
        for one in distinct(dips, np.array([APART]), DIPS_FOLLOWED)
        if one.deviance - dips[0].deviance < TOLD
    ]


def _searched(
    thin: Likelihood, sources: Sequence[Source], sight: Sight | None, counter: Counter
) -> list[Place]:
    """Minima of few samples, the best first."""
    sizes = _sizes(thin)
    starts = distinct(_survey(thin, sources, sight), ZOOMS[-1] * sizes, STARTS)
    counter.begin("descent from the best places")
    every = range(len(thin.names))
    lower = [descend(thin, one.at, every, rounds=2)[0] for one in starts]
    return distinct(lower, 0.25 * sizes, STARTS)


def _survey(thin: Likelihood, sources: Sequence[Source], sight: Sight | None) -> list[Place]:
    """Places all over what is searched, and more of them around the best."""
    names = thin.names
    guess = coordinates(
        names, [thin.scene[name] or (0.0 if name in EXPONENTS else 1.0) for name in names]
    )
    box = thin.box
    slow = [k for k, name in enumerate(names) if name in SLOW]
    rough = [k for k in range(len(names)) if k not in slow]
    curves = [one for one in sources if isinstance(one, Curve)]
    steps = np.zeros(len(names))
    steps[slow] = SLOW_STEP
    places = [thin.at(guess)]
    if slow and sight is not None:
        guess[slow] = seen(sight, [names[k] for k in slow], thin)
        alone = Likelihood(thin.scene, series_of(curves, sight), names, box, lambda: None)
        place, spread = descend(alone, np.clip(guess, thin.low, thin.high), slow)
        places, starts = [thin.at(place.at)], [place.at]
        if len(sources) == len(curves):
            return places
        steps[slow] = np.minimum(CURVE_ERRORS * np.sqrt(np.diag(spread)), MOST_CURVE_STEP)
    else:
        for k in slow:
            if names[k] not in EXPONENTS:
                box[k] = np.clip(guess[k] + math.log(FACTOR) * np.array([-1.0, 1.0]), *box[k])
        rows = design(box, _points(names), names.index(ENERGY) if ENERGY in names else -1, LEVELS)
        if lengthens(names, sources):
            first = _shortened(thin, sources, sight, SHARES[0])
            best = distinct([first.at(at) for at in rows], _sizes(thin), STARTS)
            starts = [one.at for one in best]
        else:
            places += [thin.at(at) for at in rows]
            starts = []
    if lengthens(names, sources):
        longest, steps = _lengthened(thin, sources, sight, starts, steps)
        places += [thin.at(at) for at in longest]
    if starts and rough:
        axes = {k: np.linspace(thin.low[k], thin.high[k], VALUES[names[k]]) for k in rough}
        base = min(places, key=lambda one: one.deviance).at
        places += [thin.at(at) for at in grid(thin, base, axes, slow, steps)[:RELAXED]]
    for share in ZOOMS:
        sizes = share * _sizes(thin)
        for centre in distinct(places, sizes, ZOOMED):
            places += _zoom(thin, centre.at, sizes, share * steps)
    return places


def lengthens(names: Sequence[str], sources: Sequence[Source]) -> bool:
    """Whether the search begins with a first part of each drop."""
    return any(name in EXPONENTS for name in names) and any(
        isinstance(one, DropTest) for one in sources
    )


def _shortened(
    thin: Likelihood, sources: Sequence[Source], sight: Sight | None, share: float
) -> Likelihood:
    """Likelihood of a first part of each drop, and of all else; of whole drops if they are thin."""
    parts = []
    for one in sources:
        if isinstance(one, DropTest):
            kept = one.time <= share * one.time[-1]
            if np.count_nonzero(kept) >= LEAST_DATA:
                one = replace(one, time=one.time[kept], values=one.values[kept])
        parts.append(one)
    return thin.with_series(series_of(parts, sight, SEARCH_SAMPLES))


def _lengthened(
    thin: Likelihood,
    sources: Sequence[Source],
    sight: Sight | None,
    starts: Sequence[np.ndarray],
    steps: np.ndarray,
) -> tuple[list[np.ndarray], np.ndarray]:
    """Places that fit ever longer parts of the drops, and steps of slopes there."""
    names = thin.names
    slow = [k for k, name in enumerate(names) if name in SLOW]
    axes = {
        k: np.linspace(thin.low[k], thin.high[k], ZOOM_VALUES[name])
        for k, name in enumerate(names)
        if name in ZOOM_VALUES
    }
    sizes = ZOOMS[-1] * _sizes(thin)
    carried = list(starts)
    for share in SHARES:
        like = _shortened(thin, sources, sight, share)
        found = []
        for at in carried:
            tried = grid(like, at, axes, slow, steps)[:TRIED] if axes else []
            found += [descend(like, one, range(len(names))) for one in (at, *tried)]
        best, spread = min(found, key=lambda pair: pair[0].deviance)
        steps = steps.copy()
        errors = np.sqrt(np.diag(spread))[slow]
        steps[slow] = np.clip(CURVE_ERRORS * errors, LEAST_STEP, MOST_CURVE_STEP)
        kept = distinct([place for place, _ in found], sizes, CARRIED)
        carried = [one.at for one in kept if one.deviance - best.deviance < TOLD]
    return carried, steps


def _points(names: Sequence[str]) -> int:
    """Points of a search without a curve, a power of 2."""
    return POINTS << max(sum(name != ENERGY for name in names) - OF_POINTS, 0)


def _most_surveyed(names: Sequence[str], sources: Sequence[Source]) -> int:
    """Most computations of `_survey`, where it takes whole drops from the first."""
    rough = [name for name in names if name in VALUES]
    moved = 1 + len(names) - len(rough)
    curves = sum(isinstance(one, Curve) for one in sources)
    if moved > 1 and curves:
        if len(sources) == curves or not rough:
            return 2
        first = 1 + moved * math.prod(VALUES[name] for name in rough) + RELAXED
    elif ENERGY in names:
        first = LEVELS if len(names) == 1 else _points(names) * LEVELS
    else:
        first = _points(names)
    zoom = moved * math.prod(ZOOM_VALUES[name] for name in rough) + ZOOM_RELAXED
    return 1 + first + (len(ZOOMS) * ZOOMED * zoom if rough else 0)


def _zoom(like: Likelihood, at: np.ndarray, sizes: np.ndarray, steps: np.ndarray) -> list[Place]:
    """The best places of a grid of C_R and W_R around a place; K_R and gamma follow."""
    axes = {}
    for k, name in enumerate(like.names):
        if name in ZOOM_VALUES:
            row = at[k] + sizes[k] * np.linspace(-1.0, 1.0, ZOOM_VALUES[name])
            axes[k] = np.clip(row, like.low[k], like.high[k])
    if not axes:
        return []
    slow = [k for k in range(len(at)) if k not in axes]
    return [like.at(one) for one in grid(like, at, axes, slow, steps)[:ZOOM_RELAXED]]


def check_signs(
    thin: Likelihood,
    whole: Sequence[Place],
    sources: Sequence[Source],
    searched: Callable[[Sequence[Source]], tuple[Likelihood, Place]],
) -> None:
    """Refuse drops that are explained far better with their sign reversed.

    Parameters
    ----------
    thin : Likelihood
        Of few samples of each drop.
    whole : sequence of Place
        The best first, of all samples.
    sources : sequence
    searched : callable
        Gives the likelihood and the best place of other measurements, by as many samples.

    Raises
    ------
    FitError
    """
    doubtful = [
        k
        for k, (one, off) in enumerate(zip(sources, whole[0].residuals, strict=True))
        if isinstance(one, DropTest) and _is_doubtful(one.values, off[: len(one.values)])
    ]
    if not doubtful:
        return
    best = thin.at(whole[0].at)
    tried = [doubtful] if len(doubtful) == 1 else [doubtful, *([k] for k in doubtful)]
    for turned in tried:
        others = [
            replace(one, values=-one.values) if k in turned and isinstance(one, DropTest) else one
            for k, one in enumerate(sources)
        ]
        like, found = searched(others)
        gained = sum(2.0 * len(like.series[k].data) * math.log(SMALLER) for k in turned)
        if best.deviance - found.deviance > gained:
            names = ", ".join(sources[k].name for k in turned)
            raise FitError(
                f"{names}: the sign is reversed: with the opposite one the rock explains the data "
                "far better; down and compression count positive, so multiply the column by -1"
            )


def _is_doubtful(data: np.ndarray, off: np.ndarray) -> bool:
    total = float(off @ off)
    alike = total > 0.0 and float(off[1:] @ off[:-1]) > ALIKE * total
    return alike or total > LITTLE**2 * len(data) * float(np.var(data))
