"""What one should know before using the numbers of a fit, and whether it explains its data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from percussion_model.analysis.fitting.found import (
    LAWS,
    MISFIT,
    NAMES,
    OPEN,
    OPEN_ABOVE,
    OPEN_BELOW,
    ROUGH,
    UNTOLD,
    WIDE,
    Estimate,
    Explained,
    Rival,
    SensorEstimate,
)
from percussion_model.analysis.fitting.likelihood import (
    EXPONENTS,
    SLOW,
    Likelihood,
    Place,
    decades,
    values_at,
    with_unit,
)
from percussion_model.analysis.fitting.measurements import Reading, is_rounding
from percussion_model.analysis.fitting.sampling import Profile
from percussion_model.analysis.fitting.search import steps_of
from percussion_model.analysis.fitting.sensor import DELAY, REACH
from percussion_model.simulation.uncertain import in_digits
from percussion_model.solvers.base import make_solver

UNSETTLED = (
    "the search met ever better places and no end of it: the best may not be among them, "
    "and intervals may be too narrow"
)
# An interval whose ends differ by this factor is said to be wide; exponents that differ by its
# logarithm leave it at ten times the force.
ROUGHLY = 2.0
# Residuals that follow from each other by so many standard errors are no independent noise.
MOST_CORRELATION = 4.0
# With twice the cells the best values may move by this share of their intervals' halves.
GRID_SHARE = 0.5
# Neighbouring residuals so alike are twice what independent noise would leave between them; and
# where residuals are this share of how far the data vary, the model says little of them.
ALIKE, LITTLE = 0.75, 0.5
# A single number is not explained that is off by so many of its errors.
OFF = 4.0
# An unknown of a sensor whose error is this share of its prior is known by that alone, and one
# that is so much correlated with a parameter then cannot be told from it.
BY_PRIOR, CORRELATED = 0.7, 0.9
# So many widths from 0 a found value deserves a word; so near to the end of the search, in
# widths, the true one may lie beyond.
FAR, AT_END = 2.0, 0.05


def interval_notes(estimates: Mapping[str, Estimate], like: Likelihood) -> list[str]:
    """Say which parameters the data do not tell, or only roughly."""
    notes = []
    for name, one in estimates.items():
        low, high = (with_unit(like.scene, name, end) for end in one.texts()[1:])
        apart = decades(name, one.low, one.high)
        if name in EXPONENTS:
            width, roughly = f"a range of {in_digits(apart, 2)}", f"within {in_digits(apart, 2)}"
        else:
            width = roughly = f"a factor of {in_digits(one.high / one.low, 2)}"
        told = {
            OPEN_ABOVE: f"is not determined: the data show only that it is above {low}",
            OPEN_BELOW: f"is not determined: the data show only that it is below {high}",
            OPEN: "is not determined: its interval reaches over the whole range that was searched, "
            f"{low} to {high}",
            WIDE: f"is not determined: {width}, {low} to {high}, explains the data",
        }.get(one.verdict)
        if told is None and one.determined and apart > math.log10(ROUGHLY):
            told = f"is determined only to {roughly}: {low} to {high}"
        if told is not None:
            notes.append(f"{NAMES[name]} ({name}) {told}")
    return notes


def kept_notes(like: Likelihood, slow: bool, untold: Sequence[str] = ()) -> list[str]:
    """Say what is kept as the scene has it: not told by the data, or taken to be right.

    Parameters
    ----------
    like : Likelihood
    slow : bool
        Whether all data are slow tests.
    untold : sequence of str
        Parameters that were to be fitted, but that these do not tell.
    """
    kept = [key for key in LAWS[like.scene.effects.rock] if key not in like.names]
    silent = [key for key in kept if slow and key not in SLOW]
    given = [key for key in kept if key not in (*silent, *untold) and like.scene[key] is not None]
    notes = []
    if silent:
        notes.append(f"{_values_of(like, silent)} kept: a slow test does not determine them")
    if untold:
        notes.append(
            f"{_values_of(like, untold)} kept: peaks of about one force do not determine it, "
            "and gamma "
            "holds at this force only"
        )
    if given:
        notes.append(f"{_values_of(like, given)} kept: the intervals hold only if that is right")
    if like.scene.effects.rock == "power":
        place = like.scene.rock.reference_penetration
        notes.append(f"P_0 = {place:.4g} m kept: K_R and gamma are those of this penetration")
    return notes


def _values_of(like: Likelihood, keys: Sequence[str]) -> str:
    """What the scene has of some parameters."""
    return ", ".join(
        with_unit(like.scene, key, f"{NAMES[key]} = {like.scene[key]:.4g}") for key in keys
    )


def rough_notes(rough: float) -> list[str]:
    """Say that the motion amplifies changes so much that intervals were widened for it."""
    if rough < ROUGH:
        return []
    return [
        f"the likelihood is rough: many small dips, of about {in_digits(rough, 2)} in twice its "
        "logarithm; intervals are widened for that by a rule of thumb, and their confidence is "
        "not known"
    ]


def gap_notes(like: Likelihood, profiles: Sequence[Profile]) -> list[str]:
    """Say which parameters lie in one of two ranges."""
    notes = []
    for name, one in zip(like.names, profiles, strict=True):
        if one.gap is not None:
            ends = (in_digits(values_at(name, end)) for end in one.gap)
            low, high = (with_unit(like.scene, name, end) for end in ends)
            notes.append(
                f"{NAMES[name]} ({name}) lies below {low} or above {high}: "
                "what lies between explains the data less well"
            )
    return notes


def rival_notes(rivals: Sequence[Rival]) -> list[str]:
    """Say which other rocks explain the data nearly as well."""
    notes = []
    for one in rivals:
        values = (f"{NAMES[key]} = {in_digits(value)}" for key, value in one.values.items())
        less = 1.0 / one.odds
        odds = "as likely" if less < 1.5 else f"{in_digits(less, 2)} times less likely"
        notes.append(f"another minimum, {odds}: {', '.join(values)}")
    return notes


def correlation_note(one: Explained) -> list[str]:
    """Say that neighbouring residuals are alike, where they are."""
    correlation = neighbours(one)
    if correlation * math.sqrt(len(one.residuals)) <= MOST_CORRELATION:
        return []
    return [
        f"{one.name}: neighbouring residuals are alike (correlation {correlation:.2f}): the model "
        "misses something, or the noise is no white noise; the intervals are too narrow"
    ]


def grid_notes(
    like: Likelihood, best: Place, spread: np.ndarray, profiles: Sequence[Profile]
) -> list[str]:
    """Say which best values would move with twice the cells by a good part of their intervals."""
    scene = like.scene
    simulated = [one for one in like.series if one.simulated]
    cells = list(make_solver(scene).cells.values()) if simulated else []
    if not cells:
        return []
    key = "fem.elements" if scene.solver_name == "fem" else "solver.cells"
    finer = Likelihood(
        scene.replace(**{key: 2 * cells[0], "solver.accuracy": None}),
        like.series,
        like.names,
        like.box,
        lambda: None,
    )
    weights = like.weights(best.noise)
    off = np.concatenate(best.residuals)
    change = (np.concatenate(finer.at(best.at).residuals) - off) * weights
    steps = steps_of(spread)
    columns = [
        (np.concatenate(like.at(best.at + row).residuals) - off) * weights / step
        for row, step in zip(np.diag(steps), steps, strict=True)
    ]
    moves = np.abs(spread @ np.stack(columns) @ change)
    halves = np.array([0.5 * (one.high - one.low) for one in profiles])
    moved = [
        f"{NAMES[name]} by {move / half:.1g}"
        for name, move, half in zip(like.names, moves, halves, strict=True)
        if move > GRID_SHARE * half
    ]
    if not moved:
        return []
    return [
        f"twice the cells would move {', '.join(moved)} of half its interval: calibrate with "
        f"--cells {2 * cells[0]} and use the rock with as many"
    ]


def neighbours(one: Explained) -> float:
    """Correlation of neighbouring residuals; 0 of a single number or of rounding alone."""
    residuals = one.residuals
    if len(residuals) < 2 or is_rounding(one.noise, one.data):
        return 0.0
    return float(residuals[1:] @ residuals[:-1]) / float(residuals @ residuals)


def is_explained(one: Explained) -> bool:
    """Whether residuals of a series are what its noise may leave."""
    if isinstance(one.source, Reading):
        return bool(np.abs(one.residuals).max() <= OFF * one.noise)
    if is_rounding(one.noise, one.data):
        return True
    share = one.noise / (float(np.std(one.data)) or 1.0)
    return neighbours(one) <= ALIKE and share <= LITTLE


def sensors_of(
    like: Likelihood, best: Place, spread: np.ndarray
) -> tuple[list[tuple[SensorEstimate, ...]], dict[str, str]]:
    """What is found of the sensors of all series, and parameters that cannot be told from it.

    Parameters
    ----------
    like : Likelihood
    best : Place
    spread : ndarray
        Covariance of the parameters there.
    """
    steps = steps_of(spread)
    steps = np.where(best.at + steps > like.high, -steps, steps)
    beside = [like.at(best.at + row) for row in np.diag(steps)]
    found: list[tuple[SensorEstimate, ...]] = []
    mixed: dict[str, str] = {}
    for k, one in enumerate(like.series):
        if one.sensor is None or not one.unknowns:
            found.append(())
            continue
        count = len(one.data)
        pulls, own = one.sensor.sensed(like.scene_at(best.at))[1:]
        slopes = np.stack([pulls + place.residuals[k][count:] for place in beside], axis=1)
        slopes = -slopes / steps
        errors = np.sqrt(np.diag(own + slopes @ spread @ slopes.T))
        shares = spread @ slopes.T / np.outer(np.sqrt(np.diag(spread)), errors)
        found.append(
            tuple(
                SensorEstimate(name, unit, pull * width, min(error, 1.0) * width, width)
                for (name, unit, width), pull, error in zip(
                    one.sensor.unknowns, pulls.tolist(), errors.tolist(), strict=True
                )
            )
        )
        for name, row in zip(like.names, shares, strict=True):
            for unknown, share, error in zip(one.sensor.unknowns, row, errors, strict=True):
                if abs(share) > CORRELATED and error > BY_PRIOR:
                    mixed[name] = f"the {unknown.name} of {one.name}"
    return found, mixed


def distrusted(
    estimates: Mapping[str, Estimate],
    explained: Sequence[Explained],
    mixed: Mapping[str, str],
    known: Sequence[str] = (),
) -> tuple[dict[str, Estimate], list[str]]:
    """Estimates without the word "determined" where it is not earned, and why it is not.

    `known` are reasons that are known already.
    """
    off = [one for one in explained if not is_explained(one)]
    ends = [
        f"the {it.name} of {one.name} is at the end of what was searched, {REACH:g} widths"
        for one in explained
        for it in one.sensor
        if it.name == DELAY and abs(it.value) > (REACH - AT_END) * it.width
    ]
    why = [*known, *(ends if known else [_misfit(one) for one in off] + ends)]
    kept, notes = {}, []
    for name, one in estimates.items():
        kept[name] = one
        if why:
            kept[name] = one._replace(verdict=MISFIT)
            notes.append(f"{NAMES[name]} ({name}) is not determined: {'; '.join(why)}")
        elif one.determined and name in mixed:
            kept[name] = one._replace(verdict=UNTOLD)
            notes.append(
                f"{NAMES[name]} ({name}) is not determined: the data do not distinguish it from "
                f"{mixed[name]}, of which only the prior is known"
            )
    return kept, notes


def _misfit(one: Explained) -> str:
    if isinstance(one.source, Reading):
        share = float(np.abs(one.residuals).max()) / one.noise
        return f"{one.name} is off by {in_digits(share, 2)} of its errors"
    return (
        f"the model does not explain {one.name}: residuals of {in_digits(one.noise, 2)} {one.unit} "
        "are no noise"
    )


def sensor_notes(explained: Sequence[Explained]) -> list[str]:
    """Say what of the sensors is far from its prior, or known by that alone."""
    notes = []
    for one in explained:
        for it in one.sensor:
            if abs(it.value) > FAR * it.width:
                notes.append(
                    f"{one.name}: its {it.name} of {in_digits(it.value, 3)} {it.unit} is "
                    f"{in_digits(abs(it.value) / it.width, 2)} widths of its prior: check it"
                )
        by_prior = [it.name for it in one.sensor if it.error > BY_PRIOR * it.width]
        if by_prior:
            notes.append(f"{one.name}: {' and '.join(by_prior)} known by the prior alone")
    return notes
