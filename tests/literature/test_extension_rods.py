"""Trends of efficiency over extension rods, as the public abstract of Lundberg (1987) states them.

B. Lundberg, Efficiency of percussive drilling with extension rods, Int. J. Rock Mech. Min. Sci. 24
(1987) 213. Hammer, adapter and rods are uniform and of one impedance, joints and bit of another.
The work on the rock, by the energy of the impact, generally decreases with the number of joints
and with their length, and may rise slightly with the number; what goes back to the hammer
generally grows with the hardness of the rock.
"""

import numpy as np

from percussion_model import Scene, Simulation

HAMMER, ROD, AREA, SPEED = 0.6, 3.0, 1e-3, 10.0
# Impedance of joints and bit by that of the rods.
RATIO = 2.0


def string(joints: int, joint: float, stiffness: float) -> Scene:
    """Hammer, rods with so many joints, and a bit."""
    rod = {"length": ROD, "area": AREA}
    sleeve = {"length": joint, "area": RATIO * AREA}
    rods = [{"sections": [rod, sleeve]} for _ in range(joints)]
    bars = [
        {"sections": [{"length": HAMMER, "area": AREA}]}, *rods, {"sections": [rod]},
        {"sections": [{"length": joint, "area": RATIO * AREA}]},
    ]  # fmt: skip
    off = {"gravity": False, "feed": False, "drive": "none", "loss": False, "barrier": False}
    return Scene(
        bars=bars, effects=off, rock={"loading_stiffness": stiffness, "unloading_ratio": 1e3},
        start={"piston_velocity": SPEED, "gap": 0.0, "rock_gap": 0.0}, solver={"cells": 40},
        run={"duration": 1.0, "settle": 0.0},
    )  # fmt: skip


def efficiencies(joints: int, joint: float = 0.15, stiffness: float = 2e8) -> tuple[float, float]:
    """Work on the rock by the energy of the impact, without and with what the hammer keeps."""
    scene = string(joints, joint, stiffness)
    simulation = Simulation(scene, record_events=False)
    transit = sum(bar.transit_time for bar in scene.bars.values())
    # until waves have come down often enough to have left most of their energy
    simulation.advance(12.0 * transit)
    sample, impact = simulation.observe(), 0.5 * scene.piston.mass * SPEED**2
    kept = 0.5 * scene.piston.mass * min(sample["piston_velocity"], 0.0) ** 2
    work = simulation.energy()["crushing"] / impact
    return work, work + kept / impact


def test_efficiency_falls_with_the_number_of_joints_and_rises_at_most_slightly():
    found = np.array([efficiencies(count)[0] for count in (1, 2, 4, 6, 8)])
    assert found.min() > 0.0
    assert found.max() < 1.0
    assert found[-1] < found[0] - 0.02
    assert np.diff(found).max() < 0.02


def test_efficiency_falls_with_the_length_of_joints():
    found = [efficiencies(4, joint)[0] for joint in (0.05, 0.1, 0.2, 0.4)]
    assert found == sorted(found, reverse=True)


def test_what_the_hammer_keeps_grows_with_hardness_most_with_few_joints():
    kept = {
        (joints, stiffness): np.subtract(*efficiencies(joints, 0.05, stiffness)[::-1])
        for joints in (1, 2)
        for stiffness in (5e7, 8e8)
    }
    for joints in (1, 2):
        assert kept[joints, 8e8] > 5.0 * kept[joints, 5e7]
    assert kept[1, 8e8] > 2.0 * kept[2, 8e8]
