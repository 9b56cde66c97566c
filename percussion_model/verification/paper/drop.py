"""The drop test of section 4.2 of the paper: figure 6."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from percussion_model.physics.records import EventKind
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import Simulation

# The bit falls with F_0 D_1 of kinetic energy, rounded in the paper [m/s].
SPEED = 5.25
ENERGIES = (0.005, 0.05, 0.5, 5.0)  # W_R [J]
DAMPINGS = (1e3, 1e4, 1e5)  # C_R [N s/m]
LENGTH, STEP = 80e-3, 2e-5  # [s]


@dataclass(frozen=True)
class Drop:
    """One drop test, SI units."""

    energy: float
    damping: float
    time: np.ndarray
    bit_position: np.ndarray
    rest: float  # displacement of the bit's rock end [m]
    cycles: int  # drilling cycles that crushed more than W_R/100


def drop_scene(scene: Scene, energy: float, damping: float) -> Scene:
    """Scene of a drop test: the bit alone, above the rock of the reference."""
    return scene.replace(
        **{
            "piston.model": "absent",
            "effects.drive": "none",
            "start.bit_velocity": SPEED,
            "rock.barrier_energy": energy,
            "rock.barrier_damping": damping,
        }
    )


def run_drops(scene: Scene) -> list[Drop]:
    """Drop tests over energies and dampings of the barrier."""
    return [_run(scene, energy, damping) for energy in ENERGIES for damping in DAMPINGS]


def _run(scene: Scene, energy: float, damping: float) -> Drop:
    simulation = Simulation(drop_scene(scene, energy, damping))
    samples = simulation.sample(np.arange(0.0, LENGTH, STEP))
    cycles = int(np.sum(simulation.events["kind"] == EventKind.MODE_DFC))
    return Drop(
        energy=energy,
        damping=damping,
        time=samples["time"],
        bit_position=samples["bit_position"],
        rest=float(samples["bit_end_position"][-1]),
        cycles=cycles,
    )
