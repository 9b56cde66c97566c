"""From a scene to the records of the travelling-wave kernels."""

from __future__ import annotations

from typing import Any

import numpy as np

from percussion_model.core.records import DriveKind, Mode, Piston, RockKind
from percussion_model.core.wave_records import WAVE_PAR, Coef
from percussion_model.scene_rules import SceneRules
from percussion_model.solvers.fronts import place_of_closure
from percussion_model.solvers.grid import Grid, end_viscosity, substeps

# An open gap of this many transits of the slower bar ends a blow where no
# pressure law does (docs/model.md, section 7).
REARM_TRANSITS = 20.0
# Crossings that the rock law can make within one step: FF, SS, FF, DFC, FC, BC and again;
# more would be a loop.
MOST_CROSSINGS = 12
# Inputs that can change during a run, and the fields of the state that hold them.
INPUT_FIELDS = {
    "feed_force": "feed",
    "drive_force": "drive_force",
    "reversal_distance": "reversal",
    "external_force": "external",
    "loading_stiffness": "next_k_r",
    "unloading_ratio": "next_gamma",
    "barrier_damping": "next_c_r",
    "barrier_energy": "next_w_r",
}


def pack_parameters(
    scene: SceneRules,
    piston: Grid | None,
    cp: np.ndarray,
    bit: Grid,
    cb: np.ndarray,
    loss_time: float,
) -> np.ndarray:
    """Parameter record of a scene.

    Parameters
    ----------
    piston, bit : Grid
        Cells; no piston where it is rigid or absent.
    cp, cb : ndarray
        Their coefficients.
    loss_time : float
        Kelvin-Voigt time [s], 0 without loss.

    Returns
    -------
    WAVE_PAR array of length 1
    """
    par = np.zeros(1, WAVE_PAR)
    p = par[0]
    p["dt"] = bit.time_step
    p["gravity"] = scene.gravity.acceleration if scene.effects.gravity else 0.0
    p["mass_b"] = scene.bit.mass
    p["mass_p"] = scene.piston.mass
    p["piston"] = Piston[scene.piston.model.upper()]
    p["drive"] = DriveKind[scene.effects.drive.upper()]
    p["rock"] = RockKind[scene.effects.rock.upper()]
    p["barrier"] = scene.barrier_on
    p["most_crossings"] = MOST_CROSSINGS
    p["release"] = scene.effects.standstill_tension == "release"
    p["loss"] = substeps(loss_time, bit.time_step)
    p["n_b"] = bit.n
    p["z_t"], p["z_b"] = bit.impedance[[0, -1]]
    p["kappa_t"], p["kappa_b"] = end_viscosity(cb, bit, loss_time)
    p["bound_t"] = _offset_bound(cb, bit, Coef.TOP)
    p["bound_b"] = _offset_bound(cb, bit, Coef.BOTTOM)
    slowest = scene.bit.transit_time
    if piston is not None:
        p["n_p"] = piston.n
        p["z_f"], p["z_p"] = piston.impedance[[0, -1]]
        p["kappa_f"], p["kappa_p"] = end_viscosity(cp, piston, loss_time)
        p["bound_p"] = _offset_bound(cp, piston, Coef.BOTTOM)
        slowest = max(slowest, scene.piston.transit_time)
    shortest = bit.n if piston is None else min(bit.n, piston.n)
    p["front"] = place_of_closure(loss_time / bit.time_step * shortest)
    p["rearm_time"] = REARM_TRANSITS * slowest
    rock = rock_numbers(scene)
    p["ss_stiffness"] = rock["gamma"] * rock["k_r"]
    p["ss_loading"] = rock["k_r"]
    p["ss_damping"] = rock["c_r"]
    return par


def begin_state(s: Any, scene: SceneRules, rock: dict[str, float]) -> None:
    """Fill what states have in common (`COMMON_STATE`) at time zero.

    Parameters
    ----------
    s : record
        Changed in place.
    rock : dict of float
        From `rock_numbers`.
    """
    start = scene.start
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
    s["t_open"] = -np.inf
    s["peak_from"] = np.inf
    s["b_rebound"] = np.nan
    s["b_standstill"] = np.nan
    s["gap"] = start.gap if scene.piston.model != "absent" else np.inf


def rock_numbers(scene: SceneRules) -> dict[str, float]:
    """Numbers of the rock law as the kernels take them."""
    rock, kind = scene.rock, scene.effects.rock
    barrier = scene.barrier_on
    return {
        "k_r": rock.loading_stiffness if kind != "none" else 0.0,
        "gamma": rock.unloading_ratio if kind == "bilinear" else 1.0,
        "c_r": rock.barrier_damping if barrier else 0.0,
        "w_r": rock.barrier_energy if barrier else 0.0,
    }


def _offset_bound(c: np.ndarray, grid: Grid, row: Coef) -> float:
    """Factor b in |offset| <= b sqrt(2 E) (docs/numerics.md, eq. 14)."""
    n = grid.n
    return float(np.sqrt(np.sum(c[row, :n] * c[row, :n] / c[Coef.MASS, :n])))
