"""From a scene to the records of the rigid-body kernels."""

from __future__ import annotations

from typing import Any

import numpy as np

from percussion_model.physics.records import DriveKind, Mode, Piston, RockKind
from percussion_model.scene.scene import Scene
from percussion_model.solvers.rigid.records import RIGID

# Without a switching drive a blow ends when the gap was open for so many bar transits.
BLOW_GAP_TRANSITS = 20

# More events than this within a transit of the longer bar are a storm: the reference has
# no more than 13. What rigid bodies do within a transit is not theirs to tell anyway.
MOST_EVENTS = 200
SHORTEST_WINDOW = 1e-6  # of a very short bar [s]


def st_venant_restitution(
    piston_mass: float, piston_transit: float, bit_mass: float, bit_transit: float
) -> float:
    """Restitution of two free elastic bars after their first contact (docs/model.md, sec. 9).

    The shorter bar sends a rectangular wave of force Z_c v into the longer one for twice
    its own transit time. With equal impedances this is the ratio of the lengths.

    Parameters
    ----------
    piston_mass, bit_mass : float
        Masses [kg].
    piston_transit, bit_transit : float
        Times that a wave takes from end to end [s].

    Returns
    -------
    float
        Between 0 and 1.
    """
    z_p = piston_mass / piston_transit
    z_b = bit_mass / bit_transit
    impulse = 2.0 * min(piston_transit, bit_transit) * z_p * z_b / (z_p + z_b)
    e = impulse * (1.0 / piston_mass + 1.0 / bit_mass) - 1.0
    return min(max(e, 0.0), 1.0)


def restitution(scene: Scene) -> float:
    """Coefficient of restitution of piston and bit, NaN without a piston."""
    if scene.piston.model == "absent":
        return float("nan")
    if scene.bit.model == "rigid" and scene.contact.restitution is not None:
        return float(scene.contact.restitution)
    return st_venant_restitution(
        scene.piston.mass,
        scene.piston.transit_time,
        scene.bit.mass,
        scene.bit.transit_time,
    )


def pack_rigid(scene: Scene) -> np.ndarray:
    """State of a scene at time zero, parameters and inputs included.

    Returns
    -------
    RIGID array of length 1
        Its motion has not begun: `core.rigid.begin` looks for the first event.
    """
    state = np.zeros(1, RIGID)
    _fill_parameters(scene, state["par"][0])
    _fill_start(scene, state["now"][0])
    return state


def _fill_parameters(scene: Scene, par: Any) -> None:
    effects = scene.effects
    has_piston = scene.piston.model != "absent"
    par["M_p"] = scene.piston.mass if has_piston else 0.0
    par["M_b"] = scene.bit.mass
    par["G"] = scene.gravity.acceleration if effects.gravity else 0.0
    par["F_S"] = scene.feed.force if effects.feed else 0.0
    par["F_0"] = scene.drive.force
    par["D_1"] = scene.drive.reversal_distance
    par["external"] = scene.drive.external_force
    par["e"] = restitution(scene)
    par["K_R"] = scene.rock.loading_stiffness
    par["gamma"] = scene.rock.unloading_ratio if effects.rock == "bilinear" else 1.0
    par["C_R"] = scene.rock.barrier_damping
    par["W_R"] = scene.rock.barrier_energy if scene.barrier_on else 0.0
    transit = scene.bit.transit_time
    if has_piston:
        transit = max(transit, scene.piston.transit_time)
    par["blow_gap_time"] = BLOW_GAP_TRANSITS * transit
    par["storm_window"] = max(transit, SHORTEST_WINDOW)
    par["most_events"] = MOST_EVENTS
    par["piston"] = Piston.RIGID if has_piston else Piston.ABSENT
    par["drive"] = DriveKind[effects.drive.upper()]
    par["rock"] = RockKind[effects.rock.upper()]
    par["barrier"] = int(effects.barrier and effects.rock == "bilinear")
    par["release"] = int(effects.standstill_tension == "release")


def _fill_start(scene: Scene, now: Any) -> None:
    spring_or_wall = scene.effects.rock in ("spring", "wall")
    now["mode"] = Mode.FF
    now["alpha"] = scene.start.drive_direction
    now["armed"] = int(scene.start.drive_direction > 0)
    now["p"] = -scene.start.rock_gap if spring_or_wall else 0.0
    now["P_u"] = 0.0 if spring_or_wall else scene.start.rock_gap
    now["v_b"] = scene.start.bit_velocity
    if scene.piston.model != "absent":
        now["gap"] = now["first_gap"] = scene.start.gap
        now["v_p"] = scene.start.piston_velocity
    now["opened"] = -np.inf
    now["ss_force"] = np.nan
    now["peak_from"] = np.inf
