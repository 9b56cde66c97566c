"""Body of a drill string as travelling waves on a characteristic grid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fmu_src.parts.string_body import Rods


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
        self.divide(int(parameters["rod.cells"]))
        self.total = 0.0  # of the waves
        self.ring = np.zeros(2 * count * self.cells_of_rod)
        # share of a velocity that viscous friction leaves in a step
        self._left_by_wall = 1.0 / (1.0 + self.viscous * self.cell / self.cell_mass * self.step)
        self._ends = self.impedance, self._shares(self.head_mass), self._shares(self.casing_mass)
        self._change = 0.25 * self.gravity * self.step
        self._head_weight = self.head_mass * self.head_gravity
        self._casing_weight = self.casing_mass * self.gravity

    def _shares(self, mass: float) -> tuple[float, float]:
        """Shares of an end's velocity that count in the mean of a step, and at its end."""
        x = self.impedance * self.step / mass
        return -math.expm1(-x) / x, math.exp(-x)

    def lengths(self, count: int) -> dict[str, int]:
        """Lengths of the lists in a state of so many rods."""
        return {"ring": 2 * count * self.cells_of_rod}

    @property
    def ring(self) -> np.ndarray:
        """All waves."""
        return self._now[0]

    @ring.setter
    def ring(self, waves: np.ndarray | Sequence[float]) -> None:
        waves = np.asarray(waves, float)
        # two rings, from one to the other at each shift, and back to front
        self._now, self._next = ((ring, ring[::-1]) for ring in (waves, np.empty_like(waves)))
        self._room = np.empty_like(waves)

    @property
    def cells(self) -> int:
        """Number of cells."""
        return len(self._now[0]) // 2

    @property
    def down(self) -> np.ndarray:
        """Velocity waves that go down; the first cell is below the head [m/s]."""
        return self.ring[: self.cells]

    @property
    def up(self) -> np.ndarray:
        """Those that go up; the first cell is below the head [m/s]."""
        return self.ring[: self.cells - 1 : -1]

    def rest(self, bottom_force: float) -> None:
        """Stand still, with this compression at the casing's upper side [N]."""
        above = np.arange(len(self.down) - 1, -1, -1)
        force = bottom_force - self.cell_mass * self.gravity * above
        self.down[:] = force / (2.0 * self.impedance)
        # a cell keeps the force of its middle
        self.down[:] -= 0.25 * self.gravity * self.step
        self.up[:] = -self.down
        self.total = float(self.ring.sum())

    def advance(self, forces: Sequence[tuple[float, float]]) -> None:
        """Go on by some transit times, at most as many as there are cells.

        The waves that meet an end in that time are on their way there already; so all others
        move at once, and wall friction takes its share at the end. Coulomb friction, which
        holds what is about to turn, wants one transit time at a time.

        Parameters
        ----------
        forces : sequence of tuple
            On head and casing in each transit time, without weights [N].
        """
        (now, _), (ring, back) = self._now, self._next
        count, cells, change = len(forces), len(now) // 2, self._change
        impedance, (of_head, head_keeps), (of_casing, casing_keeps) = self._ends
        head, casing = self.head_velocity, self.casing_velocity
        # what comes first lies last
        down, up = now[cells - count : cells].tolist(), now[-count:].tolist()
        tops, bottoms = [0.0] * count, [0.0] * count
        head_way = casing_way = fallen = 0.0
        total, added = self.total, 4.0 * cells * change
        gained = change  # half of the weight's effect on a wave before it meets an end
        for k in range(count - 1, -1, -1):
            head_force, casing_force = forces[count - 1 - k]
            rising, falling = up[k] + gained, down[k] + gained
            # an end tends to the velocity at which force and wave are in balance
            settled = (head_force + self._head_weight) / impedance + 2.0 * rising
            off = head - settled
            head, top = settled + off * head_keeps, settled + off * of_head
            settled = (casing_force + self._casing_weight) / impedance + 2.0 * falling
            off = casing - settled
            casing, bottom = settled + off * casing_keeps, settled + off * of_casing
            head_way += top
            casing_way += bottom
            # what is left is gained by those that go back, till the waves come to rest
            left = change * (2 * count) - gained
            tops[k], bottoms[k] = top - rising + left, bottom - falling + left
            after = total + top + bottom - 2.0 * (falling + rising) + added
            fallen += total + after  # twice the sum of the waves in the middle of this time
            total = after
            gained += 2.0 * change
        np.add(now[:-count], 2.0 * change * count, ring[count:])
        ring[:count], ring[cells : cells + count] = tops, bottoms
        self._now, self._next = self._next, self._now
        self.head_velocity, self.casing_velocity, self.total = head, casing, total
        h = self.step
        self.head += head_way * h
        self.casing += casing_way * h
        self.weight_work += h * (self._head_weight * head_way + self._casing_weight * casing_way)
        self.weight_work += 2.0 * self.cell_mass * change * fallen
        if self.sticking > 0.0:
            self._apply_coulomb_friction(ring, count)
        elif self.viscous > 0.0:
            self._apply_viscous_friction(ring, back, count)

    def _apply_coulomb_friction(self, ring: np.ndarray, count: int) -> None:
        """Coulomb and viscous friction on all cells; both waves of a cell lose the same."""
        cells = self.cells
        v = self.down + self.up
        change = 0.5 * (self.apply_friction(v, self.cell_mass, self.cell, count * self.step) - v)
        ring[:cells] += change
        ring[cells:] += change[::-1]
        self.total = float(ring.sum())

    def _apply_viscous_friction(self, ring: np.ndarray, back: np.ndarray, count: int) -> None:
        """Viscous friction alone: each velocity loses the same share."""
        v, left = self._room, self._left_by_wall**count
        np.add(ring, back, v)  # each cell twice
        self.friction_loss += 0.25 * self.cell_mass * (1.0 - left * left) * float(v.dot(v))
        self.lost_momentum += self.cell_mass * (1.0 - left) * self.total
        self.total *= left
        v *= 0.5 * (left - 1.0)
        ring += v

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
