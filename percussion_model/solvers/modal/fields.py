"""Force and velocity along a bar, from its modes and the forces at its ends."""

from __future__ import annotations

import math

import numpy as np

from percussion_model.scene.bars import bar_mass, section_mass, section_transit_time
from percussion_model.solvers.modal.modes import Modes, shapes_at
from percussion_model.solvers.modal.records import ModalBar, Shape


class Places:
    """Cells of a bar, in whose middle force and velocity are read.

    Parameters
    ----------
    sections : ndarray, shape (sections, 4)
    bar : ModalBar
    size : float
        Transit time of a cell, about [s].

    Attributes
    ----------
    mass : ndarray
        Of each cell, top to bottom [kg].
    in_sections : list of int
        Cells of each section.
    """

    def __init__(self, sections: np.ndarray, bar: ModalBar, size: float) -> None:
        self.in_sections = [
            max(1, math.floor(section_transit_time(s) / size + 0.5)) for s in sections
        ]
        section = np.repeat(np.arange(len(sections)), self.in_sections)
        share = np.concatenate([(np.arange(n) + 0.5) / n for n in self.in_sections])
        own = np.array([section_mass(s) for s in sections])
        self.mass = (own / self.in_sections)[section]
        top, low, _, stiff = bar.shape
        modes = Modes(np.sqrt(stiff), top, low)
        self._offset, self._force = shapes_at(sections, modes, section, share)
        above = (np.cumsum(self.mass) - 0.5 * self.mass) / bar_mass(sections)
        # what a constant force at an end does, beyond the modes of each set
        self._by_top = [self._beyond(bar, 1.0 - above, top, n) for n in bar.sizes]
        self._by_low = [self._beyond(bar, above, -low, n) for n in bar.sizes]

    @property
    def n(self) -> int:
        """Number of cells."""
        return len(self.mass)

    def _beyond(self, bar: ModalBar, whole: np.ndarray, end: np.ndarray, n: int) -> np.ndarray:
        held = (self._force[:, :n] * (bar.shape[Shape.SOFT] * end)[:n]).sum(axis=1)
        return np.asarray(whole - held)

    def read(
        self, w: np.ndarray, mean: float, which: int, n: int, top: float, low: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Elastic force [N] and velocity [m/s] of each cell.

        Parameters
        ----------
        w : ndarray, shape (2, modes)
            Offsets and velocities of the modes.
        mean : float
            Mean velocity [m/s].
        which, n : int
            Set of modes, and its size.
        top, low : float
            Forces at the ends that the offsets beyond the modes stand for [N].
        """
        force = (self._force[:, :n] * w[0, :n]).sum(axis=1)
        force += top * self._by_top[which] + low * self._by_low[which]
        return force, mean + (self._offset[:, :n] * w[1, :n]).sum(axis=1)
