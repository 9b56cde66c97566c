"""Ledger, momentum, unilateral contact and order of events, over pairs of effects.

Every pair of choices from `CHOICES` occurs in some scene that makes sense.
"""

from __future__ import annotations

from itertools import combinations, pairwise, product

import numpy as np
import pytest

from percussion_model import EventKind, Mode, Scene, SceneError, Section, Simulation
from tests.properties.scenes import with_loss_that_fits

DURATION = 0.1  # two blows and a part of the third [s]

LENGTHS = {
    "reference": {},
    "odd": {
        "piston.sections": (Section(length=0.171, area=5.5e-3),),
        "bit.sections": (Section(length=0.233, area=4.1e-3),),
    },
    "stepped": {
        "piston.sections": (
            Section(length=0.07, area=7e-3),
            Section(length=0.105, area=4e-3, density=7000.0, youngs_modulus=190e9),
        ),
        "bit.sections": (
            Section(length=0.07, area=3e-3),
            Section(length=0.0525, area=6e-3),
            Section(length=0.07, area=5e-3),
        ),
    },
    "one cell": {"bit.sections": (Section(length=0.0175, area=5.5e-3),)},
}
LEVELS = {
    "lengths": tuple(LENGTHS),
    "solver": ("wave", "fem", "rigid"),
    "piston": ("elastic", "rigid", "absent"),
    "rock": ("bilinear", "spring", "wall", "none"),
    "drive": ("pressure", "external", "none"),
    "loss": (True, False),
    "barrier": (True, False),
    "gravity": (True, False),
    "feed": (True, False),
    "tension": ("release", "paper"),
    "cells": (10, 20, 150),
}


def build(choice):
    """Scene of a choice, or None where its parts contradict each other."""
    changes = {
        "solver.name": choice["solver"],
        "piston.model": choice["piston"],
        "bit.model": "rigid" if choice["solver"] == "rigid" else "elastic",
        "effects.rock": choice["rock"],
        "effects.drive": choice["drive"],
        "effects.loss": choice["loss"],
        "effects.barrier": choice["barrier"],
        "effects.gravity": choice["gravity"],
        "effects.feed": choice["feed"],
        "effects.standstill_tension": choice["tension"],
        "solver.cells": choice["cells"],
        "fem.elements": choice["cells"],
        "run.settle": 0.0,
        **LENGTHS[choice["lengths"]],
    }
    if choice["drive"] == "external":
        changes["drive.external_force"] = 2000.0
    if choice["piston"] == "absent":
        changes["start.bit_velocity"] = 5.25
    try:
        scene = Scene().replace(**changes)
    except SceneError:
        return None
    return with_loss_that_fits(scene) if choice["solver"] == "wave" else scene


def cover_pairs(seed=7):
    """Choices that hold every possible pair of levels, found greedily."""
    rng = np.random.default_rng(seed)
    names = list(LEVELS)
    every = [dict(zip(names, values, strict=True)) for values in product(*LEVELS.values())]
    pool = [every[k] for k in rng.choice(len(every), 4000, replace=False)]
    pool = [choice for choice in pool if build_allowed(choice)]

    def pairs(choice):
        return {(a, choice[a], b, choice[b]) for a, b in combinations(names, 2)}

    held = [pairs(choice) for choice in pool]
    left = set().union(*held)
    found = []
    while left:
        best = max(range(len(pool)), key=lambda k: len(held[k] & left))
        found.append(pool[best])
        left -= held[best]
    return found


def build_allowed(choice):
    """What `build` finds, without the cost of making each scene."""
    if choice["piston"] == "absent" and choice["drive"] != "none":
        return False
    if choice["piston"] == "elastic" and choice["solver"] == "rigid":
        return False
    return not (choice["barrier"] and choice["rock"] != "bilinear")


CHOICES = cover_pairs()


def name_of(choice):
    return "-".join(
        f"{key}" if value is True else f"no {key}" if value is False else str(value)
        for key, value in choice.items()
    )


