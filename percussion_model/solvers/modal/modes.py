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

from percussion_model.physics.kernel import kernel
from percussion_model.scene.bars import (
    bar_transit_time,
    section_impedance,
    section_mass,
    section_transit_time,
)

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

    def above(self, section: int) -> np.ndarray:
        """Shape at the top of a section."""
        return self.summed(self.size[:, section] * np.cos(self.phase[:, section]))

    @property
    def low(self) -> np.ndarray:
        """Shape at the low end."""
        return self.summed(
            self.size[:, -1] * np.cos(self.phase[:, -1] + self.wave * self.transit[-1])
        )

    def summed(self, rows: np.ndarray) -> np.ndarray:
        """What belongs to each shape, by what belongs to each wave (first axis)."""
        out = rows.copy()
        _sum_last(rows.reshape(len(rows), -1), self.last, out.reshape(len(rows), -1))
        return out


@kernel
def _sum_last(rows, last, out):
    """Sum of rows, so much of each, into the last one, in an order of its own."""
    for j in range(rows.shape[1]):
        total = 0.0
        for k in range(len(last)):
            total += last[k] * rows[k, j]
        out[-1, j] = total


@kernel
def fill_quadrature(nodes, weights):
    """Fill in nodes and weights of Gauss and Legendre from -1 to 1.

    numpy finds them by a matrix so large that a thread of its linear algebra wakes, and then
    spins for a tenth of a second.
    """
    n = len(nodes)
    for i in range(n):
        x, slope = math.cos(math.pi * (i + 0.75) / (n + 0.5)), 1.0
        for _ in range(NEWTON_STEPS):
            before, value = 1.0, x
            for k in range(2, n + 1):
                before, value = value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k
            slope = n * (before - x * value) / (1.0 - x * x)
            x -= value / slope
        nodes[n - 1 - i] = x
        weights[n - 1 - i] = 2.0 / ((1.0 - x * x) * slope * slope)


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
                offset += last[k] * size[k, i] * math.cos(angle)
            weight = 0.5 * weights[at] * mass[i] if at >= 0 else top_mass
            total += weight * offset * offset
    return total


@kernel
def _phase(impedance, transit, top_mass, w):
    """Phase at the low end."""
    phase = math.atan2(top_mass * w, impedance[0])
    for i in range(len(transit)):
        if i > 0 and impedance[i] != impedance[i - 1]:
            half = math.pi * math.floor(phase / math.pi + 0.5)
            rest = phase - half
            ratio = impedance[i - 1] / impedance[i]
            phase = half + math.atan2(ratio * math.sin(rest), math.cos(rest))
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
            middle = 0.5 * (low + high)
            wanted = k * math.pi
            if spring > 0.0:
                wanted += math.atan2(spring, impedance[-1] * middle)
            if _phase(impedance, transit, top_mass, middle) < wanted:
                low = middle
            else:
                high = middle
        w = 0.5 * (low + high)
        phase = math.atan2(top_mass * w, impedance[0])
        at_top = math.cos(phase)
        amplitude, modal = 1.0, top_mass * at_top * at_top
        for i in range(len(transit)):
            if i > 0 and impedance[i] != impedance[i - 1]:
                c = math.cos(phase)
                s = impedance[i - 1] / impedance[i] * math.sin(phase)
                phase = math.atan2(s, c)
                amplitude *= math.sqrt(c * c + s * s)
            size[k, i], phases[k, i] = amplitude, phase
            then = phase + w * transit[i]
            swing = (math.sin(2.0 * then) - math.sin(2.0 * phase)) / (4.0 * w * transit[i])
            modal += mass[i] * amplitude * amplitude * (0.5 + swing)
            phase = then
        frequency[k] = w
        for i in range(len(transit)):
            size[k, i] /= math.sqrt(modal)


