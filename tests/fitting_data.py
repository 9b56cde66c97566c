"""Measurements that are made up from known parameters, with noise."""

from __future__ import annotations

import numpy as np

from percussion_model import Scene
from percussion_model.analysis.fitting import Curve, DropTest, bilinear_force, drop_test_signal
from percussion_model.analysis.fitting.found import DAMPING, ENERGY
from percussion_model.analysis.fitting.likelihood import RATIO, STIFFNESS

KEYS = (STIFFNESS, RATIO, DAMPING, ENERGY)
TRUTH = dict(zip(KEYS, (6e8, 6.0, 1.5e4, 0.1), strict=True))
# Truths of the trials lie between these, evenly in the logarithm.
DRAWN = {STIFFNESS: (2e8, 1.5e9), RATIO: (3.0, 12.0), DAMPING: (3e3, 1e5), ENERGY: (0.02, 0.5)}
DEPTH, FORCE_NOISE, POSITION_NOISE, DATUM = 8e-4, 4e3, 1e-5, 5e-5
SPEEDS = (5.25, 3.0)
END = 45e-3


def drawn_truth(seed):
    draw = np.random.default_rng(seed).uniform
    return {key: float(np.exp(draw(*np.log(ends)))) for key, ends in DRAWN.items()}


def noisy_curve(seed, truth=TRUTH, noise=FORCE_NOISE):
    """A slow test whose gauge begins above the rock; the peak lies between two readings."""
    up = np.linspace(0.0, DATUM + 0.998 * DEPTH, 60)
    down = DATUM + DEPTH * np.linspace(0.999, 1.0 - 1.0 / truth[RATIO], 40)
    p = np.concatenate([up, down])
    force = bilinear_force(p, truth[STIFFNESS], truth[RATIO], DATUM, DATUM + DEPTH)
    return Curve(p, force + np.random.default_rng(seed).normal(0.0, noise, len(p)))


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
