"""Straight lines in place of the curved loading of the rock.

Each does the work of the law between its ends (docs/model.md, eqs 20b to 20e). Solvers with steps
take one over the way of a step. Those that go from event to event take lines that follow each
other at fixed penetrations, so that a run does not depend on how it is cut into calls: errors of
the motion are of fourth order in the ratio of their ends, and jumps of the force where they meet
of second.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from percussion_model.physics.elementary import exp, log
from percussion_model.physics.kernel import inlined, kernel
from percussion_model.physics.power_law import (
    CHIPPING_SLOPE,
    force_and_work,
    is_chipping,
    is_reloading,
    loading_part,
    next_kink,
    recoverable_by_power,
)
from percussion_model.physics.rock import is_loading, origin, stiffness

# A line is no shorter than this share of the reference penetration: where the bit turns, it is
# the tangent.
SHORTEST = 1e-6
# Ratio of the ends of a line. The first goes from nothing to this share of the reference
# penetration, or to where rock has this share of its stiffness there: on a softer line the bit
# would swing about a place so far away that its motion had no digits left.
RATIO, FIRST, SOFTEST = 1.02, 1e-3, 1e-4
# A penetration so close below the end of a line is there, as a share of it.
CLOSE = 1e-9
# More lines than this reach beyond what any blow does.
MOST_LINES = 1000


class Line(NamedTuple):
    """The rock's spring: stiffness (p - origin) is its force [N]."""

    stiffness: float  # [N/m]
    origin: float  # [m]


@inlined
def is_curved(par, s):
    """Whether the present mode of the rock has no straight line of its own."""
    return par.power == 1 and is_loading(s)


@inlined
def present_line(par, s):
    """Line on which the rock is: that of its mode (table 1 of docs/model.md), or the one taken."""
    if is_curved(par, s):
        return Line(s.line_stiffness, s.line_origin)
    return Line(stiffness(s), origin(s))


class Place(NamedTuple):
    """A place on the curve of loading."""

    p: float  # penetration [m]
    force: float  # [N]
    work: float  # up to a constant of the cycle [J]


@inlined
def place_at(par, s, p):
    """Place of a penetration [m]."""
    force, work = force_and_work(par, s, p)
    return Place(p, force, work)


@inlined
def line_between(par, s, one, other):
    """Line that does the work of loading between two places; by the tangent where they are one."""
    least = SHORTEST * par.reference_penetration
    if abs(other.p - one.p) < least:
        other = place_at(par, s, one.p + least)
    way = other.p - one.p
    K, mean = (other.force - one.force) / way, (other.work - one.work) / way
    return Line(K, 0.5 * (one.p + other.p) - mean / K)


@kernel
def take_step_line(par, s, way):
    """Take the line from the present penetration on over a way ahead [m]."""
    if is_curved(par, s):
        here = place_at(par, s, s.p)
        line = line_between(par, s, here, place_at(par, s, s.p + max(way, 0.0)))
        s.line_stiffness, s.line_origin = line.stiffness, line.origin


@inlined
def line_work(line, a, b):
    """Work on the rock along a line between two penetrations [J]."""
    return line.stiffness * (b - a) * (0.5 * (b + a) - line.origin)


@inlined
def crushed_on_line(par, s, line, one, other):
    """What loading crushed from one place to another, between which a line was taken [J]."""
    before = recoverable_by_power(par, s, one.p, one.force)
    change = recoverable_by_power(par, s, other.p, other.force) - before
    return line_work(line, one.p, other.p) - change


@kernel
def first_end(par):
    """Penetration at which the first line ends [m]."""
    share = FIRST
    if par.exponent > 1.0:
        share = max(FIRST, exp(math.log(SOFTEST) / (par.exponent - 1.0)))
    return share * par.reference_penetration


@kernel
def take_line(par, s):
    """Move on a line from the present penetration on.

    Lines have their ends where what loads the rock has those of rock that does not chip, and
    where the rock begins and ends to chip.
    """
    a = s.p
    kink = next_kink(par, s, a)
    if kink - a <= CLOSE * a:
        a = kink
        kink = next_kink(par, s, a)
    if is_reloading(s, a):
        s.line_stiffness, s.line_origin = s.reload_stiffness, s.reload_from
        s.line_end = s.reload_to
        return
    part, first, line = loading_part(par, s, a), first_end(par), 0
    if part > (1.0 - CLOSE) * first:
        place = log(part / first) / math.log(RATIO)
        line = min(int(place + 1.0 + CLOSE / math.log(RATIO)), MOST_LINES)
    way = first * exp(line * math.log(RATIO)) - part
    b = min(a + (way / CHIPPING_SLOPE if is_chipping(par, s, a) else way), kink)
    s.line_stiffness, s.line_origin = line_between(par, s, place_at(par, s, a), place_at(par, s, b))
    s.line_end = b if line < MOST_LINES else math.inf
