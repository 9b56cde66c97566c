"""Closed-form motion over a stretch without events, and its entries in ledger and blow."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel
from percussion_model.physics.loads import (
    book_bit_load,
    book_piston_load,
    drive_force,
    pass_time,
    piston_acceleration,
)
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import (
    book_dashpot,
    crush,
    is_crushable,
    is_curved,
    line_work,
    present_line,
    recoverable,
    recoverable_at,
)
from percussion_model.solvers.rigid.forces import (
    acceleration,
    bit_force,
    contact_force,
    loads,
    on_wall,
    rock_terms,
)
from percussion_model.solvers.rigid.motion import (
    ROOT_TOLERANCE,
    SEARCH_LIMIT,
    oscillate,
    oscillate_with_loss,
    zero_time,
)


@kernel
def bit_motion(par, s, tau):
    """Displacement [m] and velocity [m/s] of the bit after tau."""
    if on_wall(par, s):
        return 0.0, 0.0
    F, M = loads(par, s)
    K, C, P = rock_terms(par, s)
    if K == 0.0:
        a = F / M
        return tau * (s.v_b + 0.5 * a * tau), s.v_b + a * tau
    y = s.p - P - F / K
    y1, v1 = oscillate(y, s.v_b, 0.5 * C / M, K / M, tau)
    return y1 - y, v1


@kernel
def piston_motion(par, s, tau, d_b, v_b):
    """Displacement [m] and velocity [m/s] of the piston after tau, given the bit's."""
    if par.piston == Piston.ABSENT:
        return 0.0, 0.0
    if s.held == 1:
        return d_b, v_b
    a = piston_acceleration(par, drive_force(par, s))
    return tau * (s.v_p + 0.5 * a * tau), s.v_p + a * tau


@kernel
def impulses(par, s, tau, v_b):
    """Impulse of the rock on the bit and of the piston on the bit over tau [N s].

    By momentum: what the constant loads give and the motion does not show.
    """
    F, M = loads(par, s)
    bit = 0.0
    if s.mode != Mode.FF:
        bit = F * tau - M * (v_b - s.v_b)
    contact = 0.0
    if s.held == 1:
        contact = (drive_force(par, s) + par.mass_p * par.gravity) * tau - par.mass_p * (
            v_b - s.v_b
        )
    return bit, contact


@kernel
def greatest_gap(par, s, tau, v_b, v_p, gap):
    """Greatest gap within the stretch: at its ends, or where it stops growing.

    Of several maxima (a bit that still rings) one is taken; they differ by the ringing.
    """
    most = max(s.gap, gap)
    if not (s.v_b > s.v_p and v_b < v_p):
        return most
    a_p = piston_acceleration(par, drive_force(par, s))
    F, M = loads(par, s)
    K, C, P = rock_terms(par, s)
    a_b = 0.0 if on_wall(par, s) else F / M
    beta = 0.5 * C / M
    k = K / M
    y = s.p - P - F / K if K > 0.0 else 0.0
    lower = 0.0
    upper = tau
    t = (s.v_b - s.v_p) / (a_p - a_b if K == 0.0 else a_p)
    for _ in range(SEARCH_LIMIT):
        if not lower < t < upper:
            t = 0.5 * (lower + upper)
        y1 = 0.0
        v1 = s.v_b + t * a_b
        slope = a_b - a_p
        if K > 0.0:
            y1, v1 = oscillate(y, s.v_b, beta, k, t)
            slope = -a_p - 2.0 * beta * v1 - k * y1
        rate = v1 - s.v_p - a_p * t
        if rate > 0.0:
            lower = t
        else:
            upper = t
        step = -rate / slope
        t += step
        if abs(step) <= ROOT_TOLERANCE * t or upper - lower <= ROOT_TOLERANCE * t:
            break
    d, _ = bit_motion(par, s, t)
    return max(most, s.gap + d - t * (s.v_p + 0.5 * a_p * t))


