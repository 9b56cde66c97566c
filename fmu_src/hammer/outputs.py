"""The hammer's outputs, a line for each: what the model description says, and how it is read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from fmu_src.hammer.inputs import DRIVE_INPUTS, PLAIN_INPUTS
from fmu_src.hammer.motion import AT, Motion
from percussion_model.components import COMPONENTS
from percussion_model.physics.records import Mode

MODES = {
    Mode.FF: "free flight",
    Mode.DFC: "dissipative forward contact",
    Mode.FC: "forward contact",
    Mode.BC: "backward contact",
    Mode.SS: "standstill",
}


@dataclass(frozen=True)
class Output:
    """An output: unit, inclusive bounds, nominal value, description, reader and type.

    And the inputs that it depends on at the start beside parameters, None where it is the
    same at every start.
    """

    unit: str | None
    lower: float | None
    upper: float | None
    nominal: float | None
    description: str
    read: Callable[[Motion], Any]
    type: Literal["Real", "Integer", "Boolean", "Enumeration"] = "Real"
    at_start: tuple[str, ...] | None = None


def _sample(name: str, sign: float = 1.0) -> Callable[[Motion], float]:
    column = AT[name]

    if sign == 1.0:
        return lambda motion: motion.read()[column]
    return lambda motion: sign * motion.read()[column]


def _blow(name: str) -> Callable[[Motion], float]:
    return lambda motion: motion.blow[name]


def _rate(motion: Motion) -> float:
    share = motion.rate_decay()
    return share * motion.blow["hole_advance"] / motion.blow["period"] if share else 0.0


def _frequency(motion: Motion) -> float:
    share = motion.rate_decay()
    return share / motion.blow["period"] if share else 0.0


def _efficiency(motion: Motion) -> float:
    energy = motion.blow["blow_energy"]
    return motion.blow["rock_energy"] / energy if energy > 0.0 else 0.0


# What meets at the start pushes at once.
ALL = (*PLAIN_INPUTS, *DRIVE_INPUTS)
_FORCE, _SPEED, _ENERGY, _FAR = 1e12, 1e4, 1e12, 1e6
# In the order of the model description; value references come from the interface.
OUTPUTS: dict[str, Output] = {
    "rate_of_penetration": Output("m/s", -_SPEED, _SPEED, 1e-2, "advance of the hole over the last whole blow by its period: of one blow, which is no mean where blows differ (take hole_depth by time); falls towards 0 after two missed periods", _rate),
    "hole_depth": Output("m", -_FAR, _FAR, 1e-2, "depth of the rock's surface if the bit were unloaded now, since the start; it never falls, and is 0 on a rock that is not crushed", _sample("hole_depth")),
    "bit.position": Output("m", -_FAR, _FAR, 1e-2, "mean displacement of the bit since the start, down positive", _sample("bit_position")),
    "bit.velocity": Output("m/s", -_SPEED, _SPEED, 1.0, "mean velocity of the bit, down positive", _sample("bit_velocity"), at_start=()),
    "bit.force": Output("N", -_FORCE, _FORCE, 1e5, "force of the bit on the rock, compression positive", _sample("bit_force"), at_start=ALL),
    "bit.force_mean": Output("N", -_FORCE, _FORCE, 1e4, "mean of bit.force over the last communication step", lambda motion: motion.mean_force(0)),
    "bit.force_peak": Output("N", 0.0, _FORCE, 1e5, "greatest bit.force in the last communication step", lambda motion: motion.peaks()[0], at_start=ALL),
    "bit.impulse": Output("N.s", -_FORCE, _FORCE, 1e2, "running integral of bit.force since the start", _sample("bit_impulse")),
    "contact.force": Output("N", -_FORCE, _FORCE, 1e5, "force of the piston on the bit, compression positive", _sample("contact_force"), at_start=ALL),
    "contact.force_mean": Output("N", -_FORCE, _FORCE, 1e3, "mean of the contact force over the last communication step", lambda motion: motion.mean_force(1)),
    "contact.force_peak": Output("N", 0.0, _FORCE, 1e5, "greatest elastic contact force in the last communication step; the impact of two rigid bodies has none", lambda motion: motion.peaks()[1], at_start=ALL),
    "contact.impulse": Output("N.s", -_FORCE, _FORCE, 1e2, "running integral of the contact force since the start", _sample("contact_impulse"), at_start=()),
    "piston.position": Output("m", -_FAR, _FAR, 1e-1, "mean displacement of the piston since the start, down positive", _sample("piston_position")),
    "piston.velocity": Output("m/s", -_SPEED, _SPEED, 1.0, "mean velocity of the piston, down positive", _sample("piston_velocity"), at_start=()),
    "piston.stroke": Output("m", 0.0, _FAR, 1e-1, "greatest lift of the piston off the bit in the last whole blow", _blow("stroke")),
    "impact_velocity": Output("m/s", -_SPEED, _SPEED, 1.0, "mean velocity of the piston at the start of the last whole blow", _blow("impact_velocity")),
    "blow_energy": Output("J", 0.0, _ENERGY, 1e2, "kinetic energy of the piston's mean motion at the start of the last whole blow", _blow("blow_energy")),
    "transfer_efficiency": Output("1", -1e3, 1e3, 1.0, "energy given to the rock in the last whole blow, divided by blow_energy: of one blow, no mean", _efficiency),
    "blow_frequency": Output("Hz", 0.0, 1e6, 10.0, "blows per time, from the last whole blow; falls towards 0 after two missed periods", _frequency),
    "penetration_per_blow": Output("m", -_FAR, _FAR, 1e-3, "advance of the hole over the last whole blow: of one blow, which is no mean where blows differ", _blow("hole_advance")),
    "blow_time": Output("s", 0.0, 1e9, 1.0, "start of the last whole blow, since the start of the simulation", _blow("time")),
    "blow_position": Output("m", -_FAR, _FAR, 1e-2, "bit.position at the start of the last whole blow", _blow("bit_position")),
    "casing_force": Output("N", -_FORCE, _FORCE, 1e3, "reaction of the drive on the casing, down positive", _sample("drive_force", -1.0), at_start=DRIVE_INPUTS),
    "casing.impulse": Output("N.s", -_FORCE, _FORCE, 1e2, "running integral of casing_force since the start", _sample("drive_impulse", -1.0)),
    "gauge_stress": Output("Pa", -1e13, 1e13, 1e8, "axial stress at the gauge at the last grid point, compression positive; 0 in a rigid bar", lambda motion: motion.stress()),
    "energy_residual": Output("1", -1.0, 1.0, 1e-10, "share of the energy put in so far that the ledger leaves unexplained", lambda motion: motion.residual()),
    "blow_count": Output(None, 0, 2**31 - 1, None, "whole blows so far; rises at the first communication point behind the end of a blow, with all numbers of the blow", lambda motion: motion.blow_count, "Integer"),
    "drilling_mode": Output(None, int(min(Mode)), int(max(Mode)), None, "mode of the rock law", lambda motion: int(motion.read()[AT["drilling_mode"]]), "Enumeration", at_start=ALL),
    "off_bottom": Output(None, None, None, None, "whether the bit met no rock in the last communication step", lambda motion: motion.off_bottom(), "Boolean", at_start=ALL),
}  # fmt: skip
# Columns of the states of components, by the names of their outputs.
OF_COMPONENTS = {
    f"{one.name}.{name}": field
    for one in COMPONENTS
    for name, field in zip(one.state, one.fields, strict=True)
}
for _one in COMPONENTS:
    for _name, (_unit, _text, _) in _one.state.items():
        _output = f"{_one.name}.{_name}"
        OUTPUTS[_output] = Output(_unit, None, None, None, _text, _sample(OF_COMPONENTS[_output]))
