"""Variables of the parts of a drilling system; SI, forces and positions down positive.

An entry of inputs and parameters is (unit, lower, upper, start, description), one of
outputs (unit, description). A start that is a flag makes a Boolean, a unit "count" a whole
number, and a tuple in place of the start an enumeration, whose first word is the start.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Entries = dict[str, tuple[Any, ...]]


@dataclass(frozen=True)
class PartTable:
    """A part: its FMU's name, the class that runs in it, and its variables."""

    name: str
    slave: str
    modules: tuple[str, ...]  # of runtime/system, besides `part`
    description: str
    inputs: Entries
    outputs: Entries
    parameters: Entries


STRING = PartTable(
    name="DrillString",
    slave="DrillStringPart",
    modules=("string_body", "string_waves", "drill_string"),
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
        "head_position": ("m", "displacement of the head, new rods left out of account"),
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
        "rod_count": ("count", "rods in the string"),
    },
    parameters={
        "model": ("", 0, 0, ("waves", "lumped"), "travelling waves, or a mass for each rod"),
        "rod.length": ("m", 0.1, 100.0, 3.0, "length of a rod"),
        "rod.area": ("m^2", 1e-5, 1.0, 2.4e-3, "cross-section of steel"),
        "rod.density": ("kg/m^3", 100.0, 3e4, 7850.0, "density"),
        "rod.youngs_modulus": ("Pa", 1e9, 1e12, 2.1e11, "Young's modulus"),
        "rod.cells": ("count", 1, 200, 2, "cells of the wave grid in a rod"),
        "rod.automatic": ("", 0, 1, True, "whether a rod is added as soon as one is wanted"),
        "start.rods": ("count", 1, 1000, 4, "rods at the start"),
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
)  # fmt: skip

RIG = PartTable(
    name="RigFeed",
    slave="RigFeedPart",
    modules=("rig_feed",),
    description="Hydraulic cylinder with servo valve, which pushes the head",
    inputs={
        "force_command": ("N", -1e9, 1e9, 0.0, "force that is wanted on the head"),
        "head_velocity": ("m/s", -1e4, 1e4, 0.0, "velocity of the head"),
    },
    outputs={
        "force": ("N", "force on the head"),
        "pressure": ("Pa", "pressure difference over the piston"),
        "energy": ("J", "hydraulic energy used"),
        "relief_volume": ("m3", "volume through the relief valves"),
        "limited": (False, "whether the valve gives its full flow"),
    },
    parameters={
        "cylinder.area": ("m^2", 1e-5, 1.0, 4e-3, "area of the piston"),
        "cylinder.volume": ("m^3", 1e-5, 10.0, 1e-2, "volume under pressure, with hoses"),
        "cylinder.bulk_modulus": ("Pa", 1e5, 1e10, 2e8, "stiffness of oil and hoses"),
        "cylinder.leakage": ("m^3/(s Pa)", 0.0, 1e-6, 0.0, "leak by pressure"),
        "servo.time": ("s", 1e-3, 10.0, 0.02, "time constant of the pressure"),
        "servo.velocity": ("m/s", 1e-3, 10.0, 0.3, "velocity of the head at full flow"),
        "force_limit": ("N", 0.0, 1e7, 2e4, "force at which the relief valves open"),
        "slide.friction": ("N s/m", 0.0, 1e7, 2e3, "viscous friction of the slide"),
        "start.force": ("N", -1e6, 1e6, 0.0, "force at the start"),
    },
)  # fmt: skip

SUPPLY = PartTable(
    name="Supply",
    slave="SupplyPart",
    modules=("supply",),
    description="Air or oil supply: source, hose volume, pressure drop, relief valve",
    inputs={
        "pressure_command": ("Pa", 0.0, 1e9, 2e6, "pressure that is wanted"),
        "percussion_on": ("", 0, 1, True, "whether the drive is open"),
        "blow_frequency": ("Hz", 0.0, 1e6, 0.0, "blows of the hammer"),
        "pressure_loss": ("1", 0.0, 1.0, 0.0, "share of the pressure that a fault takes"),
    },
    outputs={
        "supply_pressure": ("Pa", "gauge pressure at the hammer"),
        "hose_pressure": ("Pa", "gauge pressure at the source"),
        "flow": ("m3/s", "flow of the source"),
        "energy": ("J", "energy given by the source"),
        "relief_volume": ("m3", "volume through the relief valve"),
        "relief_open": (False, "whether the relief valve is open"),
    },
    parameters={
        "source.pressure_limit": ("Pa", 0.0, 1e9, 3e6, "highest pressure of the source"),
        "source.flow_limit": ("m^3/s", 0.0, 100.0, 2e-2, "highest flow of the source"),
        "source.time": ("s", 1e-4, 100.0, 0.02, "time constant of the source"),
        "vent.flow_limit": ("m^3/s", 0.0, 100.0, 0.1, "flow of the vent above what is wanted"),
        "hose.volume": ("m^3", 1e-6, 100.0, 2e-2, "volume of the hose"),
        "hose.bulk_modulus": ("Pa", 1e4, 1e10, 2.1e6, "stiffness of oil and hose, or of gas"),
        "hose.resistance": ("Pa s/m^3", 0.0, 1e12, 2e7, "pressure drop by flow"),
        "drive.volume": ("m^3", 0.0, 1.0, 1.2e-4, "volume that the drive takes for a blow"),
        "drive.leakage": ("m^3/(s Pa)", 0.0, 1e-3, 2e-10, "flow past the piston by pressure"),
        "relief_pressure": ("Pa", 0.0, 1e9, 3.2e6, "pressure at which the relief valve opens"),
        "start.pressure": ("Pa", 0.0, 1e9, 2e6, "pressure at the start"),
    },
)  # fmt: skip

