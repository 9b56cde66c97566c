"""Air as an ideal gas: flow through orifices, and volumes with mass and energy as their state.

With mass and energy as state the balances of a volume are linear in what flows, so that any
Runge-Kutta step keeps them to rounding (docs/model.md, eqs 13a, 13b).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.physics.kernel import LEAST_DIVISOR, inlined

# Gas constant of air [J/(kg K)], and the ratio of its specific heats.
AIR, RATIO = 287.05, 1.4
# Free air: dry, at 0 C and 101325 Pa (DIN 1343) [kg/m^3].
FREE_AIR = 1.2923
# Specific heat at constant pressure [J/(kg K)].
HEAT = AIR * RATIO / (RATIO - 1.0)
# Flow below this ratio of pressures is choked, and has the flow function of this ratio.
CRITICAL = (2.0 / (RATIO + 1.0)) ** (RATIO / (RATIO - 1.0))
CHOKED = math.sqrt(RATIO) * (2.0 / (RATIO + 1.0)) ** (0.5 * (RATIO + 1.0) / (RATIO - 1.0))
# Pressures that differ by less than this share are equal.
EQUAL = 1e-9
# Above this ratio the flow function goes straight to zero: its root would have no slope there.
# By 0.999 velocities of impact are others by 3e-5, and gas near the outer pressure takes twice the
# time.
STRAIGHT = 0.995
# r^(2/7) by powers of (r - MIDDLE)/HALF: Chebyshev's series, to 1e-12 from CRITICAL to 1.
MIDDLE, HALF = 0.76, 0.24
SERIES = (
    0.9245847812874018,
    0.08342118326375451,
    -0.009408404117260575,
    0.0016977574222590494,
    -0.0003638052812686033,
    8.534148874834725e-05,
    -2.117444660507673e-05,
    5.466412180421543e-06,
    -1.4497868530582997e-06,
    3.7924311762083114e-07,
    -1.0349015013844109e-07,
    3.9405551888194184e-08,
    -1.1401584742998243e-08,
)
ROOT_7 = math.sqrt(7.0)
_POWERS = STRAIGHT ** (2.0 / RATIO) - STRAIGHT ** (1.0 + 1.0 / RATIO)
AT_STRAIGHT = math.sqrt(2.0 * RATIO / (RATIO - 1.0) * _POWERS)


@inlined
def isentropic(r):
    """Flow function of a ratio of pressures between `CRITICAL` and 1."""
    t = (r - MIDDLE) / HALF
    even = odd = 0.0  # two chains at a time
    square = t * t
    for k in range(len(SERIES) - 1, -1, -2):
        even = even * square + SERIES[k]
    for k in range(len(SERIES) - 2, -1, -2):
        odd = odd * square + SERIES[k]
    y = even + t * odd
    return ROOT_7 * y * y * math.sqrt(max(y * (1.0 - y), 0.0))


@inlined
def flow_function(r):
    """Flow by area, pressure upstream and 1/sqrt(R T), for a ratio of pressures."""
    if r <= CRITICAL:
        return CHOKED
    if r > STRAIGHT:
        return AT_STRAIGHT * (1.0 - r) / (1.0 - STRAIGHT)
    return isentropic(r)


class Volume(NamedTuple):
    """What orifices see of a volume of gas."""

    pressure: float  # [Pa]
    per_pressure: float  # 1/pressure [1/Pa]
    slow: float  # 1/sqrt(R T) [s/m]
    enthalpy: float  # c_p T [J/kg]


@inlined
def volume_of(mass, energy, size, per_size):
    """Look at a mass [kg] with an internal energy [J] in a volume [m^3], and 1/volume."""
    each = RATIO - 1.0
    per_both = 1.0 / (mass * energy)  # the only division
    specific, light = energy * energy * per_both, mass * mass * per_both
    return Volume(
        each * energy * per_size,
        mass * per_both * size / each,
        math.sqrt(each * specific) * light / each,
        RATIO * specific,
    )


@inlined
def reservoir(pressure, temperature):
    """A volume so large that it stays as it is."""
    return Volume(
        pressure,
        1.0 / max(pressure, LEAST_DIVISOR),
        1.0 / math.sqrt(AIR * temperature),
        HEAT * temperature,
    )


class Flow(NamedTuple):
    """What goes through an orifice, from the first volume to the second."""

    mass: float  # [kg/s]
    energy: float  # enthalpy [W]


@inlined
def flow(one, other, area):
    """Flow through an orifice of an effective area, C_d A [m^2]."""
    high, low, sign = one, other, 1.0
    if one.pressure < other.pressure:
        high, low, sign = other, one, -1.0
    through = flow_function(low.pressure * high.per_pressure) * area * high.slow
    mass = sign * through * high.pressure
    return Flow(mass, mass * high.enthalpy)


@inlined
def stiffness(flow, one, other):
    """Bound of what a flow changes in either volume by its pressure in a second [m^3/s].

    By the secant to equal pressures, which is straight near them and twice as steep as the flow
    function elsewhere.
    """
    high, low = max(one.pressure, other.pressure), min(one.pressure, other.pressure)
    steep = 1.0 if low > STRAIGHT * high else 0.5
    return steep * (RATIO - 1.0) * abs(flow.energy) / max(high - low, EQUAL * high)