def bar_modes(
    sections: np.ndarray, count: int, spring: float = 0.0, top_mass: float = 0.0
) -> Modes:
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
    """
    rows = [(section_impedance(s), section_transit_time(s), section_mass(s)) for s in sections]
    numbers = np.ascontiguousarray(np.array(rows).T)
    frequency, (size, phase) = np.zeros(count), np.zeros((2, count, len(rows)))
    _find_modes(*numbers, float(top_mass), float(spring), frequency, size, phase)
    last = np.zeros(count)
    last[-1] = 1.0
    impedance, transit, mass = numbers
    return Modes(frequency, frequency, size, phase, last, impedance, transit, mass, top_mass)


def with_residual(modes: Modes, spring: float) -> Modes:
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
    """
    n = len(modes.frequency) - 1
    kept, low = modes.frequency[:n], modes.low[:n]
    yields = math.fsum([1.0, *(-spring * (low / kept) ** 2).tolist()]) / spring
    if not yields > LEAST_YIELD / spring:
        return modes
    frequency, wave, size, phase = (part.copy() for part in modes[:4])
    wave[n], size[n], phase[n] = 0.0, 1.0, 0.0
    last = np.append(-low / kept**2, 1.0 / spring)
    # by quadrature: as a difference of squares it would lose its digits
    nodes, weights = np.zeros((2, 2 * n + 20))
    fill_quadrature(nodes, weights)
    inertia = _inertia(
        modes.mass, modes.transit, modes.top_mass, wave, size, phase, last, nodes, weights
    )
    frequency[n] = math.sqrt(yields / inertia)
    last /= math.sqrt(inertia)
    return modes._replace(frequency=frequency, wave=wave, size=size, phase=phase, last=last)


def count_below(sections: np.ndarray, highest: float) -> int:
    """Elastic modes below a frequency [rad/s]; with several sections there may be some more."""
    return round(bar_transit_time(sections) * highest / math.pi)


@kernel
def _sinc(x):
    return 1.0 - x * x / 6.0 if abs(x) < SMALL else math.sin(x) / x


@kernel
def _fill_products(mass, transit, w, size, phase, w_2, size_2, phase_2, out):
    """Fill the products of two sets of shapes, weighted by mass."""
    for k in range(len(w)):
        for j in range(len(w_2)):
            total = 0.0
            for i in range(len(transit)):
                less = 0.5 * (w[k] - w_2[j]) * transit[i]
                more = 0.5 * (w[k] + w_2[j]) * transit[i]
                both = _sinc(less) * math.cos(phase[k, i] - phase_2[j, i] + less)
                both += _sinc(more) * math.cos(phase[k, i] + phase_2[j, i] + more)
                total += 0.5 * mass[i] * size[k, i] * size_2[j, i] * both
            out[k, j] = total


def products(one: Modes, first: int, other: Modes, second: int, count: int) -> np.ndarray:
    """Products of the shapes of two bars over so many sections that they share.

    Parameters
    ----------
    first, second : int
        The first of these sections, in each bar.

    Returns
    -------
    ndarray, shape (modes of one, modes of the other)
        Weighted by mass.
    """
    mine, theirs = slice(first, first + count), slice(second, second + count)
    out = np.zeros((len(one.frequency), len(other.frequency)))
    _fill_products(
        np.ascontiguousarray(one.mass[mine]),
        np.ascontiguousarray(one.transit[mine]),
        one.wave,
        np.ascontiguousarray(one.size[:, mine]),
        np.ascontiguousarray(one.phase[:, mine]),
        other.wave,
        np.ascontiguousarray(other.size[:, theirs]),
        np.ascontiguousarray(other.phase[:, theirs]),
        out,
    )
    out = other.summed(np.ascontiguousarray(one.summed(out).T)).T
    if first == second == 0 and one.top_mass and other.top_mass:
        out += one.top_mass * np.outer(one.above(0), other.above(0))
    return out


def totals(modes: Modes, first: int, count: int) -> np.ndarray:
    """Integral of each shape over the mass of so many sections [kg^0.5]."""
    sections = len(modes.mass)
    rigid = modes._replace(
        frequency=np.zeros(1),
        wave=np.zeros(1),
        last=np.ones(1),
        size=np.ones((1, sections)),
        phase=np.zeros((1, sections)),
        top_mass=0.0,
    )
    found: np.ndarray = products(modes, first, rigid, first, count)[:, 0]
    return found


def shapes_at(
    modes: Modes, section: np.ndarray, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Offset and elastic force of each mode at places of a bar.

    Parameters
    ----------
    section : int array
        Section of each place.
    share : ndarray
        Of that section's length that lies above it.

    Returns
    -------
    offset, force : ndarray, shape (places, modes)
        Down positive [1/kg^0.5], compression positive [N/(m kg^0.5)].
    """
    size = modes.size[:, section].T
    phase = modes.phase[:, section].T + np.outer(modes.transit[section] * share, modes.wave)
    impedance = modes.impedance[section][:, None]
    offset, force = size * np.cos(phase), impedance * modes.wave * size * np.sin(phase)
    return modes.summed(offset.T).T, modes.summed(force.T).T
