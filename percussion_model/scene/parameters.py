"""Parameters of the model: frozen, validated, SI.

The fields below are the one table of the parameters: their defaults, bounds,
units, descriptions and the effects that need them. The TOML schema, the command
line's help and the docs are read off it by `percussion_model.scene.table`.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from percussion_model.scene.fields import (
    ALL_RIGID,
    BARRIER_ON,
    DRIVE_EXTERNAL,
    DRIVE_PRESSURE,
    FEED_ON,
    GRAVITY_ON,
    HAS_PISTON,
    HAS_WAVES,
    LOSS_ON,
    ROCK_BILINEAR,
    ROCK_PRESENT,
    ROCK_SPRINGY,
    Direction,
    Flag,
    Parameters,
    choice,
    quantity,
)
from percussion_model.scene.rules import BarNumbers, SectionNumbers
from percussion_model.scene.solver_options import (
    BlowMapOptions,
    FemOptions,
    RunOptions,
    SolverOptions,
)

# Table II of the paper as repaired in docs/model.md.
STEEL_YOUNGS_MODULUS = 210e9
STEEL_DENSITY = 7850.0
REFERENCE_AREA = 5.5e-3
REFERENCE_PISTON_LENGTH = 0.175
REFERENCE_BIT_LENGTH = 0.20125

# The paper damps the highest frequency of its 58-element bit by this ratio.
_PAPER_DAMPING_RATIO = 0.5
_PAPER_BIT_ELEMENTS = 58


def _reference_loss_time() -> float:
    """Return the Kelvin-Voigt time 2 zeta/omega_cr of the paper's bit mesh [s]."""
    wave_speed = math.sqrt(STEEL_YOUNGS_MODULUS / STEEL_DENSITY)
    critical = math.sqrt(12.0) * wave_speed / (REFERENCE_BIT_LENGTH / _PAPER_BIT_ELEMENTS)
    return 2.0 * _PAPER_DAMPING_RATIO / critical


class Section(SectionNumbers, Parameters):
    """A length of bar with one cross-section and one material."""

    length: float = quantity(..., "m", "length", gt=0, le=1000)
    area: float = quantity(..., "m^2", "cross-section", gt=0, le=10)
    youngs_modulus: float = quantity(STEEL_YOUNGS_MODULUS, "Pa", "Young's modulus E", gt=0, le=1e13)
    density: float = quantity(STEEL_DENSITY, "kg/m^3", "density rho", gt=0, le=1e5)


REFERENCE_PISTON = (Section(length=REFERENCE_PISTON_LENGTH, area=REFERENCE_AREA),)
REFERENCE_BIT = (Section(length=REFERENCE_BIT_LENGTH, area=REFERENCE_AREA),)

_SECTIONS = "sections from top to bottom"


class Bar(BarNumbers, Parameters):
    """Sections one below the other; base of piston and bit."""

    model: str
    sections: tuple[Section, ...]


class PistonBar(Bar):
    """The piston; the reference one if no sections are given."""

    model: Literal["elastic", "rigid", "absent"] = choice("elastic", "how the piston is modelled")
    sections: Annotated[tuple[Section, ...], Field(min_length=1)] = choice(
        REFERENCE_PISTON, _SECTIONS, HAS_PISTON
    )


class BitBar(Bar):
    """The bit; the reference one if no sections are given."""

    model: Literal["elastic", "rigid"] = choice("elastic", "how the bit is modelled")
    sections: Annotated[tuple[Section, ...], Field(min_length=1)] = choice(REFERENCE_BIT, _SECTIONS)


class Effects(Parameters):
    """Which effects are on; only those are computed."""

    gravity: Flag = choice(True, "weight of piston and bit")
    feed: Flag = choice(True, "feed force on the bit")
    drive: Literal["pressure", "external", "none"] = choice(
        "pressure", "force on the piston: switching pressure law, a given force or none"
    )
    loss: Flag = choice(True, "structural (Kelvin-Voigt) loss in the elastic bars", HAS_WAVES)
    barrier: Flag = choice(True, "energy barrier of the bilinear rock law", ROCK_BILINEAR)
    rock: Literal["bilinear", "spring", "wall", "none"] = choice(
        "bilinear",
        "what the bit meets: bilinear law, linear spring, rigid wall or nothing",
    )
    standstill_tension: Literal["release", "paper"] = choice(
        "release",
        "in standstill: let go of the rock when the force vanishes, or pull as in the paper",
        ROCK_BILINEAR,
    )


