"""Fixtures that several suites share."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from percussion_model import Result, Scene, simulate

# How long an example takes says nothing on a machine that others use too.
settings.register_profile("shared", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared")

# Tables of blows are shared like compiled kernels, and never the user's own.
os.environ.setdefault(
    "PERCUSSION_CACHE",
    str(Path(os.environ.get("NUMBA_CACHE_DIR") or tempfile.gettempdir()) / "percussion_maps"),
)


@pytest.fixture(scope="session")
def reference() -> Result:
    """Four seconds of the reference drill, one of them to settle."""
    return simulate(Scene(), 4.0, settle=1.0)
