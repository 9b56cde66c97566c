"""Force and velocity along the bars, from the modes of a state."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.scene.bars import section_mass, section_transit_time
from percussion_model.solvers.modal.modes import Modes, shapes_at


class Places:
    """Cells of a bar, in whose middle force and velocity are read.

    Parameters
    ----------
    sections : ndarray, shape (sections, 4)
    size : float
        Transit time of a cell, about [s].

    Attributes
    ----------
    mass : ndarray
        Of each cell, top to bottom [kg].
    in_sections : list of int
        Cells of each section.
    """

    def __init__(self, sections: np.ndarray, size: float) -> None:
        self.in_sections = [
            max(1, math.floor(section_transit_time(s) / size + 0.5)) for s in sections
        ]
        self._section = np.repeat(np.arange(len(sections)), self.in_sections)
        self._share = np.concatenate([(np.arange(n) + 0.5) / n for n in self.in_sections])
        own = np.array([section_mass(s) for s in sections])
        self.mass = (own / self.in_sections)[self._section]

    @property
    def n(self) -> int:
        """Number of cells."""
        return len(self.mass)

    def read(self, modes: Modes, first: int, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Elastic force [N] and velocity [m/s] of each cell.

        Parameters
        ----------
        modes : Modes
            Of a bar of which this one is a part.
        first : int
            Section of it with which this bar begins.
        w : ndarray, shape (2 or more, modes)
            Offsets and velocities of the modes.
        """
        offset, force = shapes_at(modes, first + self._section, self._share)
        n = force.shape[1]
        return (force * w[0, :n]).sum(axis=1), (offset * w[1, :n]).sum(axis=1)
