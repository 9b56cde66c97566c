"""Whether a fit explains its data, and tells the rock from what is not known of sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from percussion_model.analysis.fitting.found import (
    MISFIT,
    NAMES,
    UNTOLD,
    Estimate,
    Explained,
    SensorEstimate,
)
from percussion_model.analysis.fitting.likelihood import Likelihood, Place
from percussion_model.analysis.fitting.measurements import Reading, is_rounding
from percussion_model.analysis.fitting.search import steps_of
from percussion_model.analysis.fitting.sensor import DELAY, REACH
from percussion_model.simulation.uncertain import in_digits

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
                f"{NAMES[name]} ({name}) is not determined: the data do not tell it from "
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
