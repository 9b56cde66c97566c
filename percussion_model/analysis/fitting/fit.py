"""The rock from all measurements together: estimates, intervals and rivals."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from percussion_model.analysis.fitting.curve import first_sight
from percussion_model.analysis.fitting.found import (
    DETERMINED,
    LAWS,
    OPEN,
    OPEN_ABOVE,
    OPEN_BELOW,
    RIVALLED,
    ROUGH_FACTOR,
    TOLD,
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
    EXPONENT,
    EXPONENTS,
    RATIO,
    SLOW,
    STIFFNESS,
    UNLOADING,
    Likelihood,
    Place,
    coordinates,
    decades,
    values_at,
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
    distrusted,
    gap_notes,
    grid_notes,
    interval_notes,
    kept_notes,
    rival_notes,
    rough_notes,
    sensor_notes,
    sensors_of,
)
from percussion_model.analysis.fitting.sampling import (
    Explored,
    Profile,
    Walk,
    profiles_of,
    pushed_out,
    steps_wanted,
    walk,
)
from percussion_model.analysis.fitting.search import (
    APART,
    beside,
    descend,
    polish,
    roughness,
)
from percussion_model.analysis.fitting.single import solved
from percussion_model.analysis.fitting.survey import Counter, minima_of, series_of
from percussion_model.scene.scene import Scene

# What can be fitted, and where it is searched; SI units.
RANGES = {
    STIFFNESS: (1e6, 1e11),
    EXPONENT: (1.0, 4.0),
    RATIO: (1.01, 100.0),
    UNLOADING: (0.0, 2.0),
    DAMPING: (1e2, 1e7),
    ENERGY: (1e-4, 10.0),
}
# Walks in turn, each from the best so far: shares of all steps. The search met all there is
# where the last one finds nothing better by this share of the threshold.
ROUNDS, BETTER = (0.4, 0.6), 0.25
# Share of all steps for each other minimum that explains the data as well.
RIVAL_SHARE = 0.2
# Peaks of slow tests within this factor are one: they tell gamma there, and q not at all.
ONE_PEAK = 1.02
# A parameter whose interval is wider than a factor of ten is not called determined; an exponent,
# where a force ten times as large would leave a factor of ten.
MOST_DECADES = 1.0


def fit_rock(
    scene: Scene,
    curve: Curve | Sequence[Curve] | None = None,
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
        Of the bit, with or without its hammer. Its rock, which follows the bilinear law or the
        power law, stays where nothing is fitted.
    curve : Curve, or sequence of them, optional
        Each one loading and unloading, of rock that was not pressed before.
    drops : sequence of DropTest
    readings : sequence of Reading
    parameters : sequence of str, optional
        Keys of `RANGES` that are fitted; default K_R and gamma for a curve alone, else all. By
        the power law n, and q unless all peaks are of about one force, as well.
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
    given = [curve] if isinstance(curve, Curve) else list(curve or ())
    curves = [checked_curve(one) for one in given]
    sources: list[Source] = [*curves, *map(checked_drop, drops), *readings]
    for reading in readings:
        check_reading(reading)
    if not sources:
        raise FitError("nothing to fit: a curve, a drop or a reading is needed")
    names = _chosen(scene, sources, parameters)
    sight = first_sight(curves, scene) if curves else None
    untold: tuple[str, ...] = ()
    both = RATIO in names and UNLOADING in names
    # what is known of q beforehand may tell it
    if both and UNLOADING not in (ranges or {}) and _of_one_peak(sources):
        if parameters is not None:
            raise FitError(
                f"{UNLOADING}: peaks of about one force do not determine it and {RATIO} both; "
                "give a "
                "range of it, or fit one of them"
            )
        untold = (UNLOADING,)
        names = tuple(name for name in names if name not in untold)
    box = _box(scene, names, ranges or {})
    counter = Counter(progress, stage)
    whole = Likelihood(scene, series_of(sources, sight), names, box, counter.tick)
    quantile = _quantile(confidence, len(names))
    if len(names) == 1 and len(sources) == 1 and isinstance(sources[0], Reading):
        counter.begin("bisection")
        found = solved(whole, sources[0], quantile)
    else:
        minima = minima_of(whole, sources, sight, counter)
        unknowns = sum(one.unknowns for one in whole.series if one.simulated)
        alike = _quantile(confidence, len(names) + unknowns)
        found = _explored(whole, minima, quantile, alike, counter)
    return _result(whole, sources, found, confidence, quantile, counter, untold)


def _quantile(confidence: float, free: int) -> float:
    """Deviance above the best to which the region of all free parameters together reaches.

    The best is the deepest of many dips, and so likelier by luck than the truth: by more than
    a single parameter's interval allows for.
    """
    from scipy.stats import chi2

    return float(chi2.ppf(confidence, free))


def _chosen(
    scene: Scene, sources: Sequence[Source], parameters: Sequence[str] | None
) -> tuple[str, ...]:
    """Free parameters; refuses scenes and choices that make no sense."""
    slow = all(isinstance(one, Curve) for one in sources)
    law = scene.effects.rock
    if law not in LAWS:
        raise FitError(f'effects.rock = "{law}": must be one of {", ".join(LAWS)}')
    possible = LAWS[law]
    default = tuple(name for name in possible if name in SLOW or not slow)
    names = default if parameters is None else tuple(parameters)
    for name in names:
        if name not in possible:
            raise FitError(f"{name} cannot be fitted: must be one of {', '.join(possible)}")
        if names.count(name) > 1:
            raise FitError(f"{name} is to be fitted {names.count(name)} times: name it once")
    if not names:
        raise FitError(f"parameters: at least one of {', '.join(possible)} is needed")
    if not slow and not scene.effects.barrier:
        raise FitError("the scene has no energy barrier: effects.barrier must be true")
    hammer = [one for one in sources if isinstance(one, Reading) and one.speed is None]
    if hammer and scene.piston.model == "absent":
        raise FitError(f"{hammer[0].name}: the scene has no piston")
    if len(names) > len(hammer) == len(sources):
        raise FitError(
            f"{', '.join(one.name for one in hammer)}: no more unknowns than numbers of the hammer "
            f"can be determined, not {', '.join(names)}; name what to fit (--only), or add "
            "tests of rock"
        )
    return names


def _box(
    scene: Scene, names: Sequence[str], ranges: Mapping[str, tuple[float, float]]
) -> np.ndarray:
    """Coordinates between which each parameter is searched."""
    for name in ranges:
        if name not in names:
            raise FitError(f"range of {name}: it is not fitted; fitted are {', '.join(names)}")
    box = np.zeros((len(names), 2))
    for k, name in enumerate(names):
        low, high = ranges.get(name, RANGES[name])
        row = scene.row_of(name)
        least, most = row.lower or 0.0, row.upper or math.inf
        above = low > 0 or name in EXPONENTS
        if not (above and low < high and least <= low and high <= most):
            raise FitError(
                f"range of {name} = {low!r} to {high!r}: must rise, between {least:g} and {most:g}"
            )
        box[k] = coordinates([name, name], [low, high])
    return box


def _of_one_peak(sources: Sequence[Source]) -> bool:
    """Whether all data are slow tests to about the same force."""
    peaks = [float(one.force.max()) for one in sources if isinstance(one, Curve)]
    return len(peaks) == len(sources) and max(peaks) < ONE_PEAK * min(peaks)


def _explored(
    like: Likelihood, minima: list[Place], quantile: float, alike: float, counter: Counter
) -> Explored:
    """Walk from the best of all minima, twice: the second knows how wide the first went.

    Minima apart that are less than `alike` above the best explain the data as well: unknowns of
    sensors make one of them the best by luck.
    """
    every, rng = range(len(like.names)), np.random.default_rng(0)
    if alike > quantile:
        counter.begin("minima beside the best")
        minima = beside(like, minima[0], SLOW, TOLD) + minima[1:]
        minima.sort(key=lambda one: one.deviance)
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
    for other in minima[1:]:
        # a dip of its own, unless it is one of what was met
        if other.deviance < best.deviance + alike and _is_apart(other, walked, best, threshold):
            there, wide_there = descend(like, other.at, every)
            steps = round(RIVAL_SHARE * steps_wanted(len(every)))
            met = walk(like, there, wide_there, threshold, steps, rng)
            walked = walked.joined(met.lifted(there.deviance, float(walked.deviance.min())))
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


def _is_apart(place: Place, walked: Walk, best: Place, threshold: float) -> bool:
    """Whether a minimum lies outside of what a walk met below a threshold, in one parameter."""
    inside = walked.at[walked.deviance < best.deviance + threshold]
    low, high = inside.min(axis=0) + APART, inside.max(axis=0) - APART
    return bool(np.any((place.at < low) | (place.at > high)))


def _outside(place: Place, profiles: Sequence[Profile]) -> bool:
    """Whether a place lies outside of an interval, in one parameter at least."""
    return any(not one.low <= at <= one.high for at, one in zip(place.at, profiles, strict=True))


def _result(
    like: Likelihood,
    sources: Sequence[Source],
    explored: Explored,
    confidence: float,
    quantile: float,
    counter: Counter,
    untold: Sequence[str],
) -> Fit:
    """Put a fit together."""
    sensors, mixed = sensors_of(like, explored.best, explored.spread)
    runs = counter.done
    counter.begin("check with finer cells")
    best, spread, profiles, minima, threshold, settled, notes, unreached = explored
    estimates, curves = {}, {}
    for k, (name, found) in enumerate(zip(like.names, profiles, strict=True)):
        estimates[name] = _estimate(name, best.at[k], found, like.low[k], like.high[k])
        curves[name] = values_at(name, found.values), found.deviance
    rivals = [
        Rival({key: float(like.scene_at(one.at)[key]) for key in like.names}, above)
        for one in minima[1:]
        if (above := one.deviance - best.deviance) < TOLD + threshold and _outside(one, profiles)
    ]
    explained = [
        Explained(one.name, one.data, one.data - off[: len(one.data)], noise, source, sensor)
        for one, off, noise, source, sensor in zip(
            like.series, best.residuals, best.noise, sources, sensors, strict=True
        )
    ]
    estimates, distrust = distrusted(estimates, explained, mixed, unreached)
    warnings = [
        *distrust,
        *notes,
        *interval_notes(estimates, like),
        *kept_notes(like, all(isinstance(one, Curve) for one in sources), untold),
        *([] if settled else [UNSETTLED]),
        *rough_notes((threshold - quantile) / ROUGH_FACTOR),
        *sensor_notes(explained),
        *gap_notes(like, profiles),
        *rival_notes(rivals),
        *(note for one in explained for note in correlation_note(one)),
        *grid_notes(like, best, spread, profiles),
    ]
    return Fit(
        like.scene.effects.rock, estimates, confidence, quantile, threshold, explained, rivals,
        curves, runs, warnings,
    )  # fmt: skip


def _estimate(name: str, at: float, found: Profile, low: float, high: float) -> Estimate:
    open_below, open_above = math.isinf(found.low), math.isinf(found.high)
    verdict = {
        (False, False): RIVALLED if found.gap else DETERMINED,
        (True, False): OPEN_BELOW,
        (False, True): OPEN_ABOVE,
        (True, True): OPEN,
    }[open_below, open_above]
    value, least, most = (
        float(values_at(name, one)) for one in (at, max(found.low, low), min(found.high, high))
    )
    if verdict in (DETERMINED, RIVALLED) and decades(name, least, most) > MOST_DECADES:
        verdict = WIDE
    return Estimate(value, least, most, verdict)
