"""The hammer's outputs, a line for each: what the model description says, and how it is read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

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


class Sample(NamedTuple):
    """Where an output is a field of what is read of a state, or that with the other sign."""

    field: str
    sign: float = 1.0


class OfBlow(NamedTuple):
    """Where an output is a field of the last whole blow."""

    field: str


@dataclass(frozen=True)
class Output:
    """An output: unit, inclusive bounds, nominal value, description, source and type.

    And the inputs that it depends on at the start beside parameters, None where it is the
    same at every start. An FMU without Python computes those without a field of their own in
    `fmu_src/native/outputs.py`.
    """

    unit: str | None
    lower: float | None
    upper: float | None
    nominal: float | None
    description: str
    source: Sample | OfBlow | Callable[[Motion], Any]
    type: Literal["Real", "Integer", "Boolean", "Enumeration"] = "Real"
    at_start: tuple[str, ...] | None = None

    @property
    def read(self) -> Callable[[Motion], Any]:
        """What reads it of a motion."""
        source = self.source
        if isinstance(source, OfBlow):
            return lambda motion: motion.blow[source.field]
        if not isinstance(source, Sample):
            return source
        column, sign = AT[source.field], source.sign
        if self.type != "Real":
            return lambda motion: int(motion.read()[column])
        if sign == 1.0:
            return lambda motion: motion.read()[column]
        return lambda motion: sign * motion.read()[column]


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
    "rate_of_penetration": Output("m/s", -_SPEED, _SPEED, 1e-2, "advance of the hole over the last whole blow divided by its period: of one blow, which is no mean where blows differ (take hole_depth divided by time); falls towards 0 after two missed periods", _rate),
    "hole_depth": Output("m", -_FAR, _FAR, 1e-2, "depth of the rock's surface if the bit were unloaded now, since the start; it never falls, and is 0 on a rock that is not crushed", Sample("hole_depth")),
    "bit.position": Output("m", -_FAR, _FAR, 1e-2, "mean displacement of the bit since the start, down positive", Sample("bit_position")),
    "bit.velocity": Output("m/s", -_SPEED, _SPEED, 1.0, "mean velocity of the bit, down positive", Sample("bit_velocity"), at_start=()),
    "bit.force": Output("N", -_FORCE, _FORCE, 1e5, "force of the bit on the rock, compression positive", Sample("bit_force"), at_start=ALL),
    "bit.force_mean": Output("N", -_FORCE, _FORCE, 1e4, "mean of bit.force over the last communication step", lambda motion: motion.mean_force(0)),
    "bit.force_peak": Output("N", 0.0, _FORCE, 1e5, "greatest bit.force in the last communication step", lambda motion: motion.peaks()[0], at_start=ALL),
    "bit.impulse": Output("N.s", -_FORCE, _FORCE, 1e2, "running integral of bit.force since the start", Sample("bit_impulse")),
    "contact.force": Output("N", -_FORCE, _FORCE, 1e5, "force of the piston on the bit, compression positive", Sample("contact_force"), at_start=ALL),
    "contact.force_mean": Output("N", -_FORCE, _FORCE, 1e3, "mean of the contact force over the last communication step", lambda motion: motion.mean_force(1)),
    "contact.force_peak": Output("N", 0.0, _FORCE, 1e5, "greatest elastic contact force in the last communication step; the impact of two rigid bodies has none", lambda motion: motion.peaks()[1], at_start=ALL),
    "contact.impulse": Output("N.s", -_FORCE, _FORCE, 1e2, "running integral of the contact force since the start", Sample("contact_impulse"), at_start=()),
    "piston.position": Output("m", -_FAR, _FAR, 1e-1, "mean displacement of the piston since the start, down positive", Sample("piston_position")),
    "piston.velocity": Output("m/s", -_SPEED, _SPEED, 1.0, "mean velocity of the piston, down positive", Sample("piston_velocity"), at_start=()),
    "piston.stroke": Output("m", 0.0, _FAR, 1e-1, "greatest lift of the piston off the bit in the last whole blow", OfBlow("stroke")),
    "impact_velocity": Output("m/s", -_SPEED, _SPEED, 1.0, "mean velocity of the piston at the start of the last whole blow", OfBlow("impact_velocity")),
    "blow_energy": Output("J", 0.0, _ENERGY, 1e2, "kinetic energy of the piston's mean motion at the start of the last whole blow", OfBlow("blow_energy")),
    "transfer_efficiency": Output("1", -1e3, 1e3, 1.0, "energy given to the rock in the last whole blow, divided by blow_energy: of one blow, no mean", _efficiency),
    "blow_frequency": Output("Hz", 0.0, 1e6, 10.0, "blows per time, from the last whole blow; falls towards 0 after two missed periods", _frequency),
    "penetration_per_blow": Output("m", -_FAR, _FAR, 1e-3, "advance of the hole over the last whole blow: of one blow, which is no mean where blows differ", OfBlow("hole_advance")),
    "blow_time": Output("s", 0.0, 1e9, 1.0, "start of the last whole blow, since the start of the simulation", OfBlow("time")),
    "blow_position": Output("m", -_FAR, _FAR, 1e-2, "bit.position at the start of the last whole blow", OfBlow("bit_position")),
    "casing_force": Output("N", -_FORCE, _FORCE, 1e3, "reaction of the drive on the casing, down positive", Sample("recoil_force", -1.0), at_start=DRIVE_INPUTS),
    "casing.impulse": Output("N.s", -_FORCE, _FORCE, 1e2, "running integral of casing_force since the start", Sample("recoil_impulse", -1.0)),
    "gauge_stress": Output("Pa", -1e13, 1e13, 1e8, "axial stress at the gauge at the last grid point, compression positive; 0 in a rigid bar", lambda motion: motion.stress()),
    "energy_residual": Output("1", -1.0, 1.0, 1e-10, "share of the energy put in so far that the ledger leaves unexplained", lambda motion: motion.residual()),
    "blow_count": Output(None, 0, 2**31 - 1, None, "whole blows so far; rises at the first communication point behind the end of a blow, with all numbers of the blow", lambda motion: motion.blow_count, "Integer"),
    "drilling_mode": Output(None, int(min(Mode)), int(max(Mode)), None, "mode of the rock law", Sample("drilling_mode"), "Enumeration", at_start=ALL),
    "off_bottom": Output(None, None, None, None, "whether the bit met no rock in the last communication step", lambda motion: motion.off_bottom(), "Boolean", at_start=ALL),
}  # fmt: skip
for _one in COMPONENTS:
    for (_name, (_unit, _text, _start)), _field in zip(
        _one.state.items(), _one.fields, strict=True
    ):
        OUTPUTS[f"{_one.name}.{_name}"] = Output(
            _unit,
            -_ENERGY,
            _ENERGY,
            1.0,
            _text,
            Sample(_field),
            at_start=(f"{_one.name}.{_start}",) if _start in _one.inputs else None,
        )
