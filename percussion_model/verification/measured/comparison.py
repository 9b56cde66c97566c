"""Computed blows beside measured ones: fits, predictions, and what each criterion says."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from percussion_model.analysis.fitting.likelihood import (
    EXPONENTS,
    Likelihood,
    Place,
    Series,
    coordinates,
    values_at,
)
from percussion_model.analysis.fitting.search import descend
from percussion_model.scene.scene import Scene
from percussion_model.verification.measured.blow import Reading, Rig
from percussion_model.verification.measured.experiments import (
    FIXED,
    LAWS,
    Experiment,
    FitPlan,
    Measurement,
)
from percussion_model.verification.measured.quantities import QUANTITIES

# A fit has as many parameters as numbers: it is to hit them, and not to come within their
# errors, so these are made smaller for the search.
SHARPER = 1e-3
# The same blow with a step this much longer tells the numerical error: of first order in the
# step, the error is no more than what that changes.
COARSER = 2.0
# Rounds of a search at most: numbers by waves have small jumps, by which it stops early.
MOST_ROUNDS = 12
# Where searches start, as shares of the range of a parameter; and when the numbers are met, in
# their sharpened errors.
STARTS = (0.1, 0.4, 0.7)
REACHED = 10.0
# Steps of the slopes that carry the errors of fitted numbers over, in the logarithm: times are
# read from sample to sample, so that shorter ones would find none.
SLOPE_STEP = 0.02

# Law by which variants of a rig are fitted.
PLAIN = "bilinear"
# Parameters of every law, which are told with each fit.
BOTH_LAWS = ("rock.loading_stiffness", "rock.unloading_ratio")

# Share of its error within which a number counts as reached by the fit to it.
HIT = 0.1

# What is computed of two other numbers.
QUOTIENT, SPEEDS = "restitution", ("rebound_velocity", "indentation_velocity")

FITTED, PREDICTED = "fitted", "predicted"
MET, MISSED, UNDECIDED, NO_CRITERION = "met", "missed", "undecided", "no criterion"
MIXED = "met by some fits"
ROCK, MASSES = "rock", "masses"
# Shares of the stiffness, and of what gamma is above 1, by which the rock's say is tried.
OTHER_ROCKS = (0.5, 2.0)


@dataclass(frozen=True)
class Row:
    """One number: measured, computed, and whether its criterion is met. SI units."""

    experiment: str
    rock: str
    law: str
    fit: str
    role: str  # `fitted` or `predicted`
    id: str  # of the measurement
    quantity: str
    speed: float | None  # of the piston [m/s]
    measured: float
    error: float
    source: str  # measured or computed by others, and whether second hand
    computed: float  # NaN where the blow has no such thing
    numerical_error: float  # of the computed number, by the time step
    fit_error: float  # of the computed number, by the errors of the numbers that were fitted
    # share of the measured value, or the difference where the quantity is not relative
    deviation: float
    within: float | None  # criterion, as the deviation
    # `met`, `missed`, `undecided`, `no criterion`; `fitted` for what was fitted and reached
    verdict: str
    reason: str  # why there is no criterion
    # `rock` or `masses`, of a prediction with a criterion: the rock decides what half or twice
    # its stiffness, or of gamma - 1, moves by more than the criterion
    decided_by: str = ""


@dataclass(frozen=True)
class FoundFit:
    """Parameters that a fit found, and those that it kept."""

    experiment: str
    law: str
    name: str
    start: str  # fit whose parameters hold for all others; empty: those of the scene
    fitted: tuple[str, ...]
    values: dict[str, float]  # of the parameters that the fit moved, set or took over, SI units
    # standard errors of the fitted ones, by the errors of the measurements
    errors: dict[str, float]
    # the same of each predicted number, by the id of its measurement
    prediction_errors: dict[str, float]
    to: tuple[str, ...]
    scene: Scene = field(repr=False)  # with these parameters

    def to_dict(self) -> dict[str, Any]:
        """Plain values, without the scene."""
        tree = {key: value for key, value in vars(self).items() if key != "scene"}
        return {key: list(one) if isinstance(one, tuple) else one for key, one in tree.items()}


@dataclass(frozen=True)
class VariantRow:
    """What one number is with another rig or reading, fitted anew."""

    experiment: str
    variant: str
    fit: str
    id: str
    quantity: str
    role: str
    measured: float
    base: float
    computed: float


@dataclass(frozen=True, repr=False)
class Comparison:
    """All experiments compared."""

    experiments: list[Experiment]
    rows: list[Row]
    fits: list[FoundFit]
    variants: list[VariantRow]

    @property
    def laws(self) -> tuple[str, ...]:
        """Rock laws that were fitted."""
        return tuple(dict.fromkeys(f.law for f in self.fits))

    def counts(self, law: str | None = None, anew: bool = False) -> dict[str, int]:
        """How many measured numbers are predicted within their criteria, missed, or have none.

        Each counts once, whatever the number of fits: those by a law, or by all, that are whole;
        `anew`: those that move some parameters of another one. A restitution, the quotient of
        two speeds, does not count beside them.
        """
        found = self._predicted(law, anew)
        return _counted({key: {row.verdict for row in rows} for key, rows in found.items()})

    def counts_once(self) -> dict[str, dict[str, int]]:
        """The same over all laws, by what decides: rock or masses; without those of no criterion.

        A number that the rock decides by one fit is the rock's.
        """
        found = self._predicted()
        split: dict[str, dict[tuple[str, str], set[str]]] = {ROCK: {}, MASSES: {}}
        for key, rows in found.items():
            by = {row.decided_by for row in rows}
            if by != {""}:
                split[ROCK if ROCK in by else MASSES][key] = {row.verdict for row in rows}
        return {name: _counted(rows) for name, rows in split.items()}

    def _predicted(
        self, law: str | None = None, anew: bool = False
    ) -> dict[tuple[str, str], list[Row]]:
        """Predictions of each measured number, as `counts` takes them."""
        chosen = {
            (f.experiment, f.name)
            for f in self.fits
            if bool(f.start) == anew and law in (None, f.law)
        }
        rows = [row for row in self.rows if (row.experiment, row.fit) in chosen]
        known = {_place(row, row.quantity) for row in rows}
        found: dict[tuple[str, str], list[Row]] = {}
        for row in rows:
            speeds = {_place(row, one) for one in SPEEDS}
            if row.role == PREDICTED and not (row.quantity == QUOTIENT and speeds <= known):
                found.setdefault((row.experiment, row.id), []).append(row)
        return found

    def of(self, experiment: str, fit: str | None = None) -> list[Row]:
        """Rows of an experiment, or of one fit of it."""
        return [r for r in self.rows if r.experiment == experiment and fit in (None, r.fit)]

    def found(self, experiment: str, fit: str) -> FoundFit:
        """A fit by name."""
        (one,) = (f for f in self.fits if (f.experiment, f.name) == (experiment, fit))
        return one

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, SI units."""
        return {
            "predictions_once": self.counts_once(),
            "predictions": {law: self.counts(law) for law in self.laws},
            "predictions_anew": self.counts(anew=True),
            "rows": [asdict(row) for row in self.rows],
            "fits": [one.to_dict() for one in self.fits],
            "variants": [asdict(row) for row in self.variants],
            "sources": {
                one.name: {"title": one.title, "about": one.about, **one.source}
                for one in self.experiments
            },
        }


