"""Rods of a drill string between two ends: what all strings share, and lumped masses.

Bodies take the force on the head and on the casing (down positive), and know displacements and
velocities of both ends. Weight and wall friction act on the way.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fmu_src.parts.part import COUNT, FLAG, NUMBER, Entries
from percussion_model.physics.kernel import kernel

# A saved string, or one that goes on adding rods, has no more.
MOST_RODS = 2000
# Rods; displacement of the head [m], its velocity [m/s]; energy that the wall has taken and
# work of the weight [J], momentum that the wall has taken [N s]; displacement
# of the head at which the next is wanted [m], whether one was asked for in the step before; energy
# and momentum of new rods.
STATE = {
    "count": (1, MOST_RODS),
    **dict.fromkeys(
        ("head", "head_velocity", "friction_loss", "weight_work", "lost_momentum", "next_rod",
         "brought_energy", "brought_momentum"),
        NUMBER,
    ),
    "was_asked": FLAG,
}  # fmt: skip
# What is refused of rods: how many there are, and how many there may be.
NO_ROOM = "the string has {0:d} rods and wants one more: rod.most must be above {1:d}"
TOO_MANY = "start.rods = {0:d}: must be at most rod.most, which is {1:d}"
SAVED_TOO_MANY = "the saved state has {0:d} rods, which must be at most rod.most, {1:d}"


def rod_parameters(cells: int) -> Entries:
    """Rows of the parameters that all strings have, with the cells of a rod at the start."""
    return {
        "rod.length": ("m", 0.1, 100.0, 3.0, "length of a rod"),
        "rod.area": ("m^2", 1e-5, 1.0, 2.4e-3, "cross-section of steel"),
        "rod.density": ("kg/m^3", 100.0, 3e4, 7850.0, "density"),
        "rod.youngs_modulus": ("Pa", 1e9, 1e12, 2.1e11, "Young's modulus"),
        "rod.cells": (COUNT, 1, 200, cells, "cells of the wave grid in a rod"),
        "rod.automatic": ("", 0, 1, True, "whether a rod is added as soon as one is wanted"),
        "rod.most": (COUNT, 1, MOST_RODS, 100, "rods that there may come to be"),
        "start.rods": (COUNT, 1, 1000, 4, "rods at the start"),
        "start.rod_left": ("m", 0.0, 100.0, 3.0, "way of the head to the first new rod"),
        "head.mass": ("kg", 1.0, 1e5, 300.0, "rotation head with carriage"),
        "friction.force": ("N/m", 0.0, 1e5, 0.0, "Coulomb friction at the wall per length"),
        "friction.viscosity": ("N s/m^2", 0.0, 1e5, 20.0, "viscous friction per length"),
        "fluid_density": ("kg/m^3", 0.0, 3e3, 0.0, "density of the fluid in the hole (buoyancy)"),
        "gravity": ("m/s^2", -100.0, 100.0, 10.0, "acceleration, down positive"),
        "feed_filter": ("s", 1e-4, 100.0, 0.1, "time of the filter of feed_force_mean"),
    }


@kernel
def rods_fault(count, most, facts):
    """Whether there are more rods than there is room for; fills the facts."""
    facts[0], facts[1] = count, most
    return count > most


@kernel
def impedance_of(p):
    """Impedance of the rods [N s/m]."""
    return p.rod_area * math.sqrt(p.rod_youngs_modulus * p.rod_density)


@kernel
def step_of(p):
    """Time in which a wave crosses a cell [s]."""
    return p.rod_length / p.rod_cells / math.sqrt(p.rod_youngs_modulus / p.rod_density)


@kernel
def cell_mass_of(p):
    """Mass of a cell [kg]."""
    return p.rod_density * p.rod_area * (p.rod_length / p.rod_cells)


@kernel
def gravity_of(p):
    """Acceleration of what is in the hole, less buoyancy [m/s^2]."""
    return p.gravity * (1.0 - p.fluid_density / p.rod_density)


@kernel
def weight_of(p, count, casing_mass):
    """Weight of head, rods and casing, less buoyancy [N]."""
    rods = p.rod_density * p.rod_area * p.rod_length * count
    return p.gravity * p.head_mass + gravity_of(p) * (rods + casing_mass)


@kernel
def is_wanted(p, u, s):
    """Whether a rod is to be added: on the rising edge of `add_rod`, or where the head is down."""
    asked = bool(u.add_rod)
    wanted = s.head >= s.next_rod and (bool(p.rod_automatic) or (asked and not s.was_asked))
    s.was_asked = asked
    return wanted


@kernel
def rubbed(p, s, v, mass, length, h):
    """Velocity of a piece after a step of wall friction, whose loss is booked.

    Coulomb friction stops a piece at most, viscous friction is implicit:
    m v' = -s L sign(v) - c L v.
    """
    slowed = max(abs(v) - p.friction_force * length / mass * h, 0.0)
    after = math.copysign(slowed, v) / (1.0 + p.friction_viscosity * length / mass * h)
    s.friction_loss += 0.5 * mass * (v * v - after * after)
    s.lost_momentum += mass * (v - after)
    return after


class Lumps(NamedTuple):
    """A mass for each rod between springs: their mass and stiffness, those at the ends twice as
    stiff since they are half as long."""

    rod_mass: float
    stiffness: float
    velocities: int  # where they begin in what moves; places come first


@kernel
def lumps_of(p):
    """Masses and springs of rods."""
    rod_mass = p.rod_density * p.rod_area * p.rod_length
    return Lumps(rod_mass, p.rod_youngs_modulus * p.rod_area / p.rod_length, p.rod_most + 2)


@kernel
def mass_at(p, s, lumps, k):
    """Mass of a lump, head first [kg]."""
    return p.head_mass if k == 0 else p.casing_mass if k == s.count + 1 else lumps.rod_mass


@kernel
def weight_at(p, s, lumps, k):
    """Weight of a lump [N]."""
    return (p.gravity if k == 0 else gravity_of(p)) * mass_at(p, s, lumps, k)


@kernel
def spring_below(s, lumps, k):
    """Stiffness of the spring below a lump [N/m]."""
    return (2.0 if k == 0 or k == s.count else 1.0) * lumps.stiffness


@kernel
def rest_lumps(p, s, w, bottom_force):
    """Stand still, with this compression at the casing's upper side [N]."""
    lumps, x, force = lumps_of(p), w.moving, bottom_force
    for k in range(s.count, -1, -1):
        x[k] = x[k + 1] + force / spring_below(s, lumps, k)
        force -= weight_at(p, s, lumps, k)


