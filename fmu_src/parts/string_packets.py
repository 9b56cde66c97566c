"""Rods as travelling waves that are polynomials within each cell, open at the low end.

In the transit time of a cell each wave moves by one, exactly. The wave of a cell is a sum of
Legendre polynomials of the time from -1 to 1 in which it leaves the cell. With v = d + u and the
compression F = Z (d - u), d goes down and u up. The head is a mass at the upper end, moved in
closed form: M v' = F + M g - Z (v - 2 u). What leaves the lowest cell, and what comes into it, is
for others to take and to give.
"""

from __future__ import annotations

import math

import numpy as np

from fmu_src.parts.string_body import cell_mass_of, gravity_of, impedance_of, step_of
from percussion_model.physics.elementary import cos, exp
from percussion_model.physics.kernel import kernel

# Polynomials that make up a wave within a cell or a communication step.
DEGREES = 8
# A wave keeps its energy to this share; that of its varying part is made so much larger at most.
KEPT, MOST = 1e-12, 10.0
# Rounds of Newton's method, more than double precision takes.
ROUNDS = 8


def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places and weights from -1 to 1 of Gauss and Legendre, the same bits on every machine."""
    places, weights = np.zeros(count), np.zeros(count)
    for i in range(count):
        x = -float(cos(math.pi * (i + 0.75) / (count + 0.5)))
        slope = 1.0
        for _ in range(ROUNDS):
            before, now = 1.0, x
            for k in range(2, count + 1):
                before, now = now, ((2 * k - 1) * x * now - (k - 1) * before) / k
            slope = count * (x * now - before) / (x * x - 1.0)
            x -= now / slope
        places[i], weights[i] = x, 2.0 / ((1.0 - x * x) * slope * slope)
    return places, weights


def polynomials(places: np.ndarray) -> np.ndarray:
    """Values of the polynomials at places, one place a row."""
    rows = [np.ones_like(places), places]
    for k in range(2, DEGREES):
        rows.append(((2 * k - 1) * places * rows[-1] - (k - 1) * rows[-2]) / k)
    return np.array(rows).T.copy()


# At these places products of two polynomials are summed up exactly.
PLACES, WEIGHTS = gauss(DEGREES)
# From values there to shares of the polynomials.
SHARES = (polynomials(PLACES) * WEIGHTS[:, None]).T * np.arange(0.5, DEGREES)[:, None]
# The next of them from two: P_(k+1) = (2 k + 1)/(k + 1) x P_k - k/(k + 1) P_(k-1).
FORTH = np.arange(1.0, 2.0 * DEGREES, 2.0) / np.arange(1.0, DEGREES + 1.0)
BACK = np.arange(DEGREES) / np.arange(1.0, DEGREES + 1.0)
# Mean squares of the polynomials, and their signs when they are read from the other end.
SQUARES = 1.0 / np.arange(1.0, 2.0 * DEGREES, 2.0)
MIRROR = (-1.0) ** np.arange(DEGREES)
# Places of the integrals that move the head.
FINE, FINE_WEIGHTS = gauss(24)
# What is made of parameters: velocities of the head at the places and at the end of a transit time
# by the polynomials of a wave, by a force [N], by the velocity before; and room for some waves.
TIMES = DEGREES + 1
BY_WAVE, BY_FORCE, KEEPS = 0, TIMES * DEGREES, TIMES * (DEGREES + 1)
COMING = TIMES * (DEGREES + 2)
RISING, HEAD = COMING + DEGREES, COMING + 2 * DEGREES
MADE = HEAD + TIMES


@kernel
def make_packets(p, made):
    """Find how the head answers: M v' + Z v = 2 Z u + F."""
    step = step_of(p)
    fall = impedance_of(p) * step / p.head_mass
    for i in range(TIMES):
        time = 0.5 * (PLACES[i] + 1.0) if i < DEGREES else 1.0
        for j in range(len(FINE)):
            at = 0.5 * time * (FINE[j] + 1.0)
            share = 0.5 * time * FINE_WEIGHTS[j] * exp(-fall * (time - at))
            made[BY_FORCE + i] += share * step / p.head_mass
            before, now, x = 0.0, 1.0, 2.0 * at - 1.0
            for k in range(DEGREES):
                made[BY_WAVE + i * DEGREES + k] += 2.0 * fall * share * now
                before, now = now, FORTH[k] * x * now - BACK[k] * before
        made[KEEPS + i] = exp(-fall * time)


