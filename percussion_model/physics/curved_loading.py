"""Loading of the rock by the power law, followed through one step.

The bit end obeys F_R = z (v_free - v) and the rock answers with F(p) + C v, so that
(z + C) dp/dt = z v_free - F(p): one autonomous equation, whose velocity keeps its sign and
falls. It is integrated by the three stages of Gauss, which are of order six (E. Hairer, S. P.
Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.7).
"""

from __future__ import annotations

import math

from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.power_law import (
    CHIPPING_SLOPE,
    exponent_at,
    is_chipping,
    is_reloading,
    loading_force,
    loading_part,
    loading_slope,
    loading_work,
    next_kink,
    part_at,
)
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import book_dashpot, crush, damping

ROOT = math.sqrt(15.0)
# Weights of the stages in each other, and in the whole.
A_11, A_12, A_13 = 5.0 / 36.0, 2.0 / 9.0 - ROOT / 15.0, 5.0 / 36.0 - ROOT / 30.0
A_21, A_22, A_23 = 5.0 / 36.0 + ROOT / 24.0, 2.0 / 9.0, 5.0 / 36.0 - ROOT / 24.0
A_31, A_32, A_33 = 5.0 / 36.0 + ROOT / 30.0, 2.0 / 9.0 + ROOT / 15.0, 5.0 / 36.0
B_1, B_2 = 5.0 / 18.0, 4.0 / 9.0
# Newton's steps, and where they end, relative to the first velocity or to the step.
MOST_TURNS, SETTLED = 60, 1e-14
# A step is cut where the rock changes by more than this share of the end's impedance in it, and
# where what loads the rock grows by more than a share of it, an nth part of `GROWTH`: a power has
# no series about zero. From nothing on it may come to a share of where it balances the push.
LARGEST_SHARE, GROWTH, LEAST_SHARE = 0.25, 0.5, 1e-3
# A velocity that has fallen to this share of the first, or of that without rock, moves nothing
# any more: it is rounding of the force. So is one whose whole way is rounding of the penetration.
SPENT, ROUNDING = 1e-16, 1e-15
# A penetration so close below where the rock begins or ends to chip is there, as a share of it.
CLOSE = 1e-12


@inlined
def _answer(par, s, push, z, p):
    """Velocity of the end at a penetration, and how it changes with that [m/s, 1/s]."""
    return (push - loading_force(par, s, p)) / z, -loading_slope(par, s, p) / z


@kernel
def _part(par, s, push, z, p, h):
    """Integrals of the velocity [m] and of its square [m2/s] over `h` from `p` on."""
    start, slope = _answer(par, s, push, z, p)
    enough = SETTLED * abs(start) + SPENT * abs(push) / z
    # the linear answer at the stages is a good guess
    mid = start / (1.0 - 0.5 * h * slope)
    v_1, v_2, v_3 = 0.5 * (start + mid), mid, mid + 0.5 * (mid - start)
    for _ in range(MOST_TURNS):
        f_1, g_1 = _answer(par, s, push, z, p + h * (A_11 * v_1 + A_12 * v_2 + A_13 * v_3))
        f_2, g_2 = _answer(par, s, push, z, p + h * (A_21 * v_1 + A_22 * v_2 + A_23 * v_3))
        f_3, g_3 = _answer(par, s, push, z, p + h * (A_31 * v_1 + A_32 * v_2 + A_33 * v_3))
        a_11, a_12, a_13 = 1.0 - h * g_1 * A_11, -h * g_1 * A_12, -h * g_1 * A_13
        a_21, a_22, a_23 = -h * g_2 * A_21, 1.0 - h * g_2 * A_22, -h * g_2 * A_23
        a_31, a_32, a_33 = -h * g_3 * A_31, -h * g_3 * A_32, 1.0 - h * g_3 * A_33
        r_1, r_2, r_3 = f_1 - v_1, f_2 - v_2, f_3 - v_3
        m_11, m_12, m_13 = (
            a_22 * a_33 - a_23 * a_32,
            a_23 * a_31 - a_21 * a_33,
            a_21 * a_32 - a_22 * a_31,
        )
        whole = a_11 * m_11 + a_12 * m_12 + a_13 * m_13
        d_1 = (
            r_1 * m_11 + a_12 * (a_23 * r_3 - r_2 * a_33) + a_13 * (r_2 * a_32 - a_22 * r_3)
        ) / whole
        d_2 = (
            a_11 * (r_2 * a_33 - a_23 * r_3) + r_1 * m_12 + a_13 * (a_21 * r_3 - r_2 * a_31)
        ) / whole
        d_3 = (
            a_11 * (a_22 * r_3 - r_2 * a_32) + a_12 * (r_2 * a_31 - a_21 * r_3) + r_1 * m_13
        ) / whole
        v_1 += d_1
        v_2 += d_2
        v_3 += d_3
        if abs(d_1) + abs(d_2) + abs(d_3) <= enough:
            break
    d = h * (B_1 * (v_1 + v_3) + B_2 * v_2)
    return d, h * (B_1 * (v_1 * v_1 + v_3 * v_3) + B_2 * v_2 * v_2)


