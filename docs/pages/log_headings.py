"""Headings and units of drilling logs that `percussion identify` knows."""

from __future__ import annotations

from docs.blocks import Made
from percussion_model.analysis.identify.cleaning import COLUMNS
from percussion_model.interface.csv_tables import UNITS
from percussion_model.interface.drill_log import NAMES, SPELLED, USUAL
from percussion_model.simulation.markdown import table


def page() -> str:
    """Our names, what rigs call them, and units."""
    rows = []
    for name, si in COLUMNS.items():
        units = [*UNITS[si], *SPELLED.get(si, {})]
        without = f"; {USUAL[name]} if none is given" if name in USUAL else ""
        rows.append((f"`{name}`", ", ".join(NAMES[name]), ", ".join(units) + without))
    text = table(("column", "headings, in any case", "units"), rows)
    return f"# Headings and units of drilling logs\n\n{text}"


def made() -> Made:
    """The page."""
    return Made(texts={"data/log_headings.md": page()})
