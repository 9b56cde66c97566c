"""The nastiest scenes that the model has, and what every solver makes of them."""

from percussion_model.verification.hard_cases.cases import SOLVERS, HardCase, hard_cases
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