@kernel
def gain_of(p):
    """What weight adds to a wave that leaves within a transit time, until then and after [m/s]."""
    return 0.25 * gravity_of(p) * step_of(p)


@kernel
def value_at(shares, at, x):
    """Value of a wave at a place from -1 to 1, whose shares begin somewhere in an array."""
    before, now, total = 0.0, 1.0, 0.0
    for k in range(DEGREES):
        total += shares[at + k] * now
        before, now = now, FORTH[k] * x * now - BACK[k] * before
    return total


@kernel
def project(shares, at, begin, span, found, to, since, long):
    """Add a wave over one time to the sums of its projection on another time.

    Parameters
    ----------
    shares, at : array, int
        The wave, from `begin` over `span` [s].
    found, to : array, int
        Sums, over the time from `since` on, `long` [s].

    Returns
    -------
    squared : float
        What the wave adds to the mean square over that time [m2/s2].
    """
    low, squared = max(since, begin), 0.0
    both = min(since + long, begin + span) - low
    if both <= 0.0:
        return squared
    for i in range(DEGREES):
        t = low + 0.5 * both * (PLACES[i] + 1.0)
        value = value_at(shares, at, 2.0 * (t - begin) / span - 1.0)
        share = both / long * WEIGHTS[i] * value
        squared += 0.5 * share * value
        before, now, x = 0.0, 1.0, 2.0 * (t - since) / long - 1.0
        for k in range(DEGREES):
            found[to + k] += (k + 0.5) * share * now
            before, now = now, FORTH[k] * x * now - BACK[k] * before
    return squared


@kernel
def keep_energy(waves, at, squared):
    """Scale what a projection has besides its mean, so that it has the mean square given [m2/s2].

    It has less by itself (Bessel); the mean, which is momentum, stays.

    Returns
    -------
    lacking : float
        Mean square that it cannot have, below 0 where the mean alone has more.
    """
    mean = waves[at] * waves[at]
    varies, wanted = square(waves, at) - mean, max(squared - mean, 0.0)
    if varies > 0.0 and abs(wanted - varies) > KEPT * squared:
        scale = math.sqrt(min(wanted / varies, MOST))
        for k in range(1, DEGREES):
            waves[at + k] *= scale
    return squared - square(waves, at)


@kernel
def clear(waves, at):
    """No wave."""
    for k in range(DEGREES):
        waves[at + k] = 0.0


@kernel
def square(waves, at):
    """Mean square of a wave [m2/s2]."""
    total = 0.0
    for k in range(DEGREES):
        total += waves[at + k] * waves[at + k] * SQUARES[k]
    return total


@kernel
def rest_packets(p, s, w, down, up, bottom_force):
    """Stand still, with this compression at the low end [N].

    Parameters
    ----------
    down, up : int
        Where waves that go down, and up, begin in what moves.
    """
    x, cells, weight = w.moving, s.count * p.rod_cells, cell_mass_of(p) * gravity_of(p)
    for k in range(cells):
        force = bottom_force - weight * (cells - 1 - k + 0.5)
        x[down + k * DEGREES] = force / (2.0 * impedance_of(p))
        x[up + k * DEGREES] = -x[down + k * DEGREES]
        x[down + k * DEGREES + 1] = x[up + k * DEGREES + 1] = -gain_of(p)


@kernel
def leave(p, s, w, down, ahead, to):
    """Put what leaves the low end in a transit time to come, the next one with 0, into the room.

    True as far as friction does not take part of it on the way.
    """
    at, gain = down + (s.count * p.rod_cells - 1 - ahead) * DEGREES, gain_of(p)
    for k in range(DEGREES):
        w.made[to + k] = w.moving[at + k]
    w.made[to] += gain + 2.0 * ahead * gain
    w.made[to + 1] += gain