@inlined
def _longest(par, s, p, least):
    """Way in which what loads the rock grows little enough [m]."""
    if is_reloading(s, p):
        return math.inf
    part = loading_part(par, s, p)
    way = max(GROWTH / exponent_at(par, part) * part, least)
    return way / CHIPPING_SLOPE if is_chipping(par, s, p) else way


@kernel
def load(par, s, push, z, time):
    """Integrals of the velocity [m] and of its square [m2/s] over a time of loading.

    Parameters
    ----------
    push : float
        Force of the end if it were held [N].
    z : float
        Its impedance, with the damping of the mode [N s/m].
    time : float
        [s]
    """
    d = q = done = first = 0.0
    balance = part_at(par, s.k_r, max(push, 0.0))
    least = LEAST_SHARE * min(par.reference_penetration, balance)
    while done < time:
        p = s.p + d
        kink = next_kink(par, s, p)
        if kink - p <= CLOSE * p:
            p = kink  # what comes next is of the rock behind it
            kink = next_kink(par, s, p)
        v, slope = _answer(par, s, push, z, p)
        first = max(first, abs(v))
        spent = max(SPENT * first, ROUNDING * abs(push) / z, -slope * ROUNDING * abs(p))
        if abs(v) <= spent:
            break
        h = min(time - done, -LARGEST_SHARE / slope)
        if v > 0.0:
            # never past a kink: no series knows what comes behind it
            h = min(h, _longest(par, s, p, least) / v, (kink - p) / v)
        step, square = _part(par, s, push, z, p, h)
        d += step
        q += square
        done += h
    return d, q


@merged
def time_to_break(par, s, push, z, rest, square):
    """When the barrier is broken: the dashpot has taken W_R; `rest` if not before.

    Parameters
    ----------
    square : float
        Integral of the velocity's square over `rest` [m2/s].
    """
    wanted = (s.w_r - s.w) / s.c_r
    if wanted <= 0.0:
        return 0.0
    low, high, t = 0.0, rest, rest * wanted / square
    for _ in range(MOST_TURNS):
        d, q = load(par, s, push, z, t)
        if q < wanted:
            low = t
        else:
            high = t
        v = (push - loading_force(par, s, s.p + d)) / z
        change = (wanted - q) / (v * v) if v != 0.0 else math.inf
        t += change
        if abs(change) <= SETTLED * rest:
            break
        if not low < t < high:
            t = 0.5 * (low + high)
    return t


@kernel
def loading_stretch(par, s, v_free, z, rest, time):
    """Follow a drilling cycle until the barrier is broken or the step ends.

    Parameters and results are those of `rock_end.contact_stretch`.
    """
    C = damping(s)
    push, whole = z * v_free, z + C
    t, next_mode = rest, -1
    d, q = load(par, s, push, whole, rest)
    if s.mode == Mode.DFC and s.w + C * q >= s.w_r:
        t, next_mode = time_to_break(par, s, push, whole, rest, q), Mode.FC.value
        d, q = load(par, s, push, whole, t)
    first = push - z * (push - loading_force(par, s, s.p)) / whole
    if time < s.peak_from < time + t:
        before, _ = load(par, s, push, whole, s.peak_from - time)
        seen = push - z * (push - loading_force(par, s, s.p + before)) / whole
    else:
        seen = first
    p_before = s.p
    s.p += d
    # by the energy that the rock has taken, so that the ledger closes
    q = (push * d - loading_work(par, s, s.p) + loading_work(par, s, p_before)) / whole
    book_dashpot(s, C * q)
    crush(par, s, p_before)
    last = push - z * (push - loading_force(par, s, s.p)) / whole
    s.b_peak_bit = max(s.b_peak_bit, first, last)
    if time + t > s.peak_from:
        s.peak_bit_force = max(s.peak_bit_force, seen, last)
    return t, d, q, next_mode
