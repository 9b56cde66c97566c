"""Fixtures that several suites share."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings

from percussion_model import Result, Scene, simulate

# How long an example takes says nothing on a machine that others use too.
settings.register_profile("shared", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared")


@pytest.fixture(scope="session")
def reference() -> Result:
    """Four seconds of the reference drill, one of them to settle."""
    return simulate(Scene(), 4.0, settle=1.0)
