"""The rock from all measurements together: estimates, intervals and rivals."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from percussion_model.analysis.fitting.curve import first_sight
from percussion_model.analysis.fitting.found import (
    DETERMINED,
    OPEN,
    OPEN_ABOVE,
    OPEN_BELOW,
    RIVALLED,
    ROUGH_FACTOR,
    WIDE,
    Estimate,
    Explained,
    Fit,
    Rival,
    Source,
)
from percussion_model.analysis.fitting.likelihood import (
    DAMPING,
    ENERGY,
    RATIO,
    STIFFNESS,
    Likelihood,
    Place,
    Series,
    curve_series,
    drop_series,
    reading_series,
)
from percussion_model.analysis.fitting.measurements import (
    Curve,
    DropTest,
    FitError,
    Reading,
    check_reading,
    checked_curve,
    checked_drop,
)
from percussion_model.analysis.fitting.notes import (
    UNSETTLED,
    correlation_note,
    gap_notes,
    grid_notes,
    interval_notes,
    kept_notes,
    rival_notes,
    rough_notes,
)
from percussion_model.analysis.fitting.sampling import (
    Profile,
    Walk,
    profiles_of,
    pushed_out,
    steps_wanted,
    walk,
)
from percussion_model.analysis.fitting.search import (
    descend,
    design,
    distinct,
    grid,
    polish,
    roughness,
)
from percussion_model.scene.scene import Scene

# What can be fitted, and where it is searched; SI units.
RANGES = {
    STIFFNESS: (1e6, 1e11),
    RATIO: (1.01, 100.0),
    DAMPING: (1e2, 1e7),
    ENERGY: (1e-4, 10.0),
}
# With a curve, a grid of C_R and W_R is computed for its K_R and gamma and for those this share
# of their standard errors beside, and so many of the best places with K_R and gamma moved.
CURVE_ERRORS, RELAXED = 0.3, 48
VALUES = {DAMPING: 11, ENERGY: 16}
# Without, so many points with K_R and gamma within this factor of the scene's, with so many
# values of W_R at each: it decides on the number of drilling cycles.
POINTS, FACTOR, LEVELS = 128, 10.0, 20
SLOW_STEP = 3e-3
# Around so many of the best places finer grids follow, these shares of `ZOOM` to each side, in
# the logarithm; of each so many of the best places are computed.
ZOOMS, ZOOMED, ZOOM_RELAXED = (1.0, 0.3), 3, 8
ZOOM_VALUES = {DAMPING: 6, ENERGY: 6}
# The search goes down from so many places, in so many samples of each drop, then from the best
# few in all samples. Places nearer to each other than this are one, in the logarithm.
SEARCH_SAMPLES = 50
STARTS, FINALISTS = 8, 4
ZOOM = {STIFFNESS: 0.5, RATIO: 0.3, DAMPING: 1.0, ENERGY: 0.6}
# The last of these grids is of all samples.
LAST_ZOOM, LAST_STEP = 0.12, 2e-4
# Minima are told up to this deviance above the best: less likely by exp(-10).
TOLD = 20.0
# Walks in turn, each from the best so far: shares of all steps. The search met all there is
# where the last one finds nothing better by this share of the threshold.
ROUNDS, BETTER = (0.4, 0.6), 0.25
# A parameter whose interval is wider than this factor is not called determined.
MOST_WIDTH = 10.0


def fit_rock(
    scene: Scene,
    curve: Curve | None = None,
    drops: Sequence[DropTest] = (),
    readings: Sequence[Reading] = (),
    parameters: Sequence[str] | None = None,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    confidence: float = 0.95,
    progress: Callable[[int], None] | None = None,
    stage: Callable[[str, int], None] | None = None,
) -> Fit:
    """Fit the rock of a scene to all measurements together.

    All measurements have one likelihood. The noise of each curve and of each drop is
    estimated along; it is taken to be independent from one datum to the next. What is
    measured jumps where the number of drilling cycles changes, so the deviance has many
    minima: the whole range of C_R and W_R is searched, least squares go down from the best
    places, and a random walk from there visits all that the data allow. An interval holds
    all values of its parameter with which it found the data likely enough.

    Parameters
    ----------
    scene : Scene
        Of the bit, with or without its hammer. Its rock stays where nothing is fitted.
    curve : Curve, optional
    drops : sequence of DropTest
    readings : sequence of Reading
    parameters : sequence of str, optional
        Keys of `RANGES` that are fitted; default K_R and gamma for a curve alone, else all.
    ranges : mapping, optional
        Where a parameter is searched, in place of `RANGES`: what is known beforehand.
    confidence : float
        Of the intervals together: they span the region of that confidence of all parameters.
    progress : callable, optional
        Called with the number of computations done. How many there will be is not known.
    stage : callable, optional
        Called with what begins, and the most computations that it takes; 0 where that is not
        known.

    Returns
    -------
    Fit

    Raises
    ------
    FitError
        If data or arguments make no sense.
    """
    if not 0 < confidence < 1:
        raise FitError(f"confidence = {confidence!r}: must be a number above 0 and below 1")
    curve = None if curve is None else checked_curve(curve)
    sources: list[Source] = [
        *([] if curve is None else [curve]),
        *map(checked_drop, drops),
        *readings,
    ]
    for reading in readings:
        check_reading(reading)
    if not sources:
        raise FitError("nothing to fit: a curve, a drop or a reading is needed")
    names = _chosen(scene, sources, parameters)
    box = _box(scene, names, ranges or {})
    counter = _Counter(progress, stage)
    whole = Likelihood(scene, [_series(one) for one in sources], names, box, counter.tick)
    minima = _minima(whole, sources, counter)
    quantile = _quantile(confidence, len(names))
    found = _explored(whole, minima, quantile, counter)
    counter.begin("check with finer cells")
    return _result(whole, sources, found, confidence, quantile, counter.done)


def _quantile(confidence: float, free: int) -> float:
    """Deviance above the best to which the region of all free parameters together reaches.

    The best is the deepest of many dips, and so likelier by luck than the truth: by more than
    a single parameter's interval allows for.
    """
    from scipy.stats import chi2

    return float(chi2.ppf(confidence, free))


class _Counter:
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


def _chosen(
    scene: Scene, sources: Sequence[Source], parameters: Sequence[str] | None
) -> tuple[str, ...]:
    """Free parameters; refuses scenes and choices that make no sense."""
    slow = all(isinstance(one, Curve) for one in sources)
    names = tuple(parameters) if parameters is not None else tuple(RANGES)[: 2 if slow else 4]
    for name in names:
        if name not in RANGES:
            raise FitError(f"{name} cannot be fitted: must be one of {', '.join(RANGES)}")
        if names.count(name) > 1:
            raise FitError(f"{name} is to be fitted {names.count(name)} times: name it once")
    if not names:
        raise FitError(f"parameters: at least one of {', '.join(RANGES)} is needed")
    if scene.effects.rock != "bilinear":
        raise FitError(f'effects.rock = "{scene.effects.rock}": must be "bilinear"')
    if not slow and not scene.effects.barrier:
        raise FitError("the scene has no energy barrier: effects.barrier must be true")
    hammer = [one for one in sources if isinstance(one, Reading) and one.speed is None]
    if hammer and scene.piston.model == "absent":
        raise FitError(f"{hammer[0].name}: the scene has no piston")
    return names


def _box(
    scene: Scene, names: Sequence[str], ranges: Mapping[str, tuple[float, float]]
) -> np.ndarray:
    """Logarithms between which each parameter is searched."""
    for name in ranges:
        if name not in names:
            raise FitError(f"range of {name}: it is not fitted; fitted are {', '.join(names)}")
    box = np.zeros((len(names), 2))
    for k, name in enumerate(names):
        low, high = ranges.get(name, RANGES[name])
        row = scene.row_of(name)
        least, most = row.lower or 0.0, row.upper or math.inf
        if not (0 < low < high and least <= low and high <= most):
            raise FitError(
                f"range of {name} = {low!r} to {high!r}: must rise, between {least:g} and {most:g}"
            )
        box[k] = np.log([low, high])
    return box


def _series(source: Source, most: int | None = None) -> Series:
    if isinstance(source, Curve):
        return curve_series(source)
    if isinstance(source, DropTest):
        return drop_series(source, most)
    return reading_series(source)


def _minima(whole: Likelihood, sources: Sequence[Source], counter: _Counter) -> list[Place]:
    """Find minima that may be the best, the deepest first."""
    thin = Likelihood(
        whole.scene,
        [_series(one, SEARCH_SAMPLES) for one in sources],
        whole.names,
        np.stack([whole.low, whole.high], axis=1),
        counter.tick,
    )
    simple = all(isinstance(one, Curve) for one in sources)
    every = range(len(whole.names))
    sizes = np.array([ZOOM[name] for name in whole.names])
    counter.begin("search of the whole range", _most_surveyed(whole.names, sources))
    starts = distinct(_survey(thin, sources), ZOOMS[-1] * sizes, STARTS)
    counter.begin("descent from the best places")
    lower = [descend(thin, one.at, every, rounds=2)[0] for one in starts]
    found = distinct(lower, 0.25 * sizes, STARTS)
    # few samples tell less: what is far above the best in them is so in all
    near = [one for one in found if one.deviance - found[0].deviance < TOLD]
    places = distinct([whole.at(one.at) for one in near], 0.0 * sizes, FINALISTS)
    deep = [descend(whole, one.at, every, rounds=2)[0] for one in places]
    if not simple:
        best = min(deep, key=lambda one: one.deviance)
        steps = np.array([0.0 if name in ZOOM_VALUES else LAST_STEP for name in whole.names])
        closer = _zoom(whole, best.at, LAST_ZOOM * sizes, steps)
        deep += [descend(whole, one.at, every, rounds=2)[0] for one in closer[:1]]
    return distinct(deep, 0.1 * sizes, FINALISTS)


def _survey(thin: Likelihood, sources: Sequence[Source]) -> list[Place]:
    """Places all over what is searched, and more of them around the best."""
    names = thin.names
    guess = np.log([thin.scene[name] or 1.0 for name in names])
    box = np.stack([thin.low, thin.high], axis=1)
    slow = [k for k, name in enumerate(names) if name in (STIFFNESS, RATIO)]
    rough = [k for k in range(len(names)) if k not in slow]
    curves = [one for one in sources if isinstance(one, Curve)]
    steps = np.zeros(len(names))
    steps[slow] = SLOW_STEP
    places = [thin.at(guess)]
    if slow and curves:
        sight = dict(zip((STIFFNESS, RATIO), first_sight(curves[0])[:2], strict=True))
        guess[slow] = np.log([sight[names[k]] for k in slow])
        alone = Likelihood(thin.scene, [_series(curves[0])], names, box, lambda: None)
        place, spread = descend(alone, np.clip(guess, thin.low, thin.high), slow)
        places = [thin.at(place.at)]
        if len(sources) == len(curves) or not rough:
            return places
        steps[slow] = CURVE_ERRORS * np.sqrt(np.diag(spread))
        axes = {k: np.linspace(box[k, 0], box[k, 1], VALUES[names[k]]) for k in rough}
        places += [thin.at(at) for at in grid(thin, place.at, axes, slow, steps)[:RELAXED]]
    else:
        for k in slow:
            box[k] = np.clip(guess[k] + math.log(FACTOR) * np.array([-1.0, 1.0]), *box[k])
        rows = design(box, POINTS, names.index(ENERGY) if ENERGY in names else -1, LEVELS)
        places += [thin.at(at) for at in rows]
    for share in ZOOMS:
        sizes = share * np.array([ZOOM[name] for name in names])
        for centre in distinct(places, sizes, ZOOMED):
            places += _zoom(thin, centre.at, sizes, share * steps)
    return places


def _most_surveyed(names: Sequence[str], sources: Sequence[Source]) -> int:
    """Most computations of `_survey`."""
    rough = [name for name in names if name in VALUES]
    moved = 1 + len(names) - len(rough)
    curves = sum(isinstance(one, Curve) for one in sources)
    if moved > 1 and curves:
        if len(sources) == curves or not rough:
            return 2
        first = 1 + moved * math.prod(VALUES[name] for name in rough) + RELAXED
    elif ENERGY in names:
        first = LEVELS if len(names) == 1 else POINTS * LEVELS
    else:
        first = POINTS
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


class Explored(NamedTuple):
    """The best place, its covariance, what was found around, and whether no better place was."""

    best: Place
    spread: np.ndarray
    profiles: list[Profile]
    minima: list[Place]
    threshold: float
    settled: bool


def _explored(
    like: Likelihood, minima: list[Place], quantile: float, counter: _Counter
) -> Explored:
    """Walk from the best of all minima, twice: the second knows how wide the first went."""
    every, rng = range(len(like.names)), np.random.default_rng(0)
    walked = Walk.of(minima)
    wide: np.ndarray | None = None
    for turn, share in enumerate(ROUNDS, 1):
        best, spread = descend(like, minima[0].at, every)
        best = polish(like, best, spread)
        threshold = quantile + ROUGH_FACTOR * max(roughness(like, best, spread))
        minima = [best, *(one for one in minima if one.deviance > best.deviance)]
        steps = round(share * steps_wanted(len(every)))
        first = spread if wide is None else wide
        counter.begin(f"walk {turn} of {len(ROUNDS)}", steps)
        walked = walked.joined(walk(like, best, first, threshold, steps, rng))
        counter.begin("descent from where it went")
        wide = walked.spread(threshold)
        place = like.at(walked.best)
        settled = place.deviance > best.deviance - BETTER * threshold
        if place.deviance < best.deviance:
            minima = [place, *minima]
    best, spread = descend(like, minima[0].at, every)
    walked = walked.joined(Walk.of([best]))
    counter.begin("ends of the intervals")
    beyond = pushed_out(
        like,
        walked,
        threshold,
        lambda at, free, rounds: descend(like, at, free, rounds=rounds)[0],
    )
    walked = walked.joined(Walk.of([best, *beyond]))
    deepest = min([best, *beyond], key=lambda one: one.deviance)
    if deepest is not best:
        settled = settled and deepest.deviance > best.deviance - BETTER * threshold
        best, spread = deepest, descend(like, deepest.at, every)[1]
    minima = [best, *minima[1:]]
    profiles = profiles_of(like, walked, threshold)
    return Explored(best, spread, profiles, minima, threshold, settled)


def _outside(place: Place, profiles: Sequence[Profile]) -> bool:
    """Whether a place lies outside of an interval, in one parameter at least."""
    return any(not one.low <= at <= one.high for at, one in zip(place.at, profiles, strict=True))


def _result(
    like: Likelihood,
    sources: Sequence[Source],
    explored: Explored,
    confidence: float,
    quantile: float,
    runs: int,
) -> Fit:
    """Put a fit together."""
    best, spread, profiles, minima, threshold, settled = explored
    estimates, curves = {}, {}
    for k, (name, found) in enumerate(zip(like.names, profiles, strict=True)):
        estimates[name] = _estimate(best.at[k], found, like.low[k], like.high[k])
        curves[name] = np.exp(found.values), found.deviance
    rivals = [
        Rival(dict(zip(like.names, np.exp(one.at).tolist(), strict=True)), above)
        for one in minima[1:]
        if (above := one.deviance - best.deviance) < TOLD + threshold and _outside(one, profiles)
    ]
    explained = [
        Explained(one.name, one.data, one.data - off, noise, source)
        for one, off, noise, source in zip(
            like.series, best.residuals, best.noise, sources, strict=True
        )
    ]
    warnings = [
        *interval_notes(estimates, like),
        *kept_notes(like, all(isinstance(one, Curve) for one in sources)),
        *([] if settled else [UNSETTLED]),
        *rough_notes((threshold - quantile) / ROUGH_FACTOR),
        *gap_notes(like, profiles),
        *rival_notes(rivals),
        *(note for one in explained for note in correlation_note(one)),
        *grid_notes(like, best, spread, profiles),
    ]
    return Fit(
        estimates, confidence, quantile, threshold, explained, rivals, curves, runs, warnings
    )


def _estimate(at: float, found: Profile, low: float, high: float) -> Estimate:
    open_below, open_above = math.isinf(found.low), math.isinf(found.high)
    verdict = {
        (False, False): RIVALLED if found.gap else DETERMINED,
        (True, False): OPEN_BELOW,
        (False, True): OPEN_ABOVE,
        (True, True): OPEN,
    }[open_below, open_above]
    ends = (math.exp(max(found.low, low)), math.exp(min(found.high, high)))
    if verdict in (DETERMINED, RIVALLED) and ends[1] > MOST_WIDTH * ends[0]:
        verdict = WIDE
    return Estimate(math.exp(at), *ends, verdict)
