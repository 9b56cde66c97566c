"""Body of a drill string between two end masses: what all have in common, and lumped masses.

Bodies take the force on the head and on the casing (down positive), and know the
displacements and velocities of the two ends. Weight and wall friction act on the way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

# A saved string of more rods is refused: their lumps would need matrices of this size squared.
MOST_RODS = 2000


class Rods:
    """What both bodies share: material, masses, forces along the wall.

    Parameters
    ----------
    parameters : dict
        Of the drill string, by name.
    count : int
        Rods at the start.

    Attributes
    ----------
    head, casing : float
        Displacements, down positive [m].
    head_velocity, casing_velocity : float
        [m/s]
    friction_loss, weight_work, lost_momentum : float
        Energy taken by the wall, work of the weight [J], momentum taken by the wall [N s].
    """

    STATE: ClassVar[tuple[str, ...]] = (
        "count", "head", "casing", "head_velocity", "casing_velocity", "friction_loss",
        "weight_work", "lost_momentum",
    )  # fmt: skip

    def __init__(self, parameters: dict[str, Any], count: int) -> None:
        p = parameters
        self.count = count
        self.length_of_rod = p["rod.length"]
        self.area, self.density = p["rod.area"], p["rod.density"]
        self.modulus = p["rod.youngs_modulus"]
        self.speed = math.sqrt(self.modulus / self.density)
        self.impedance = self.area * math.sqrt(self.modulus * self.density)
        buoyancy = p["fluid_density"] / self.density
        self.gravity = p["gravity"] * (1.0 - buoyancy)  # of what is in the hole
        self.head_gravity = p["gravity"]
        self.head_mass, self.casing_mass = p["head.mass"], p.get("casing.mass", 0.0)
        self.sticking = p["friction.force"]  # by length [N/m]
        self.viscous = p["friction.viscosity"]  # by length [N s/m2]
        self.head = self.casing = self.head_velocity = self.casing_velocity = 0.0
        self.friction_loss = self.weight_work = self.lost_momentum = 0.0

    def divide(self, cells: int) -> None:
        """Divide each rod into so many cells, which waves cross in `step` [s]."""
        self.cells_of_rod, self.cell = cells, self.length_of_rod / cells
        self.step = self.cell / self.speed
        self.cell_mass = self.density * self.area * self.cell

    def apply_friction(self, v: np.ndarray, mass: float, length: float, step: float) -> np.ndarray:
        """Velocities after a step of wall friction on pieces of a mass and a length.

        Coulomb friction stops a piece at most, viscous friction is implicit:
        m v' = -s L sign(v) - c L v.
        """
        slowing = self.sticking * length / mass * step
        after = np.sign(v) * np.maximum(np.abs(v) - slowing, 0.0)
        after /= 1.0 + self.viscous * length / mass * step
        self.friction_loss += 0.5 * mass * float(v @ v - after @ after)
        self.lost_momentum += mass * float((v - after).sum())
        return after

    @property
    def weight(self) -> float:
        """Weight of head, rods and casing, less buoyancy [N]."""
        rods = self.density * self.area * self.length_of_rod * self.count
        return self.head_gravity * self.head_mass + self.gravity * (rods + self.casing_mass)


class TakesRods:
    """A model of a string whose body gets more rods as it goes down.

    Attributes
    ----------
    added : int
        Rods since the start.
    next_rod : float
        Displacement of the head at which the next one is wanted [m].
    was_asked : bool
        Whether one was asked for in the step before.
    brought_energy, brought_momentum : float
        Of new rods [J, N s].
    """

    parameters: dict[str, Any]
    body: Any
    added: int
    next_rod: float
    was_asked: bool
    brought_energy: float
    brought_momentum: float

    def rods_fault(self, saved: Mapping[str, Any]) -> str:
        """What is wrong with the rods of a state from outside; empty if nothing is."""
        body, count = saved["body"], saved["body"]["count"]
        if type(count) is not int or not 1 <= count <= MOST_RODS:
            return f"{count!r} rods, which must be 1 to {MOST_RODS}"
        for name, length in self.body.lengths(count).items():
            if len(body[name]) != length:
                return f"{len(body[name])} numbers in {name}, which must be {length}"
        return ""

    def _add_rods(self, asked: bool) -> None:
        """Add a rod on the rising edge of `add_rod`, or by itself where the head is down."""
        wanted = self.body.head >= self.next_rod
        if wanted and (self.parameters["rod.automatic"] or (asked and not self.was_asked)):
            before = self.body.stored, self.body.momentum
            self.body.add_rod()
            self.added += 1
            self.next_rod += self.parameters["rod.length"]
            self.brought_energy += self.body.stored - before[0]
            self.brought_momentum += self.body.momentum - before[1]
        self.was_asked = bool(asked)


class Lumps(Rods):
    """A mass for each rod between springs; the implicit midpoint rule, any step.

    Without Coulomb friction a step is a matrix, which is kept: one product moves the string.

    Attributes
    ----------
    places, velocities : ndarray, shape (rods + 2,)
        Displacements from the unloaded string [m] and velocities [m/s], head first.
    """

    STATE = (*Rods.STATE, "places", "velocities")
    step = math.inf  # a communication step is a step

    def __init__(self, parameters: dict[str, Any], count: int) -> None:
        super().__init__(parameters, count)
        self.places = np.zeros(count + 2)
        self.velocities = np.zeros(count + 2)
        self.assemble()

    def lengths(self, count: int) -> dict[str, int]:
        """Lengths of the lists in a state of so many rods."""
        return {"places": count + 2, "velocities": count + 2}

    def assemble(self) -> None:
        """Masses, weights, and springs: half a rod's length beside an end."""
        n = self.count
        rod = self.density * self.area * self.length_of_rod
        self.masses = np.array([self.head_mass, *[rod] * n, self.casing_mass])
        self.weights = self.gravity * self.masses
        self.weights[0] = self.head_gravity * self.head_mass
        whole = self.modulus * self.area / self.length_of_rod
        springs = np.array([2.0 * whole, *[whole] * (n - 1), 2.0 * whole])
        self.springs = springs
        self.stiffness = np.zeros((n + 2, n + 2))
        for i, k in enumerate(springs):
            self.stiffness[i, i] += k
            self.stiffness[i + 1, i + 1] += k
            self.stiffness[i, i + 1] -= k
            self.stiffness[i + 1, i] -= k
        self._made_for = 0.0  # step of the operators [s]
        self._ones = np.ones(n)
        # places, velocities, forces on head and casing, and 1 for the weights; now and next
        self._buffers = [np.zeros(2 * n + 7), np.zeros(2 * n + 7)]
        for buffer in self._buffers:
            buffer[-1] = 1.0
        now = self._buffers[0]
        now[: n + 2], now[n + 2 : -3] = self.places, self.velocities
        self._view(now)

    def _view(self, buffer: np.ndarray) -> None:
        n = self.count
        self.places, self.velocities = buffer[: n + 2], buffer[n + 2 : -3]

    def _make(self, h: float) -> None:
        """Operators of a step `h` [s]."""
        n, m = self.count + 2, np.diag(self.masses)
        # (M + h^2/4 K) v_mean = M v + h/2 (f - K x)
        self._inverse = np.linalg.inv(m + 0.25 * h * h * self.stiffness)
        half = 0.5 * h * self._inverse
        mean = np.column_stack([-half @ self.stiffness, self._inverse @ m,
                                half[:, 0], half[:, -1], half @ self.weights])  # fmt: skip
        stay = np.eye(2 * n, 2 * n + 3)
        self._left = 1.0 / (1.0 + self.viscous * self.length_of_rod / self.masses[1] * h)
        kept = np.array([1.0, *[self._left] * self.count, 1.0])[:, None]
        self._moves = np.vstack([stay[:n] + h * mean, kept * (2.0 * mean - stay[n:])])
        self._made_for = h

    def rest(self, bottom_force: float) -> None:
        """Stand still, with this compression at the casing's upper side [N]."""
        n = self.count
        force = bottom_force
        for i in range(n, -1, -1):
            self.places[i] = self.places[i + 1] + force / self.springs[i]
            force -= self.weights[i]

    def advance(self, head_force: float, casing_force: float, h: float) -> None:
        """Go on by a step `h` [s] under forces on head and casing [N], without weights."""
        if h != self._made_for:
            self._make(h)
        if self.sticking > 0.0:
            self._advance_with_friction(head_force, casing_force, h)
            return
        now, after = self._buffers
        before, last = self.places, self.count + 1
        now[-3], now[-2] = head_force, casing_force
        np.dot(self._moves, now, after[:-3])
        self._buffers = [after, now]
        self._view(after)
        self.head += after.item(0) - now.item(0)
        self.casing += after.item(last) - now.item(last)
        self.weight_work += float(self.weights.dot(self.places - before))
        self.head_velocity, self.casing_velocity = after.item(last + 1), after.item(-4)
        if self.viscous > 0.0:
            rods, left, mass = self.velocities[1:-1], self._left, self.masses.item(1)
            self.friction_loss += 0.5 * mass * (1.0 / left**2 - 1.0) * float(rods.dot(rods))
            self.lost_momentum += mass * (1.0 / left - 1.0) * float(rods.dot(self._ones))

    def _advance_with_friction(self, head_force: float, casing_force: float, h: float) -> None:
        """The same with Coulomb friction."""
        force = self.weights - self.stiffness @ self.places
        force[0] += head_force
        force[-1] += casing_force
        before = self.velocities
        mean = self._inverse @ (self.masses * before + 0.5 * h * force)
        self.velocities[:] = 2.0 * mean - before
        self.weight_work += h * float(self.weights @ mean)
        self.places += h * mean
        self.head += h * float(mean[0])
        self.casing += h * float(mean[-1])
        rods = self.velocities[1:-1]
        rods[:] = self.apply_friction(rods.copy(), float(self.masses[1]), self.length_of_rod, h)
        self.head_velocity = float(self.velocities[0])
        self.casing_velocity = float(self.velocities[-1])

    def add_rod(self) -> None:
        """Put a rod below the head, at rest in the compression of the place."""
        force = self.springs[0] * float(self.places[0] - self.places[1])
        v = float(self.velocities[0])
        places, velocities, weight = self.places, self.velocities, float(self.weights[1])
        self.count += 1
        rod = float(places[1]) + force / (0.5 * float(self.springs[0]))
        head = rod + (force - weight) / float(self.springs[0])
        self.places = np.concatenate([[head, rod], places[1:]])
        self.velocities = np.concatenate([[v, v], velocities[1:]])
        self.assemble()

    @property
    def stored(self) -> float:
        """Kinetic and elastic energy [J]."""
        v, x = self.velocities, self.places
        return 0.5 * float(v @ (self.masses * v) + x @ (self.stiffness @ x))

    @property
    def momentum(self) -> float:
        """Of head, rods and casing [N s]."""
        return float(self.masses @ self.velocities)