_LAYER = {
    "top": ("m", -1.0, 2e4, "depth at which the layer begins (-1: no such layer)"),
    "loading_stiffness": ("N/m", 1e3, 1e13, "loading stiffness K_R"),
    "unloading_ratio": ("1", 1.0, 1e4, "gamma: unloading by loading stiffness"),
    "torque_factor": ("1", 0.0, 100.0, "torque on the rotation, by that of sound rock"),
}
_LAYER_START = {
    "top": -1.0, "loading_stiffness": 7.5e8, "unloading_ratio": 5.0, "torque_factor": 1.0,
}  # fmt: skip


def _layers() -> Entries:
    """Parameters of six layers; the first begins at the surface."""
    found: Entries = {}
    for i in range(1, 7):
        for name, (unit, lower, upper, text) in _LAYER.items():
            start = 0.0 if i == 1 and name == "top" else _LAYER_START[name]
            found[f"layers[{i}].{name}"] = (unit, lower, upper, start, text)
    return found


ROCK = PartTable(
    name="RockProfile",
    slave="RockProfilePart",
    modules=("rock_profile",),
    description="Rock by depth: layers, voids, random variation, stiffness by feed",
    inputs={
        "bit_position": ("m", -1e6, 1e6, 0.0, "displacement of the bit"),
        "feed_force": ("N", -1e9, 1e9, 2500.0, "feed force on the bit"),
        "supply_pressure": ("Pa", 0.0, 1e9, 2e6, "gauge pressure at the hammer"),
    },
    outputs={
        "loading_stiffness": ("N/m", "loading stiffness K_R at the bit"),
        "unloading_ratio": ("1", "gamma at the bit"),
        "depth": ("m", "greatest depth of the bit"),
        "rotation_torque": ("N.m", "torque on the rotation"),
        "in_void": (False, "whether the layer is soft enough to count as a void"),
        "layer": ("count", "number of the layer"),
    },
    parameters=_layers()
    | {
        "start.depth": ("m", 0.0, 2e4, 0.0, "depth of the hole at the start"),
        "variation.spread": ("1", 0.0, 2.0, 0.0, "standard deviation of ln K_R"),
        "variation.length": ("m", 1e-4, 1e3, 0.01, "distance of the knots of the variation"),
        "variation.seed": ("count", 0, 1_000_000, 1, "seed of the variation"),
        "best_feed.force": ("N", 1.0, 1e9, 2500.0, "feed force at which K_R is lowest"),
        "best_feed.factor": ("1", 0.0, 1e6, 0.0, "growth of K_R by the square of the distance"),
        "best_pressure.pressure": ("Pa", 1.0, 1e9, 2e6, "supply pressure at which K_R is lowest"),
        "best_pressure.factor": ("1", 0.0, 1e6, 0.0, "growth of K_R by the square of the distance"),
        "torque_arm": ("m", 0.0, 10.0, 0.04, "torque by feed force in sound rock"),
        "void_stiffness": ("N/m", 0.0, 1e13, 1e7, "K_R up to which a layer counts as a void"),
    },
)

