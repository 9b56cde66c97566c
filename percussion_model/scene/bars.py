"""Numbers that follow from the sections of a bar.

A section is a row of length [m], cross-section [m^2], Young's modulus [Pa] and density
[kg/m^3]; a bar is such rows from top to bottom, as an array (n, 4) or as tuples. Their
numbers are taken as plain floats, which overflow without a warning and are quicker.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

LENGTH, AREA, YOUNGS_MODULUS, DENSITY = range(4)


def section_wave_speed(section: Any) -> float:
    """Speed of longitudinal waves, sqrt(E/rho) [m/s]."""
    return math.sqrt(float(section[YOUNGS_MODULUS]) / float(section[DENSITY]))


def section_impedance(section: Any) -> float:
    """Force per particle velocity of a wave, A sqrt(E rho) [N s/m]."""
    return float(section[AREA]) * math.sqrt(
        float(section[YOUNGS_MODULUS]) * float(section[DENSITY])
    )


def section_mass(section: Any) -> float:
    """Mass [kg]."""
    return float(section[DENSITY]) * float(section[AREA]) * float(section[LENGTH])


def section_transit_time(section: Any) -> float:
    """Time a wave takes from end to end [s]."""
    return float(section[LENGTH]) / section_wave_speed(section)


def bar_mass(sections: Any) -> float:
    """Mass [kg]."""
    total = rest = 0.0
    for section in _plain(sections):
        total, rest = add(total, rest, section_mass(section))
    return total + rest


def bar_length(sections: Any) -> float:
    """Length [m]."""
    total = rest = 0.0
    for section in _plain(sections):
        total, rest = add(total, rest, float(section[LENGTH]))
    return total + rest


def bar_transit_time(sections: Any) -> float:
    """Time a wave takes from end to end [s]."""
    total = rest = 0.0
    for section in _plain(sections):
        total, rest = add(total, rest, section_transit_time(section))
    return total + rest


def bar_compliance(sections: Any) -> float:
    """Shortening by a force that is the same along the bar, sum of length / (E A) [m/N]."""
    return sum(float(s[LENGTH]) / (float(s[YOUNGS_MODULUS]) * float(s[AREA])) for s in sections)


def _plain(sections: Any) -> Any:
    """The rows as lists of floats: those of an array are slow to take one by one."""
    return sections.tolist() if isinstance(sections, np.ndarray) else sections


def add(total: float, rest: float, term: float) -> tuple[float, float]:
    """Add to a sum of two floats, the second of which is what the first rounds off."""
    rounded = total + term
    shift = rounded - total
    lost = (total - (rounded - shift)) + (term - shift)
    return rounded, rest + lost
