"""Drill string: head, rods, casing, and the shoulder that pushes the bit.

The shoulder is a spring with a damper, in compression only,

    F = k (x_c - x_b) + c (v_c - v_b)  >= 0,

and F is held over a communication step on both sides: the casing feels what the bit
feels, so momentum passes the interface exactly. A force that is held for a step h, and
known to the bit a step late, brings energy into the pair unless the damper takes it:
c > k h / 2 for the hold, 3 k h / 2 with the delay. A damper that is sampled needs
c h well below the mass that it brakes. `_shoulder` keeps both, by less stiffness if need
be: then a free bit comes to rest at any step. No sampled force is passive for every
partner; one that swings within a few steps has to lose a few percent a cycle, as rock does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fmu_src.parts.part import COUNT, Model, PartTable, slave_of
from fmu_src.parts.string_body import Lumps, TakesRods
from fmu_src.parts.string_waves import Waves

# Damping by stiffness and step: 3/2 is the limit, the rest is margin.
DAMPING_OF_DELAY = 2.0
# Damping by mass and step: stable below 1/2 with a delay of one step, the rest is margin
# for bits that swing on rock.
SHARE_OF_MASS = 0.1
# A step that misses the end of a cell by rounding ends there.
ROUNDING = 1e-9
# Implicit midpoint is stable at any step, but blind to what is faster [s].
LONGEST_LUMPED_STEP = 2e-3


class DrillString(TakesRods, Model):
    """String with shoulder.

    Attributes
    ----------
    force : float
        Of the shoulder, on the bit and on the casing, until the next step ends [N].
    lag : float
        Time by which the waves stay behind the communication point [s].
    """

    force: float
    force_before: float
    lag: float
    gap: float
    bit: float
    casing_impulse: float
    head_impulse_due: float
    casing_impulse_due: float
    mean_force: float
    added: int
    next_rod: float
    was_asked: bool
    stiffness: float
    brought_energy: float
    brought_momentum: float
    head_work: float
    reaction_work: float
    bit_work: float
    shoulder_work: float
    head_impulse: float
    bit_impulse: float
    loaded: float
    time: float
    body: Any
    STATE = tuple(__annotations__)

    def __init__(self, parameters: dict[str, Any]) -> None:
        super().__init__(parameters)
        for name in self.STATE:
            setattr(self, name, 0.0)
        kind = {"waves": Waves, "lumped": Lumps}[parameters["model"]]
        self.body = kind(parameters, int(parameters["start.rods"]))
        self.was_asked = False
        self._share = 0.0, 0.0  # of a step that the filter of the feed lets through
        self._allowed = 0.0, (0.0, 0.0)  # stiffness and damping of the shoulder for a step [s]

    def begin(self, inputs: dict[str, Any]) -> None:
        """Stand still in balance, the shoulder loaded by `start.feed_force`."""
        self.force = self.mean_force = self.parameters["start.feed_force"]
        self.force_before = 0.0
        self.stiffness = self.parameters["shoulder.stiffness"]
        self.gap = self.force / self.stiffness  # compression at equal displacements [m]
        self.loaded = 0.5 * self.force**2 / self.stiffness  # energy that is there already [J]
        self.bit = inputs["bit_position"]
        self.casing_impulse = inputs["casing_impulse"]
        casing_weight = self.body.gravity * self.body.casing_mass
        self.body.rest(self.force - casing_weight)
        self.next_rod = self.parameters["start.rod_left"]

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """Forces act, waves travel, the shoulder finds its new force."""
        h, body = step_size, self.body
        reaction = (inputs["casing_impulse"] - self.casing_impulse) / h
        self.casing_impulse = inputs["casing_impulse"]
        before = body.head, self.casing_position()
        self._travel(inputs["head_force"], reaction - self.force, h)
        self.head_work += inputs["head_force"] * (body.head - before[0])
        self.head_impulse += inputs["head_force"] * h
        self.time += h
        moved = self.casing_position() - before[1]
        self.reaction_work += reaction * moved
        self.shoulder_work += self.force * moved
        self.bit_impulse += self.force * h
        bit = inputs["bit_position"]
        # what the bit did is known a step late, as it is in a master that goes by Jacobi
        self.bit_work += self.force_before * (bit - self.bit)
        self.force_before = self.force
        self._update_force((bit - self.bit) / h, bit, h)
        self.bit = bit
        if h != self._share[0]:
            self._share = h, 1.0 - math.exp(-h / self.parameters["feed_filter"])
        self.mean_force += self._share[1] * (self.force - self.mean_force)
        self._add_rods(inputs["add_rod"])

    def _travel(self, head_force: float, casing_force: float, h: float) -> None:
        """Bring the body up to the communication point, or within a cell of it."""
        body = self.body
        if isinstance(body, Lumps):
            count = max(1, math.ceil(h / LONGEST_LUMPED_STEP - ROUNDING))
            for _ in range(count):
                body.advance(head_force, casing_force, h / count)
            return
        cell, enough = body.step, body.step * (1.0 - ROUNDING)
        if self.lag + h < enough:
            self.head_impulse_due += head_force * h
            self.casing_impulse_due += casing_force * h
            self.lag += h
            return
        # what has acted since the last transit time ended counts in the first one
        first = cell - self.lag
        forces = [
            (
                (self.head_impulse_due + head_force * first) / cell,
                (self.casing_impulse_due + casing_force * first) / cell,
            )
        ]
        whole = max(0, math.floor((h - first) / cell + ROUNDING))
        forces += [(head_force, casing_force)] * whole
        # Coulomb friction holds what is about to turn, so it has to act after each cell
        most = 1 if body.sticking > 0.0 else body.cells
        for begin in range(0, len(forces), most):
            body.advance(forces[begin : begin + most])
        self.lag = max(0.0, h - first - whole * cell)
        self.head_impulse_due = head_force * self.lag
        self.casing_impulse_due = casing_force * self.lag

    def casing_position(self) -> float:
        """Displacement of the casing at the communication point [m]."""
        return self.body.casing + self.body.casing_velocity * self.lag

    def _shoulder(self, h: float) -> tuple[float, float]:
        """Stiffness [N/m] and damping [N s/m] that a communication step `h` [s] allows."""
        p = self.parameters
        k, c = p["shoulder.stiffness"], p["shoulder.damping"]
        if not p["shoulder.passive"]:
            return k, c
        most = SHARE_OF_MASS * p["shoulder.bit_mass"] / h
        k = min(k, most / (DAMPING_OF_DELAY * h))
        return k, min(max(c, DAMPING_OF_DELAY * k * h), most)

    def _update_force(self, bit_velocity: float, bit: float, h: float) -> None:
        """Force of the shoulder for the step to come."""
        if h != self._allowed[0]:
            self._allowed = h, self._shoulder(h)
        k, c = self._allowed[1]
        if k != self.stiffness:
            # another step size: the same force at another stiffness
            softer = 1.0 / k - 1.0 / self.stiffness
            self.gap += self.force * softer
            self.loaded += 0.5 * self.force**2 * softer
            self.stiffness = k
        compression = self.gap + self.casing_position() - bit
        if compression <= 0.0:
            self.force = 0.0
            return
        self.force = max(0.0, k * compression + c * (self.body.casing_velocity - bit_velocity))

    def signals(self) -> dict[str, Any]:
        """What rig, rock, hammer and controller take."""
        return {
            "feed_force": self.force,
            "feed_force_mean": self.mean_force,
            "head_velocity": self.body.head_velocity,
        }

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        body = self.body
        stored_in_shoulder = 0.5 * self.force**2 / self.stiffness
        return self.signals() | {
            "head_position": body.head + body.head_velocity * self.lag,
            "casing_position": self.casing_position(),
            "casing_velocity": body.casing_velocity,
            "length": body.count * body.length_of_rod,
            "weight": body.weight,
            "rod_wanted": bool(body.head >= self.next_rod),
            "lifted": self.force == 0.0,
            "shoulder_stiffness": self.stiffness,
            "head_impulse": self.head_impulse,
            "bit_impulse": self.bit_impulse,
            "momentum": body.momentum - self.brought_momentum,
            "wall_momentum": body.lost_momentum,
            "energy.head": self.head_work,
            "energy.reaction": self.reaction_work,
            "energy.weight": body.weight_work,
            "energy.bit": self.bit_work,
            "energy.shoulder": self.shoulder_work
            - self.bit_work
            - (stored_in_shoulder - self.loaded),
            "energy.wall": body.friction_loss,
            "energy.stored": body.stored + stored_in_shoulder - self.brought_energy,
            "rod_count": int(body.count),
        }

    def state_fault(self, saved: Mapping[str, Any]) -> str:
        """As in `Model`: the number of rods, what is divided by, and a lag within a cell."""
        if fault := self.rods_fault(saved):
            return fault
        if not saved["stiffness"] > 0.0:
            return f"stiffness = {saved['stiffness']!r}, which must be above 0 N/m"
        if not 0.0 <= saved["lag"] <= self.body.step:
            return f"lag = {saved['lag']!r}, which must be from 0 to {self.body.step!r} s"
        return ""

    def restore(self, saved: dict[str, Any]) -> None:
        """Go back to a state, which is right."""
        super().restore(saved)
        if isinstance(self.body, Lumps):
            self.body.assemble()


DrillStringPart = slave_of(DrillString)


TABLE = PartTable(
    name="DrillString",
    slave=DrillStringPart,
    description="Axial drill string with head, casing and the shoulder that pushes the bit",
    inputs={
        "head_force": ("N", -1e9, 1e9, 0.0, "force of the rig on the head"),
        "bit_position": ("m", -1e6, 1e6, 0.0, "displacement of the bit"),
        "casing_impulse": (
            "N s", -1e12, 1e12, 0.0, "running integral of the drive's reaction on the casing"
        ),
        "add_rod": ("", 0, 1, False, "a rising edge adds a rod, where rod_wanted"),
    },
    outputs={
        "feed_force": ("N", "force of the shoulder on the bit, held for the next step"),
        "feed_force_mean": ("N", "the same, filtered"),
        "head_position": ("m", "displacement of the head, without that of adding rods"),
        "head_velocity": ("m/s", "velocity of the head"),
        "casing_position": ("m", "displacement of the casing"),
        "casing_velocity": ("m/s", "velocity of the casing"),
        "length": ("m", "length of the rods"),
        "weight": ("N", "weight of head, rods and casing, less buoyancy"),
        "rod_wanted": (False, "whether the head is down and a rod may be added"),
        "lifted": (False, "whether the shoulder is off the bit"),
        "shoulder_stiffness": ("N/m", "stiffness of the shoulder that the step size allows"),
        "head_impulse": ("N s", "running integral of head_force"),
        "bit_impulse": ("N s", "running integral of feed_force"),
        "momentum": ("N s", "of head, rods and casing, less what new rods brought"),
        "wall_momentum": ("N s", "momentum that the wall has taken"),
        "energy.head": ("J", "work of head_force"),
        "energy.reaction": ("J", "work of the drive's reaction on the casing"),
        "energy.weight": ("J", "work of the weight"),
        "energy.bit": ("J", "work of feed_force on the bit"),
        "energy.shoulder": (
            "J", "energy that the shoulder has taken; below 0 the coupling has made energy"
        ),
        "energy.wall": ("J", "energy that wall friction has taken"),
        "energy.stored": ("J", "kinetic and elastic energy, less what new rods brought"),
        "rod_count": (COUNT, "rods in the string"),
    },
    parameters={
        "model": ("", 0, 0, ("waves", "lumped"), "travelling waves, or a mass for each rod"),
        "rod.length": ("m", 0.1, 100.0, 3.0, "length of a rod"),
        "rod.area": ("m^2", 1e-5, 1.0, 2.4e-3, "cross-section of steel"),
        "rod.density": ("kg/m^3", 100.0, 3e4, 7850.0, "density"),
        "rod.youngs_modulus": ("Pa", 1e9, 1e12, 2.1e11, "Young's modulus"),
        "rod.cells": (COUNT, 1, 200, 2, "cells of the wave grid in a rod"),
        "rod.automatic": ("", 0, 1, True, "whether a rod is added as soon as one is wanted"),
        "start.rods": (COUNT, 1, 1000, 4, "rods at the start"),
        "start.rod_left": ("m", 0.0, 100.0, 3.0, "way of the head to the first new rod"),
        "start.feed_force": ("N", 0.0, 1e6, 2500.0, "force of the shoulder at the start"),
        "head.mass": ("kg", 1.0, 1e5, 300.0, "rotation head with carriage"),
        "casing.mass": ("kg", 0.1, 1e5, 40.0, "casing of the hammer; part of the string"),
        "shoulder.stiffness": ("N/m", 1e3, 1e10, 1e5, "stiffness of shoulder, chuck and damper"),
        "shoulder.damping": ("N s/m", 0.0, 1e7, 200.0, "damping of the same"),
        "shoulder.bit_mass": ("kg", 0.1, 1e4, 8.69, "mass of the bit, for the limit of a step"),
        "shoulder.passive": ("", 0, 1, True, "keep to what a communication step can bear"),
        "friction.force": ("N/m", 0.0, 1e5, 0.0, "Coulomb friction at the wall by length"),
        "friction.viscosity": ("N s/m^2", 0.0, 1e5, 20.0, "viscous friction by length"),
        "fluid_density": ("kg/m^3", 0.0, 3e3, 0.0, "density of the fluid in the hole (buoyancy)"),
        "gravity": ("m/s^2", -100.0, 100.0, 10.0, "acceleration, down positive"),
        "feed_filter": ("s", 1e-4, 100.0, 0.1, "time of the filter of feed_force_mean"),
    },
    at_start=dict.fromkeys(
        (
            "feed_force", "feed_force_mean", "length", "weight", "rod_wanted", "lifted",
            "shoulder_stiffness", "momentum", "energy.stored", "rod_count",
        ),
        (),
    ),
)  # fmt: skip
