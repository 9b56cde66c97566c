"""What one should know before using the numbers of a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from percussion_model.analysis.fitting.found import (
    LAWS,
    NAMES,
    OPEN,
    OPEN_ABOVE,
    OPEN_BELOW,
    ROUGH,
    WIDE,
    Estimate,
    Explained,
    Rival,
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
from percussion_model.analysis.fitting.sampling import Profile
from percussion_model.analysis.fitting.search import steps_of
from percussion_model.analysis.fitting.trust import neighbours
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
            OPEN_ABOVE: f"is not determined: the data tell only that it is above {low}",
            OPEN_BELOW: f"is not determined: the data tell only that it is below {high}",
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
        notes.append(f"{_values_of(like, silent)} kept: a slow test does not tell them")
    if untold:
        notes.append(
            f"{_values_of(like, untold)} kept: peaks of about one force do not tell it, and gamma "
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
