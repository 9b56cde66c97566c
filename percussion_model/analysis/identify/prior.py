"""What is known of rock and bit before the first sample."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from percussion_model.analysis.identify.observation import UNKNOWNS
from percussion_model.scene.rocks import STIFFNESS, Number, read_rock, rock, rocks
from percussion_model.scene.rocks.breaking import (
    EFFICIENCY,
    ENERGY,
    energy_by_strength,
    numbers_under,
)
from percussion_model.scene.scene import Scene

# Standard deviations from low to high of an interval that holds nine tenths.
WITHIN = 3.29
# Strengths of rock that is drilled by blows [Pa].
WEAKEST, STRONGEST = 30e6, 400e6
GAMMA = "rock.unloading_ratio"
KEYS = (ENERGY, GAMMA, STIFFNESS, "rotation.renewal_length", "breaking.threshold",
        "rotation.friction")  # fmt: skip


@dataclass(frozen=True)
class Prior:
    """Logarithms of the unknowns and their standard deviations, by `UNKNOWNS`."""

    mean: np.ndarray
    spread: np.ndarray
    rock: str | None


def prior_of(scene: Scene, name: str | None = None) -> Prior:
    """Return the prior of a rock under the bit of a scene.

    Parameters
    ----------
    name : str, optional
        A rock of the library, whose numbers and intervals are taken; any rock if left out: the
        crushing energy by its strength, ratio and stiffness as in all rocks of the library that
        have the scene's law.
    """
    known = _any_rock(scene) if name is None else _numbers(scene, name)
    mean, spread = (np.zeros(len(UNKNOWNS)) for _ in range(2))
    for k, key in enumerate(KEYS):
        low, high = known[key].low, known[key].high
        mean[k], spread[k] = 0.5 * math.log(low * high), math.log(high / low) / WITHIN
    ends = math.log(EFFICIENCY.low * EFFICIENCY.high), math.log(EFFICIENCY.high / EFFICIENCY.low)
    mean[0] -= 0.5 * ends[0]
    spread[0] = math.hypot(spread[0], ends[1] / WITHIN)
    return Prior(mean, spread, name)


def _numbers(scene: Scene, name: str) -> dict[str, Number]:
    return {one.key: one for one in numbers_under(read_rock(name), scene)}


def _any_rock(scene: Scene) -> dict[str, Number]:
    """Intervals that hold those of all rocks of the scene's law."""
    same = [one for one in map(rock, rocks()) if one.law == scene["effects.rock"] and one.buttons]
    each = [_numbers(scene, one.name) for one in same]
    found = dict(each[0])
    for key in KEYS:
        ends = [one[key].low for one in each], [one[key].high for one in each]
        low, high = min(ends[0]), max(ends[1])
        if key == ENERGY:
            low, high = min(low, energy_by_strength(WEAKEST)), energy_by_strength(STRONGEST)
        found[key] = Number(key, math.sqrt(low * high), low, high, "assumed", "any rock")
    return found
