"""What the page of a study can show of each point."""

from __future__ import annotations

import numpy as np
from bokeh.models import Select

from percussion_model.analysis.study import Study

# What can be shown: column of the page, name, unit, column of a study, factor from SI.
QUANTITIES = (
    ("rate", "Rate of penetration", "mm/s", "rate_of_penetration", 1e3),
    ("error", "Relative error of the rate", "–", "", 1.0),
    ("period", "Blow period", "ms", "blow_period", 1e3),
    ("impact", "Impact velocity", "m/s", "impact_velocity", 1.0),
    ("stroke", "Stroke", "mm", "stroke", 1e3),
    ("energy", "Blow energy", "J", "blow_energy", 1.0),
    ("given", "Energy into the rock, per blow", "J", "rock_energy", 1.0),
    ("advance", "Penetration per blow", "mm", "penetration_per_blow", 1e3),
    ("bit_force", "Greatest bit force", "kN", "peak_bit_force", 1e-3),
    ("contact_force", "Greatest contact force", "kN", "peak_contact_force", 1e-3),
    ("contacts", "Contacts per blow", "–", "contacts_per_blow", 1.0),
    ("cycles", "Drilling cycles per blow", "–", "drilling_cycles_per_blow", 1.0),
    ("order", "Blows of a cycle", "–", "order", 1.0),
)


def columns(found: Study) -> dict[str, np.ndarray]:
    """What the page carries of each point, in the units that it shows."""
    rows = found.rows
    return {
        name: np.asarray(
            (rows[field] if field else found.relative_error) * factor, dtype=np.float32
        )
        for name, _, _, field, factor in QUANTITIES
    }


def labelled(key: str, unit: str) -> str:
    """Key and unit of a parameter."""
    return f"{key} [{unit}]".replace("[-]", "[–]").replace("^2", "²").replace("^3", "³")


def titles() -> dict[str, str]:
    """Name and unit of each quantity."""
    return {name: f"{words} [{unit}]" for name, words, unit, _, _ in QUANTITIES}


def choice() -> Select:
    """A list to choose a quantity from."""
    return Select(
        title="Show", name="shown", value="rate", options=list(titles().items()), width=280
    )