def _counted(found: Mapping[Any, set[str]]) -> dict[str, int]:
    """How many numbers have each verdict; what fits do not agree on is `MIXED`."""
    verdicts = [next(iter(one)) if len(one) == 1 else MIXED for one in found.values()]
    return {name: verdicts.count(name) for name in (MET, MISSED, MIXED, UNDECIDED, NO_CRITERION)}


def _place(row: Row, quantity: str) -> tuple[Any, ...]:
    """What a quantity beside that of a row is known by."""
    return row.experiment, row.fit, row.source, row.speed, quantity


def compare(
    experiments: Sequence[Experiment],
    variants: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> Comparison:
    """Fit, predict and compare.

    Parameters
    ----------
    experiments : sequence of Experiment
    variants : bool
        Whether variants of the rigs are computed as well.
    progress : callable, optional
        Is told how many fits are done, and of how many.
    """
    plans = [(one, plan) for one in experiments for plan in one.fits]
    others = [
        (one, k, plan)
        for one in experiments
        for k in range(len(one.variants) if variants else 0)
        for plan in one.fits
        if not plan.start and plan.law == PLAIN
    ]
    done, count = 0, len(plans) + len(others)
    fits: list[FoundFit] = []
    rows: list[Row] = []
    rigs = {one.name: Rig(Reading(one.gauge)) for one in experiments}
    for one, plan in plans:
        rig = rigs[one.name]
        found = fit(one, plan, rig, [f for f in fits if f.experiment == one.name])
        fits.append(found)
        rows += _rows(one, plan, found, rig)
        done = _told(progress, done, count)
    varied: list[VariantRow] = []
    for one, k, plan in others:
        base = {row.id: row.computed for row in rows if _is_of(row, one, plan)}
        varied += _variant_rows(one, k, plan, base)
        done = _told(progress, done, count)
    return Comparison(list(experiments), rows, fits, varied)


def _told(progress: Callable[[int, int], None] | None, done: int, count: int) -> int:
    if progress is not None:
        progress(done + 1, count)
    return done + 1


def _is_of(row: Row, one: Experiment, plan: FitPlan) -> bool:
    return row.experiment == one.name and row.fit == plan.name


def fit(
    experiment: Experiment, plan: FitPlan, rig: Rig, before: Sequence[FoundFit] = ()
) -> FoundFit:
    """Fit parameters of the rock to as many measurements.

    Parameters
    ----------
    experiment : Experiment
    plan : FitPlan
    rig : Rig
        That computes the blows.
    before : sequence of FoundFit
        Among which is that which this one starts from.
    """
    scene = experiment.scene.replace(**{"effects.rock": plan.law})
    told = {*BOTH_LAWS, *plan.parameters, *plan.fixed}
    for one in before:
        if one.name == plan.start:
            scene = scene.replace(**one.values)
            told |= set(one.values)
    scene = scene.replace(**plan.fixed)
    targets = [experiment.measured[name] for name in plan.to]
    ends = zip(*(LAWS[plan.law][key] for key in plan.parameters), strict=True)
    box = np.stack([coordinates(plan.parameters, one) for one in ends], axis=1)
    series = [_series(one, rig) for one in targets]
    like = Likelihood(scene, series, plan.parameters, box, lambda: None)
    place = _best_place(like, plan, scene, box)
    best = like.scene_at(place.at)
    values = {key: best[key] for key in (*LAWS[plan.law], *FIXED[plan.law]) if key in told}
    errors, carried = _errors(experiment, plan, best, rig)
    return FoundFit(
        experiment.name, plan.law, plan.name, plan.start, plan.parameters, values, errors, carried,
        plan.to, best,
    )  # fmt: skip


def _best_place(like: Likelihood, plan: FitPlan, scene: Scene, box: np.ndarray) -> Place:
    """Where the numbers are met, or else the best of several searches.

    They start from the scene; then from other values of what only bends the lines of the law,
    since a search that starts far from the right bend ends beside it.
    """
    best: Place | None = None
    for start in _starts(like, plan, scene, box):
        found, _ = descend(like, start, range(len(plan.parameters)), rounds=MOST_ROUNDS)
        if best is None or found.deviance < best.deviance:
            best = found
        pairs = zip(best.residuals, like.series, strict=True)
        if all(abs(off[0]) <= REACHED * (one.error or 0.0) for off, one in pairs):
            break
    assert best is not None
    return best


def _starts(like: Likelihood, plan: FitPlan, scene: Scene, box: np.ndarray) -> Iterator[np.ndarray]:
    """Where searches start, one after the other."""
    names = plan.parameters
    inside = [np.clip(float(scene[key]), *LAWS[plan.law][key]) for key in names]
    begin = coordinates(names, inside)
    yield begin
    bends = [k for k, key in enumerate(names) if key not in BOTH_LAWS]
    lines = [k for k in range(len(names)) if k not in bends]
    for shares in itertools.product(STARTS, repeat=len(bends)) if bends else ():
        other = begin.copy()
        other[bends] = box[bends, 0] + np.array(shares) * (box[bends, 1] - box[bends, 0])
        yield descend(like, other, lines)[0].at if lines else other


def _series(one: Measurement, rig: Rig) -> Series:
    def model(scene: Scene) -> np.ndarray:
        return np.array([rig.read(scene, one.quantity, one.speed)])

    return Series(one.id, np.array([one.value]), SHARPER * one.error, model)


def _rows(experiment: Experiment, plan: FitPlan, found: FoundFit, rig: Rig) -> Iterator[Row]:
    coarse = Rig(rig.reading, COARSER * rig.step)
    names = (*plan.to, *plan.predicts)
    for name in names:
        one = experiment.measured[name]
        computed = rig.read(found.scene, one.quantity, one.speed)
        other = coarse.read(found.scene, one.quantity, one.speed)
        off = deviation(one, computed)
        numerical = abs(computed - other)
        role = FITTED if name in plan.to else PREDICTED
        yield Row(
            experiment=experiment.name, rock=experiment.rock, law=plan.law, fit=plan.name,
            role=role, id=name, quantity=one.quantity, speed=one.speed, measured=one.value,
            error=one.error, source=one.source_text, computed=computed,
            numerical_error=numerical,
            fit_error=found.prediction_errors.get(name, math.nan), deviation=off,
            within=one.within, verdict=verdict(one, off, numerical, role), reason=one.no_criterion,
            decided_by=_decided_by(one, found.scene, rig, off) if role == PREDICTED else "",
        )  # fmt: skip


def _decided_by(one: Measurement, scene: Scene, rig: Rig, off: float) -> str:
    """Whether the rock can move a number by more than its criterion, or else the masses decide."""
    if one.within is None or not math.isfinite(off):
        return "" if one.within is None else ROCK
    stiffness, ratio = BOTH_LAWS
    low, high = LAWS["bilinear"][ratio]
    for share in OTHER_ROCKS:
        other = 1.0 + share * (float(scene[ratio]) - 1.0)
        for key, value in (
            (stiffness, share * float(scene[stiffness])),
            (ratio, min(max(other, low), high)),
        ):
            moved = rig.read(scene.replace(**{key: value}), one.quantity, one.speed)
            if not abs(deviation(one, moved) - off) <= one.within:
                return ROCK
    return MASSES


def _errors(
    experiment: Experiment, plan: FitPlan, scene: Scene, rig: Rig
) -> tuple[dict[str, float], dict[str, float]]:
    """Standard errors of parameters and of predictions by those of what was fitted.

    NaN where what was fitted does not tell the parameters.
    """
    names = (*plan.to, *plan.predicts)
    here = _read_all(experiment, names, scene, rig)
    slopes = {}
    for key in plan.parameters:
        step, moved = _moved(plan.law, key, scene)
        there = _read_all(experiment, names, moved, rig)
        slopes[key] = {name: (there[name] - here[name]) / step for name in names}
    of_fitted = np.array([[slopes[key][name] for key in plan.parameters] for name in plan.to])
    sizes = np.array([experiment.measured[name].error for name in plan.to])
    try:
        inverse = np.linalg.inv(of_fitted) * sizes
    except np.linalg.LinAlgError:
        inverse = np.full_like(of_fitted, math.nan)
    shares = np.linalg.norm(inverse, axis=1)
    parameters = {
        key: (1.0 if key in EXPONENTS else float(scene[key])) * float(share)
        for key, share in zip(plan.parameters, shares, strict=True)
    }
    predicted = {}
    for name in plan.predicts:
        own = np.array([slopes[key][name] for key in plan.parameters])
        predicted[name] = float(np.linalg.norm(own @ inverse))
    return parameters, predicted


def _moved(law: str, key: str, scene: Scene) -> tuple[float, Scene]:
    """A step of one parameter, in the coordinate of the search, and the scene after it.

    Of an exponent a share, or of 1 where it is less, as it may be 0; downward at its greatest.
    """
    value = float(scene[key])
    step = SLOPE_STEP * max(value, 1.0) if key in EXPONENTS else SLOPE_STEP
    (at,) = coordinates([key], [value])
    if values_at(key, at + step) > LAWS[law][key][1]:
        step = -step
    return step, scene.replace(**{key: float(values_at(key, at + step))})


def _read_all(
    experiment: Experiment, names: Sequence[str], scene: Scene, rig: Rig
) -> dict[str, float]:
    rows = ((name, experiment.measured[name]) for name in names)
    return {name: rig.read(scene, one.quantity, one.speed) for name, one in rows}


def deviation(one: Measurement, computed: float) -> float:
    """Share of the measured value by which a number is off, or the difference."""
    off = computed - one.value
    return off / one.value if QUANTITIES[one.quantity].relative else off


def verdict(one: Measurement, off: float, numerical: float, role: str = PREDICTED) -> str:
    """What the criterion of a measurement says; undecided where the numerical error decides.

    What was fitted is no success: it is `fitted`, or missed where the fit did not reach it.
    """
    if one.within is None:
        return NO_CRITERION
    if not math.isfinite(off):
        return MISSED
    if role == FITTED:
        error = one.error / one.value if QUANTITIES[one.quantity].relative else one.error
        return FITTED if abs(off) <= HIT * error else MISSED
    reach = numerical / one.value if QUANTITIES[one.quantity].relative else numerical
    if abs(abs(off) - one.within) <= reach:
        return UNDECIDED
    return MET if abs(off) <= one.within else MISSED


def _variant_rows(
    experiment: Experiment, k: int, plan: FitPlan, base: Mapping[str, float]
) -> Iterator[VariantRow]:
    variant = experiment.variants[k]
    changed = experiment.scene.replace(**variant.changes)
    gauge = experiment.gauge if variant.gauge is None else variant.gauge
    rig = Rig(Reading(gauge, variant.end, variant.slope_to))
    other = Experiment(**{**vars(experiment), "scene": changed, "gauge": gauge})
    found = fit(other, plan, rig)
    for name in (*plan.to, *plan.predicts):
        one = experiment.measured[name]
        yield VariantRow(
            experiment.name, variant.name, plan.name, name, one.quantity,
            FITTED if name in plan.to else PREDICTED, one.value, base[name],
            rig.read(found.scene, one.quantity, one.speed),
        )  # fmt: skip
