"""Waves in the sections of bars: arriving, being sent, and the sums over what is under way."""

from __future__ import annotations

import numpy as np

from percussion_model.physics.kernel import inlined, kernel, preparing
from percussion_model.solvers.modal.lanes import (
    WIDTH,
    from_front,
    load,
    spread,
    total,
    totals,
)
from percussion_model.solvers.wave.records import Bar, Body, Place, Steel
from percussion_model.solvers.wave.taps import width_of

BAR, RING, SIZE, DELAY, TAPS, WEIGHTS, CELLS, PASSAGE, REACH = (int(row) for row in Place)
IMPEDANCE, ALPHA, BETA, CELL_MASS, BY_LOSS, BY_MIXING = (int(row) for row in Steel)
MASS, FIRST, LAST, INV_MASS, LATE = (int(row) for row in Body)
GIVEN = int(Bar.GIVEN)
# Rows of `Waves.came`: what arrives at the lower and the upper end of a section, what leaves
# these, and the impulses on the upper and the lower end of a bar and its acceleration.
DOWN, UP, DOWN_OUT, UP_OUT, FROM_ABOVE, FROM_BELOW, ACCELERATION = range(7)
CAME_ROWS = 7
# What waves are read for in cells.
VELOCITY_OF, STRESS_OF = 0, 1


@inlined
def turned(places, weights, rings, step, k, way):
    """By how much a step changes what a section of one to two steps keeps (`taps.turning`)."""
    weight, size = places[k, WEIGHTS], places[k, SIZE]
    late = (step - places[k, DELAY]) & (size - 1)
    x = rings[0, from_front(places[k, RING] + 2 * size * way + late)]
    q = rings[0, from_front(places[k, RING] + 4 * size + way)]
    return weights[0, from_front(weight + 1)] * x - weights[0, from_front(weight)] * q - q


@inlined
def send(places, weights, rings, step, k, down, up, share):
    """Send both waves, less what body forces gave the bar, into a section at a step's end."""
    size = places[k, SIZE]
    if places[k, TAPS] == 1 and places[k, WEIGHTS] >= 0:
        kept = from_front(places[k, RING] + 4 * size)
        beside = from_front(places[k, RING] + 4 * size + 1)
        one = turned(places, weights, rings, step, k, 0)
        other = turned(places, weights, rings, step, k, 1)
        rings[0, kept] += share * one
        rings[0, beside] += share * other
    place = places[k, RING] + ((step + 1) & (size - 1))
    # twice, so that what is read never wraps
    rings[0, from_front(place)] = rings[0, from_front(place + size)] = down
    rings[0, from_front(place + 2 * size)] = rings[0, from_front(place + 3 * size)] = up


@inlined
def pass_on(par, s, chain, waves):
    """Let waves arrive at the ends of sections, and pass from one to the next within bars.

    v = (2 Z1 d + 2 Z2 u) / (Z1 + Z2) (docs/model.md, eq. 8), in which what body forces give
    cancels. Waves that come to the ends of bars are left in rows of `came`. Arriving takes energy:
    the weighted squares of what was sent, less those of what arrives.
    """
    places, steel, weights, step = chain.places, chain.steel, chain.weights, s.step
    rings, came, bars = waves.rings, waves.came, waves.bars
    lost = mixed = spread(0.0)
    loss = other = before = 0.0
    for k in range(par.sections):
        size, taps, weight = places[k, SIZE], places[k, TAPS], places[k, WEIGHTS]
        first = places[k, RING] + ((step - places[k, DELAY] - taps + 1) & (size - 1))
        second = first + 2 * size
        if taps == 1:
            down, up = rings[0, from_front(first)], rings[0, from_front(second)]
            if weight >= 0:  # of one to two steps (taps.turning)
                a, b = weights[0, from_front(weight)], weights[0, from_front(weight + 1)]
                kept = places[k, RING] + 4 * size
                down = a * down + b * rings[0, from_front(kept)]
                up = a * up + b * rings[0, from_front(kept + 1)]
        else:
            share = load(weights, 0, weight)
            x, y = load(rings, 0, first), load(rings, 0, second)
            one, two = share * x, share * y
            squares = one * x + two * y
            for j in range(WIDTH, taps, WIDTH):
                share = load(weights, 0, weight + j)
                x, y = load(rings, 0, first + j), load(rings, 0, second + j)
                p, q = share * x, share * y
                one, two = one + p, two + q
                squares = squares + (p * x + q * y)
            down, up = totals(one, two)
            by, both = steel[k, BY_LOSS], down * down + up * up
            lost = lost + squares * by
            loss += by * both
            by = steel[k, BY_MIXING]
            if by > 0.0:
                mixed = mixed + squares * by
                other += by * both
        alpha = steel[k, ALPHA]
        if alpha == 0.0:
            came[UP, k] = up + bars[GIVEN, from_front(places[k, BAR])]
            if k > 0:
                above = from_front(k - 1)
                came[DOWN, above] = before + bars[GIVEN, from_front(places[above, BAR])]
        else:
            v = alpha * before + steel[k, BETA] * up
            came[UP_OUT, from_front(k - 1)], came[DOWN_OUT, k] = v - before, v - up
        before = down
    last = par.sections - 1
    came[DOWN, last] = before + bars[GIVEN, places[last, BAR]]
    return total(lost) - loss, total(mixed) - other


