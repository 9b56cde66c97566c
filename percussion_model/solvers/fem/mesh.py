"""Linear finite elements with consistent mass for bars of any sections."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from percussion_model.physics.kernel import preparing
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
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes
from percussion_model.solvers.fem.records import Mesh
from percussion_model.solvers.setup import PISTONS

# A length this close to half an element is half an element.
ROUNDING = 1e-9
MESH_ROWS = len(Mesh)


class BarMesh(NamedTuple):
    """Elements of one bar, top to bottom; none where it is rigid.

    Attributes
    ----------
    length, stiffness, mass, transit_time : ndarray, shape (n,)
        Of each element [m], [N/m], [kg], [s].
    total : float
        Mass of the bar [kg].
    nodes : int
        One more than elements; 0 where there is no bar.
    """

    length: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    transit_time: np.ndarray
    total: float
    nodes: int

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
    piston, bit : BarMesh
    """

    element: float
    piston: BarMesh
    bit: BarMesh


@preparing
def section_count(section, element):
    """Elements of about the length `element` [m] that a section gets, half a one for one."""
    return max(1, math.floor(section[LENGTH] / element + 0.5 + ROUNDING))


@preparing
def _no_elements(total, nodes):
    """A bar without elements."""
    none = np.zeros(0)
    return BarMesh(none, none, none, none, total, nodes)


@preparing
def cut_bar(sections, element):
    """Cut the sections of a bar into elements of about one length.

    Parameters
    ----------
    sections : float array, shape (n, 4)
        As from `section_numbers`.
    element : float
        Wanted length [m].

    Returns
    -------
    BarMesh
    """
    n = 0
    for k in range(len(sections)):
        n += section_count(sections[k], element)
    length, stiffness, mass, transit_time = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    end = 0
    for k in range(len(sections)):
        section = sections[k]
        count = section_count(section, element)
        begin, end, each = end, end + count, section[LENGTH] / count
        length[begin:end] = each
        stiffness[begin:end] = section[YOUNGS_MODULUS] * section[AREA] / each
        mass[begin:end] = section_mass(section) / count
        transit_time[begin:end] = section_transit_time(section) / count
    return BarMesh(length, stiffness, mass, transit_time, bar_mass(sections), n + 1)


@preparing
def element_length(numbers):
    """About the length of an element that a scene asks for [m]."""
    elastic = PISTONS[numbers.values.piston_model] == Piston.ELASTIC
    return bar_length(numbers.piston if elastic else numbers.bit) / numbers.values.fem_elements


@preparing
def elements_wanted(numbers):
    """About how many elements there will be."""
    element = element_length(numbers)
    count = max(bar_length(numbers.bit) / element, float(len(numbers.bit)))
    if PISTONS[numbers.values.piston_model] == Piston.ELASTIC:
        count += max(bar_length(numbers.piston) / element, float(len(numbers.piston)))
    return count


@preparing
def cut_bars(numbers):
    """Cut the elastic bars of a scene into elements of about one length; `BarMeshes`."""
    kind, element = PISTONS[numbers.values.piston_model], element_length(numbers)
    if kind == Piston.ELASTIC:
        piston = cut_bar(numbers.piston, element)
    elif kind == Piston.ABSENT:
        piston = _no_elements(0.0, 0)
    else:
        piston = _no_elements(bar_mass(numbers.piston), 1)
    return BarMeshes(element, piston, cut_bar(numbers.bit, element))


@preparing
def add_bar(c, at, bar):
    """Fill in the nodes of a bar from column `at` on (eq. 36 of the paper); the next column.

    Parameters
    ----------
    c : float array, shape (len(Mesh), n)
        Of zeros there.
    at : int
    bar : BarMesh
    """
    for k in range(len(bar.mass)):
        top, low = at + k, at + k + 1
        c[Mesh.MASS, top] += bar.mass[k] / 3.0
        c[Mesh.MASS, low] += bar.mass[k] / 3.0
        c[Mesh.COUPLING, top] = bar.mass[k] / 6.0
        c[Mesh.STIFFNESS, top] = bar.stiffness[k]
        c[Mesh.SPRINGS, top] += bar.stiffness[k]
        c[Mesh.SPRINGS, low] += bar.stiffness[k]
        c[Mesh.SHARE, top] += bar.mass[k] / 2.0
        c[Mesh.SHARE, low] += bar.mass[k] / 2.0
    if bar.nodes == 1:
        c[Mesh.MASS, at] = c[Mesh.SHARE, at] = bar.total
    return at + bar.nodes


@preparing
def mesh_of(bars):
    """Rows of `Mesh` of both bars."""
    c = np.zeros((MESH_ROWS, bars.piston.nodes + bars.bit.nodes))
    add_bar(c, add_bar(c, 0, bars.piston), bars.bit)
    return c


def assemble(bars: Iterable[BarMesh]) -> np.ndarray:
    """Rows of `Mesh` for bars one below the other.

    Returns
    -------
    ndarray, shape (len(Mesh), n)
    """
    bars = list(bars)
    c, at = np.zeros((MESH_ROWS, sum(bar.nodes for bar in bars))), 0
    for bar in bars:
        at = add_bar(c, at, bar)
    return c


@preparing
def shortest_transit(bar):
    """Least transit time of an element [s]; infinite where there are none."""
    least = math.inf
    for k in range(len(bar.transit_time)):
        least = min(least, bar.transit_time[k])
    return least


@preparing
def critical_frequency(bar):
    """Highest natural frequency of the longest of equal elements, sqrt(12) c0 / L_e [rad/s]."""
    return math.sqrt(12.0) / shortest_transit(bar)
