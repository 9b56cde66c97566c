"""Restitution of rigid piston and bit: given, or that of elastic bars after St Venant."""

from __future__ import annotations

import math

from percussion_model.physics.records import Piston
from percussion_model.scene.bars import bar_mass, bar_transit_time
from percussion_model.scene.numbers import Numbers
from percussion_model.solvers.setup import PISTONS, Bit


def st_venant_restitution(
    piston_mass: float, piston_transit: float, bit_mass: float, bit_transit: float
) -> float:
    """Restitution of two free elastic bars after their contact (docs/model.md, eq. 23).

    The shorter bar sends a rectangular wave of force Z_c v into the longer one for twice
    its own transit time. With equal impedances this is the ratio of the lengths.

    Parameters
    ----------
    piston_mass, bit_mass : float
        Masses [kg].
    piston_transit, bit_transit : float
        Times that a wave takes from end to end [s].

    Returns
    -------
    float
        Between 0 and 1.
    """
    z_p = piston_mass / piston_transit
    z_b = bit_mass / bit_transit
    impulse = 2.0 * min(piston_transit, bit_transit) * z_p * z_b / (z_p + z_b)
    e = impulse * (1.0 / piston_mass + 1.0 / bit_mass) - 1.0
    return min(max(e, 0.0), 1.0)


def restitution(numbers: Numbers) -> float:
    """Coefficient of restitution of piston and bit, NaN without a piston."""
    values = numbers.values
    if PISTONS[values.piston_model] == Piston.ABSENT:
        return math.nan
    if values.bit_model == Bit.RIGID and not math.isnan(values.contact_restitution):
        return float(values.contact_restitution)
    return st_venant_restitution(
        bar_mass(numbers.piston),
        bar_transit_time(numbers.piston),
        bar_mass(numbers.bit),
        bar_transit_time(numbers.bit),
    )