class Gravity(Parameters):
    """Weight."""

    acceleration: float = quantity(
        10.0, "m/s^2", "acceleration, down positive", GRAVITY_ON, ge=-1000, le=1000
    )


class Feed(Parameters):
    """Force from the surface on the bit."""

    force: float = quantity(
        2500.0,
        "N",
        "feed force F_S on the bit, down positive",
        FEED_ON,
        ge=-1e9,
        le=1e9,
    )


class Drive(Parameters):
    """Force on the piston."""

    force: float = quantity(
        3000.0, "N", "drive force F_0 of the pressure law", DRIVE_PRESSURE, ge=0, le=1e9
    )
    reversal_distance: float = quantity(
        0.040,
        "m",
        "D_1: piston this far up turns the drive downward",
        DRIVE_PRESSURE,
        gt=0,
        le=100,
    )
    external_force: float = quantity(
        0.0, "N", "force on the piston, down positive", DRIVE_EXTERNAL, ge=-1e9, le=1e9
    )


class Loss(Parameters):
    """Structural loss, stress = E (strain + time * strain rate)."""

    time: float = quantity(
        _reference_loss_time(),
        "s",
        "Kelvin-Voigt time eta of the bars",
        LOSS_ON,
        ge=0,
        le=1e-3,
    )


class RockLaw(Parameters):
    """The rock under the bit (docs/model.md, table 1)."""

    loading_stiffness: float = quantity(
        7.5e8, "N/m", "loading stiffness K_R", ROCK_SPRINGY, ge=1, le=1e13
    )
    unloading_ratio: float = quantity(
        5.0, "-", "gamma: unloading by loading stiffness", ROCK_BILINEAR, gt=1, le=1e4
    )
    barrier_damping: float = quantity(
        1e4, "N s/m", "damping C_R of the energy barrier", BARRIER_ON, ge=0, le=1e9
    )
    barrier_energy: float = quantity(0.05, "J", "energy barrier W_R", BARRIER_ON, ge=0, le=1e6)


class Contact(Parameters):
    """Contact between a rigid piston and a rigid bit."""

    restitution: float | None = quantity(
        None,
        "-",
        "coefficient of restitution; St Venant value if left out",
        ALL_RIGID,
        ge=0,
        le=1,
    )


class Start(Parameters):
    """The state at time zero."""

    piston_velocity: float = quantity(
        10.0,
        "m/s",
        "velocity of the piston, down positive",
        HAS_PISTON,
        ge=-1000,
        le=1000,
    )
    bit_velocity: float = quantity(
        0.0, "m/s", "velocity of the bit, down positive", ge=-1000, le=1000
    )
    gap: float = quantity(1e-5, "m", "gap g_0 between piston and bit", HAS_PISTON, ge=0, le=100)
    rock_gap: float = quantity(
        1e-5, "m", "gap P_u between bit and rock", ROCK_PRESENT, ge=0, le=100
    )
    depth: float = quantity(0.0, "m", "depth of the hole", ge=0, le=20000)
    drive_direction: Direction = choice(
        1, "alpha of the pressure law: 1 down, -1 up", DRIVE_PRESSURE
    )


# The groups of a scene, in the order in which they are written.
GROUPS: dict[str, type[Parameters]] = {
    "effects": Effects,
    "piston": PistonBar,
    "bit": BitBar,
    "gravity": Gravity,
    "feed": Feed,
    "drive": Drive,
    "loss": Loss,
    "rock": RockLaw,
    "contact": Contact,
    "start": Start,
    "solver": SolverOptions,
    "fem": FemOptions,
    "blow_map": BlowMapOptions,
    "run": RunOptions,
}
