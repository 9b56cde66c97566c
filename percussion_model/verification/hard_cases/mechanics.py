"""Checks of mechanics on a run: momentum, no tension, no interpenetration."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.ledger import WORKS
from percussion_model.scene.scene import Scene

# Without a penalty nothing interpenetrates but by the rounding of a flight of metres [m].
ROUNDING_GAP = 1e-12
# Rigid bodies whose events a guard postpones by 0.2 µs pass each other by 1e-11 m where the
# reference's drive presses them together, and by not much more elsewhere [m].
STORM_GAP = 1e-10
# Forces are compared with the greatest push, or with this where there is none [N].
LEAST_FORCE = 1.0


def not_finite(samples: dict[str, np.ndarray] | None, energy: dict[str, float]) -> str:
    """Return what is not finite in a run; empty where all is."""
    for name, values in (samples or {}).items():
        # what a scene does not have is undefined throughout
        if not np.all(np.isfinite(values)) and not np.all(np.isnan(values)):
            return f"{name} is not finite"
    for name, value in energy.items():
        if not math.isfinite(value) and not name.endswith("relative"):
            return f"{name} of the ledger is not finite"
    return ""


def mechanics(
    scene: Scene, samples: dict[str, np.ndarray], energy: dict[str, float], storms: int
) -> dict[str, float]:
    """Momentum, tension and interpenetration of a run; see `Measures`.

    Parameters
    ----------
    storms : int
        How many storms of events a guard had to bound.
    """
    put_in = abs(energy["initial"]) + sum(abs(energy[name]) for name in WORKS)
    allowed = ROUNDING_GAP
    if storms:
        allowed = STORM_GAP
    if scene.solver_name == "fem":
        allowed += math.sqrt(2.0 * put_in / scene.fem.contact_stiffness)
    found = {"momentum": _momentum(scene, samples)}
    deep = []
    if scene.piston.model != "absent":
        found["contact_tension"] = _pull(samples["contact_force"])
        deep.append(-float(samples["gap"].min()))
    if scene.effects.standstill_tension == "release" or scene.effects.rock != "bilinear":
        found["rock_tension"] = _pull(samples["bit_force"])
    if scene.effects.rock == "wall":
        deep.append(float(samples["bit_end_position"].max()) - scene.start.rock_gap)
    if deep:
        found["interpenetration"] = max(0.0, *deep) / allowed
    return found


def _pull(force: np.ndarray) -> float:
    """Greatest tension divided by the greatest compression."""
    return max(0.0, -float(force.min())) / max(float(force.max()), LEAST_FORCE)


def _momentum(scene: Scene, samples: dict[str, np.ndarray]) -> float:
    """Greatest difference of momentum and impulse of a body, divided by the greatest impulse."""
    weight = scene.gravity.acceleration if scene.effects.gravity else 0.0
    t = samples["here"]
    contact = np.nan_to_num(samples["contact_impulse"])
    mass = scene.bit.mass
    given = samples["feed_impulse"] + mass * weight * t + contact - samples["bit_impulse"]
    off = _mismatch(mass * samples["bit_velocity"], given)
    parts = [
        samples["feed_impulse"],
        contact,
        samples["bit_impulse"],
        mass * samples["bit_velocity"],
    ]
    if scene.piston.model != "absent":
        mass = scene.piston.mass
        given = mass * weight * t + samples["drive_impulse"] - contact
        off = max(off, _mismatch(mass * samples["piston_velocity"], given))
        parts += [samples["drive_impulse"], mass * samples["piston_velocity"]]
    greatest = max(float(np.abs(part).max()) for part in parts)
    return off / greatest if greatest > 0.0 else off


def _mismatch(momentum: np.ndarray, given: np.ndarray) -> float:
    return float(np.abs((momentum - momentum[0]) - (given - given[0])).max())