@inlined
def kept_of(chain, k):
    """What a section of one to two steps keeps of a lasting wave of 1 m/s; 0 of others."""
    weight = chain.places[k, WEIGHTS]
    if chain.places[k, TAPS] > 1 or weight < 0:
        return 0.0
    return chain.weights[0, weight + 1] / (1.0 + chain.weights[0, weight])


@kernel
def mixing_in_turns(dt, chain, waves, step, k, share, change):
    """As `part_of_step` dissipates, in what a section of one to two steps keeps, before it."""
    if chain.places[k, TAPS] > 1 or chain.places[k, WEIGHTS] < 0:
        return 0.0
    change *= kept_of(chain, k)
    a = turned(chain.places, chain.weights, waves.rings, step, k, 0) + change
    b = turned(chain.places, chain.weights, waves.rings, step, k, 1) + change
    return share * (1.0 - share) * chain.steel[k, IMPEDANCE] * dt * (a * a + b * b)


@kernel
def part_of_step(dt, chain, waves, step, bar, share, change):
    """Move the waves of a bar back to a share of the step just done, into which they were sent.

    Waves of neighbouring steps mix so.

    Parameters
    ----------
    change : float
        Velocity that body forces give each wave in a whole step [m/s].

    Returns
    -------
    float
        Energy that the mixing dissipates [J].
    """
    lost, rings = 0.0, waves.rings
    for k in range(int(chain.bodies[bar, FIRST]), int(chain.bodies[bar, LAST]) + 1):
        size, taps, weight = chain.places[k, SIZE], chain.places[k, TAPS], chain.places[k, WEIGHTS]
        one = 0.0
        for way in range(2):
            start, left = chain.places[k, RING] + 2 * size * way, 1.0
            for age in range(size - 1):
                late = age - chain.places[k, DELAY]
                if late >= taps:
                    left = 0.0
                elif late > 0:
                    left -= chain.weights[0, weight + taps - late]
                here = start + ((step - age) & (size - 1))
                jump = rings[0, here] - rings[0, start + ((step - age - 1) & (size - 1))]
                one += left * (jump + change) * (jump + change)
                rings[0, here] -= (1.0 - share) * jump
                rings[0, here + size] = rings[0, here]
        lost += chain.steel[k, IMPEDANCE] * dt * one
    return share * (1.0 - share) * lost


@kernel
def write_given(chain, waves, bar):
    """Write what body forces gave the waves of a bar into its rings."""
    given = waves.bars[GIVEN, bar]
    waves.bars[GIVEN, bar] = 0.0
    for k in range(int(chain.bodies[bar, FIRST]), int(chain.bodies[bar, LAST]) + 1):
        start, count = chain.places[k, RING], 4 * chain.places[k, SIZE]
        for i in range(count):
            waves.rings[0, start + i] += given
        waves.rings[0, start + count] += kept_of(chain, k) * given
        waves.rings[0, start + count + 1] += kept_of(chain, k) * given


@inlined
def sent_to_cell(places, rings, step, k, way, cell):
    """A wave of a section in a cell as it was sent, without what body forces gave."""
    size = places[k, SIZE]
    age = cell if way == 0 else places[k, CELLS] - 1 - cell
    return rings[0, places[k, RING] + 2 * size * way + ((step - age) & (size - 1))]


@kernel
def wave_in_cell(chain, rings, step, k, way, cell, of):
    """A wave of a section in a cell, counted from the top, without what body forces gave.

    On its way there loss has spread it, as it does on the whole way through the section; `of` is
    VELOCITY_OF, or STRESS_OF: by a wave in stress, Z times which is a force.
    """
    places, size, reach = chain.places, chain.places[k, SIZE], chain.places[k, REACH]
    if reach == 0:
        return sent_to_cell(places, rings, step, k, way, cell)
    age = cell if way == 0 else places[k, CELLS] - 1 - cell
    start, row = places[k, RING] + 2 * size * way, width_of(reach)
    weight = places[k, PASSAGE] + (of * places[k, CELLS] + age) * row
    if age >= reach:
        first = start + ((step - age - reach - 1) & (size - 1))
        sums = load(chain.passage, 0, weight) * load(rings, 0, first)
        for j in range(WIDTH, row, WIDTH):
            sums = sums + load(chain.passage, 0, weight + j) * load(rings, 0, first + j)
        return total(sums)
    newest, wave = rings[0, start + (step & (size - 1))], 0.0
    for j in range(2 * reach + 2):
        back = age + reach + 1 - j
        sent = rings[0, start + ((step - abs(back)) & (size - 1))]
        # what is still to come goes on in a straight line
        sent = sent if back >= 0 else 2.0 * newest - sent
        wave += chain.passage[0, weight + j] * sent
    return wave


