"""End of the present closed-form stretch: the time and kind of the next event."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel
from percussion_model.physics.loads import (
    drive_force,
    hold_components,
    lasting,
    piston_acceleration,
    room_to_turn,
)
from percussion_model.physics.records import Mode, Piston
from percussion_model.physics.rock import (
    REST_VELOCITY,
    barrier_level,
    barrier_off,
    has_rock,
    is_curved,
    is_elastic_rock,
)
from percussion_model.solvers.rigid.forces import (
    ROUNDING,
    acceleration,
    acceleration_doubt,
    in_storm,
    loads,
    on_wall,
    rock_terms,
    storm_persists,
)
from percussion_model.solvers.rigid.motion import NEVER, fall_time, zero_time
from percussion_model.solvers.rigid.records import Next
from percussion_model.solvers.rigid.search import (
    approach_time,
    barrier_time,
    fall_time_parabola,
)

# An overdamped bit is at rest after this many of its slowest time constants.
SETTLED = 100.0


@kernel
def touch_event(par, s):
    """Next contact of a flying bit with the rock."""
    if not has_rock(par):
        return NEVER, Next.NOTHING
    a = acceleration(par, s)
    v = s.v_b
    h = s.p_u - s.p
    if h >= 0.0:
        return fall_time_parabola(h, -v, -a), Next.TOUCH
    # Let go while p > P_u: contact is made again where the bit turns, or from above P_u.
    if v > 0.0 or (v == 0.0 and a > 0.0):
        return 0.0, Next.TOUCH_INSIDE
    if a <= 0.0:
        return NEVER, Next.NOTHING
    root = v * v + 2.0 * a * h
    if root <= 0.0:
        return -v / a, Next.TOUCH_INSIDE
    return (math.sqrt(root) - v) / a, Next.TOUCH


@kernel
def loading_event(s, y, acc, beta, k, M):
    """End of DFC or FC: the barrier is spent, or the bit turns upward."""
    v = s.v_b
    if v < 0.0 or (v == 0.0 and acc < -ROUNDING * k * abs(s.p)):
        return 0.0, Next.PEAK
    tau = zero_time(v, acc, beta, k)
    if s.mode == Mode.DFC:
        end = tau if tau < NEVER else SETTLED * 2.0 * beta / k
        spent = barrier_time(y, v, beta, k, M, s.w_r - s.w, end)
        if spent < NEVER:
            return spent, Next.BARRIER
    return tau, Next.PEAK


@kernel
def unloading_event(s, y, acc, k, level):
    """End of BC: the bit turns downward, or lifts off at p = P_u (y = level)."""
    v = s.v_b
    if v > 0.0 or (v == 0.0 and acc > ROUNDING * k * abs(y - level)):
        return 0.0, Next.TURN
    if s.p <= s.p_u:
        return 0.0, Next.LIFT
    if v < 0.0 or acc < 0.0:
        tau = fall_time(y, v, 0.0, k, level)
        # What lifts off does so before it turns.
        if tau < NEVER:
            return tau, Next.LIFT
    return zero_time(v, acc, 0.0, k), Next.TURN


@kernel
def standstill_event(par, s, y, acc, beta, k, F, M):
    """End of standstill: KE_b exceeds W_R, or (release) the bit force vanishes."""
    v = s.v_b
    tau = NEVER
    kind = Next.NOTHING
    if not barrier_off(par, s):
        limit = math.sqrt(2.0 * barrier_level(par, s) / par.mass_b)
        if abs(v) > limit:
            return 0.0, Next.LEAVE_DOWN if v > -REST_VELOCITY else Next.LEAVE_UP
        if math.sqrt(v * v + acc * acc / k) > limit:
            tau = fall_time(v, acc, beta, k, -limit)
            kind = Next.LEAVE_UP
            down = fall_time(-v, -acc, beta, k, -limit)
            if down < tau:
                tau = down
                kind = Next.LEAVE_DOWN
    else:
        return 0.0, Next.LEAVE_DOWN if v > -REST_VELOCITY else Next.LEAVE_UP
    if par.release == 1:
        force = M * (k * y + 2.0 * beta * v)
        rate = M * (k * v + 2.0 * beta * acc)
        if F - math.sqrt(force * force + rate * rate / k) <= 0.0:
            gone = fall_time(force, rate, beta, k, -F)
            if gone < tau:
                tau = gone
                kind = Next.LIFT
    return tau, kind


@kernel
def release_time(a_p, acc, jerk, doubt, beta, k):
    """When a held piston lets go: the common acceleration exceeds its own, F_C < 0."""
    if acc - a_p > doubt:
        return 0.0
    if k == 0.0:
        return NEVER
    return fall_time(-acc, -jerk, beta, k, -a_p)


@kernel
def close_time_flight(gap, dv, acc, a_p, doubt):
    """When two freely flying bodies meet."""
    da = acc - a_p
    if abs(da) <= doubt:
        da = 0.0
    return fall_time_parabola(gap, dv, da)


@kernel
def postponed(par, s, tau, kind):
    """In a storm of events, the earliest that one may come (docs/numerics.md, section 12).

    Bodies that meet never wait: they would pass through each other. Of the rest the
    drive waits in any storm, all in the worst.

    Returns
    -------
    float
        Time until it [s]. That of a state depends on its last event alone, so that
        commits in between do not put it off again and again.
    """
    if (
        not in_storm(par, s)
        or kind == Next.TOUCH
        or kind == Next.TOUCH_INSIDE
        or kind == Next.NOTHING
    ):
        return tau
    if kind != Next.SWITCH and not storm_persists(par, s):
        return tau
    return max(tau, par.window / par.most_events - (s.time - s.last_event))


@kernel
def piston_event(par, s, y, acc, beta, k, tau, kind):
    """Earlier of (tau, kind) and what comes next between piston, bit and drive."""
    a_p = piston_acceleration(par, drive_force(par, s))
    jerk = -2.0 * beta * acc - k * s.v_b
    doubt = acceleration_doubt(par, s, acc)
    if s.held == 1 and room_to_turn(par, s, 0.0) <= 0.0:
        return 0.0, Next.SWITCH  # a start in contact: u_r = 0 is reached
    if s.held == 1:
        t_release = release_time(a_p, acc, jerk, doubt, beta, k)
        t_release = postponed(par, s, t_release, Next.RELEASE)
        if t_release < tau:
            return t_release, Next.RELEASE
        return tau, kind
    # while it pushes down it turns where they meet
    lift = s.alpha < 0 and room_to_turn(par, s, -s.gap) < math.inf
    if k > 0.0:
        # No further than this can the gap change before tau.
        reach = abs(acc) + abs(a_p) + abs(jerk) / math.sqrt(k)
        reach = tau * (abs(s.v_b - s.v_p) + 0.5 * tau * reach)
        if reach < s.gap and not (lift and reach >= room_to_turn(par, s, -s.gap)):
            return tau, kind
        close = approach_time(s.gap, 1.0, y, s.v_b, beta, k, s.v_p, a_p, doubt, tau)
    else:
        close = close_time_flight(s.gap, s.v_b - s.v_p, acc, a_p, doubt)
    if close < tau:
        tau = close
        kind = Next.CLOSE
    if lift:
        h = room_to_turn(par, s, -s.gap)
        if h <= 0.0 and postponed(par, s, 0.0, Next.SWITCH) == 0.0:
            return 0.0, Next.SWITCH
        if h <= 0.0:
            turn = 0.0
        elif k > 0.0:
            turn = approach_time(h, -1.0, y, s.v_b, beta, k, s.v_p, a_p, doubt, tau)
        else:
            turn = fall_time_parabola(h, s.v_p - s.v_b, a_p - acc)
        turn = postponed(par, s, turn, Next.SWITCH)
        if turn < tau:
            tau = turn
            kind = Next.SWITCH
    return tau, kind


@kernel
def schedule(par, s):
    """Find the next event and note it in the state. Depends on the state alone."""
    s.closed = s.held
    longest = NEVER
    if par.effects == 1:
        lasts = lasting(par, s)
        longest = lasts if 0.0 < lasts < NEVER else par.window
    hold_components(par, s, longest)
    find_next(par, s, longest)
    if 0.0 < s.next_tau < longest < NEVER:
        hold_components(par, s, s.next_tau)
        find_next(par, s, longest)


@kernel
def find_next(par, s, longest):
    """Find the next event under the forces that are held, for a time at most [s]."""
    F, M = loads(par, s)
    K, C, P = rock_terms(par, s)
    acc = acceleration(par, s)
    beta = 0.5 * C / M
    k = K / M
    y = 0.0
    if s.mode == Mode.FF:
        tau, kind = touch_event(par, s)
    elif on_wall(par, s):
        tau, kind = (0.0, Next.LIFT) if F < 0.0 else (NEVER, Next.NOTHING)
    else:
        y = s.p - P - F / K
        acc = -2.0 * beta * s.v_b - k * y
        if is_elastic_rock(par):
            tau, kind = fall_time(y, s.v_b, 0.0, k, -F / K), Next.LIFT
        elif s.mode == Mode.DFC or s.mode == Mode.FC:
            tau, kind = loading_event(s, y, acc, beta, k, M)
            if is_curved(par, s) and tau > 0.0:
                end = fall_time(-y, -s.v_b, beta, k, P + F / K - s.line_end)
                if end < tau:
                    tau, kind = end, Next.LINE
        elif s.mode == Mode.BC:
            tau, kind = unloading_event(s, y, acc, k, -F / K)
        else:
            tau, kind = standstill_event(par, s, y, acc, beta, k, F, M)
    later = postponed(par, s, tau, kind)
    s.late = 1 if later > tau else 0
    tau = later
    if par.piston != Piston.ABSENT:
        tau, kind = piston_event(par, s, y, acc, beta, k, tau, kind)
    if tau > longest:
        tau = longest
        kind = Next.HOLD
    s.next_tau = tau
    s.next_time = s.time + tau
    s.next_kind = kind
    s.scheduled = 1
