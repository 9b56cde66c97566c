"""The rigid solver blow by blow against a model of its own, which `rigid_blows` has."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model import Scene, Simulation
from percussion_model.scene.bits import bit
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks import rock
from percussion_model.scene.rocks.breaking import parameters_under
from tests.agreement.rigid_blows import rig_of

REFERENCE = Scene().replace(**bit("dth-90").parameters)
HAMMER = hammer("dth5")
HAMMER = HAMMER.replace(**parameters_under(rock("kuru-granite"), HAMMER))
OFF, OLD = {"effects.barrier": False}, {"rotation.old_line": True}
# Relative, of all columns; and how far the hole is off by its mean advance.
CLOSE = 1e-6
# Scene, restitution, changes and blows. Motions that repeat keep what they begin with for 50
# blows; rock met again makes them aperiodic, and rounding grows from blow to blow.
CASES = {
    "feed on the bit": (REFERENCE, 0.3, {"breaking.threshold": 1.0}, 50),
    "without a barrier": (REFERENCE, 0.87, {"breaking.threshold": 1.0} | OFF, 50),
    "rock is loaded where blows begin": (
        REFERENCE,
        0.87,
        {"breaking.threshold": 0.0, "feed.force": 3e4} | OFF,
        25,
    ),
    "feed on the casing": (HAMMER, 0.87, {}, 50),
    "much feed": (HAMMER, 0.87, {"feed.force": 44000.0}, 50),
    "below recoil": (HAMMER, 0.87, {"feed.force": 5000.0}, 25),
    "a motor that slows": (
        HAMMER,
        0.87,
        {"rotation.stall_torque": 200.0, "rotation.full_torque": 60.0},
        50,
    ),
    "a string that twists": (
        HAMMER,
        0.87,
        {"rotation.string_stiffness": 5000.0, "rotation.inertia": 0.3},
        50,
    ),
    "advance by what is pressed in": (REFERENCE, 0.87, {"breaking.crushing_energy": 0.0}, 50),
    "limited by the depth": (REFERENCE, 0.87, {"breaking.crushing_energy": 1e6}, 50),
    "rock met again": (HAMMER, 0.87, OFF | OLD, 12),
    "rock met again by a bit that turns slowly": (
        HAMMER,
        0.87,
        OFF | OLD | {"rotation.speed": 0.5},
        12,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_blows_are_those_of_another_model(name):
    scene, restitution, changes, count = CASES[name]
    scene = scene.computed_by("rigid", **{"contact.restitution": restitution, **changes})
    wanted = rig_of(scene).run(count)
    simulation = Simulation(scene, record_events=False)
    simulation.advance(wanted[-1]["time"] + 1.5 * wanted[-1]["period"])
    blows = simulation.blows[:count]
    assert len(blows) == count
    for column in wanted[0]:
        values = np.array([row[column] for row in wanted])
        scale = np.abs(values).max() if column == "rotation_torque" else np.abs(values).mean()
        np.testing.assert_allclose(
            blows[column], values, rtol=CLOSE, atol=CLOSE * scale, err_msg=column
        )
        assert scale > 0.0 or (
            column == "breaking_blow_volume" and not scene["breaking.crushing_energy"]
        )


def test_a_wrong_law_is_seen():
    """With the threshold of a blow in place of that of each button the model drills too fast."""
    scene, restitution, changes, count = CASES["feed on the casing"]
    scene = scene.computed_by("rigid", **{"contact.restitution": restitution, **changes})
    rig = rig_of(scene)
    rig.law.buttons = 1
    wrong = [row["hole_advance"] for row in rig.run(count)]
    simulation = Simulation(scene, record_events=False)
    simulation.advance(2.5)
    assert np.mean(wrong) > 1.05 * simulation.blows["hole_advance"][:count].mean()
