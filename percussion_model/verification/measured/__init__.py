"""Published experiments: what was measured, and criteria that were fixed before any run."""

from percussion_model.verification.measured.comparison import (
    Comparison,
    FoundFit,
    Row,
    VariantRow,
    compare,
)
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
    "Comparison",
    "Experiment",
    "ExperimentError",
    "FitPlan",
    "FoundFit",
    "Measurement",
    "Quantity",
    "Row",
    "Variant",
    "VariantRow",
    "compare",
    "load",
    "read_experiment",
    "stored",
    "wanted",
]
