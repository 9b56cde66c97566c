"""Between two looks at the rock end: forces, turns and work that neither look tells.

The velocity of the rock end goes like the parabola that has its values at the looks and the way
between them (docs/modal.md, section 5).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.physics.kernel import inlined
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import REST_VELOCITY, damping, stiffness


class End(NamedTuple):
    """The rock end at some time."""

    p: float  # penetration [m]
    speed: float  # [m/s]
    force: float  # of the rock [N]


class Parabola(NamedTuple):
    """first + slope x + bend x^2: a growth in each time between looks, at a share x of that."""

    first: float
    slope: float
    bend: float


@inlined
def parabola(first, last, mean):
    """The one with these values at two looks and this mean between them."""
    bend = 3.0 * (first + last - 2.0 * mean)
    return Parabola(first, last - first - bend, bend)


@inlined
def value_at(x, before, rate):
    """What grows at a rate between two looks, at a share of the time between them."""
    return before + x * (rate.first + x * (0.5 * rate.slope + x * rate.bend / 3.0))


@inlined
def least_at(rate):
    """Share of the time between two looks at which what falls, then rises is least.

    Parameters
    ----------
    rate : Parabola
        How fast it grows, below zero first and above it last.
    """
    root = math.sqrt(max(0.0, rate.slope * rate.slope - 4.0 * rate.bend * rate.first))
    if rate.slope < 0.0:
        return 0.5 * (root - rate.slope) / rate.bend
    return -2.0 * rate.first / (rate.slope + root)


@inlined
def falls_below(before, slope, then, slope_then):
    """Where between two looks something falls below zero that is not at either.

    Parameters
    ----------
    before, then : float
        What it is at the looks.
    slope, slope_then : float
        How much it grows there in the time between them; in between like a parabola.

    Returns
    -------
    float
        Share of the time between them at which it is least, or shortly before; 0 where it stays
        above zero.
    """
    if not slope < 0.0 < slope_then:
        return 0.0
    rate = parabola(slope, slope_then, then - before)
    at = least_at(rate)
    least = value_at(at, before, rate)
    if not least < 0.0:
        return 0.0
    # about half way from where it passes zero
    return at * (1.0 - 0.5 * math.sqrt(least / (least - before)))


@inlined
def force_rates(s, one, other, h):
    """How much the force of the rock grows in `h` at two looks so far apart [N]."""
    way = parabola(h * one.speed, h * other.speed, other.p - one.p)
    K, lag = stiffness(s), damping(s) / h
    return K * way.first + lag * way.slope, K * h * other.speed + lag * (way.slope + 2.0 * way.bend)


class Top(NamedTuple):
    """Force of the rock between two looks."""

    first: float  # at the one [N]
    last: float  # at the other
    rate: Parabola  # of its growth in between [N]
    at: float  # share of the time between them at which it is greatest
    peak: float  # then [N]


@inlined
def top_between(s, one, other, h):
    """Make out the greatest force of the rock between two looks `h` apart."""
    slope, then = force_rates(s, one, other, h)
    rate = parabola(slope, then, other.force - one.force)
    at, peak = 1.0, other.force
    if slope > 0.0 > then:
        at = least_at(Parabola(-rate.first, -rate.slope, -rate.bend))
        peak = max(peak, value_at(at, one.force, rate))
    return Top(one.force, other.force, rate, at, peak)


@inlined
def late_peak(s, end, h, top):
    """Greatest force after s.peak_from between two looks, the later at `end`, `h` apart [N]."""
    after = end - s.peak_from
    if not after > 0.0:
        return 0.0
    begin = 1.0 - min(after / h, 1.0)
    late = max(top.last, value_at(begin, top.first, top.rate))
    return max(late, top.peak) if begin <= top.at else late


@inlined
def turns_between(s, one, other, h):
    """Where between two looks the mode of the rock ends though it goes on at both.

    Parameters
    ----------
    one, other : End
        The rock end at looks that are `h` apart.

    Returns
    -------
    float
        Share of the time between them; 0 where the mode does not end.
    """
    if s.time < s.rest_until:
        return 0.0
    if s.mode == Mode.FF:
        return falls_below(s.p_u - one.p, -h * one.speed, s.p_u - other.p, -h * other.speed)
    if s.mode == Mode.SS:
        slope, then = force_rates(s, one, other, h)
        return falls_below(one.force, slope, other.force, then)
    way = parabola(h * one.speed, h * other.speed, other.p - one.p)
    sign = -1.0 if s.mode == Mode.BC else 1.0
    slope, bend = sign * way.slope, sign * way.bend
    if not 0.0 < -slope < 2.0 * bend:
        return 0.0
    if sign * way.first - slope * slope / (4.0 * bend) >= -REST_VELOCITY * h:
        return 0.0
    return -0.5 * slope / bend


@inlined
def squared_between(one, other, h):
    """Integral of the squared velocity of the rock end between two looks `h` apart [m2/s]."""
    first, slope, bend = parabola(one.speed, other.speed, (other.p - one.p) / h)
    even = first * first + (slope * slope + 2.0 * first * bend) / 3.0 + 0.2 * bend * bend
    return h * (even + slope * (first + 0.5 * bend))


@inlined
def late_force(s, end, h, first, last):
    """Greatest force after s.peak_from of one that goes straight for `h` until a time [N]."""
    after = end - s.peak_from
    if not after > 0.0:
        return 0.0
    return max(last, last + (first - last) * min(after / h, 1.0))
