"""Fixtures that several suites share."""

from __future__ import annotations

import pytest

from percussion_model import Result, Scene, simulate


@pytest.fixture(scope="session")
def reference() -> Result:
    """Four seconds of the reference drill, one of them to settle."""
    return simulate(Scene(), 4.0, settle=1.0)
