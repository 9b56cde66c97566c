"""Hard cases: the nastiest scenes of the model, run by every solver."""

from percussion_model.verification.hard_cases.cases import (
    SOLVERS,
    HardCase,
    hard_cases,
)
from percussion_model.verification.hard_cases.collection import Collection, run_collection
from percussion_model.verification.hard_cases.measures import Measures, measure

__all__ = [
    "SOLVERS",
    "Collection",
    "HardCase",
    "Measures",
    "hard_cases",
    "measure",
    "run_collection",
]
