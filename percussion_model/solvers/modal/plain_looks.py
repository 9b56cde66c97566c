"""Looks of a whole scan, side by side: through how many of them a mode plainly goes on."""

from __future__ import annotations

import numpy as np

from percussion_model.physics.kernel import inlined
from percussion_model.physics.records import Mode
from percussion_model.solvers.modal.lanes import higher_of, load, lower_of, store, total
from percussion_model.solvers.modal.records import SCAN

# Rows of `Bars.rows` with what a search sees, of the rock end and of the other.
SEEN, SIDE = 2, 6
# And with what it saw from the look before on, where no piston is near.
BEFORE = SIDE
# Share of both velocities that a way is at most beyond both its ends: 4/27, and rounding.
BEYOND = 0.1482
# Of looks, in intervals.
TIMES = np.arange(1.0, SCAN + 1.0).reshape(1, SCAN)


@inlined
def magnitude(lanes):
    """Absolute values."""
    return higher_of(lanes, lanes * -1.0)


@inlined
def room_of_flight(s, p, p_before, both):
    """How far the rock is, at least: a cubic is at most 4/27 of both slopes beyond its ends."""
    return lower_of(p * -1.0, p_before * -1.0) + (s.p_u - both * BEYOND)


@inlined
def room_of_way(s, p, p_before, v, v_before, h):
    """Above zero where the rock end goes on in its way, down or up, from look to look."""
    sign = -1.0 if s.mode == Mode.BC else 1.0
    first, last = v_before * (sign * h), v * (sign * h)
    bend = (first + last - (p - p_before) * (2.0 * sign)) * 3.0
    slope = last - first - bend
    # a parabola that bends upwards has its least value above zero
    turn = higher_of(bend * first * 4.0 - slope * slope, bend * -1.0)
    room = lower_of(lower_of(first, last), turn)
    if s.mode == Mode.BC:
        room = lower_of(room, lower_of(p, p_before) - s.p_u)
    return room


@inlined
def plainly_kept(s, bars, law, h, last, most, spare):
    """How many looks of a whole scan the mode plainly goes on, with no force that counts.

    From one look to the next the velocity is a parabola: in either half it is no further from
    the nearer look's than 1.5 times its mean and both its ends together, nor from zero.

    Parameters
    ----------
    h : float
        Between looks [s].
    last : End
        The rock end where the search is.
    most : float
        Force from which on it counts [N].
    spare : float
        What the dashpot may take by the looks before it may be enough [J].

    Returns
    -------
    kept : int
    taken : float
        By the dashpot, by the looks that are kept [J].
    """
    K, C, rows, work = law.stiffness, law.damping, bars.rows, 0.0
    rows[BEFORE, 0], rows[BEFORE + 1, 0], t = last.p, last.speed, load(TIMES, 0, 0)
    p = load(rows, SEEN, 0) + (s.p + (s.rest_low - s.low)) + t * t * (0.5 * law.pull * h * h)
    v = load(rows, SEEN + 1, 0) + t * (law.pull * h)
    store(rows, BEFORE, 1, p)
    store(rows, BEFORE + 1, 1, v)
    p_before, v_before = load(rows, BEFORE, 0), load(rows, BEFORE + 1, 0)
    both = (magnitude(v) + magnitude(v_before)) * h
    if s.mode == Mode.FF:
        room = room_of_flight(s, p, p_before, both)
    else:
        reach = (magnitude(p - p_before) * 1.5 + both) * (K + C / h)
        force, before = p * K + v * C, p_before * K + v_before * C
        room = lower_of(force * -1.0, before * -1.0) - reach + (most + K * law.origin)
        if s.mode == Mode.SS:
            room = lower_of(room, lower_of(force, before) - reach - K * law.origin)
        else:
            room = lower_of(room, room_of_way(s, p, p_before, v, v_before, h))
    store(rows, BEFORE, 0, room)
    if s.mode == Mode.DFC:
        share = (v * v + v_before * v_before) * (0.5 * C * h)
        if not total(share) < spare:
            return 0, 0.0
        store(rows, BEFORE + 1, 0, share)
    kept = 0
    while kept < SCAN and rows[BEFORE, kept] > 0.0:
        if s.mode == Mode.DFC:
            work += rows[BEFORE + 1, kept]
        kept += 1
    return kept, work