@kernel
def force_on(p, s, w, lumps, k, head_force, casing_force):
    """Force on a lump, of its springs, its weight and from outside [N]."""
    x, last, force = w.moving, s.count + 1, weight_at(p, s, lumps, k)
    if k > 0:
        force += spring_below(s, lumps, k - 1) * (x[k - 1] - x[k])
    if k < last:
        force -= spring_below(s, lumps, k) * (x[k] - x[k + 1])
    return force + (head_force if k == 0 else casing_force if k == last else 0.0)


@kernel
def advance_lumps(p, s, w, head_force, casing_force, h):
    """Go on by a step `h` [s] under forces on head and casing [N], by the implicit midpoint rule.

    (M + h^2/4 K) v_mean = M v + h/2 (f - K x), whose matrix has three diagonals (Thomas).
    """
    lumps, last, quarter = lumps_of(p), s.count + 1, 0.25 * h * h
    x, v0 = w.moving, lumps.velocities
    above, mean = w.made, lumps.velocities  # shares of the lump below, then mean velocities
    for k in range(last + 1):
        mass = mass_at(p, s, lumps, k)
        upper = quarter * spring_below(s, lumps, k - 1) if k > 0 else 0.0
        lower = quarter * spring_below(s, lumps, k) if k < last else 0.0
        right = mass * x[v0 + k]
        right += 0.5 * h * force_on(p, s, w, lumps, k, head_force, casing_force)
        diagonal = mass + upper + lower
        if k > 0:
            diagonal -= upper * above[k - 1]
            right += upper * above[mean + k - 1]
        above[k], above[mean + k] = lower / diagonal, right / diagonal
    for k in range(last - 1, -1, -1):
        above[mean + k] += above[k] * above[mean + k + 1]
    for k in range(last + 1):
        v = above[mean + k]
        x[v0 + k] = 2.0 * v - x[v0 + k]
        x[k] += h * v
        s.weight_work += h * weight_at(p, s, lumps, k) * v
        if 0 < k < last:
            x[v0 + k] = rubbed(p, s, x[v0 + k], lumps.rod_mass, p.rod_length, h)
    s.head += h * above[mean]
    s.casing += h * above[mean + last]
    s.head_velocity, s.casing_velocity = x[v0], x[v0 + last]


@kernel
def add_lump(p, s, w):
    """Put a rod below the head, at rest in the compression of the place."""
    lumps, x = lumps_of(p), w.moving
    v0, top = lumps.velocities, 2.0 * lumps.stiffness
    force, weight = top * (x[0] - x[1]), weight_at(p, s, lumps, 1)
    s.count += 1
    for k in range(s.count + 1, 1, -1):
        x[k], x[v0 + k] = x[k - 1], x[v0 + k - 1]
    x[1] = x[2] + force / lumps.stiffness
    x[0] = x[1] + (force - weight) / top
    x[v0 + 1] = x[v0]


@kernel
def stored_in_lumps(p, s, w):
    """Kinetic and elastic energy [J]."""
    lumps, x, total = lumps_of(p), w.moving, 0.0
    for k in range(s.count + 2):
        v = x[lumps.velocities + k]
        total += mass_at(p, s, lumps, k) * (v * v)
    for k in range(s.count + 1):
        pressed = x[k] - x[k + 1]
        total += spring_below(s, lumps, k) * (pressed * pressed)
    return 0.5 * total


@kernel
def momentum_of_lumps(p, s, w):
    """Of head, rods and casing [N s]."""
    lumps, total = lumps_of(p), 0.0
    for k in range(s.count + 2):
        total += mass_at(p, s, lumps, k) * w.moving[lumps.velocities + k]
    return total
