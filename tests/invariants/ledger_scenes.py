"""Random scenes for the ledger of waves: wide ranges of all that its books depend on."""

from __future__ import annotations

from percussion_model import Scene, Section
from tests.properties.scenes import with_loss_that_fits

DENSITIES = (7850.0, 7200.0)


def random_sections(rng):
    """One to three sections of an elastic bar, a few of them of other steel."""
    return tuple(
        Section(
            length=float(rng.uniform(0.05, 0.3)),
            area=float(10.0 ** rng.uniform(-3.0, -2.0)),
            density=float(rng.choice(DENSITIES)),
        )
        for _ in range(rng.integers(1, 4))
    )


def random_scene(rng):
    """A scene of elastic bars with any of the effects, drawn by `rng`."""
    loss = float(
        rng.choice([0.0, 10.0 ** rng.uniform(-9.0, -3.0), 10.0 ** rng.uniform(-7.5, -6.0)])
    )
    changes = {
        "solver.name": "wave",
        "bit.sections": random_sections(rng),
        "solver.cells": int(rng.integers(1, 41)),
        "loss.time": loss,
        "effects.loss": loss > 0.0,
        "feed.force": float(rng.choice([0.0, 10.0 ** rng.uniform(1.0, 7.0), 2500.0])),
        "start.rock_gap": float(rng.choice([0.0, 1e-5, 1e-3])),
        "run.settle": 0.0,
    }
    for name in ("gravity", "feed"):
        changes[f"effects.{name}"] = bool(rng.random() < 0.8)
    kind = str(rng.choice(["elastic", "rigid", "absent"], p=[0.6, 0.15, 0.25]))
    changes["piston.model"] = kind
    if kind == "absent":
        changes |= {"effects.drive": "none", "start.bit_velocity": float(rng.uniform(0.0, 10.0))}
    else:
        changes["start.piston_velocity"] = float(rng.uniform(1.0, 12.0))
        changes["effects.drive"] = str(
            rng.choice(["pressure", "external", "none"], p=[0.7, 0.2, 0.1])
        )
        changes["drive.external_force"] = float(rng.uniform(0.0, 5e3))
        changes["drive.force"] = float(10.0 ** rng.uniform(3.0, 4.0))
        changes["drive.reversal_distance"] = float(10.0 ** rng.uniform(-2.5, -1.3))
    if kind == "elastic":
        changes["piston.sections"] = random_sections(rng)
    rock = str(rng.choice(["bilinear", "spring", "wall", "none"], p=[0.8, 0.1, 0.05, 0.05]))
    changes["effects.rock"] = rock
    changes["effects.barrier"] = bool(rock == "bilinear" and rng.random() < 0.8)
    changes["effects.standstill_tension"] = str(rng.choice(["release", "paper"]))
    changes["rock.loading_stiffness"] = float(10.0 ** rng.uniform(6.0, 10.0))
    changes["rock.unloading_ratio"] = float(1.0 + 10.0 ** rng.uniform(-1.0, 2.0))
    changes["rock.barrier_damping"] = float(rng.choice([0.0, 10.0 ** rng.uniform(2.0, 7.0)]))
    changes["rock.barrier_energy"] = float(rng.choice([0.0, 10.0 ** rng.uniform(-3.0, 1.0)]))
    return with_loss_that_fits(Scene().replace(**changes))
