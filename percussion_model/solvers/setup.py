"""From a scene to the fields that the records of all solvers have in common."""

from __future__ import annotations

from typing import Any

import numpy as np

from percussion_model.physics.effects import EFFECTS
from percussion_model.physics.records import DriveKind, Mode, Piston, RockKind
from percussion_model.scene.scene import Scene

# An open gap of this many transits of the slower bar ends a blow where no
# pressure law does (docs/model.md, section 7).
REARM_TRANSITS = 20.0
# Changes of mode that the rock law can make within one step or at one instant: FF, SS, FF,
# DFC, FC, BC and again; more would be a loop.
MOST_CHANGES = 12


def fill_parameters(p: Any, scene: Scene, with_piston: bool) -> float:
    """Fill `COMMON_PARAMETERS`.

    Parameters
    ----------
    p : record
        Changed in place.
    with_piston : bool
        Whether waves go through the piston too, or would if it were not rigid.

    Returns
    -------
    float
        Transit time of the slower bar [s].
    """
    effects = scene.effects
    slowest = scene.bit.transit_time
    if with_piston:
        slowest = max(slowest, scene.piston.transit_time)
    p["rearm_time"] = REARM_TRANSITS * slowest
    p["gravity"] = scene.gravity.acceleration if effects.gravity else 0.0
    p["mass_b"] = scene.bit.mass
    p["mass_p"] = scene.piston.mass
    p["piston"] = Piston[scene.piston.model.upper()]
    p["drive"] = DriveKind[effects.drive.upper()]
    p["rock"] = RockKind[effects.rock.upper()]
    p["barrier"] = scene.barrier_on
    p["release"] = effects.standstill_tension == "release"
    for effect in EFFECTS:
        if scene[f"effects.{effect.name}"]:
            p["effects"] = 1
            for name in effect.parameters:
                p[f"{effect.name}_{name}"] = scene[f"{effect.name}.{name}"]
    return float(slowest)


def rock_numbers(scene: Scene) -> dict[str, float]:
    """Numbers of the rock law as the kernels take them."""
    rock, kind = scene.rock, scene.effects.rock
    barrier = scene.barrier_on
    return {
        "k_r": rock.loading_stiffness if kind != "none" else 0.0,
        "gamma": rock.unloading_ratio if kind == "bilinear" else 1.0,
        "c_r": rock.barrier_damping if barrier else 0.0,
        "w_r": rock.barrier_energy if barrier else 0.0,
    }


def fill_start(s: Any, scene: Scene, rock: dict[str, float]) -> None:
    """Fill what states have in common (`COMMON_STATE`) at time zero.

    Parameters
    ----------
    s : record
        Changed in place.
    rock : dict of float
        From `rock_numbers`.
    """
    start, has_piston = scene.start, scene.piston.model != "absent"
    s["live"] = 1
    s["mode"] = Mode.FF
    s["alpha"] = start.drive_direction
    s["armed"] = scene.effects.drive != "pressure" or start.drive_direction > 0
    s["feed"] = scene.feed.force if scene.effects.feed else 0.0
    s["drive_force"] = scene.drive.force
    s["reversal"] = scene.drive.reversal_distance
    s["external"] = scene.drive.external_force
    for key, value in rock.items():
        s[key] = value
        s[f"next_{key}"] = value
    s["p"] = -start.rock_gap
    s["x_r"] = start.rock_gap
    s["v_b"] = start.bit_velocity
    s["v_p"] = start.piston_velocity if has_piston else 0.0
    s["gap"] = start.gap if has_piston else np.inf
    s["t_open"] = -np.inf
    s["peak_from"] = np.inf
    s["b_rebound"] = np.nan
    s["b_standstill"] = np.nan
