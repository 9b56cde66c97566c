"""Normal modes of a stepped bar, to rounding and for any lengths.

In each section a mode is u = R cos(phi), with the force Z w R sin(phi); the phase phi grows
by w T over a section of transit time T. Where the impedance changes, u and the force stay. The
top end is free or carries a mass, the low end is free or stands on a spring: the phases that
follow rise with w, and each mode is a root of its own, which bisection finds
(docs/modal.md, section 1).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from percussion_model.physics.elementary import atan2, cos, sin
from percussion_model.physics.kernel import kernel, plain, preparing
from percussion_model.scene.bars import (
    add,
    bar_transit_time,
    section_impedance,
    section_mass,
    section_transit_time,
)
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes

# Halvings of the interval in which a root lies: more than a number has digits.
HALVINGS = 70
# What left-out modes yield has to be above this share of what the spring yields to have digits.
LEAST_YIELD = 1e-9
# Below this argument sin(x) / x is its series.
SMALL = 1e-4
# Of the nodes of a quadrature; each doubles their digits.
NEWTON_STEPS = 5


class Modes(NamedTuple):
    """Modes of a bar, the lowest first; shapes have a modal mass of 1 kg.

    Attributes
    ----------
    frequency : ndarray, shape (n,)
        Angular, without loss [rad/s]; 0 first where nothing holds the bar.
    wave : ndarray, shape (n,)
        The same of the wave in each row of `size` and `phase`.
    size, phase : ndarray, shape (n, sections)
        Amplitude [1/kg^0.5] in each section, and phase at its top.
    last : ndarray, shape (n,)
        The last shape is the sum of all waves, so much of each.
    impedance, transit, mass : ndarray, shape (sections,)
        Of the sections [N s/m, s, kg].
    top_mass : float
        Mass on the top end [kg].
    """

    frequency: np.ndarray
    wave: np.ndarray
    size: np.ndarray
    phase: np.ndarray
    last: np.ndarray
    impedance: np.ndarray
    transit: np.ndarray
    mass: np.ndarray
    top_mass: float


@plain
def summed(modes, rows):
    """What belongs to each shape, by what belongs to each wave (first axis of a matrix)."""
    out = rows.copy()
    _sum_last(rows, modes.last, out)
    return out


@kernel
def _fill_shape(modes, section, share, waves):
    """Fill the one column of a matrix with the waves at a place, after a share of a section."""
    for k in range(len(modes.wave)):
        phase = modes.phase[k, section] + modes.wave[k] * (modes.transit[section] * share)
        waves[k, 0] = modes.size[k, section] * cos(phase)


@plain
def _shape_at(modes, section, share):
    """Shape at a place of a section, after such a share of its length."""
    waves = np.zeros((len(modes.wave), 1))
    _fill_shape(modes, section, share, waves)
    return summed(modes, waves)[:, 0].copy()


@plain
def shape_above(modes, section):
    """Shape at the top of a section."""
    return _shape_at(modes, section, 0.0)


@plain
def shape_low(modes):
    """Shape at the low end."""
    return _shape_at(modes, len(modes.transit) - 1, 1.0)


@kernel
def _sum_last(rows, last, out):
    """Sum of rows, so much of each, into the last one, in an order of its own."""
    for j in range(rows.shape[1]):
        total = 0.0
        for k in range(len(last)):
            total += last[k] * rows[k, j]
        out[-1, j] = total


@kernel
def _fill_quadrature(nodes, weights, before, value):
    """Fill in nodes and weights; of polynomials of Legendre, the last two that were reached."""
    n = len(nodes)
    for i in range(n):
        nodes[i] = cos(math.pi * (n - 1 - i + 0.75) / (n + 0.5))
    for _ in range(NEWTON_STEPS):
        for i in range(n):
            before[i], value[i] = 1.0, nodes[i]
        for k in range(2, n + 1):
            for i in range(n):  # side by side: each of them would wait for its last quotient
                x, last = nodes[i], value[i]
                value[i] = ((2.0 * k - 1.0) * x * last - (k - 1.0) * before[i]) / k
                before[i] = last
        for i in range(n):
            x = nodes[i]
            weights[i] = n * (before[i] - x * value[i]) / (1.0 - x * x)  # the slope
            nodes[i] = x - value[i] / weights[i]
    for i in range(n):
        x, slope = nodes[i], weights[i]
        weights[i] = 2.0 / ((1.0 - x * x) * slope * slope)


@plain
def quadrature(count):
    """Nodes and weights of Gauss and Legendre from -1 to 1, so many.

    numpy finds them by a matrix so large that a thread of its linear algebra wakes, and then
    spins for a tenth of a second.
    """
    nodes, weights = np.zeros(count), np.zeros(count)
    _fill_quadrature(nodes, weights, np.zeros(count), np.zeros(count))
    return nodes, weights


@plain
def enough_nodes(modes):
    """Nodes that so many modes take in each section."""
    return 2 * modes + 18


@kernel
def _inertia(mass, transit, top_mass, wave, size, phase, last, nodes, weights):
    """Modal mass of the sum of all waves, so much of each."""
    total = 0.0
    for i in range(len(transit)):
        for at in range(-1 if i == 0 else 0, len(nodes)):
            share = 0.5 * (1.0 + nodes[at]) if at >= 0 else 0.0
            offset = 0.0
            for k in range(len(wave)):
                angle = phase[k, i] + wave[k] * transit[i] * share
                offset += last[k] * size[k, i] * cos(angle)
            weight = 0.5 * weights[at] * mass[i] if at >= 0 else top_mass
            total += weight * offset * offset
    return total


@kernel
def _phase(impedance, transit, top_mass, w):
    """Phase at the low end."""
    phase = atan2(top_mass * w, impedance[0])
    for i in range(len(transit)):
        if i > 0 and impedance[i] != impedance[i - 1]:
            half = math.pi * math.floor(phase / math.pi + 0.5)
            rest = phase - half
            ratio = impedance[i - 1] / impedance[i]
            phase = half + atan2(ratio * sin(rest), cos(rest))
        phase += w * transit[i]
    return phase


@kernel
def _find_modes(impedance, transit, mass, top_mass, spring, frequency, size, phases):
    """Fill frequencies, sizes and phases."""
    whole = total = 0.0
    for i in range(len(transit)):
        whole += transit[i]
        total += mass[i]
    # changes of impedance and a mass on top shift the phase by less than a right angle each
    shift = 0.5 * math.pi * (len(transit) + 1)
    for k in range(len(frequency)):
        if k == 0 and spring == 0.0:
            frequency[k] = 0.0
            for i in range(len(transit)):
                size[k, i] = 1.0 / math.sqrt(total + top_mass)
                phases[k, i] = 0.0
            continue
        low = max(0.0, k * math.pi - shift) / whole
        high = (k * math.pi + 0.5 * math.pi + shift) / whole
        for _ in range(HALVINGS):
            middle, below, beyond = 0.5 * (low + high), low, high
            wanted = k * math.pi
            if spring > 0.0:
                wanted += atan2(spring, impedance[-1] * middle)
            if _phase(impedance, transit, top_mass, middle) < wanted:
                low = middle
            else:
                high = middle
            if low == below and high == beyond:
                break
        w = 0.5 * (low + high)
        phase = atan2(top_mass * w, impedance[0])
        at_top = cos(phase)
        amplitude, modal = 1.0, top_mass * at_top * at_top
        for i in range(len(transit)):
            if i > 0 and impedance[i] != impedance[i - 1]:
                c = cos(phase)
                s = impedance[i - 1] / impedance[i] * sin(phase)
                phase = atan2(s, c)
                amplitude *= math.sqrt(c * c + s * s)
            size[k, i], phases[k, i] = amplitude, phase
            then = phase + w * transit[i]
            swing = (sin(2.0 * then) - sin(2.0 * phase)) / (4.0 * w * transit[i])
            modal += mass[i] * amplitude * amplitude * (0.5 + swing)
            phase = then
        frequency[k] = w
        for i in range(len(transit)):
            size[k, i] /= math.sqrt(modal)


@plain
def bar_modes(sections, count, spring=0.0, top_mass=0.0):
    """Return the lowest modes of a bar.

    Parameters
    ----------
    sections : ndarray, shape (sections, 4)
        As `section_numbers` has them.
    count : int
        The rigid one of a free bar among them.
    spring : float
        Stiffness under the low end [N/m].
    top_mass : float
        Mass on the top end [kg].

    Returns
    -------
    Modes
    """
    parts = len(sections)
    impedance, transit, mass = np.zeros(parts), np.zeros(parts), np.zeros(parts)
    for i in range(parts):
        impedance[i] = section_impedance(sections[i])
        transit[i] = section_transit_time(sections[i])
        mass[i] = section_mass(sections[i])
    frequency, last = np.zeros(count), np.zeros(count)
    size, phase = np.zeros((count, parts)), np.zeros((count, parts))
    _find_modes(impedance, transit, mass, float(top_mass), float(spring), frequency, size, phase)
    last[count - 1 :] = 1.0
    return Modes(
        frequency, frequency.copy(), size, phase, last, impedance, transit, mass, float(top_mass)
    )


@kernel
def _yields_left(low, frequency, spring):
    """What modes but the last one leave of the offset by a force of 1 N at the low end [m/N]."""
    total, rest = 1.0, 0.0
    for k in range(len(low) - 1):
        share = low[k] / frequency[k]
        total, rest = add(total, rest, -spring * (share * share))
    return (total + rest) / spring


@plain
def with_residual(modes, spring, nodes, weights):
    """Return the modes of a bar on a spring with what those left out yield in place of the last.

    A constant force at the low end moves such a bar as a whole, by 1 / K. Less what the other
    modes have of that, this is a shape orthogonal to them, in mass and in stiffness: with it
    the low end yields as that of the whole bar (a residual vector of structural dynamics).

    Parameters
    ----------
    modes : Modes
        As `bar_modes` finds them.
    spring : float
        Stiffness under the low end [N/m].
    nodes, weights : ndarray
        A `quadrature` of `enough_nodes`.

    Returns
    -------
    Modes
    """
    n = len(modes.frequency) - 1
    low = shape_low(modes)
    yields = _yields_left(low, modes.frequency, float(spring))
    if not yields > LEAST_YIELD / spring:
        return modes
    frequency, wave = modes.frequency.copy(), modes.wave.copy()
    size, phase, last = modes.size.copy(), modes.phase.copy(), np.zeros(n + 1)
    wave[n] = 0.0
    size[n], phase[n] = 1.0, 0.0
    last[:n] = -low[:n] / (modes.frequency[:n] * modes.frequency[:n])
    last[n] = 1.0 / spring
    # by quadrature: as a difference of squares it would lose its digits
    inertia = _inertia(
        modes.mass, modes.transit, modes.top_mass, wave, size, phase, last, nodes, weights
    )
    frequency[n] = math.sqrt(yields / inertia)
    last /= math.sqrt(inertia)
    return Modes(
        frequency, wave, size, phase, last,
        modes.impedance, modes.transit, modes.mass, modes.top_mass,
    )  # fmt: skip


@plain
def count_below(sections, highest):
    """Elastic modes below a frequency [rad/s]; with several sections there may be some more."""
    return round(bar_transit_time(sections) * highest / math.pi)


@kernel
def _sinc(x):
    return 1.0 - x * x / 6.0 if abs(x) < SMALL else sin(x) / x


@kernel
def _fill_products(mass, transit, w, size, phase, w_2, size_2, phase_2, out, back):
    """Fill the products of two sets of shapes, weighted by mass, and those of the second and first.

    They differ by rounding alone, and what is dear in them is the same.
    """
    for k in range(len(w)):
        for j in range(len(w_2)):
            total = other = 0.0
            for i in range(len(transit)):
                less = 0.5 * (w[k] - w_2[j]) * transit[i]
                more = 0.5 * (w[k] + w_2[j]) * transit[i]
                both = _sinc(less) * cos(phase[k, i] - phase_2[j, i] + less)
                both += _sinc(more) * cos(phase[k, i] + phase_2[j, i] + more)
                total += 0.5 * mass[i] * size[k, i] * size_2[j, i] * both
                other += 0.5 * mass[i] * size_2[j, i] * size[k, i] * both
            out[k, j] = total
            back[j, k] = other


@plain
def _of_shapes(one, first, other, second, waves):
    """Products of shapes by those of their waves."""
    by_shape = summed(other, np.ascontiguousarray(summed(one, waves).T))
    found = np.ascontiguousarray(by_shape.T)
    if first == 0 and second == 0 and one.top_mass > 0.0 and other.top_mass > 0.0:
        mine, theirs = shape_above(one, 0), shape_above(other, 0)
        for k in range(len(mine)):
            found[k] += one.top_mass * (mine[k] * theirs)
    return found


@plain
def products_both(one, first, other, second, count):
    """`products` of two bars, and those of the second and the first."""
    out = np.zeros((len(one.frequency), len(other.frequency)))
    back = np.zeros((len(other.frequency), len(one.frequency)))
    _fill_products(
        one.mass[first : first + count],
        one.transit[first : first + count],
        one.wave,
        np.ascontiguousarray(one.size[:, first : first + count]),
        np.ascontiguousarray(one.phase[:, first : first + count]),
        other.wave,
        np.ascontiguousarray(other.size[:, second : second + count]),
        np.ascontiguousarray(other.phase[:, second : second + count]),
        out,
        back,
    )
    there = _of_shapes(one, first, other, second, out)
    return there, _of_shapes(other, second, one, first, back)


@plain
def products(one, first, other, second, count):
    """Products of the shapes of two bars over so many sections that they share.

    Parameters
    ----------
    one, other : Modes
    first, second : int
        The first of these sections, in each bar.
    count : int

    Returns
    -------
    ndarray, shape (modes of one, modes of the other)
        Weighted by mass.
    """
    return products_both(one, first, other, second, count)[0]


@plain
def totals(modes, first, count):
    """Integral of each shape over the mass of so many sections [kg^0.5]."""
    sections = len(modes.mass)
    rigid = Modes(
        np.zeros(1), np.zeros(1), np.ones((1, sections)), np.zeros((1, sections)), np.ones(1),
        modes.impedance, modes.transit, modes.mass, 0.0,
    )  # fmt: skip
    return products(modes, first, rigid, first, count)[:, 0]


@preparing
def shapes_at(modes, section, share):
    """Offset and elastic force of each mode at places of a bar.

    Parameters
    ----------
    modes : Modes
    section : int array
        Section of each place.
    share : ndarray
        Of that section's length that lies above it.

    Returns
    -------
    offset, force : ndarray, shape (modes, places)
        Down positive [1/kg^0.5], compression positive [N/(m kg^0.5)].
    """
    n, places = len(modes.wave), len(section)
    offset, force = np.zeros((n, places)), np.zeros((n, places))
    for j in range(places):
        i = section[j]
        for k in range(n):
            phase = modes.phase[k, i] + modes.transit[i] * share[j] * modes.wave[k]
            offset[k, j] = modes.size[k, i] * cos(phase)
            swing = modes.impedance[i] * modes.wave[k] * modes.size[k, i]
            force[k, j] = swing * sin(phase)
    return summed(modes, offset), summed(modes, force)
