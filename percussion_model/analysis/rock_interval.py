"""How far a rate of penetration may lie by the intervals of rock and bit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from percussion_model.scene.bits import RADIUS, bit, bit_of
from percussion_model.scene.rocks import Number, read_rock
from percussion_model.scene.rocks.breaking import EFFICIENCY, numbers_under, rock_of
from percussion_model.scene.scene import Scene
from percussion_model.simulation.driller_numbers import DRILLER_NUMBERS, driller_text
from percussion_model.simulation.simulate import simulate
from percussion_model.simulation.uncertain import in_digits

RATE = "rate_of_penetration"
SAMPLES = 48
# Shares of the samples below and above which the interval ends.
ENDS = 0.05, 0.95
# What no interval holds (docs/field.md).
NOT_CALIBRATED = (
    "Real drills differ more: without a calibration on site the rate may be off by a factor of 2 "
    "or more."
)
# Runs of rigid bodies that tell how a rate changes [s].
DURATION, SETTLE = 2.0, 0.5


class RateInterval(NamedTuple):
    """What the intervals of rock and bit leave of a rate."""

    rock: str  # its name
    low: float  # nine tenths of the samples' rates lie above this, and
    high: float  # below this, by the rate itself
    samples: int  # that have a rate


def interval_text(found: RateInterval, summary: Mapping[str, Any]) -> str:
    """An interval beside rate and numerical error of a run; empty where no rate is known."""
    rate = summary[RATE]
    if not rate or summary["rate_of_penetration_undecided"]:
        return ""
    one = DRILLER_NUMBERS[RATE]
    low, high = (in_digits(one.factor * rate * end, 2) for end in (found.low, found.high))
    return (
        f"Rate: {driller_text(summary, RATE)} {one.unit} numerical; {low} to {high} {one.unit} "
        f"by the intervals of {found.rock} and bit, which hold nine tenths of {found.samples} "
        f"samples. {NOT_CALIBRATED}"
    )


def uncertain_numbers(scene: Scene) -> tuple[str, list[Number]]:
    """Name of the rock that a scene has, and what is known of it and the bit by intervals."""
    name = rock_of(scene)
    if not name:
        return "", []
    numbers = [*numbers_under(read_rock(name), scene), _about(EFFICIENCY, scene)]
    if (own := bit_of(scene)) and scene["effects.rotation"]:
        numbers.append(replace(bit(own).mean_radius, key=RADIUS))
    return name, [one for one in numbers if one.low < one.high and scene.matters(one.key)]


def _about(number: Number, scene: Scene) -> Number:
    """A number of the bit about the value that a scene has, with an interval as wide."""
    share = scene[number.key] / number.value
    return replace(
        number,
        value=share * number.value,
        low=share * number.low,
        high=min(share * number.high, 1.0),
    )


def rate_interval(
    scene: Scene,
    samples: int = SAMPLES,
    progress: Callable[[float], None] | None = None,
) -> RateInterval | None:
    """Sample the intervals of a scene's rock and bit; None where its rock has no name.

    How the rate changes is told by rigid bodies, where the scene has no drill string.

    Parameters
    ----------
    scene : Scene
        With effects.breaking; without it the rate does not follow from what breaks.
    samples : int
    progress : callable, optional
        Called with the share that is done.
    """
    name, numbers = uncertain_numbers(scene)
    if not numbers or not scene["effects.breaking"]:
        return None
    plain = scene if scene.effects.string else scene.computed_by("rigid")
    own = _rate(plain)
    rates = []
    for k, shares in enumerate(sample_shares(samples, len(numbers))):
        pairs = zip(numbers, shares, strict=True)
        rates.append(_rate(plain.replace(**{one.key: _within(one, share) for one, share in pairs})))
        if progress is not None:
            progress((k + 1) / samples)
    known = np.array([one for one in rates if math.isfinite(one)])
    if len(known) == 0 or not own > 0.0:
        return None
    low, high = np.quantile(known / own, ENDS).tolist()
    return RateInterval(name, low, high, len(known))


def sample_shares(samples: int, numbers: int) -> list[list[float]]:
    """Samples in a box of side 1 that are spread evenly along each side, always the same."""
    random = np.random.default_rng(0)
    places = random.permuted(np.tile(np.arange(samples), (numbers, 1)), axis=1).T
    found: list[list[float]] = ((places + random.random(places.shape)) / samples).tolist()
    return found


def _within(one: Number, share: float) -> float:
    """Value of a number: half of all below its own, evenly by the logarithm on both sides."""
    low, high, part = one.low, one.value, 2.0 * share
    if share >= 0.5:
        low, high, part = one.value, one.high, 2.0 * share - 1.0
    if low <= 0.0:  # of which there is no logarithm
        return float(low + part * (high - low))
    return float(low * (high / low) ** part)


def _rate(scene: Scene) -> float:
    found = simulate(scene, DURATION, SETTLE, error_estimate=False, record_events=False)
    return found.rate_of_penetration
