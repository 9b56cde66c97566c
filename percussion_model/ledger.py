"""Sums and residual of the energy ledger."""

from __future__ import annotations

import math

WORKS = ("drive", "feed", "gravity")
DISSIPATED = ("crushing", "barrier", "standstill", "loss", "contact")
NUMERICAL = ("numerical", "overshoot")
STORED = ("kinetic", "elastic", "recoverable")


def complete_ledger(entries: dict[str, float]) -> dict[str, float]:
    """Add sums, residual and relative figures to the entries of a solver [J]."""
    ledger = {"initial": entries["start"]}
    ledger |= {name: entries[name] for name in (*WORKS, *DISSIPATED, *NUMERICAL, *STORED)}
    given = sum(ledger[name] for name in WORKS)
    stored = sum(ledger[name] for name in STORED)
    dissipated = sum(ledger[name] for name in DISSIPATED)
    apart = sum(ledger[name] for name in NUMERICAL)
    residual = ledger["initial"] + given - stored - dissipated - apart
    scale = abs(ledger["initial"]) + sum(abs(ledger[name]) for name in WORKS)
    ledger |= {"input": given, "stored": stored, "dissipated": dissipated, "residual": residual}
    for name in (*NUMERICAL, "residual"):
        ledger[f"{name}_relative"] = ledger[name] / scale if scale > 0 else math.nan
    return {name: float(value) for name, value in ledger.items()}
