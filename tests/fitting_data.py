"""Measurements that are made up from known parameters, with noise."""

from __future__ import annotations

import numpy as np

from percussion_model import Scene
from percussion_model.analysis.fitting import (
    Curve,
    DropTest,
    drop_test_signal,
    slow_force,
)
from percussion_model.analysis.fitting.found import LAWS
from percussion_model.analysis.fitting.likelihood import (
    DAMPING,
    ENERGY,
    EXPONENT,
    RATIO,
    STIFFNESS,
    UNLOADING,
    coordinates,
    values_at,
)

KEYS = LAWS["bilinear"]
TRUTH = dict(zip(KEYS, (6e8, 6.0, 1.5e4, 0.1), strict=True))
POWER = {"effects.rock": "power"}
POWER_TRUTH = TRUTH | {EXPONENT: 1.6, UNLOADING: 0.3}
# Truths of the trials lie between these, evenly in the logarithm; exponents evenly.
DRAWN = {STIFFNESS: (2e8, 1.5e9), RATIO: (3.0, 12.0), DAMPING: (3e3, 1e5), ENERGY: (0.02, 0.5)}
POWER_DRAWN = DRAWN | {EXPONENT: (1.2, 2.5), UNLOADING: (0.1, 0.6)}
DEPTH, FORCE_NOISE, POSITION_NOISE, DATUM = 8e-4, 4e3, 1e-5, 5e-5
# Slow tests of the power law go to the first and to a second peak.
SHALLOW = 4e-4
SPEEDS = (5.25, 3.0)
END = 45e-3


def drawn_truth(seed, drawn=DRAWN):
    draw = np.random.default_rng(seed).uniform
    ends = {key: coordinates([key, key], ends) for key, ends in drawn.items()}
    return {key: float(values_at(key, draw(*pair))) for key, pair in ends.items()}


def rock_of(truth):
    """Scene with a rock that is given by its parameters."""
    return Scene().replace(**({} if EXPONENT not in truth else POWER), **truth)


def given_back(truth, depth):
    """Share of a peak's depth that the rock gives back, in closed form."""
    n, q = truth.get(EXPONENT, 1.0), truth.get(UNLOADING, 0.0)
    return min((depth / 1e-3) ** (-n * q) / truth[RATIO], 1.0 / n)


def noisy_curve(seed, truth=TRUTH, noise=FORCE_NOISE, depth=DEPTH):
    """A slow test whose gauge begins above the rock; the peak lies between two readings."""
    up = np.linspace(0.0, DATUM + 0.998 * depth, 60)
    down = DATUM + depth * np.linspace(0.999, 1.0 - given_back(truth, depth), 40)
    p = np.concatenate([up, down])
    force = slow_force(p, rock_of(truth), DATUM, DATUM + depth)
    name = f"to {1e3 * depth:g} mm"
    return Curve(p, force + np.random.default_rng(seed).normal(0.0, noise, len(p)), name)


def bit(solver="rigid", **changes):
    """Scene of a bit alone with the rock of the reference; a rigid one is quick to drop."""
    scene = Scene().replace(**{"piston.model": "absent", "effects.drive": "none"})
    scene = scene.computed_by(solver, **{"piston.model": "absent"})
    return scene.replace(**changes)


def drops(scene, seed, truth=TRUTH, samples=450, speeds=SPEEDS, end=END, noise=POSITION_NOISE):
    rng, times = np.random.default_rng(1000 + seed), np.linspace(0.0, end, samples)
    there = scene.replace(**truth)
    return [
        DropTest(times, y + rng.normal(0.0, noise, samples), v, name=f"drop at {v:g} m/s")
        for v in speeds
        for y in [drop_test_signal(there, times, v)]
    ]
