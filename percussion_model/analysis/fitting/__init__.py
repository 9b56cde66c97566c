"""Fits to measurements: parameters of the rock, with confidence intervals."""

from __future__ import annotations

from percussion_model.analysis.fitting.drop_test import (
    BARRIER,
    ROCK,
    DropTest,
    drop_test_signal,
    fit_drop_tests,
)
from percussion_model.analysis.fitting.force_penetration import (
    bilinear_force,
    fit_force_penetration,
)
from percussion_model.analysis.fitting.least_squares import Estimate, Fit, FitError

__all__ = [
    "BARRIER",
    "ROCK",
    "DropTest",
    "Estimate",
    "Fit",
    "FitError",
    "bilinear_force",
    "drop_test_signal",
    "fit_drop_tests",
    "fit_force_penetration",
]