def check_forces(seen, scene):
    """No tension between piston and bit, none on the rock that may let go.

    Nothing interpenetrates, but for what the force needs where contact is a penalty.
    """
    greatest = max(1.0, np.nanmax(np.abs(seen["bit_force"])))
    give = 1.0 / scene.fem.contact_stiffness if scene.solver_name == "fem" else 0.0
    if scene.piston.model != "absent":
        force = np.nan_to_num(seen["contact_force"])  # rigid bodies have an impulse only
        assert force.min() > -1e-9 * max(1.0, force.max())
        travel = max(1e-5, np.abs(seen["gap"]).max())
        assert (seen["gap"] + give * force).min() > -1e-12 * travel - 1e-15
    if scene.effects.standstill_tension == "release" or scene.effects.rock != "bilinear":
        assert seen["bit_force"].min() > -1e-9 * greatest
    if scene.effects.rock == "wall":
        into = seen["bit_end_position"] - scene.start.rock_gap
        assert (into - give * seen["bit_force"]).max() < 1e-12


def check_momentum(seen, scene, scale):
    """Momentum is what impulses gave, of both bodies and of the piston alone."""
    t = seen["time"]
    g = scene.gravity.acceleration if scene.effects.gravity else 0.0
    feed = scene.feed.force if scene.effects.feed else 0.0
    m_b = scene.bit.mass
    impulse = (feed + m_b * g) * t + seen["contact_impulse"] - seen["bit_impulse"]
    momentum = m_b * (seen["bit_velocity"] - seen["bit_velocity"][0])
    np.testing.assert_allclose(momentum, impulse - impulse[0], atol=1e-9 * scale)
    if scene.piston.model == "absent":
        return
    m_p = scene.piston.mass
    impulse = m_p * g * t + seen["drive_impulse"] - seen["contact_impulse"]
    momentum = m_p * (seen["piston_velocity"] - seen["piston_velocity"][0])
    np.testing.assert_allclose(momentum, impulse - impulse[0], atol=1e-9 * scale)


ALLOWED = {
    Mode.FF: {Mode.DFC, Mode.FC, Mode.SS},
    Mode.DFC: {Mode.FC, Mode.BC},
    Mode.FC: {Mode.BC, Mode.FF},
    Mode.BC: {Mode.FF, Mode.DFC, Mode.FC, Mode.SS},
    Mode.SS: {Mode.DFC, Mode.FC, Mode.BC, Mode.FF},
}


def check_events(events, scene):
    """Events come in the order of time, and each follows what may come before it."""
    kinds = events["kind"]
    assert np.all(np.diff(events["time"]) >= 0)
    contact = kinds[(kinds == EventKind.CONTACT_CLOSED) | (kinds == EventKind.CONTACT_OPENED)]
    if scene.bit.model == "elastic":
        assert np.all(np.diff(contact) != 0)
    drive = kinds[kinds >= EventKind.DRIVE_UP]
    assert np.all(np.diff(drive) != 0)
    modes = [Mode.FF, *(Mode(kind) for kind in kinds[kinds <= EventKind.MODE_SS])]
    if scene.effects.rock == "bilinear":
        for before, after in pairwise(modes):
            assert after in ALLOWED[before], (before.name, after.name)
    if not scene.barrier_on:
        assert Mode.DFC not in modes


def test_every_pair_is_there():
    assert len(CHOICES) < 80
    seen = {(key, value) for choice in CHOICES for key, value in choice.items()}
    assert seen == {(key, value) for key, values in LEVELS.items() for value in values}


@pytest.mark.parametrize("choice", CHOICES, ids=name_of)
def test_conservation(choice):
    scene = build(choice)
    assert scene is not None
    # at least every case meets a blow; a fine grid is slow
    end = DURATION if choice["cells"] < 100 and choice["lengths"] != "one cell" else 0.015
    simulation = Simulation(scene)
    times = np.concatenate([np.linspace(0.0, 6e-4, 301), np.linspace(6e-4, end, 301)])
    seen = simulation.sample(times)
    ledger = simulation.energy()
    assert abs(ledger["residual_relative"]) < 1e-9
    assert ledger["numerical_relative"] > -1e-9
    for name in ("crushing", "barrier", "loss", "contact"):
        assert ledger[name] >= -1e-9 * ledger["initial"], name
    scale = scene.bit.mass * 10.0 + np.abs(seen["bit_impulse"]).max()
    check_momentum(seen, scene, scale)
    check_forces(seen, scene)
    check_events(simulation.events, scene)
    assert simulation.statistics().get("locked", 0) == 0