@kernel
def advance_packets(p, s, w, down, up, head_force, free):
    """Go on by a transit time; what comes in at the low end lies in the room.

    Parameters
    ----------
    head_force : float
        On the head, without weight [N].
    free : int
        Lowest cells in which the wall takes nothing; those above take their part as well.
    """
    x, made, cells, gain = w.moving, w.made, s.count * p.rod_cells, gain_of(p)
    last, weight, mass = (cells - 1) * DEGREES, p.head_mass * p.gravity, cell_mass_of(p)
    # squares that weight adds: to waves that leave or arrive, and to those that go on
    gained = -square(x, down + last) - square(x, up)
    for k in range(DEGREES):
        made[RISING + k] = x[up + k] + (gain if k < 2 else 0.0)
    left = square(x, down + last) + 2.0 * gain * x[down + last] + gain * gain
    left += (2.0 * gain * x[down + last + 1] + gain * gain) / 3.0
    gained += left + square(made, RISING)
    for i in range(TIMES):
        found = made[BY_FORCE + i] * (head_force + weight) + made[KEEPS + i] * s.head_velocity
        for k in range(DEGREES):
            found += made[BY_WAVE + i * DEGREES + k] * made[RISING + k]
        made[HEAD + i] = found
    s.head_velocity = made[HEAD + DEGREES]
    for k in range(DEGREES):  # what goes back from the head
        found = 0.0
        for i in range(DEGREES):
            found += SHARES[k, i] * made[HEAD + i]
        if k == 0:
            s.head += step_of(p) * found
            s.weight_work += weight * step_of(p) * found
        made[RISING + k] = found - made[RISING + k]
    gained -= square(made, RISING) + square(made, COMING)
    s.port_work -= mass * (square(made, COMING) - left)
    for k in range(last - 1, -1, -1):
        x[down + DEGREES + k] = x[down + k]
    for k in range(last):
        x[up + k] = x[up + DEGREES + k]
    for k in range(1, cells):
        for at in (down + k * DEGREES, up + (k - 1) * DEGREES):
            gained += 4.0 * gain * (x[at] + gain)
            x[at] += 2.0 * gain
    for k in range(DEGREES):
        after = gain if k == 0 else -gain if k == 1 else 0.0
        x[down + k], x[up + last + k] = made[RISING + k] + after, made[COMING + k] + after
    gained += square(x, down) + square(x, up + last)
    s.weight_work += mass * gained
    rub_packets(p, s, w, down, up, free)


@kernel
def rub_packets(p, s, w, down, up, free):
    """Wall friction on the cells above the lowest, which takes from both waves alike."""
    x, cells, mass = w.moving, s.count * p.rod_cells, cell_mass_of(p)
    rubbed = cells - free
    if rubbed < 1 or not (p.friction_viscosity > 0.0 or p.friction_force > 0.0):
        return
    more = cells / rubbed * (p.rod_length / p.rod_cells) / mass * step_of(p)
    keeps, slowed = 1.0 / (1.0 + p.friction_viscosity * more), p.friction_force * more
    for at in range(0, rubbed * DEGREES, DEGREES):
        for k in range(DEGREES):
            before = x[up + at + k] + MIRROR[k] * x[down + at + k]
            after = before * keeps
            if k == 0:
                after = math.copysign(max(abs(after) - slowed, 0.0), after)
                s.lost_momentum += mass * (before - after)
            x[up + at + k] += 0.5 * (after - before)
            x[down + at + k] += MIRROR[k] * 0.5 * (after - before)
            s.friction_loss += 0.5 * mass * (before * before - after * after) * SQUARES[k]


@kernel
def add_to_packets(p, s, w, down, up):
    """Put a rod below the head, in the state of the place where it joins."""
    x, new, gain = w.moving, p.rod_cells, gain_of(p)
    for k in range(s.count * new * DEGREES - 1, -1, -1):
        x[down + new * DEGREES + k], x[up + new * DEGREES + k] = x[down + k], x[up + k]
    s.count += 1
    falls, rises = x[down + new * DEGREES], x[up + new * DEGREES]
    for k in range(new):
        for at in (down + k * DEGREES, up + k * DEGREES):
            clear(x, at)
            x[at + 1] = -gain
        x[down + k * DEGREES] = falls - (new - k) * 2.0 * gain
        x[up + k * DEGREES] = rises + (new - k) * 2.0 * gain


@kernel
def stored_in_packets(p, s, w, down, up):
    """Kinetic and elastic energy of head and rods [J]."""
    total = 0.0
    for at in range(0, s.count * p.rod_cells * DEGREES, DEGREES):
        total += square(w.moving, down + at) + square(w.moving, up + at)
    return cell_mass_of(p) * total + 0.5 * p.head_mass * (s.head_velocity * s.head_velocity)


@kernel
def momentum_of_packets(p, s, w, down, up):
    """Of head and rods [N s]."""
    total = 0.0
    for at in range(0, s.count * p.rod_cells * DEGREES, DEGREES):
        total += w.moving[down + at] + w.moving[up + at]
    return cell_mass_of(p) * total + p.head_mass * s.head_velocity
