"""Times at which two bodies meet, and at which the dashpot of the barrier has taken its share."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel
from percussion_model.solvers.rigid.motion import (
    NEVER,
    ROOT_TOLERANCE,
    SEARCH_LIMIT,
    fall_time,
    oscillate,
)

# A distance between bodies below this is closed: rounding of a 0.1 m flight is 1e-17 m.
CLOSED_GAP = 1e-15

# A search for a tangent root gains one bit a step; over a long ringing it may take many.
APPROACH_LIMIT = 100000


@kernel
def fall_time_parabola(h, dh, ddh):
    """First tau >= 0 at which h + dh tau + ddh tau**2/2 falls to zero; NEVER if it does not.

    At h = 0 the motion must go downwards for the start itself to count.
    """
    if h <= 0.0:
        if dh < 0.0 or (dh == 0.0 and ddh < 0.0):
            return 0.0
        return -2.0 * dh / ddh if dh > 0.0 and ddh < 0.0 else NEVER
    root = dh * dh - 2.0 * ddh * h
    if root < 0.0 or (ddh >= 0.0 and dh >= 0.0):
        return NEVER
    root = math.sqrt(root)
    return 2.0 * h / (root - dh) if dh < 0.0 else (dh + root) / -ddh


@kernel
def approach_time(h, sign, y, v, beta, k, v_p, a_p, doubt, end):
    """First tau in [0, end] at which the distance to an oscillating body falls to zero.

    The distance is h + sign [y(tau) - y - v_p tau - a_p tau**2/2]. Its second derivative
    stays above -c with c from the decaying energy of y'', so the parabola with that
    curvature is a lower bound: stepping to its root never jumps over a closure, crosses
    quiet stretches in one step, and converges as Newton's method does.

    Parameters
    ----------
    h : float
        Distance at the start [m].
    sign : float
        +1 when the oscillating body is ahead, -1 when the distance shrinks as it moves on.
    y, v, beta, k : float
        Oscillating body, see `oscillate`.
    v_p, a_p : float
        Velocity [m/s] and acceleration [m/s^2] of the free body.
    doubt : float
        Relative accelerations below this may be rounding [m/s^2].
    end : float
        The search ends here [s].

    Returns
    -------
    tau : float
        Time [s], NEVER if the distance stays open up to `end`.
    """
    acc = -2.0 * beta * v - k * y
    jerk = -2.0 * beta * acc - k * v
    tau = 0.0
    dh = sign * (v - v_p)
    ddh = sign * (acc - a_p)
    if h <= 0.0:
        if dh < 0.0 or (dh == 0.0 and ddh < -doubt):
            return 0.0
        if dh == 0.0 and ddh <= doubt and sign * jerk <= 0.0:
            return 0.0 if sign * jerk < 0.0 else NEVER
    if dh >= 0.0 and ddh >= -doubt:
        # The bodies part and their acceleration parts them: nothing closes before it turns.
        tau = fall_time(sign * acc, sign * jerk, beta, k, sign * a_p)
    y1 = y
    v1 = v
    for _ in range(APPROACH_LIMIT):
        if tau > end or tau == NEVER:
            return NEVER
        if tau > 0.0:
            y1, v1 = oscillate(y, v, beta, k, tau)
        d = h + sign * (y1 - y - tau * (v_p + 0.5 * a_p * tau))
        dd = sign * (v1 - v_p - a_p * tau)
        if d <= CLOSED_GAP and dd < 0.0:
            return tau
        acc = -2.0 * beta * v1 - k * y1
        jerk = -2.0 * beta * acc - k * v1
        c = math.sqrt(acc * acc + jerk * jerk / k) + sign * a_p
        step = fall_time_parabola(max(d, 0.0), dd, -c)
        tau += step
        if step <= ROOT_TOLERANCE * tau:
            return tau if tau <= end else NEVER
    return tau


@kernel
def barrier_time(y, v, beta, k, mass, work, end):
    """Time at which a dashpot has taken a given energy, NEVER if not before `end`.

    W(tau) = E(0) - E(tau) with E = M (v**2 + k y**2)/2 rises as long as v > 0.
    """
    if work <= 0.0:
        return 0.0
    damping = 2.0 * beta * mass
    e0 = v * v + k * y * y
    a = 0.0
    b = end
    enough = False
    t = min(work / (damping * v * v), end) if v > 0.0 else 0.5 * end
    for _ in range(SEARCH_LIMIT):
        y1, v1 = oscillate(y, v, beta, k, t)
        left = work - 0.5 * mass * (e0 - v1 * v1 - k * y1 * y1)
        if left > 0.0:
            if t == end:
                return NEVER
            a = t
        else:
            if left == 0.0:
                return t
            b = t
            enough = True
        power = damping * v1 * v1
        change = -2.0 * damping * v1 * (2.0 * beta * v1 + k * y1)
        new = t + left / power
        if abs(left * change) < power * power:
            new = t + left * power / (power * power + 0.5 * left * change)
        if not a < new < b:
            # The work may end short of what is asked for: look at the end once.
            new = 0.5 * (a + b) if enough else end
        step = abs(new - t)
        t = new
        # As in _fall_between: the error left is of third order.
        curvature = change / power
        error = step * min(1.0, step * step * (curvature * curvature + k))
        if t < end and error <= ROOT_TOLERANCE * t:
            break
    return t
