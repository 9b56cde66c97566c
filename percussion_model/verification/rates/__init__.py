"""Published drilling rates beside predicted ones, with criteria that were fixed before any run."""

from percussion_model.verification.rates.cases import (
    Case,
    Crater,
    Stored,
    stored_cases,
)
from percussion_model.verification.rates.comparison import RateRow, Rates, compare_rates

__all__ = ["Case", "Crater", "RateRow", "Rates", "Stored", "compare_rates", "stored_cases"]
