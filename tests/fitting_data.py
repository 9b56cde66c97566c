"""Measurements that are made up from known parameters, with noise."""

from __future__ import annotations

import numpy as np

from percussion_model import Scene
from percussion_model.analysis.fitting import DropTest, bilinear_force, drop_test_signal

STIFFNESS, RATIO, DATUM = 7.5e8, 5.0, 5e-5
CURVE = {"rock.loading_stiffness": STIFFNESS, "rock.unloading_ratio": RATIO, "datum": DATUM}
BARRIER = {"rock.barrier_damping": 1e4, "rock.barrier_energy": 0.5}


def way():
    """Gauge readings of a slow test; the peak lies between two of them."""
    return np.concatenate([np.linspace(0.0, 8.47e-4, 60), np.linspace(8.49e-4, 6.7e-4, 40)])


def noisy_curve(seed, noise=6e3):
    p = way()
    force = bilinear_force(p, STIFFNESS, RATIO, DATUM, peak=8.5e-4)
    return p, force + np.random.default_rng(seed).normal(0.0, noise, len(p))


def bit(solver="rigid", **changes):
    """Scene of a bit alone; a rigid one is quick to drop."""
    scene = Scene().replace(**{"piston.model": "absent", "effects.drive": "none"})
    scene = scene.computed_by(solver, **{"piston.model": "absent"}, **BARRIER)
    return scene.replace(**{"solver.cells": 8}, **changes)


def drops(scene, seed, noise=1e-5, speeds=(3.0, 5.25), step=4e-4):
    rng, times = np.random.default_rng(seed), np.arange(0.0, 45e-3, step)
    return [
        DropTest(times, y + rng.normal(0.0, noise, len(times)), v)
        for v in speeds
        for y in [drop_test_signal(scene, times, v, "bit_position")]
    ]
