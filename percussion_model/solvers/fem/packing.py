"""From a scene to the parameters of the finite-element kernels."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.physics.records import DriveKind, Piston, RockKind
from percussion_model.scene.scene import Scene
from percussion_model.solvers.fem.mesh import BarMesh, critical_frequency
from percussion_model.solvers.fem.records import FEM_PAR
from percussion_model.solvers.wave.packing import REARM_TRANSITS

# Changes of mode that can follow each other at one instant; more would be a loop.
MOST_CHANGES = 12
# Steps cut short by events within the length of a whole one; more are a storm. The
# reference has no more than 5.
MOST_EVENTS = 64


def loss_time(scene: Scene, bit: BarMesh) -> float:
    """Kelvin-Voigt time [s]: that of the scene, or 2 zeta_K / omega_cr (eq. 55 of the paper)."""
    if not scene.effects.loss:
        return 0.0
    if scene.fem.damping_ratio is None:
        return float(scene.loss.time)
    return 2.0 * float(scene.fem.damping_ratio) / critical_frequency(bit)


def pack_fem(
    scene: Scene, piston: BarMesh | None, bit: BarMesh, time_step: float, eta: float
) -> np.ndarray:
    """Parameter record of a scene.

    Parameters
    ----------
    piston, bit : BarMesh
        No piston where it is absent.
    time_step : float
        [s]
    eta : float
        Kelvin-Voigt time [s].

    Returns
    -------
    FEM_PAR array of length 1
    """
    options = scene.fem
    par = np.zeros(1, FEM_PAR)
    p = par[0]
    p["dt"] = time_step
    mu = eigenvalue(options.spectral_radius)
    p["mu_re"], p["mu_im"] = mu.real, mu.imag
    p["dissipation"] = defect(options.spectral_radius)
    p["k_c"] = options.contact_stiffness
    p["eta"] = eta
    p["q_tol"], p["t_tol"] = options.event_tolerance, options.time_tolerance
    p["gravity"] = scene.gravity.acceleration if scene.effects.gravity else 0.0
    p["mass_p"], p["mass_b"] = scene.piston.mass, scene.bit.mass
    slowest = scene.bit.transit_time
    if scene.piston.model == "elastic":
        slowest = max(slowest, scene.piston.transit_time)
    p["rearm_time"] = REARM_TRANSITS * slowest
    p["start_gap"] = scene.start.gap
    p["n_p"] = 0 if piston is None else piston.n + 1
    p["n_b"] = bit.n + 1
    p["piston"] = Piston[scene.piston.model.upper()]
    p["drive"] = DriveKind[scene.effects.drive.upper()]
    kind = RockKind[scene.effects.rock.upper()]
    # a wall is met like the piston: by a penalty
    p["rock"] = RockKind.SPRING if kind == RockKind.WALL else kind
    p["barrier"] = scene.barrier_on
    p["most_changes"], p["most_events"] = MOST_CHANGES, MOST_EVENTS
    p["release"] = scene.effects.standstill_tension == "release"
    return par


def eigenvalue(spectral_radius: float) -> complex:
    """Complex eigenvalue of the scheme's matrix (docs/numerics.md, section 10)."""
    p = (2.0 + spectral_radius) / (3.0 * (1.0 + spectral_radius))
    q = 1.0 / (6.0 * (1.0 + spectral_radius))
    return complex(0.5 * p, math.sqrt(q - 0.25 * p * p))


def defect(spectral_radius: float) -> float:
    """Defect of the scheme's energy identity (docs/numerics.md, section 10)."""
    return (1.0 - spectral_radius) / (36.0 * (1.0 + spectral_radius))
