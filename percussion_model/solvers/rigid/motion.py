"""Closed-form motion of a rigid body and the instants at which it crosses a level.

A body on the rock obeys y'' + 2 beta y' + k y = 0, y measured from rest under the
constant load; beta = C/(2M), k = K/M. Any linear combination of y and y' obeys the
same equation, so one set of functions serves position, velocity, acceleration and force.
"""

from __future__ import annotations

import math

from percussion_model.physics.elementary import acos, atan2, atanh, cos_and_sin, exp, expm1
from percussion_model.physics.kernel import kernel

NEVER = math.inf

# Relative step of a root search that is no progress any more (a few units in the last place).
ROOT_TOLERANCE = 4e-16

# Searches triple their digits each step; bracketing alone needs a step a bit.
SEARCH_LIMIT = 200

# Below this share of the critical damping's square the closed integral of v**2 loses digits.
NEAR_CRITICAL = 1e-4


@kernel
def oscillate(y, v, beta, k, tau):
    """Solution of y'' + 2 beta y' + k y = 0 after a time tau.

    Parameters
    ----------
    y, v : float
        Value and rate at the start.
    beta, k : float
        Decay rate [1/s] and square of the undamped angular frequency [1/s^2].
    tau : float
        Time [s], not negative.

    Returns
    -------
    y, v : float
        Value and rate at tau.
    """
    w2 = k - beta * beta
    if w2 > 0.0:
        w = math.sqrt(w2)
        decay = exp(-beta * tau)
        c, s = cos_and_sin(w * tau)
        s /= w
    else:
        r = math.sqrt(-w2)
        decay = exp(-k / (beta + r) * tau)
        c = 0.5 * (1.0 + exp(-2.0 * r * tau))
        s = -expm1(-2.0 * r * tau) / (2.0 * r) if r > 0.0 else tau
    return decay * (y * c + (v + beta * y) * s), decay * (v * c - (beta * v + k * y) * s)


@kernel
def zero_time(f, df, beta, k):
    """First tau > 0 at which a solution with value f and rate df is zero; NEVER if none.

    A zero at the start itself does not count.
    """
    w2 = k - beta * beta
    g = df + beta * f
    if w2 > 0.0:
        w = math.sqrt(w2)
        angle = atan2(f * w, -g)
        if angle <= 0.0:
            angle += math.pi
        return angle / w
    if f == 0.0 or f * g >= 0.0:
        return NEVER
    r = math.sqrt(-w2)
    ratio = -f / g
    if r * ratio >= 1.0:
        return NEVER
    return atanh(r * ratio) / r if r > 0.0 else ratio


@kernel
def _fall_between(f, df, beta, k, level, a, b, t):
    """Instant in [a, b] at which a falling solution reaches a level: Halley from t, bracketed."""
    for _ in range(SEARCH_LIMIT):
        g, dg = oscillate(f, df, beta, k, t)
        ddg = -2.0 * beta * dg - k * g
        g -= level
        if g > 0.0:
            a = t
        else:
            b = t
        new = 0.5 * (a + b)
        # Near an extremum the method would run to the extremum: halve the bracket there.
        if abs(g * ddg) < dg * dg:
            new = t - g * dg / (dg * dg - 0.5 * g * ddg)
            if not a <= new <= b:
                new = 0.5 * (a + b)
        step = new - t
        t = new
        # The error left is of third order in the step.
        curvature = ddg / dg
        if abs(step) * min(1.0, step * step * (curvature * curvature + k)) <= ROOT_TOLERANCE * t:
            break
    return t


@kernel
def fall_time(f, df, beta, k, level):
    """First tau at which a solution falls to a level; NEVER if it does not.

    The start must lie on or above the level up to rounding. A solution that starts on
    the level and rises is followed over its maximum. Extrema shrink, so only the first
    fall can reach the level: no more than two monotone pieces are looked at.
    """
    ddf = -2.0 * beta * df - k * f
    falls = df < 0.0 or (df == 0.0 and ddf < 0.0)
    if falls and f <= level:
        return 0.0
    if beta == 0.0:
        w = math.sqrt(k)
        radius = math.sqrt(f * f + df * df / k)
        if level < -radius or radius == 0.0:
            return NEVER
        phase = atan2(df / w, f)
        return max(0.0, (phase + acos(min(1.0, level / radius))) / w)
    w2 = k - beta * beta
    a = 0.0
    b = zero_time(df, ddf, beta, k)
    if not falls:
        if b == NEVER:
            return NEVER
        a = b
        b = a + math.pi / math.sqrt(w2) if w2 > 0.0 else NEVER
    if b == NEVER:
        # The last piece of an overdamped motion falls to zero and no further.
        if level <= 0.0:
            return NEVER
        b = 2.0 * a + 1.0 / beta
        while oscillate(f, df, beta, k, b)[0] > level:
            b *= 2.0
        return _fall_between(f, df, beta, k, level, a, b, b)
    # Amplitude over w/sqrt(k) is the size of the extrema of a decaying cosine.
    g = df + beta * f
    least = -math.sqrt((f * f * w2 + g * g) / k) * exp(-beta * b)
    if least > level:
        return NEVER
    # Around its least value the solution is nearly a cosine.
    t = max(a, b - acos(max(level / least, -1.0)) / math.sqrt(k)) if least < 0.0 else b
    return _fall_between(f, df, beta, k, level, a, b, t)


@kernel
def oscillate_with_loss(y, v, beta, k, tau):
    """`oscillate`, and the integral of y'**2 over [0, tau].

    The integral comes from the solution, not from the energy balance that it is to check;
    only within one ten-thousandth of critical damping the balance serves.

    Returns
    -------
    y, v : float
        Value and rate at tau.
    square : float
        Integral of the squared rate.
    """
    acc = -2.0 * beta * v - k * y
    w2 = k - beta * beta
    if w2 > NEAR_CRITICAL * k:
        w = math.sqrt(w2)
        c, s = cos_and_sin(w * tau)
        fade = -expm1(-beta * tau)
        decay = 1.0 - fade
        fade *= 1.0 + decay
        a = (v + beta * y) / w
        b = (acc + beta * v) / w
        mean = fade / (2.0 * beta) if beta > 0.0 else tau
        # cos and sin of twice the angle, less their values at the start, both decayed
        twice = 2.0 * s * c * decay * decay
        shift = fade + 2.0 * s * s * decay * decay
        square = 0.5 * (v * v + b * b) * mean
        square += (0.5 * (v * v - b * b) * (beta * shift + w * twice)) / (2.0 * k)
        square += v * b * (w * shift - beta * twice) / (2.0 * k)
        return decay * (y * c + a * s), decay * (v * c + b * s), square
    y1, v1 = oscillate(y, v, beta, k, tau)
    if w2 < -NEAR_CRITICAL * k:
        r = math.sqrt(-w2)
        slow = k / (beta + r)
        fast = beta + r
        a = (acc + fast * v) / (2.0 * r)
        b = v - a
        square = -a * a * expm1(-2.0 * slow * tau) / (2.0 * slow)
        square -= a * b * expm1(-2.0 * beta * tau) / beta
        square -= b * b * expm1(-2.0 * fast * tau) / (2.0 * fast)
        return y1, v1, square
    return y1, v1, (v * v - v1 * v1 + k * (y * y - y1 * y1)) / (4.0 * beta)
