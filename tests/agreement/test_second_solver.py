"""Waves and modes against a chain of masses and springs that shares no code with them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from percussion_model import Scene, simulate

sys.path.insert(0, str(Path(__file__).parent))
import lumped_chain

DURATION, SETTLE = 0.55, 0.2


@pytest.fixture(scope="module")
def chain():
    drill = lumped_chain.Drill(piston_elements=100, bit_elements=115, contact_stiffness=1e13)
    return lumped_chain.solve(drill, drill.stable_step, DURATION, SETTLE)


@pytest.mark.parametrize("solver", ["wave", "modal"])
def test_rate_and_period_agree_with_the_lumped_chain(solver, chain):
    """Over the same blows; both are converged to less than what is allowed here."""
    scene = Scene().computed_by(solver, **{"solver.cells": 40})
    found = simulate(scene, DURATION, settle=SETTLE)
    assert len(found.counted) == chain.blows
    assert found.rate_of_penetration == pytest.approx(chain.rate_of_penetration, rel=1e-3)
    assert found.summary()["blow_period"] == pytest.approx(chain.period, rel=5e-4)
    assert found.summary()["contacts_per_blow"] == chain.contacts_per_blow