@kernel
def greatest_bit_force(par, s, tau, p, v, known):
    """Greatest bit force within the stretch: at its ends or at its first maximum.

    Where nothing above the force `known` [N] can come, the ends alone are looked at.
    """
    most = max(bit_force(par, s, s.p, s.v_b), bit_force(par, s, p, v))
    K, C, P = rock_terms(par, s)
    # In BC the force falls, in FC it rises with the penetration.
    if K == 0.0 or s.mode == Mode.BC or (s.mode == Mode.FC and is_crushable(par)):
        return most
    F, M = loads(par, s)
    beta = 0.5 * C / M
    k = K / M
    acc = (F - K * (s.p - P) - C * s.v_b) / M
    # The force less its mean obeys the equation of motion too.
    f = K * (s.p - P) + C * s.v_b - F
    rate = K * s.v_b + C * acc
    if F + math.sqrt(f * f + rate * rate / k) <= max(most, known):
        return most
    t = zero_time(rate, -2.0 * beta * rate - k * f, beta, k)
    if t < tau:
        most = max(most, F + oscillate(f, rate, beta, k, t)[0])
        if k > beta * beta:
            t += math.pi / math.sqrt(k - beta * beta)
            if t < tau:
                most = max(most, F + oscillate(f, rate, beta, k, t)[0])
    return most


@kernel
def note_peaks(par, s, tau):
    """Note the greatest forces of the stretch, from `peak_from` of the state on."""
    p, v_b = s.p, s.v_b
    early = max(s.peak_from - s.time, 0.0)
    if early > 0.0:
        d, s.v_b = bit_motion(par, s, early)
        s.p += d
    rest = tau - early
    d, v = bit_motion(par, s, rest)
    if s.mode != Mode.FF:
        most = greatest_bit_force(par, s, rest, s.p + d, v, s.peak_bit_force)
        s.peak_bit_force = max(s.peak_bit_force, most)
    if s.held == 1:
        # the free piston's acceleration less the common one, which the bit force changes
        first = bit_force(par, s, s.p, s.v_b)
        last = bit_force(par, s, s.p + d, v)
        most = contact_force(par, s, acceleration(par, s))
        share = par.mass_p / (par.mass_p + par.mass_b)
        s.peak_contact_force = max(s.peak_contact_force, most, most + share * (last - first))
    s.p, s.v_b = p, v_b


@kernel
def dashpot_motion(par, s, tau):
    """`bit_motion`, and the energy that the dashpot of the rock takes meanwhile [J]."""
    K, C, P = rock_terms(par, s)
    if C == 0.0:
        d, v = bit_motion(par, s, tau)
        return d, v, 0.0
    F, M = loads(par, s)
    y = s.p - P - F / K
    y1, v, square = oscillate_with_loss(y, s.v_b, 0.5 * C / M, K / M, tau)
    return y1 - y, v, C * square


@kernel
def book_rock(par, s, p_before, taken):
    """Ledger entries of the rock while the bit has moved on from `p_before`.

    Parameters
    ----------
    taken : float
        By the dashpot meanwhile [J].
    """
    change = recoverable(par, s) - recoverable_at(par, s, p_before)
    if s.mode == Mode.FF:
        # Rock that springs back without the bit relaxes on its dashpot.
        s.e_standstill -= change
        return
    book_dashpot(s, taken)
    given = change + crush(par, s, p_before)
    if is_curved(par, s):
        # what rock that yields by lines does not give back is crushed: more than by its law
        # within a line, or less, and as much over a whole one
        work = line_work(present_line(par, s), p_before, s.p)
        s.e_crushing += work - given
        given = work
    s.rock_work += given + taken


@kernel
def move(par, s, tau):
    """Carry the state over a stretch of tau without events; `time` is left to the caller."""
    d_b, v_b, taken = dashpot_motion(par, s, tau)
    d_p, v_p = piston_motion(par, s, tau, d_b, v_b)
    bit, contact = impulses(par, s, tau, v_b)
    gap = s.gap + (d_b - d_p)
    book_bit_load(par, s, d_b)
    if s.mode != Mode.FF:
        most = greatest_bit_force(par, s, tau, s.p + d_b, v_b, s.b_peak_bit)
        s.b_peak_bit = max(s.b_peak_bit, most)
    if s.time + tau > s.peak_from:
        note_peaks(par, s, tau)
    if par.piston != Piston.ABSENT:
        push = drive_force(par, s)
        book_piston_load(par, s, push, d_p, push * tau)
        if s.held == 0:
            s.b_stroke = max(s.b_stroke, greatest_gap(par, s, tau, v_b, v_p, gap))
    s.i_bit += bit
    s.i_contact += contact
    p_before = s.p
    s.p += d_b
    s.v_b = v_b
    s.v_p = v_p
    s.gap = gap
    book_rock(par, s, p_before, taken)
    s.u_r = -s.gap
    pass_time(par, s, tau)
