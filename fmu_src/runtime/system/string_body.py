"""The body of a drill string between two end masses: travelling waves, or lumped masses.

Both take the force on the head and on the casing (down positive), and know the
displacements and velocities of the two ends. Weight and wall friction act on the way.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np


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
        self.head_mass, self.casing_mass = p["head.mass"], p["casing.mass"]
        self.sticking = p["friction.force"]  # by length [N/m]
        self.viscous = p["friction.viscosity"]  # by length [N s/m2]
        self.head = self.casing = self.head_velocity = self.casing_velocity = 0.0
        self.friction_loss = self.weight_work = self.lost_momentum = 0.0

    def rubbed(self, v: np.ndarray, mass: float, length: float, step: float) -> np.ndarray:
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
    def rubs(self) -> bool:
        """Whether there is wall friction at all."""
        return self.sticking > 0.0 or self.viscous > 0.0

    @property
    def weight(self) -> float:
        """Weight of head, rods and casing, less buoyancy [N]."""
        rods = self.density * self.area * self.length_of_rod * self.count
        return self.head_gravity * self.head_mass + self.gravity * (rods + self.casing_mass)


class Lumps(Rods):
    """A mass for each rod between springs; the implicit midpoint rule, any step.

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
        self._made: tuple[int, float] = (0, 0.0)
        self._assemble()

    def _assemble(self) -> None:
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
        self._made = (0, 0.0)

    def _operator(self, h: float) -> np.ndarray:
        if self._made != (self.count, h):
            # (M + h^2/4 K) v_mean = M v + h/2 (f - K x)
            self._inverse = np.linalg.inv(np.diag(self.masses) + 0.25 * h * h * self.stiffness)
            self._made = (self.count, h)
        return self._inverse

    def rest(self, bottom_force: float) -> None:
        """Stand still, with this compression at the casing's upper side [N]."""
        n = self.count
        force = bottom_force
        for i in range(n, -1, -1):
            self.places[i] = self.places[i + 1] + force / self.springs[i]
            force -= self.weights[i]

    def go_on(self, head_force: float, casing_force: float, h: float) -> None:
        """Go on by a step `h` [s] under forces on head and casing [N], without weights."""
        force = self.weights - self.stiffness @ self.places
        force[0] += head_force
        force[-1] += casing_force
        before = self.velocities
        mean = self._operator(h) @ (self.masses * before + 0.5 * h * force)
        self.velocities = 2.0 * mean - before
        self.weight_work += h * float(self.weights @ mean)
        self.places = self.places + h * mean
        self.head += h * float(mean[0])
        self.casing += h * float(mean[-1])
        if self.rubs:
            rods = self.velocities[1:-1]
            self.velocities[1:-1] = self.rubbed(rods, float(self.masses[1]), self.length_of_rod, h)
        self.head_velocity = float(self.velocities[0])
        self.casing_velocity = float(self.velocities[-1])

    def add_rod(self) -> None:
        """Put a rod below the head, at rest in the compression of the place."""
        force = self.springs[0] * float(self.places[0] - self.places[1])
        v = float(self.velocities[0])
        self.count += 1
        self._assemble()
        rod = float(self.places[1]) + force / self.springs[1]
        head = rod + (force - self.weights[1]) / self.springs[0]
        self.places = np.concatenate([[head, rod], self.places[1:]])
        self.velocities = np.concatenate([[v, v], self.velocities[1:]])

    @property
    def stored(self) -> float:
        """Kinetic and elastic energy [J]."""
        v, x = self.velocities, self.places
        return 0.5 * float(v @ (self.masses * v) + x @ (self.stiffness @ x))

    @property
    def momentum(self) -> float:
        """Of head, rods and casing [N s]."""
        return float(self.masses @ self.velocities)
