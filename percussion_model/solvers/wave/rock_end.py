"""Rock end of the bit, followed exactly through one step.

The bit end obeys F_R = z (v_free - v), the rock answers with
F_R = K (p - P_R) + C v: a scalar linear equation with constant input over a
step, so every crossing is a logarithm (docs/model.md, eqs 14-18, table 1).
"""

from __future__ import annotations

from percussion_model.physics.blows import push_event
from percussion_model.physics.curved_loading import loading_stretch
from percussion_model.physics.elementary import expm1, log
from percussion_model.physics.kernel import inlined, kernel, merged
from percussion_model.physics.records import Mode
from percussion_model.physics.rock import (
    book_dashpot,
    close_interface,
    crush,
    damping,
    enter_standstill,
    has_rock,
    is_crushable,
    is_curved,
    is_elastic_rock,
    is_rigid_rock,
    leave_by_velocity,
    leave_standstill,
    origin,
    overcomes_barrier,
    recoverable,
    spring_force,
    stiffness,
)


@merged
def time_in_mode(par, s, v_free, v, y, rate, y_end, rest):
    """How long the present contact mode lasts within the rest of the step.

    Returns
    -------
    time : float
        At most `rest` [s].
    next_mode : int
        Mode that follows, -1 where none does.
    """
    if s.mode == Mode.DFC:
        left = 1.0 - 2.0 * (s.w_r - s.w) * rate / (s.c_r * v * v)
        if left > 0.0:
            t = -0.5 * log(left) / rate
            if t < rest:
                return max(t, 0.0), Mode.FC
    elif s.mode == Mode.BC or (s.mode == Mode.FC and is_elastic_rock(par)):
        if v < 0.0 and y_end < 0.0:
            t = -log(-y_end / (y - y_end)) / rate if y > 0.0 else 0.0
            if t < rest:
                return t, Mode.FF
    elif s.mode == Mode.SS and par.release == 1:
        if v < 0.0 and v_free < 0.0:
            t = -log(v_free / v) / rate if v_free > v else 0.0
            if t < rest:
                return t, Mode.FF
    return rest, -1


@kernel
def note_peak(s, time, first, change, rate, last):
    """Note the bit force of a stretch for an observer; it is monotone, so its ends tell.

    What came before the communication step that the observer looks at (`peak_from`)
    must not count.

    Parameters
    ----------
    time : float
        Start of the stretch [s].
    first, last : float
        Force at its start and its end [N].
    change, rate : float
        Force t after the start is first + change (1 - exp(-rate t)) [N, 1/s].
    """
    if time < s.peak_from:
        first -= change * expm1(-rate * (s.peak_from - time))
    s.peak_bit_force = max(s.peak_bit_force, first, last)


@merged
def contact_stretch(par, s, v_free, z, rest, time):
    """Follow one contact mode until it ends or the step does, from `time` on.

    Returns
    -------
    time, d, q : float
        Duration [s], integral of velocity [m] and of its square [m2/s].
    next_mode : int
    """
    K = stiffness(s)
    C = damping(s)
    start = origin(s)
    y = s.p - start
    v = (z * v_free - K * y) / (z + C)
    rate = K / (z + C)
    t, next_mode = time_in_mode(par, s, v_free, v, y, rate, y + v / rate, rest)
    fade = -expm1(-rate * t)
    d = v * fade / rate
    q = 0.5 * v * v * fade * (2.0 - fade) / rate
    p_before = s.p
    s.p += d
    book_dashpot(s, C * q)
    crush(par, s, p_before)
    if next_mode == Mode.FF and y < 0.0:
        # standstill had pulled the bit when its unloading began: the rock lets go
        s.e_standstill += recoverable(par, s)
    elif next_mode == Mode.FF and s.mode != Mode.SS:
        s.p = start  # exactly unloaded
    last = z * (v_free - v * (1.0 - fade))
    s.b_peak_bit = max(s.b_peak_bit, K * y + C * v, last)
    if time + t > s.peak_from:
        note_peak(s, time, K * y + C * v, z * v, rate, last)
    return t, d, q, next_mode