CONTROLLER = PartTable(
    name="DrillController",
    slave="DrillControllerPart",
    modules=("controller", "seeker"),
    description="Feed PI, pressure by feed, cut-back in voids, retract from jams, rate seeking",
    inputs={
        "feed_setpoint": ("N", 0.0, 1e9, 2500.0, "feed force that is wanted"),
        "pressure_setpoint": ("Pa", 0.0, 1e9, 2e6, "supply pressure that is wanted"),
        "feed_force": ("N", -1e9, 1e9, 2500.0, "measured feed force, filtered"),
        "rate_of_penetration": ("m/s", -1e4, 1e4, 0.0, "measured rate of penetration"),
        "supply_pressure": ("Pa", 0.0, 1e9, 2e6, "measured supply pressure"),
        "blow_frequency": ("Hz", 0.0, 1e6, 0.0, "measured frequency of the blows"),
        "rotation_torque": ("N m", -1e9, 1e9, 0.0, "measured torque of the rotation"),
        "head_velocity": ("m/s", -1e4, 1e4, 0.0, "measured velocity of the head"),
    },
    outputs={
        "force_command": ("N", "force that the rig is to give"),
        "pressure_command": ("Pa", "pressure that the supply is to give"),
        "percussion_on": (False, "whether the drive is to be open"),
        "mode": ("count", "0 drilling, 1 void, 2 retract"),
        "feed_wanted": ("N", "feed force that the PI keeps"),
        "seek.centre": ("N", "feed force about which the seeker swings"),
        "seek.gradient": ("1", "d ln rate / d ln feed, as the seeker found it last"),
        "seek.pressure_centre": ("Pa", "pressure about which the seeker swings"),
        "seek.pressure_gradient": ("1", "d ln rate / d ln pressure, as it was found last"),
    },
    parameters={
        "pi.on": ("", 0, 1, True, "PI on the feed force; off: the force at the start stays"),
        "pi.gain": ("1", 0.0, 1e3, 0.5, "gain of the PI"),
        "pi.time": ("s", 1e-3, 1e3, 0.2, "integral time of the PI"),
        "start.force": ("N", -1e6, 1e6, 0.0, "force command at the start"),
        "force_limit": ("N", 0.0, 1e7, 2e4, "greatest force command"),
        "force_rate": ("N/s", 0.0, 1e9, 4e4, "fastest change of the command outside the PI"),
        "feed_rate": ("N/s", 0.0, 1e9, 3e3, "fastest change of the feed that is wanted"),
        "pressure_rate": ("Pa/s", 0.0, 1e12, 2e7, "fastest change of the pressure command"),
        "speed_filter": ("s", 1e-4, 100.0, 0.05, "time of the filter of the head's velocity"),
        "mode_time": ("s", 0.0, 100.0, 0.3, "shortest stay in void or retract"),
        "ratio.on": ("", 0, 1, False, "pressure follows the feed"),
        "ratio.slope": ("Pa/N", 0.0, 1e9, 800.0, "pressure by feed force"),
        "ratio.lowest": ("Pa", 0.0, 1e9, 8e5, "lowest pressure of the ratio"),
        "cutback.on": ("", 0, 1, True, "cut percussion back in a void"),
        "cutback.velocity": ("m/s", 0.0, 100.0, 0.12, "velocity of the head that tells a void"),
        "cutback.pressure": ("Pa", 0.0, 1e9, 4e5, "pressure in a void; 0 shuts the drive"),
        "cutback.force": ("N", -1e6, 1e6, 0.0, "force in a void, beside that of the weights"),
        "cutback.feed": ("N", 0.0, 1e6, 800.0, "feed from which drilling begins again"),
        "retract.on": ("", 0, 1, True, "retract where the rotation jams"),
        "retract.torque": ("N m", 0.0, 1e9, 250.0, "torque that tells a jam"),
        "retract.share": ("1", 0.0, 1.0, 0.4, "share of it at which the jam is over"),
        "retract.delay": ("s", 0.0, 100.0, 0.1, "time that a jam has to last"),
        "retract.force": ("N", -1e6, 1e6, 400.0, "force while retracting, beside the weights"),
        "seek.on": ("", 0, 1, False, "seek the feed of the best rate"),
        "seek.swing": ("1", 1e-4, 0.5, 0.06, "swing of the feed by its mean"),
        "seek.period": ("s", 0.01, 1e3, 2.0, "period of the swing"),
        "seek.wait": ("s", 0.0, 1e4, 2.0, "time before the first period counts"),
        "seek.gain": ("1", 0.0, 100.0, 0.15, "move of ln feed by the gradient found"),
        "seek.largest_move": ("1", 0.0, 1.0, 0.12, "largest move of ln feed in a period"),
        "seek.lowest": ("N", 1.0, 1e9, 500.0, "lowest feed of the seeker"),
        "seek.highest": ("N", 1.0, 1e9, 2e4, "highest feed of the seeker"),
        "seek.pressure_on": ("", 0, 1, False, "seek the pressure too, by a second swing"),
        "seek.pressure_swing": ("1", 1e-4, 0.5, 0.06, "swing of the pressure by its mean"),
        "seek.pressure_cycles": ("count", 2, 50, 3, "swings of the pressure in a period"),
        "seek.pressure_gain": ("1", 0.0, 100.0, 0.15, "move of ln pressure by its gradient"),
        "seek.pressure_lowest": ("Pa", 1.0, 1e9, 8e5, "lowest pressure of the seeker"),
        "seek.pressure_highest": ("Pa", 1.0, 1e9, 3e6, "highest pressure of the seeker"),
    },
)  # fmt: skip

PARTS = {part.name: part for part in (STRING, RIG, SUPPLY, ROCK, CONTROLLER)}
