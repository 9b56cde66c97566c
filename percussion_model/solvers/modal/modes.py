"""Normal modes of a stepped bar with free ends, to rounding and for any lengths.

In each section a mode is u = R cos(phi), with the force -Z w R sin(phi); the phase phi grows
by w T over a section of transit time T. Where the impedance changes, u and the force stay. Both
ends are free where the phase at the low end is a multiple of pi, and it rises with w: each
mode is a root of its own, which bisection finds (docs/modal.md, section 1).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from percussion_model.physics.kernel import kernel
from percussion_model.scene.bars import (
    AREA,
    LENGTH,
    YOUNGS_MODULUS,
    bar_mass,
    bar_transit_time,
    section_impedance,
    section_mass,
    section_transit_time,
)

# Halvings of the interval in which a root lies: more than a number has digits.
HALVINGS = 60


class Modes(NamedTuple):
    """Elastic modes of a bar, the lowest first; shapes have a modal mass of 1 kg.

    Attributes
    ----------
    frequency : ndarray, shape (n,)
        Angular, without loss [rad/s].
    top, low : ndarray, shape (n,)
        Shape at both ends [1/kg^0.5].
    """

    frequency: np.ndarray
    top: np.ndarray
    low: np.ndarray

    def below(self, highest: float) -> Modes:
        """Modes up to a frequency."""
        n = int(np.searchsorted(self.frequency, highest, side="right"))
        return Modes(self.frequency[:n], self.top[:n], self.low[:n])


@kernel
def _phase(impedance, transit, w):
    """Phase at the low end of a bar whose top end is free."""
    phase = 0.0
    for i in range(len(transit)):
        if i > 0 and impedance[i] != impedance[i - 1]:
            half = math.pi * math.floor(phase / math.pi + 0.5)
            rest = phase - half
            ratio = impedance[i - 1] / impedance[i]
            phase = half + math.atan2(ratio * math.sin(rest), math.cos(rest))
        phase += w * transit[i]
    return phase


@kernel
def _find_modes(impedance, transit, mass, out):
    """Fill rows of frequency, shape at the top and at the low end."""
    whole = 0.0
    for i in range(len(transit)):
        whole += transit[i]
    # a change of impedance shifts the phase by less than a right angle
    shift = 0.5 * math.pi * len(transit)
    for k in range(out.shape[1]):
        wanted = (k + 1) * math.pi
        low, high = max(0.0, wanted - shift) / whole, (wanted + shift) / whole
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if _phase(impedance, transit, middle) < wanted:
                low = middle
            else:
                high = middle
        w = 0.5 * (low + high)
        size, phase, modal = 1.0, 0.0, 0.0
        for i in range(len(transit)):
            if i > 0 and impedance[i] != impedance[i - 1]:
                c = math.cos(phase)
                s = impedance[i - 1] / impedance[i] * math.sin(phase)
                phase = math.atan2(s, c)
                size *= math.sqrt(c * c + s * s)
            then = phase + w * transit[i]
            swing = (math.sin(2.0 * then) - math.sin(2.0 * phase)) / (4.0 * w * transit[i])
            modal += mass[i] * size * size * (0.5 + swing)
            phase = then
        out[0, k] = w
        out[1, k] = 1.0 / math.sqrt(modal)
        out[2, k] = size * math.cos(phase) / math.sqrt(modal)


@kernel
def _find_forces(impedance, transit, frequency, top, section, share, out):
    """Fill the force (compression) of each mode at places, shape (places, modes)."""
    for k in range(len(frequency)):
        w = frequency[k]
        size, phase, j = top[k], 0.0, 0
        for i in range(len(transit)):
            if i > 0 and impedance[i] != impedance[i - 1]:
                c = math.cos(phase)
                s = impedance[i - 1] / impedance[i] * math.sin(phase)
                phase = math.atan2(s, c)
                size *= math.sqrt(c * c + s * s)
            while j < len(section) and section[j] == i:
                there = phase + w * transit[i] * share[j]
                out[0, j, k] = size * math.cos(there)
                out[1, j, k] = impedance[i] * w * size * math.sin(there)
                j += 1
            phase += w * transit[i]


def shapes_at(
    sections: np.ndarray, modes: Modes, section: np.ndarray, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Offset and force of each mode at places of a bar.

    Parameters
    ----------
    section : int array
        Section of each place, not falling.
    share : ndarray
        Of that section's length that lies above it.

    Returns
    -------
    offset, force : ndarray, shape (places, modes)
        Down positive [1/kg^0.5], compression positive [N/(m kg^0.5)].
    """
    out = np.zeros((2, len(section), len(modes.frequency)))
    impedance, transit, _ = _numbers_of(sections)
    _find_forces(impedance, transit, modes.frequency, modes.top, section, share, out)
    return out[0], out[1]


def _numbers_of(sections: np.ndarray) -> np.ndarray:
    """Impedance, transit time and mass of each section, in rows."""
    rows = [(section_impedance(s), section_transit_time(s), section_mass(s)) for s in sections]
    return np.ascontiguousarray(np.array(rows).T)


def free_modes(sections: np.ndarray, count: int) -> Modes:
    """Return the lowest elastic modes of a free bar.

    Parameters
    ----------
    sections : ndarray, shape (sections, 4)
        As `section_numbers` has them.
    count : int

    Returns
    -------
    Modes
    """
    out = np.zeros((3, count))
    _find_modes(*_numbers_of(sections), out)
    return Modes(*out)


def count_below(sections: np.ndarray, highest: float) -> int:
    """Most elastic modes that may lie below a frequency [rad/s]."""
    return math.ceil(bar_transit_time(sections) * highest / math.pi + 0.5 * len(sections))


def end_compliance(sections: np.ndarray) -> float:
    """Offset of the low end from the mean of a free bar, by a constant force there [m/N].

    The sum of shape^2 / frequency^2 over all modes. The bar's own inertia balances the force,
    so that a section carries the share of it that the mass above is of all.
    """
    whole, above, total = bar_mass(sections), 0.0, 0.0
    for section in sections:
        first = above / whole
        above += section_mass(section)
        last = above / whole
        flexible = float(section[LENGTH]) / float(section[YOUNGS_MODULUS] * section[AREA])
        total += flexible * (first * first + first * last + last * last) / 3.0
    return total
