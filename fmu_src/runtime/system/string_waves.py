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
        # shares of an end's velocity that are left after a step, and in its mean
        self._left, self._mean = {}, {}
        for mass in (self.head_mass, self.casing_mass):
            x = self.impedance * self.step / mass
            self._left[mass] = math.exp(-x)
            self._mean[mass] = -math.expm1(-x) / x

    @property
    def ring(self) -> np.ndarray:
        """All waves."""
        return self._ring

    @ring.setter
    def ring(self, waves: np.ndarray) -> None:
        # two rings, from one to the other at each shift, and what is seen of them
        self._ring, self._other = waves, np.empty_like(waves)
        self._before, self._other_before = waves[:-1], self._other[:-1]
        self._after, self._other_after = waves[1:], self._other[1:]
        self._back, self._other_back = waves[::-1], self._other[::-1]
        self._room, self._ones = np.empty_like(waves), np.ones_like(waves)

    def _shift(self, change: float) -> None:
        """Move all waves by a cell, and add a change."""
        np.add(self._before, change, out=self._other_after)
        self._ring, self._other = self._other, self._ring
        self._before, self._other_before = self._other_before, self._before
        self._after, self._other_after = self._other_after, self._after
        self._back, self._other_back = self._other_back, self._back

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
        h, cells = self.step, len(self._ring) // 2
        # half of the weight's effect before the waves travel, half of it after
        change = 0.25 * self.gravity * h
        arriving_down = float(self._ring[cells - 1]) + change
        arriving_up = float(self._ring[-1]) + change
        head_weight = self.head_mass * self.head_gravity
        casing_weight = self.casing_mass * self.gravity
        top, self.head_velocity = self._end(
            self.head_velocity, head_force + head_weight, arriving_up, self.head_mass
        )
        bottom, self.casing_velocity = self._end(
            self.casing_velocity, casing_force + casing_weight, arriving_down, self.casing_mass
        )
        self._shift(2.0 * change)
        ring = self._ring
        ring[0], ring[cells] = top - arriving_up + change, bottom - arriving_down + change
        self.head += top * h
        self.casing += bottom * h
        entered = top + bottom - 2.0 * (arriving_down + arriving_up)
        self.weight_work += h * (head_weight * top + casing_weight * bottom)
        # the sum of the waves in the middle of each half
        fallen = 2.0 * self.total + entered + 4.0 * cells * change
        self.weight_work += 2.0 * self.cell_mass * change * fallen
        self.total += entered + 4.0 * cells * change
        if self.rubs:
            self._rub()

    def _rub(self) -> None:
        """Wall friction on all cells; both waves of a cell lose the same."""
        ring, room = self._ring, self._room
        np.add(ring, self._back, out=room)  # velocities, each cell twice
        if self.sticking > 0.0:
            half = room[: len(ring) // 2]
            half = 0.5 * (self.rubbed(half, self.cell_mass, self.cell, self.step) - half)
            ring += np.concatenate([half, half[::-1]])
            self.total = float(ring.sum())
            return
        left = self._left_by_wall
        total = 0.5 * float(room.dot(self._ones))
        self.friction_loss += 0.25 * self.cell_mass * (1.0 - left * left) * float(room.dot(room))
        self.lost_momentum += self.cell_mass * (1.0 - left) * total
        self.total = left * total
        room *= 0.5 * (left - 1.0)
        ring += room

    def _end(self, v: float, force: float, arriving: float, mass: float) -> tuple[float, float]:
        """Mean velocity of an end over a step, and that at its end [m/s]."""
        settled = force / self.impedance + 2.0 * arriving
        off = v - settled
        return settled + off * self._mean[mass], settled + off * self._left[mass]

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
        waves = self.cell_mass * float(self._ring @ self._ring)
        ends = self.head_mass * self.head_velocity**2 + self.casing_mass * self.casing_velocity**2
        return waves + 0.5 * ends

    @property
    def momentum(self) -> float:
        """Of head, rods and casing [N s]."""
        waves = self.cell_mass * float(self._ring.sum())
        return waves + self.head_mass * self.head_velocity + self.casing_mass * self.casing_velocity
