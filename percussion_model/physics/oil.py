"""Hydraulic oil with entrained air: what fills a volume, flow through orifices, gas under oil.

What is kept of a volume is its filling: the oil in it, by the volume that it would have with its
air at the reference pressure. So what flows is neither lost nor won (docs/model.md, eqs 13d, 13e).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.physics.elementary import exp, log
from percussion_model.physics.kernel import inlined

# Pressure of the surroundings, at which fillings and the share of air are told [Pa].
REFERENCE = 101325.0
# A volume with less of a filling counts as having this share.
LEAST_SHARE = 1e-6


@inlined
def pressure_of(filling, size, bulk, air, least):
    """Pressure of oil with a share of air in a volume [Pa], no less than that of its vapour.

    Oil follows its bulk modulus, air is isothermal: p is the positive root of
    (1 - a) (p - p_0) p/B + (V/V_0 - 1 + a) p = a p_0 (docs/model.md, eq. 13d).
    """
    square = (1.0 - air) / bulk
    line = size / max(filling, LEAST_SHARE * size) - (1.0 - air) - square * REFERENCE
    root = math.sqrt(line * line + 4.0 * square * air * REFERENCE)
    if line > 0.0:  # the other form would cancel
        return max(2.0 * air * REFERENCE / (line + root), least)
    return max((root - line) / (2.0 * square), least)


@inlined
def filling_of(pressure, size, bulk, air):
    """What has a pressure in a volume [m^3]."""
    oil = (1.0 - air) * (1.0 - (pressure - REFERENCE) / bulk)
    return size / (oil + air * REFERENCE / pressure)


@inlined
def compliance(pressure, filling, size, bulk, air, least):
    """How much a filling grows with pressure [m^3/Pa]; that of vapour as if it were a gas."""
    softness = (1.0 - air) / bulk + air * REFERENCE / (pressure * pressure)
    return size / least if pressure <= least else softness * filling * filling / size


class Orifice(NamedTuple):
    """What goes through an orifice."""

    flow: float  # [m^3/s]
    slope: float  # how it grows with the difference of pressures [m^3/(s Pa)]


@inlined
def orifice(drop, wide, straight):
    """Flow by a difference of pressures, Q = k d/(d^2 + s^2)^(1/4) (docs/model.md, eq. 13e).

    Parameters
    ----------
    drop : float
        d: difference of pressures [Pa].
    wide : float
        k = C_d A sqrt(2/rho) [m^3/(s Pa^(1/2))].
    straight : float
        s: below it the flow grows straight [Pa].
    """
    both = drop * drop + straight * straight
    by_drop = wide / math.sqrt(math.sqrt(both))
    return Orifice(by_drop * drop, by_drop * (1.0 - 0.5 * drop * drop / both))


@inlined
def drop_for(flow, wide, straight):
    """Difference of pressures at which `orifice` has a flow [Pa]."""
    square = flow * flow / (wide * wide)
    both = square + math.sqrt(square * square + 4.0 * straight * straight)
    return math.copysign(math.sqrt(0.5 * square * both), flow)


@inlined
def gas_pressure(precharge, whole, size, exponent):
    """Pressure of the gas of an accumulator that oil has pressed into a part of the whole [Pa]."""
    return precharge * exp(exponent * log(whole / size))


class Weights(NamedTuple):
    """What stages of a step of y' = n(y) - l y count for y, by exponentials of z = -l h."""

    fades: float  # e^(z/2)
    half: float  # of one stage over half the step [s]
    first: float  # of the stages over the whole [s]
    middle: float
    last: float


@inlined
def weights_of(z, h):
    """Weights of Cox and Matthews' fourth-order step; those of Runge and Kutta where z is small.

    S. M. Cox, P. C. Matthews, J. Comput. Phys. 176 (2002) 430.
    """
    fades = exp(0.5 * z)
    e, by = fades * fades, h / (z * z * z)
    return Weights(
        fades,
        h * (fades - 1.0) / z,
        by * (e * (4.0 - 3.0 * z + z * z) - 4.0 - z),
        2.0 * by * (2.0 + z + e * (z - 2.0)),
        by * (e * (4.0 - z) - 4.0 - 3.0 * z - z * z),
    )
