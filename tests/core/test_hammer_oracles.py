"""Drive, drop and momentum of the whole hammer against closed forms (oracles of docs/model.md)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from bare_scenes import F_S, G

from percussion_model import EventKind, Scene, Section, Simulation

# ------------------------------------------------- oracle 7: piston over a bit held still


def test_pressure_law_over_a_bit_held_still():
    """Eq. 12 of the paper, without gravity, over a bit so heavy that it stays at rest."""
    f_0, d_1, v_0 = 3000.0, 0.040, -3.0
    scene = Scene().replace(
        **{
            "effects.gravity": False,
            "effects.feed": False,
            "effects.loss": False,
            "effects.rock": "none",
            "bit.sections": (Section(length=100.0, area=10.0, density=1e5, youngs_modulus=1e13),),
            "drive.force": f_0,
            "drive.reversal_distance": d_1,
            "start.piston_velocity": v_0,
            "start.gap": 0.0,
            "start.drive_direction": -1,
            "run.settle": 0.0,
            "solver.cells": 1,
        }
    )
    m_p = scene.piston.mass
    simulation = Simulation(scene)
    simulation.advance(0.15)
    mu = m_p * v_0**2 / (2 * f_0 * d_1)
    blow = simulation.blows[0]
    v_3 = math.sqrt(f_0 * d_1 / m_p) * math.sqrt(4 + 2 * mu)
    factor = math.sqrt(4 + 2 * mu) + 2 * math.sqrt(2 * mu + 2) - math.sqrt(2 * mu)
    t_3 = math.sqrt(d_1 * m_p / f_0) * factor
    assert blow["impact_velocity"] == pytest.approx(v_3, rel=1e-6)
    assert blow["time"] == pytest.approx(t_3, rel=1e-6)
    assert v_3 == pytest.approx(8.51639, rel=1e-6)
    assert t_3 == pytest.approx(46.0535e-3, rel=1e-6)


# ------------------------------------------------------------------ oracle 9: drop test


@pytest.mark.parametrize(("solver", "leaps"), [("wave", True), ("modal", True), ("modal", False)])
def test_drop_of_the_bit(solver, leaps):
    scene = Scene().replace(
        **{
            "solver.name": solver,
            "piston.model": "absent",
            "effects.drive": "none",
            "start.bit_velocity": 5.25,
            "solver.leaps": leaps,
            "solver.cells": 46,
            "run.settle": 0.0,
        }
    )
    simulation = Simulation(scene)
    simulation.advance(0.1)
    events = simulation.events
    contact = events[0]
    a = G + F_S / scene.bit.mass
    fall = 2e-5 / (5.25 + math.sqrt(5.25**2 + 2 * a * 1e-5))
    assert contact["kind"] == EventKind.MODE_DFC
    # body forces of waves act step by step; modes find an event to a tick of 1024 a step
    tick = simulation.solver.time_step / 1024 if solver == "modal" else 0.0
    assert contact["time"] == pytest.approx(fall, rel=1e-5, abs=tick)
    assert contact["time"] == pytest.approx(1.9047e-6, rel=1e-4, abs=tick)
    assert np.count_nonzero(events["kind"] == EventKind.MODE_DFC) == 6
    assert simulation.observe()["bit_end_position"] == pytest.approx(0.8622e-3, rel=1e-3)


# ------------------------------------------------------------------ oracle 8: impulses


def momentum_of(seen, mass_p, mass_b):
    return mass_p * seen["piston_velocity"] + mass_b * seen["bit_velocity"]


def test_impulse_balance(reference):
    """Impulses between any two times differ by the stored momentum, by nothing else."""
    scene = reference.scene
    m_p, m_b = scene.piston.mass, scene.bit.mass
    simulation = Simulation(scene)
    seen = simulation.sample(np.linspace(0.0, 1.0, 1001))
    t = seen["time"]
    stored = momentum_of(seen, m_p, m_b)
    given = (F_S + (m_p + m_b) * G) * t + seen["drive_impulse"] - seen["bit_impulse"]
    scale = seen["bit_impulse"][-1]
    np.testing.assert_allclose(stored - stored[0], given, atol=1e-9 * scale)
    of_piston = m_p * G * t + seen["drive_impulse"] - seen["contact_impulse"]
    piston = m_p * seen["piston_velocity"]
    np.testing.assert_allclose(piston - piston[0], of_piston, atol=1e-9 * scale)


def test_mean_forces_over_whole_blows(reference):
    """Oracle 8 over the counted blows: what is left is the momentum of one blow start."""
    rows = reference.counted
    m_p, m_b = reference.scene.piston.mass, reference.scene.bit.mass
    time = rows["period"].sum()
    drive = rows["drive_impulse"].sum() / time
    rock = F_S + (m_p + m_b) * G + drive
    contact = m_p * G + drive
    assert reference.mean_bit_force == pytest.approx(rock, rel=1e-4)
    assert reference.mean_contact_force == pytest.approx(contact, rel=1e-4)
