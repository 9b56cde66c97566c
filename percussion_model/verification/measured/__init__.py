"""Published experiments: what was measured, and criteria that were fixed before any run."""

from percussion_model.verification.measured.experiments import (
    Experiment,
    ExperimentError,
    FitPlan,
    Measurement,
    Variant,
    load,
    read_experiment,
    stored,
    wanted,
)
from percussion_model.verification.measured.quantities import QUANTITIES, Quantity

__all__ = [
    "QUANTITIES",
    "Experiment",
    "ExperimentError",
    "FitPlan",
    "Measurement",
    "Quantity",
    "Variant",
    "load",
    "read_experiment",
    "stored",
    "wanted",
]
