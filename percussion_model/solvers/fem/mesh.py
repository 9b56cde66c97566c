"""Linear finite elements with consistent mass for bars of any sections."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from percussion_model.physics.records import Piston
from percussion_model.scene.bars import (
    AREA,
    LENGTH,
    YOUNGS_MODULUS,
    bar_length,
    bar_mass,
    section_mass,
    section_transit_time,
)
from percussion_model.scene.numbers import Numbers
from percussion_model.solvers.fem.records import Mesh
from percussion_model.solvers.setup import PISTONS, refuse_many

# A length this close to half an element is half an element.
ROUNDING = 1e-9


class BarMesh(NamedTuple):
    """Elements of one bar, top to bottom; none where it is rigid.

    Attributes
    ----------
    length, stiffness, mass, transit_time : ndarray, shape (n,)
        Of each element [m], [N/m], [kg], [s].
    total : float
        Mass of the bar [kg].
    """

    length: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    transit_time: np.ndarray
    total: float

    @property
    def n(self) -> int:
        """Number of elements."""
        return len(self.mass)


class BarMeshes(NamedTuple):
    """Elements of a scene.

    Attributes
    ----------
    element : float
        About their length [m].
    piston : BarMesh or None
        None where it is absent.
    bit : BarMesh
    """

    element: float
    piston: BarMesh | None
    bit: BarMesh

    @property
    def both(self) -> list[BarMesh]:
        """The bars, top to bottom."""
        return [self.bit] if self.piston is None else [self.piston, self.bit]


def section_count(section: np.ndarray, element: float) -> int:
    """Elements of about the length `element` [m] that a section gets, half a one for one."""
    return max(1, math.floor(float(section[LENGTH]) / element + 0.5 + ROUNDING))


def cut_bar(sections: np.ndarray, element: float, elastic: bool = True) -> BarMesh:
    """Cut the sections of a bar into elements of about one length.

    Parameters
    ----------
    sections : float array, shape (n, 4)
        As from `section_numbers`.
    element : float
        Wanted length [m].
    elastic : bool
        Whether the bar has elements at all.
    """
    total = bar_mass(sections)
    if not elastic:
        none = np.zeros(0)
        return BarMesh(none, none, none, none, total)
    counts = np.zeros(len(sections), np.int64)
    each = np.zeros((4, len(sections)))
    for k, section in enumerate(sections):
        count = section_count(section, element)
        length = float(section[LENGTH]) / count
        counts[k] = count
        each[0, k] = length
        each[1, k] = float(section[YOUNGS_MODULUS]) * float(section[AREA]) / length
        each[2, k] = section_mass(section) / count
        each[3, k] = section_transit_time(section) / count
    lengths, stiffness, mass, transit_time = [np.repeat(row, counts) for row in each]
    return BarMesh(lengths, stiffness, mass, transit_time, total)


def cut_bars(numbers: Numbers) -> BarMeshes:
    """Cut the elastic bars of a scene into elements of about one length."""
    values, kind = numbers.values, PISTONS[numbers.values.piston_model]
    first = numbers.piston if kind == Piston.ELASTIC else numbers.bit
    element = bar_length(first) / values.fem_elements
    elastic = [numbers.bit] if first is numbers.bit else [first, numbers.bit]
    refuse_many("elements", sum(max(bar_length(bar) / element, len(bar)) for bar in elastic))
    piston = None
    if kind != Piston.ABSENT:
        piston = cut_bar(numbers.piston, element, kind == Piston.ELASTIC)
    return BarMeshes(element, piston, cut_bar(numbers.bit, element))


def assemble(bars: list[BarMesh]) -> np.ndarray:
    """Rows of `Mesh` for bars one below the other (eq. 36 of the paper).

    Returns
    -------
    ndarray, shape (len(Mesh), n)
    """
    c = np.zeros((len(Mesh), sum(bar.n + 1 for bar in bars)))
    at = 0
    for bar in bars:
        top, low = slice(at, at + bar.n), slice(at + 1, at + bar.n + 1)
        c[Mesh.MASS, top] += bar.mass / 3.0
        c[Mesh.MASS, low] += bar.mass / 3.0
        c[Mesh.COUPLING, top] = bar.mass / 6.0
        c[Mesh.STIFFNESS, top] = bar.stiffness
        c[Mesh.SPRINGS, top] += bar.stiffness
        c[Mesh.SPRINGS, low] += bar.stiffness
        c[Mesh.SHARE, top] += bar.mass / 2.0
        c[Mesh.SHARE, low] += bar.mass / 2.0
        if bar.n == 0:
            c[Mesh.MASS, at] = c[Mesh.SHARE, at] = bar.total
        at += bar.n + 1
    return c


def critical_frequency(bar: BarMesh) -> float:
    """Highest natural frequency of the longest of equal elements, sqrt(12) c0 / L_e [rad/s]."""
    return math.sqrt(12.0) / float(bar.transit_time.min())
