"""From a scene to the records of the travelling-wave kernels."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from percussion_model.physics.records import DriveKind, Mode, Piston, RockKind
from percussion_model.scene.scene import Scene
from percussion_model.solvers.wave.bar_cells import MOST_KEPT, CutBars
from percussion_model.solvers.wave.fronts import place_of_closure
from percussion_model.solvers.wave.grid import substeps
from percussion_model.solvers.wave.records import WAVE_PAR

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


def pack_parameters(scene: Scene, bars: CutBars) -> np.ndarray:
    """Parameter record of a scene.

    Parameters
    ----------
    scene : Scene
    bars : CutBars
        Its elastic bars.

    Returns
    -------
    WAVE_PAR array of length 1
    """
    par = np.ndarray(1, WAVE_PAR, bytearray(_of_bars(bars)))
    p = par[0]
    p["gravity"] = scene.gravity.acceleration if scene.effects.gravity else 0.0
    p["mass_b"] = scene.bit.mass
    p["mass_p"] = scene.piston.mass
    p["piston"] = Piston[scene.piston.model.upper()]
    p["drive"] = DriveKind[scene.effects.drive.upper()]
    p["rock"] = RockKind[scene.effects.rock.upper()]
    p["barrier"] = scene.barrier_on
    p["release"] = scene.effects.standstill_tension == "release"
    rock = rock_numbers(scene)
    p["ss_stiffness"] = rock["gamma"] * rock["k_r"]
    p["ss_loading"] = rock["k_r"]
    p["ss_damping"] = rock["c_r"]
    return par


@lru_cache(MOST_KEPT)
def _of_bars(bars: CutBars) -> bytes:
    """Bytes of a parameter record with what depends on the bars alone."""
    par = np.zeros(1, WAVE_PAR)
    p = par[0]
    p["dt"] = bars.time_step
    p["most_crossings"] = MOST_CROSSINGS
    p["loss"] = substeps(bars.loss_time, bars.time_step)
    bit = bars.bit
    p["n_b"] = bit.grid.n
    p["z_t"], p["z_b"] = bit.grid.impedance[[0, -1]]
    p["kappa_t"], p["kappa_b"] = bit.kappa
    p["bound_t"], p["bound_b"] = bit.bound
    piston = bars.piston
    if piston is not None:
        p["n_p"] = piston.grid.n
        p["z_f"], p["z_p"] = piston.grid.impedance[[0, -1]]
        p["kappa_f"], p["kappa_p"] = piston.kappa
        p["bound_p"] = piston.bound[1]
    shortest = min(bar.grid.n for bar in bars.both)
    p["front"] = place_of_closure(bars.loss_time / bars.time_step * shortest)
    p["rearm_time"] = REARM_TRANSITS * max(bar.transit_time for bar in bars.both)
    return par.tobytes()


def begin_state(s: Any, scene: Scene, rock: dict[str, float]) -> None:
    """Fill what states have in common (`COMMON_STATE`) at time zero.

    Parameters
    ----------
    s : record
        Changed in place, by the names of its fields.
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
