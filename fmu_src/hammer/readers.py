"""How each output of the hammer is read; the names are those of the interface."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from fmu_src.hammer.motion import AT, Motion


def _sample(name: str, sign: float = 1.0) -> Callable[[Motion], float]:
    column = AT[name]

    if sign == 1.0:
        return lambda motion: motion.read()[column]
    return lambda motion: sign * motion.read()[column]


def _blow(name: str) -> Callable[[Motion], float]:
    return lambda motion: motion.blow[name]


def _rate(motion: Motion) -> float:
    share = motion.fading()
    return share * motion.blow["penetration"] / motion.blow["period"] if share else 0.0


def _frequency(motion: Motion) -> float:
    share = motion.fading()
    return share / motion.blow["period"] if share else 0.0


def _efficiency(motion: Motion) -> float:
    energy = motion.blow["blow_energy"]
    return motion.blow["rock_energy"] / energy if energy > 0.0 else 0.0


OUTPUTS: Mapping[str, Callable[[Motion], Any]] = MappingProxyType(
    {
        "rate_of_penetration": _rate,
        "bit.position": _sample("bit_position"),
        "bit.velocity": _sample("bit_velocity"),
        "bit.force": _sample("bit_force"),
        "bit.force_mean": lambda motion: motion.mean_force(0),
        "bit.force_peak": lambda motion: motion.peaks()[0],
        "bit.impulse": _sample("bit_impulse"),
        "contact.force": _sample("contact_force"),
        "contact.force_mean": lambda motion: motion.mean_force(1),
        "contact.force_peak": lambda motion: motion.peaks()[1],
        "contact.impulse": _sample("contact_impulse"),
        "piston.position": _sample("piston_position"),
        "piston.velocity": _sample("piston_velocity"),
        "piston.stroke": _blow("stroke"),
        "impact_velocity": _blow("impact_velocity"),
        "blow_energy": _blow("blow_energy"),
        "transfer_efficiency": _efficiency,
        "blow_frequency": _frequency,
        "blow_count": lambda motion: motion.blow_count,
        "penetration_per_blow": _blow("penetration"),
        "blow_time": _blow("time"),
        "blow_position": _blow("bit_position"),
        "drilling_mode": lambda motion: int(motion.read()[AT["drilling_mode"]]),
        "casing_force": _sample("drive_force", -1.0),
        "casing.impulse": _sample("drive_impulse", -1.0),
        "gauge_stress": lambda motion: motion.stress(),
        "energy_residual": lambda motion: motion.residual(),
        "off_bottom": lambda motion: motion.off_bottom(),
    }
)
