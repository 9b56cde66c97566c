"""The wave solver against a chain of masses and springs that shares no code with it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from percussion_model import Scene, simulate

sys.path.insert(0, str(Path(__file__).parent))
import lumped_chain

DURATION, SETTLE = 0.55, 0.2


def test_rate_and_period_agree_with_the_lumped_chain():
    """Over the same blows; both are converged to less than what is allowed here."""
    drill = lumped_chain.Drill(piston_elements=100, bit_elements=115, contact_stiffness=1e13)
    chain = lumped_chain.solve(drill, drill.stable_step, DURATION, SETTLE)
    waves = simulate(Scene().replace(**{"solver.cells": 40}), DURATION, settle=SETTLE)
    assert len(waves.counted) == chain.blows
    assert waves.rate_of_penetration == pytest.approx(chain.rate_of_penetration, rel=1e-3)
    assert waves.summary()["blow_period"] == pytest.approx(chain.period, rel=5e-4)
    assert waves.summary()["contacts_per_blow"] == chain.contacts_per_blow
