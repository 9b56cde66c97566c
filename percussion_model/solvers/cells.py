"""Where a place of a bar lies among the cells in which it is read."""

from __future__ import annotations

from percussion_model.physics.kernel import preparing
from percussion_model.scene.bars import AREA, LENGTH, section_mass
from percussion_model.solvers import plain_code  # noqa: F401  # kernels call functions of scenes


@preparing
def find_cell(sections, masses, place):
    """Cell at a place along a bar.

    Parameters
    ----------
    sections : ndarray, shape (sections, 4)
    masses : ndarray
        Of the cells, top to bottom [kg].
    place : float
        From the top of the bar [m].

    Returns
    -------
    cell : int
    area : float
        Cross-section there [m2].
    """
    above, k = 0.0, 0
    while k < len(sections) - 1 and place > sections[k, LENGTH]:
        above += section_mass(sections[k])
        place -= sections[k, LENGTH]
        k += 1
    mass = above + section_mass(sections[k]) * min(place / sections[k, LENGTH], 1.0)
    passed, cell = masses[0], 0
    while cell < len(masses) - 1 and passed <= mass:
        cell += 1
        passed += masses[cell]
    return cell, sections[k, AREA]