@kernel
def force_in(chain, rings, step, bar, cell):
    """Elastic force in a cell of a bar, compression positive [N]."""
    k, last = int(chain.bodies[bar, FIRST]), int(chain.bodies[bar, LAST])
    while k < last and cell >= chain.places[k, CELLS]:
        cell -= chain.places[k, CELLS]
        k += 1
    down = wave_in_cell(chain, rings, step, k, 0, cell, STRESS_OF)
    up = wave_in_cell(chain, rings, step, k, 1, cell, STRESS_OF)
    return chain.steel[k, IMPEDANCE] * (down - up)


@kernel
def fill_cells(chain, rings, step, bar, force, velocity):
    """Fill in elastic force [N] and velocity [m/s] of each cell of a bar.

    Velocities are without what body forces gave.
    """
    at = 0
    for k in range(int(chain.bodies[bar, FIRST]), int(chain.bodies[bar, LAST]) + 1):
        for cell in range(chain.places[k, CELLS]):
            down = wave_in_cell(chain, rings, step, k, 0, cell, STRESS_OF)
            up = wave_in_cell(chain, rings, step, k, 1, cell, STRESS_OF)
            force[at] = chain.steel[k, IMPEDANCE] * (down - up)
            down = wave_in_cell(chain, rings, step, k, 0, cell, VELOCITY_OF)
            up = wave_in_cell(chain, rings, step, k, 1, cell, VELOCITY_OF)
            velocity[at] = down + up
            at += 1


@preparing
def cell_masses(chain, bar):
    """Mass of each cell of a bar, top to bottom [kg]."""
    first, end = int(chain.bodies[bar, FIRST]), int(chain.bodies[bar, LAST]) + 1
    n = 0
    for k in range(first, end):
        n += chain.places[k, CELLS]
    found, at = np.zeros(n), 0
    for k in range(first, end):
        for _ in range(chain.places[k, CELLS]):
            found[at] = chain.steel[k, CELL_MASS]
            at += 1
    return found


@kernel
def kinetic_as_sent(chain, waves, step, bar):
    """About the kinetic energy of a bar, which is less by what loss takes on the way [J]."""
    energy, given = 0.0, waves.bars[GIVEN, bar]
    for k in range(int(chain.bodies[bar, FIRST]), int(chain.bodies[bar, LAST]) + 1):
        one = 0.0
        for cell in range(chain.places[k, CELLS]):
            v = sent_to_cell(chain.places, waves.rings, step, k, 0, cell)
            v += sent_to_cell(chain.places, waves.rings, step, k, 1, cell) + 2.0 * given
            one += v * v
        energy += 0.5 * chain.steel[k, CELL_MASS] * one
    return energy


@kernel
def kinetic_of_bar(chain, waves, step, bar):
    """Kinetic energy of a bar [J]."""
    energy, given = 0.0, waves.bars[GIVEN, bar]
    for k in range(int(chain.bodies[bar, FIRST]), int(chain.bodies[bar, LAST]) + 1):
        one = 0.0
        for cell in range(chain.places[k, CELLS]):
            v = wave_in_cell(chain, waves.rings, step, k, 0, cell, VELOCITY_OF)
            v += wave_in_cell(chain, waves.rings, step, k, 1, cell, VELOCITY_OF) + 2.0 * given
            one += v * v
        energy += 0.5 * chain.steel[k, CELL_MASS] * one
    return energy


@kernel
def under_way(dt, chain, waves, step, bar):
    """Energy [J] and mean velocity [m/s] of a bar: of each wave what has not yet arrived of it."""
    energy = momentum = 0.0
    given = waves.bars[GIVEN, bar]
    for k in range(int(chain.bodies[bar, FIRST]), int(chain.bodies[bar, LAST]) + 1):
        size, taps, weight = chain.places[k, SIZE], chain.places[k, TAPS], chain.places[k, WEIGHTS]
        one = both = 0.0
        kept = kept_of(chain, k)
        for way in range(2):
            start = chain.places[k, RING] + 2 * size * way
            left = 1.0
            for age in range(chain.places[k, DELAY] + taps):
                late = age - chain.places[k, DELAY]
                if late > 0:  # the newest weight is the last
                    left -= chain.weights[0, weight + taps - late]
                x = waves.rings[0, start + ((step - age) & (size - 1))] + given
                one += left * x * x
                both += left * x
            x = waves.rings[0, chain.places[k, RING] + 4 * size + way] + kept * given
            one += x * x
            both += kept * x
        energy += chain.steel[k, IMPEDANCE] * dt * one
        momentum += chain.steel[k, IMPEDANCE] * dt * both
    return energy, momentum * chain.bodies[bar, INV_MASS]
