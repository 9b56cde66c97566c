"""The rods of a drill string as travelling waves on a characteristic grid."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fmu_src.runtime.system.string_body import Rods


class Waves(Rods):
    """Waves on a characteristic grid: in a step each moves by one cell, exactly.

    With v = d + u and the compression F = Z (d - u) in each cell, d goes down and u up.
    An end mass is advanced in closed form under the wave that meets it:
    M v' = F + M g - Z (v - 2 u).

    The waves lie in a ring, down the cells and up again, so that one shift moves them all.

    Attributes
    ----------
    ring : ndarray, shape (2 cells,)
        Waves that go down, from the head to the casing, then those that go up, from the
        casing to the head [m/s].
    step : float
        Transit time of a cell [s].
    """

    STATE = (*Rods.STATE, "total", "ring")

    def __init__(self, parameters: dict[str, Any], count: int) -> None:
        super().__init__(parameters, count)
        self.cells_of_rod = int(parameters["rod.cells"])
        self.cell = self.length_of_rod / self.cells_of_rod
        self.step = self.cell / self.speed
        self.cell_mass = self.density * self.area * self.cell
        self.total = 0.0  # of the waves
        self.ring = np.zeros(2 * count * self.cells_of_rod)
        # share of a velocity that viscous friction leaves in a step
        self._left_by_wall = 1.0 / (1.0 + self.viscous * self.cell / self.cell_mass * self.step)
        self._head, self._casing = self._shares(self.head_mass), self._shares(self.casing_mass)
        self._change = 0.25 * self.gravity * self.step
        self._head_weight = self.head_mass * self.head_gravity
        self._casing_weight = self.casing_mass * self.gravity

    def _shares(self, mass: float) -> tuple[float, float]:
        """Shares of an end's velocity that count in the mean of a step, and at its end."""
        x = self.impedance * self.step / mass
        return -math.expm1(-x) / x, math.exp(-x)

    @property
    def ring(self) -> np.ndarray:
        """All waves."""
        return self._now[0]

    @ring.setter
    def ring(self, waves: np.ndarray) -> None:
        # two rings, from one to the other at each shift, and what is seen of them
        self._now, self._next = (
            (ring, ring[:-1], ring[1:], ring[::-1]) for ring in (waves, np.empty_like(waves))
        )
        self._room, self._ones = np.empty_like(waves), np.ones_like(waves)

    @property
    def down(self) -> np.ndarray:
        """Velocity waves that go down; the first cell is below the head [m/s]."""
        return self.ring[: len(self.ring) // 2]

    @property
    def up(self) -> np.ndarray:
        """Those that go up; the first cell is below the head [m/s]."""
        return self.ring[: len(self.ring) // 2 - 1 : -1]

    def rest(self, bottom_force: float) -> None:
        """Stand still, with this compression at the casing's upper side [N]."""
        above = np.arange(len(self.down) - 1, -1, -1)
        force = bottom_force - self.cell_mass * self.gravity * above
        self.down[:] = force / (2.0 * self.impedance)
        # a cell keeps the force of its middle
        self.down[:] -= 0.25 * self.gravity * self.step
        self.up[:] = -self.down
        self.total = float(self.ring.sum())

    def advance(self, head_force: float, casing_force: float) -> None:
        """Go on by a transit time under forces on head and casing [N], without weights."""
        h, now, other = self.step, self._now, self._next
        cells = len(now[0]) // 2
        # half of the weight's effect before the waves travel, half of it after
        change, head_weight, casing_weight = self._change, self._head_weight, self._casing_weight
        arriving_down = float(now[0][cells - 1]) + change
        arriving_up = float(now[0][-1]) + change
        top, self.head_velocity = self._end(
            self.head_velocity, head_force + head_weight, arriving_up, self._head
        )
        bottom, self.casing_velocity = self._end(
            self.casing_velocity, casing_force + casing_weight, arriving_down, self._casing
        )
        np.add(now[1], 2.0 * change, other[2])
        ring = other[0]
        ring[0], ring[cells] = top - arriving_up + change, bottom - arriving_down + change
        self._now, self._next = other, now
        self.head += top * h
        self.casing += bottom * h
        entered = top + bottom - 2.0 * (arriving_down + arriving_up)
        # the sum of the waves in the middle of each half
        fallen = 2.0 * self.total + entered + 4.0 * cells * change
        self.weight_work += h * (head_weight * top + casing_weight * bottom)
        self.weight_work += 2.0 * self.cell_mass * change * fallen
        self.total += entered + 4.0 * cells * change
        if self.sticking > 0.0:
            self._stick(ring)
        elif self.viscous > 0.0:
            self._rub(ring, other[3])

    def _stick(self, ring: np.ndarray) -> None:
        """Coulomb and viscous friction on all cells; both waves of a cell lose the same."""
        cells = len(ring) // 2
        v = self.down + self.up
        change = 0.5 * (self.rubbed(v, self.cell_mass, self.cell, self.step) - v)
        ring[:cells] += change
        ring[cells:] += change[::-1]
        self.total = float(ring.sum())

    def _rub(self, ring: np.ndarray, back: np.ndarray) -> None:
        """Viscous friction alone: each velocity loses the same share."""
        v, left = self._room, self._left_by_wall
        np.add(ring, back, v)  # each cell twice
        total = 0.5 * float(v.dot(self._ones))
        self.friction_loss += 0.25 * self.cell_mass * (1.0 - left * left) * float(v.dot(v))
        self.lost_momentum += self.cell_mass * (1.0 - left) * total
        self.total = left * total
        v *= 0.5 * (left - 1.0)
        ring += v

    def _end(
        self, v: float, force: float, arriving: float, shares: tuple[float, float]
    ) -> tuple[float, float]:
        """Mean velocity of an end over a step, and that at its end [m/s]."""
        settled = force / self.impedance + 2.0 * arriving
        off = v - settled
        return settled + off * shares[0], settled + off * shares[1]

    def add_rod(self) -> None:
        """Put a rod below the head, in the state of the place where it joins."""
        self.count += 1
        above = np.arange(self.cells_of_rod, 0, -1)
        change = 0.5 * self.gravity * self.step * above
        down, up = self.ring[0] - change, self.ring[-1] + change
        self.ring = np.concatenate([down, self.ring, up[::-1]])
        self.total = float(self.ring.sum())

    @property
    def stored(self) -> float:
        """Kinetic and elastic energy [J]."""
        waves = self.cell_mass * float(self.ring @ self.ring)
        ends = self.head_mass * self.head_velocity**2 + self.casing_mass * self.casing_velocity**2
        return waves + 0.5 * ends

    @property
    def momentum(self) -> float:
        """Of head, rods and casing [N s]."""
        waves = self.cell_mass * float(self.ring.sum())
        return waves + self.head_mass * self.head_velocity + self.casing_mass * self.casing_velocity
