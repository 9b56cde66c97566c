"""Loading by the power law as straight lines, on which rigid bodies move in closed form.

Lines follow each other at fixed penetrations, so that a run does not depend on how it is cut
into calls. Each does the work of the law over its range: errors of the motion are of fourth
order in the ratio of its ends, and jumps of the force where lines meet of second.
"""

from __future__ import annotations

import math

from percussion_model.physics.elementary import exp, log
from percussion_model.physics.kernel import kernel
from percussion_model.physics.power_law import (
    CHIPPING_SLOPE,
    is_chipping,
    is_reloading,
    loading_force,
    loading_part,
    loading_work,
    next_kink,
)
from percussion_model.physics.rock import is_loading

# Ratio of the ends of a line. The first goes from nothing to this share of the reference
# penetration, or to where rock has this share of its stiffness there: on a softer line the bit
# would swing about a place so far away that its motion had no digits left.
RATIO, FIRST, SOFTEST = 1.02, 1e-3, 1e-4
# A penetration so close below the end of a line is there, as a share of it.
CLOSE = 1e-9
# More lines than this reach beyond what any blow does.
MOST_LINES = 1000


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
    s.line_stiffness = (loading_force(par, s, b) - loading_force(par, s, a)) / (b - a)
    mean = (loading_work(par, s, b) - loading_work(par, s, a)) / (b - a)
    s.line_origin = 0.5 * (a + b) - mean / s.line_stiffness
    s.line_end = b if line < MOST_LINES else math.inf


@kernel
def begin_loading(par, s):
    """Take the line of the present penetration, where a drilling cycle by the power law begins."""
    if par.power == 1 and is_loading(s):
        take_line(par, s)


@kernel
def line_work(s, p_before):
    """Work on the rock along the present line from `p_before` to now [J]."""
    return s.line_stiffness * (s.p - p_before) * (0.5 * (s.p + p_before) - s.line_origin)
