"""Loading stiffness of a spherical button, derived from the strength of the rock.

The rock under the button is taken as fully plastic: the mean pressure is a factor times the
compressive strength. At a penetration p, small beside the radius R, the button has the area
2 pi R p, so the force is linear in p.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from percussion_model.scene.rocks import STIFFNESS, Rock, rock, rocks


def button_stiffness(radius: float, strength: float, factor: float) -> float:
    """Return the loading stiffness of one button [N/m].

    Parameters
    ----------
    radius : float
        Of the button [m].
    strength : float
        Compressive strength of the rock [Pa].
    factor : float
        Mean pressure divided by the strength.
    """
    return 2.0 * math.pi * radius * factor * strength


def pressure_factor(chosen: Rock) -> float | None:
    """Return the factor that a rock has; None where no slope, radius or strength is known."""
    known = chosen.number(STIFFNESS)
    if known.kind not in ("measured", "computed"):
        return None
    if chosen.buttons is None or chosen.button_radius is None or chosen.strength is None:
        return None
    unit = button_stiffness(chosen.button_radius, chosen.strength.value, 1.0)
    return known.value / (chosen.buttons * unit)


def pressure_factors(chosen: Iterable[Rock] | None = None) -> dict[str, float]:
    """Return the factors of all rocks that have one, by name."""
    found = {one.name: pressure_factor(one) for one in chosen or map(rock, rocks())}
    return {name: factor for name, factor in found.items() if factor is not None}


def mean_factor(factors: Iterable[float]) -> float:
    """Return the geometric mean."""
    logarithms = [math.log(one) for one in factors]
    return math.exp(sum(logarithms) / len(logarithms))


def derived_stiffness(radius: float, strength: float, low: float, high: float) -> list[float]:
    """Return value, low and high of the loading stiffness of one button [N/m].

    Low and high have the least and the greatest factor of the rocks with a slope.

    Parameters
    ----------
    radius : float
        Of the button [m].
    strength, low, high : float
        Compressive strength of the rock, and its interval [Pa].
    """
    factors = pressure_factors().values()
    pairs = ((strength, mean_factor(factors)), (low, min(factors)), (high, max(factors)))
    return [button_stiffness(radius, value, factor) for value, factor in pairs]