@merged
def flight_stretch(par, s, v_free, rest):
    """Follow free flight until the interface closes or the step ends.

    Returns
    -------
    time : float
        Duration [s].
    closes : int
        1 where it ends in contact.
    """
    before = recoverable(par, s)
    t = rest
    closes = 0
    if has_rock(par) and v_free > 0.0:
        reach = (s.p_u - s.p) / v_free
        if reach < rest:
            t = max(reach, 0.0)
            closes = 1
    if closes == 1 and s.p < s.p_u:
        s.p = s.p_u
    else:
        s.p += v_free * t
    # A rock that was still springing back relaxes without doing work.
    s.e_standstill += before - recoverable(par, s)
    return t, closes


@inlined
def asks_for_energy(par, s, v_free, z, tau):
    """Whether a step may come to where the rock law goes by the kinetic energy of the bit."""
    if s.mode == Mode.SS:
        return is_crushable(par)
    if s.mode == Mode.FF:
        return s.p_u - s.p < v_free * tau
    return s.mode == Mode.BC and z * v_free - spring_force(par, s) > 0.0


@merged
def rock_step(par, s, energy, v_free, z, tau, time, events):
    """Advance the rock end of the bit by `tau`.

    Parameters
    ----------
    par, s : record
        Parameters and state.
    energy : float
        Kinetic energy of the bit, where `asks_for_energy` [J].
    v_free : float
        Velocity the end would have if it were free [m/s].
    z : float
        Its impedance, with the viscous share of the last cell [N s/m].
    tau, time : float
        Duration and start of the step [s].
    events : EVENT array

    Returns
    -------
    d, q : float
        Integrals of velocity [m] and of its square [m2/s].
    """
    if s.mode == Mode.SS and is_crushable(par):
        if overcomes_barrier(par, s, energy):
            force = spring_force(par, s)
            leave_standstill(par, s, (z * v_free - force) / (z + s.c_r))
            push_event(s, events, time, s.mode, force)
    rest = tau
    d = 0.0
    q = 0.0
    for _ in range(par.most_changes):
        here = time + (tau - rest)
        if s.mode == Mode.FF:
            t, closes = flight_stretch(par, s, v_free, rest)
            step = v_free * t
            d += step
            q += v_free * v_free * t
            rest -= t
            if closes == 0:
                return d, q
            close_interface(par, s, energy)
            if s.mode == Mode.SS:
                enter_standstill(s, here + t)
            push_event(s, events, here + t, s.mode, 0.0)
            continue
        if is_rigid_rock(par):
            if v_free > 0.0:
                s.b_peak_bit = max(s.b_peak_bit, z * v_free)
                if here + rest > s.peak_from:
                    s.peak_bit_force = max(s.peak_bit_force, z * v_free)
                return d, q
            s.mode = Mode.FF
            s.p_u = s.p
            push_event(s, events, here, s.mode, 0.0)
            continue
        if end_of_mode(par, s, energy, v_free, z) == 1:
            if s.mode == Mode.SS:
                enter_standstill(s, here)
            push_event(s, events, here, s.mode, spring_force(par, s))
            continue
        if is_curved(par, s):
            t, step, square, next_mode = loading_stretch(par, s, v_free, z, rest, here)
        else:
            t, step, square, next_mode = contact_stretch(par, s, v_free, z, rest, here)
        d += step
        q += square
        rest -= t
        if next_mode < 0:
            return d, q
        s.mode = next_mode
        push_event(s, events, here + t, s.mode, spring_force(par, s))
    s.count_locked += 1
    return d, q


@merged
def end_of_mode(par, s, energy, v_free, z):
    """Whether the sign of the velocity ends the mode at once; sets the next."""
    v = (z * v_free - spring_force(par, s)) / (z + damping(s))
    return leave_by_velocity(par, s, v, energy)
