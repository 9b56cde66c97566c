"""Roots of the cubic with given values and slopes at 0 and 1."""

from __future__ import annotations

from percussion_model.physics.kernel import inlined, merged

# Halvings that find a root to rounding.
HALVINGS = 50


@inlined
def cubic(q0, d0, q1, d1, t):
    """Hermite's cubic at `t` between 0 and 1."""
    rise = q1 - q0
    b = 3.0 * rise - 2.0 * d0 - d1
    a = d0 + d1 - 2.0 * rise
    return q0 + t * (d0 + t * (b + t * a))


@merged
def lowest_inside(q0, d0, q1, d1):
    """Where a cubic that falls at 0 and rises at 1 turns between."""
    low = 0.0
    high = 1.0
    rise = q1 - q0
    b = 3.0 * rise - 2.0 * d0 - d1
    a = d0 + d1 - 2.0 * rise
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        if d0 + t * (2.0 * b + 3.0 * a * t) < 0.0:
            low = t
        else:
            high = t
    return low


@merged
def first_root(q0, d0, q1, d1):
    """First place between 0 and 1 where a cubic goes below zero, 2 where it does not."""
    high = 1.0
    if q1 >= 0.0:
        if d0 >= 0.0 or d1 <= 0.0:
            return 2.0
        high = lowest_inside(q0, d0, q1, d1)
        if cubic(q0, d0, q1, d1, high) >= 0.0:
            return 2.0
    low = 0.0
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        if cubic(q0, d0, q1, d1, t) < 0.0:
            high = t
        else:
            low = t
    return high
