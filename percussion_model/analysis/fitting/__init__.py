"""Fits to measurements: parameters of the rock, with intervals."""

from __future__ import annotations

from percussion_model.analysis.fitting.curve import slow_force
from percussion_model.analysis.fitting.fit import RANGES, fit_rock
from percussion_model.analysis.fitting.found import Estimate, Explained, Fit, Rival
from percussion_model.analysis.fitting.measurements import (
    QUANTITIES,
    SIGNALS,
    Curve,
    DropTest,
    FitError,
    Reading,
)
from percussion_model.analysis.fitting.predictions import drop_test_signal

__all__ = [
    "QUANTITIES",
    "RANGES",
    "SIGNALS",
    "Curve",
    "DropTest",
    "Estimate",
    "Explained",
    "Fit",
    "FitError",
    "Reading",
    "Rival",
    "drop_test_signal",
    "fit_rock",
    "slow_force",
]
