"""Error against computing time: references with error bars, ladders of methods, orders."""

from __future__ import annotations

from percussion_model.verification.accuracy.references import Reference, find_reference
from percussion_model.verification.accuracy.study import Point, Study, study

__all__ = ["Point", "Reference", "Study", "find_reference", "study"]
