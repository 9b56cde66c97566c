"""No blow breaks more than its crushed energy pays, in scenes drawn at random.

40 scenes each time, 2,000 with PERCUSSION_LONG=1.
"""

from __future__ import annotations

import math
import os

import numpy as np
import pytest

from percussion_model import Scene, Simulation
from percussion_model.scene.bits import bit
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks import rock
from percussion_model.scene.rocks.breaking import parameters_under

COUNT = 2000 if os.environ.get("PERCUSSION_LONG") == "1" else 40
DURATION = 0.4
# Rounding of the energies that are subtracted, and of positions, whose difference the depth is.
ROUNDING, DIGITS = 1e-14, 4.0 * np.finfo(float).eps
# A blow ends at a grid point of the solver: what is read is a little later.
LATER, CLOSE = 1e-9, 1e-6
# Bounds of what is drawn evenly by its logarithm, and how often it is left at 0.
DRAWN = {
    "rock.unloading_ratio": (1.2, 30.0, 0.0), "feed.force": (300.0, 6e4, 0.0),
    "feed.casing_mass": (1.0, 300.0, 0.2), "breaking.crushing_energy": (1e6, 1e10, 0.0),
    "breaking.threshold": (1e-2, 300.0, 0.2), "breaking.efficiency": (0.01, 1.0, 0.0),
    "breaking.wear_length": (1e-3, 100.0, 0.7), "breaking.flushed_volume": (1e-8, 1e-3, 0.7),
    "rotation.speed": (1e-2, 100.0, 0.1), "rotation.renewal_length": (1e-4, 0.1, 0.15),
    "rotation.friction": (1e-2, 2.0, 0.1), "rotation.stall_torque": (10.0, 5e3, 0.6),
    "rotation.response": (1e-3, 10.0, 0.2), "rotation.string_stiffness": (10.0, 1e6, 0.6),
}  # fmt: skip


def drawn_scene(seed: int) -> Scene:
    """A hammer down the hole or the reference, far from what it is."""
    rng = np.random.default_rng([49, seed])
    name = rng.choice(["reference", "dth3", "dth4", "dth5", "dth6"])
    base = Scene().replace(**bit("dth-90").parameters) if name == "reference" else hammer(name)
    kind = rng.choice(["kuru-granite", "st-anne-limestone", "sierra-white-granite"])
    base = base.replace(**parameters_under(rock(kind), base))
    changes = {
        key: 0.0 if rng.random() < zero else math.exp(rng.uniform(math.log(low), math.log(high)))
        for key, (low, high, zero) in DRAWN.items()
    }
    changes["rock.loading_stiffness"] = base.rock.loading_stiffness * 10.0 ** rng.uniform(-1, 1)
    changes["breaking.buttons"] = int(rng.integers(1, 60))
    changes["rotation.full_torque"] = rng.random() * changes["rotation.stall_torque"]
    changes["rotation.inertia"] = 10.0 ** rng.uniform(-3, 1)
    changes["feed.on"] = rng.choice(["bit", "casing"])
    changes["effects.rotation"] = rng.random() < 0.85
    changes["effects.barrier"] = rng.random() < 0.8
    changes["rotation.old_line"] = changes["effects.barrier"] and rng.random() < 0.4
    if (solver := rng.choice(["rigid", "rigid", "modal", "modal", "wave"])) != "rigid":
        changes["effects.rock"] = rng.choice(["bilinear", "bilinear", "power"])
    plain = {
        key: value.item() if hasattr(value, "item") else value for key, value in changes.items()
    }
    return base.computed_by(str(solver), **{"run.settle": 0.0, **plain})


@pytest.mark.parametrize("seed", range(COUNT))
def test_no_blow_breaks_more_than_it_crushed(seed):
    scene = drawn_scene(seed)
    simulation = Simulation(scene)
    simulation.advance(DURATION)
    blows, ledger = simulation.blows, simulation.energy()
    assert abs(ledger["residual_relative"]) < 1e-9
    assert ledger["turning"] == ledger["friction"]
    if not len(blows):
        return
    again, crushed, depth, reach = Simulation(scene), [], [], 1e-5
    for t in [*blows["time"], blows["time"][-1] + blows["period"][-1]]:
        again.advance(float(t) + LATER)
        crushed.append(again.energy()["crushing"])
        seen = again.observe()
        depth.append(seen["hole_depth"])
        reach = max(reach, abs(seen["bit_position"]))
    # positions count from where the bit would be without climbing
    reach += ledger["climb"] / max(scene.feed.force, 1.0)
    price = scene["breaking.crushing_energy"] * 0.25 * math.pi * scene.hole_diameter**2
    paid, spent = scene["breaking.efficiency"] * np.diff(crushed), price * np.diff(depth)
    slack = ROUNDING * crushed[-1] + DIGITS * price * reach
    assert np.all(spent <= paid * (1.0 + CLOSE) + slack)
