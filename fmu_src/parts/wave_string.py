"""Drill string that meets the hammer's casing by waves.

What crosses a communication point is the wave that goes down the lowest rod over the next step,
known since rods delay it, and the one that has come up over the last: sums of Legendre
polynomials, whose projections can only lose energy. So the coupling makes none, whatever the
hammer does (docs/system.md, section 4). Steps may be as long as the rods delay a wave.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fmu_src.parts.part import COUNT, Model, PartTable, slave_of
from fmu_src.parts.string_body import TakesRods
from fmu_src.parts.string_packets import DEGREES, Packet, Packets, projected

# A time this close to another, by the step, is that.
ROUNDING = 1e-9
_DOWN = tuple(f"wave_{k + 1}" for k in range(DEGREES))
_UP = tuple(f"returned_{k + 1}" for k in range(DEGREES))


class WaveString(TakesRods, Model):
    """String whose lower end is a port for waves.

    Attributes
    ----------
    time : float
        Of the last communication point [s].
    clock : float
        Up to which the rods have gone, a step or two behind [s].
    """

    body: Any
    time: float
    clock: float
    known_until: float
    returned: list[float]
    begin_of_wave: float
    wave: list[float]
    given: float
    taken: float
    mean_push: float
    added: int
    next_rod: float
    was_asked: bool
    brought_energy: float
    brought_momentum: float
    head_work: float
    head_impulse: float
    STATE = tuple(__annotations__)

    def __init__(self, parameters: dict[str, Any]) -> None:
        super().__init__(parameters)
        for name in self.STATE:
            setattr(self, name, 0.0)
        self.body = Packets(parameters, int(parameters["start.rods"]))
        self.was_asked, self.returned, self.wave = False, [], [0.0] * DEGREES
        self.span = parameters["communication_step"]
        self._free_of(self.body.cells)  # refuses a step that is too long

    def _free_of(self, cells: int) -> int:
        """Lowest cells that give what the hammer needs next whatever it does until then."""
        free = math.ceil(2.0 * self.span / self.body.step - ROUNDING) + 1
        if free >= cells:
            longest = 0.5 * self.body.step * (cells - 2)
            raise ValueError(
                f"communication_step = {self.span!r} s: must be at most {longest:.4g} s for "
                f"{self.body.count} rods in {cells} cells"
            )
        return free

    def begin(self, inputs: dict[str, Any]) -> None:
        """Stand still in balance, with `start.force` at the low end."""
        self.body.rest(self.parameters["start.force"])
        self.mean_push = self.parameters["start.feed_force"]
        self.next_rod = self.parameters["start.rod_left"]
        self._give(0.0)

    def step(self, inputs: dict[str, Any], step_size: float) -> None:
        """Take what the hammer has sent, move the rods as far as that is known, and give."""
        h = self.span
        if abs(step_size - h) > ROUNDING * h:
            raise ValueError(
                f"a step of {step_size!r} s: communication_step is {h!r} s: take steps of that, or "
                f"set communication_step = {step_size!r}"
            )
        self._take(inputs)
        body, free = self.body, self._free_of(self.body.cells)
        packets, before = self._packets(), body.head
        while self.clock + body.step <= self.known_until + ROUNDING * h:
            coming = projected(packets, self.clock, body.step)
            body.advance(inputs["head_force"], coming.shares, free)
            self.clock += body.step
        self._forget()
        self.head_work += inputs["head_force"] * (body.head - before)
        self.head_impulse += inputs["head_force"] * h
        self.time += h
        self._give(self.time)
        share = 1.0 - math.exp(-h / self.parameters["feed_filter"])
        self.mean_push += share * (inputs["push"] - self.mean_push)
        self._add_rods(inputs["add_rod"])

    def _take(self, inputs: dict[str, Any]) -> None:
        """Keep a wave that the hammer has sent whole."""
        begin, h = inputs["returned_begin"], self.span
        is_whole = inputs["returned_until"] >= begin + h * (1.0 - 1e-4)
        if is_whole and begin > self.known_until + 0.5 * h:
            raise ValueError(
                f"returned_begin = {begin!r} s: the wave from {self.known_until!r} s on is "
                f"lacking: the hammer must take steps of communication_step, {h!r} s"
            )
        if is_whole and begin > self.known_until - 0.5 * h:
            shares = [float(inputs[name]) for name in _UP]
            self.returned += [begin, *shares]
            self.known_until = begin + h
            self.taken += Packet(begin, h, np.array(shares)).square

    def _packets(self) -> list[Packet]:
        rows = np.reshape(self.returned, (-1, 1 + DEGREES))
        return [Packet(row[0], self.span, row[1:]) for row in rows]

    def _forget(self) -> None:
        """Forget waves that are in the rods."""
        while self.returned and self.returned[0] + self.span <= self.clock + ROUNDING * self.span:
            del self.returned[: 1 + DEGREES]

    def _give(self, begin: float) -> None:
        """Find the wave that leaves over the step to come."""
        body, ahead = self.body, int((begin - self.clock) / self.body.step)
        packets = [
            Packet(self.clock + k * body.step, body.step, body.leaving(k))
            for k in range(ahead, min(ahead + 2 + math.ceil(self.span / body.step), body.cells))
        ]
        found = projected(packets, begin, self.span)
        self.begin_of_wave, self.wave = begin, found.shares.tolist()
        self.given += found.square

    def signals(self) -> dict[str, Any]:
        """What hammer, rig, rock and controller take."""
        return {
            "impedance": self.body.impedance,
            "wave_begin": self.begin_of_wave,
            "wave_span": self.span,
            **dict(zip(_DOWN, self.wave, strict=True)),
            "feed_force_mean": self.mean_push,
            "head_velocity": self.body.head_velocity,
        }

    def outputs(self) -> dict[str, Any]:
        """Present values by name."""
        body = self.body
        port = body.impedance * (self.given - self.taken)
        return self.signals() | {
            "head_position": body.head,
            "length": body.count * body.length_of_rod,
            "weight": body.weight,
            "rod_wanted": bool(body.head >= self.next_rod),
            "head_impulse": self.head_impulse,
            "momentum": body.momentum - self.brought_momentum,
            "wall_momentum": body.lost_momentum,
            "energy.head": self.head_work,
            "energy.weight": body.weight_work,
            "energy.port": port,
            "energy.left": body.port_work,
            "energy.wall": body.friction_loss,
            "energy.stored": body.stored - self.brought_energy,
            "rod_count": int(body.count),
        }

    def state_fault(self, saved: Mapping[str, Any]) -> str:
        """As in `Model`: the number of rods, and the lengths of what depends on it."""
        if fault := self.rods_fault(saved):
            return fault
        if len(saved["returned"]) % (1 + DEGREES) or len(saved["wave"]) != DEGREES:
            return "waves of another length"
        return ""


WaveStringPart = slave_of(WaveString)


TABLE = PartTable(
    name="WaveString",
    slave=WaveStringPart,
    description="Axial drill string with head, coupled to a casing in the hammer by waves",
    inputs={
        "head_force": ("N", -1e9, 1e9, 0.0, "force of the rig on the head"),
        "push": ("N", -1e9, 1e9, 0.0, "push of the shoulder on the bit"),
        "returned_begin": ("s", 0.0, 1e9, 0.0, "when the step began whose wave comes up"),
        "returned_until": ("s", 0.0, 1e9, 0.0, "up to which time that is complete"),
        **{
            name: ("m/s", -1e4, 1e4, 0.0, f"share of polynomial {k} of the wave that comes up")
            for k, name in enumerate(_UP)
        },
        "add_rod": ("", 0, 1, False, "a rising edge adds a rod, where rod_wanted"),
    },
    outputs={
        "impedance": ("N s/m", "impedance of the rods"),
        "wave_begin": ("s", "when the step begins whose wave goes down"),
        "wave_span": ("s", "length of that step"),
        **{
            name: ("m/s", f"share of polynomial {k} of the wave that goes down")
            for k, name in enumerate(_DOWN)
        },
        "feed_force_mean": ("N", "push, filtered"),
        "head_position": ("m", "displacement of the head, without that of adding rods"),
        "head_velocity": ("m/s", "velocity of the head"),
        "length": ("m", "length of the rods"),
        "weight": ("N", "weight of head and rods, less buoyancy"),
        "rod_wanted": (False, "whether the head is down and a rod may be added"),
        "head_impulse": ("N s", "running integral of head_force"),
        "momentum": ("N s", "of head and rods, less what new rods brought"),
        "wall_momentum": ("N s", "momentum that the wall has taken"),
        "energy.head": ("J", "work of head_force"),
        "energy.weight": ("J", "work of the weight"),
        "energy.port": ("J", "energy of waves sent less that of waves received"),
        "energy.left": ("J", "energy that has left the lowest cell, less what has come in"),
        "energy.wall": ("J", "energy that wall friction has taken"),
        "energy.stored": ("J", "kinetic and elastic energy, less what new rods brought"),
        "rod_count": (COUNT, "rods in the string"),
    },
    parameters={
        "communication_step": ("s", 1e-6, 1.0, 1e-3, "step of the master"),
        "rod.length": ("m", 0.1, 100.0, 3.0, "length of a rod"),
        "rod.area": ("m^2", 1e-5, 1.0, 2.4e-3, "cross-section of steel"),
        "rod.density": ("kg/m^3", 100.0, 3e4, 7850.0, "density"),
        "rod.youngs_modulus": ("Pa", 1e9, 1e12, 2.1e11, "Young's modulus"),
        "rod.cells": (COUNT, 1, 200, 4, "cells of the wave grid in a rod"),
        "rod.automatic": ("", 0, 1, True, "whether a rod is added as soon as one is wanted"),
        "start.rods": (COUNT, 1, 1000, 4, "rods at the start"),
        "start.rod_left": ("m", 0.0, 100.0, 3.0, "way of the head to the first new rod"),
        "start.feed_force": ("N", 0.0, 1e6, 2500.0, "push of the shoulder at the start"),
        "start.force": ("N", -1e6, 1e6, 2100.0, "force of the rods on the casing at the start"),
        "head.mass": ("kg", 1.0, 1e5, 300.0, "rotation head with carriage"),
        "friction.force": ("N/m", 0.0, 1e5, 0.0, "Coulomb friction at the wall by length"),
        "friction.viscosity": ("N s/m^2", 0.0, 1e5, 20.0, "viscous friction by length"),
        "fluid_density": ("kg/m^3", 0.0, 3e3, 0.0, "density of the fluid in the hole (buoyancy)"),
        "gravity": ("m/s^2", -100.0, 100.0, 10.0, "acceleration, down positive"),
        "feed_filter": ("s", 1e-4, 100.0, 0.1, "time of the filter of feed_force_mean"),
    },
    at_start=dict.fromkeys(
        (
            "impedance", "wave_begin", "wave_span", "wave_1", "wave_2", "feed_force_mean",
            "length", "weight", "rod_wanted", "momentum", "energy.stored", "rod_count",
        ),
        (),
    ),
)  # fmt: skip
