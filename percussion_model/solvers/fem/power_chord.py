"""Loading by the power law in a step of elements: a straight line over the way ahead.

The line does the work of the law between the penetration at the start of a step and that to
which the present velocity leads.
"""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, kernel
from percussion_model.physics.power_law import loading_force, loading_work
from percussion_model.physics.rock import is_loading, origin, stiffness

# A line is no shorter than this share of the reference penetration: where the bit turns, it is
# the tangent.
SHORTEST = 1e-6


@inlined
def has_chord(par, s):
    """Whether the rock is followed by a line."""
    return par.power == 1 and is_loading(s)


@kernel
def take_chord(par, s, h):
    """Take the line of a step of length `h` [s] from the present state."""
    if has_chord(par, s):
        a = s.p
        b = a + max(s.v_end * h, SHORTEST * par.reference_penetration)
        s.chord_stiffness = (loading_force(par, s, b) - loading_force(par, s, a)) / (b - a)
        mean = (loading_work(par, s, b) - loading_work(par, s, a)) / (b - a)
        s.chord_origin = 0.5 * (a + b) - mean / s.chord_stiffness


@inlined
def rock_stiffness(par, s):
    """K of the present step [N/m]."""
    return s.chord_stiffness if has_chord(par, s) else stiffness(s)


@inlined
def rock_origin(par, s):
    """P_R of the present step [m]."""
    return s.chord_origin if has_chord(par, s) else origin(s)


@inlined
def chord_work(s, p_before):
    """Work on the rock along the line from `p_before` to now [J]."""
    return s.chord_stiffness * (s.p - p_before) * (0.5 * (s.p + p_before) - s.chord_origin)
