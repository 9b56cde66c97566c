"""Parameters of bars: sections, piston, bit, and the drill string between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from percussion_model.scene import bars
from percussion_model.scene.group import (
    DAMPER_ON,
    HAS_PISTON,
    JOINTS_ON,
    LISTED,
    MOST_LISTED,
    NO_PISTON,
    STRING_ON,
    Parameters,
)
from percussion_model.scene.rows import choice, quantity, rod_list, section_list

# Table II of the paper as repaired in docs/data/reference_configuration.md.
STEEL_YOUNGS_MODULUS = 210e9
STEEL_DENSITY = 7850.0
REFERENCE_AREA = 5.5e-3
REFERENCE_PISTON_LENGTH = 0.175
REFERENCE_BIT_LENGTH = 0.20125
# What is usual of a section in the hammers of docs/data/hammer_sources.md, and of steel.
USUAL_LENGTH, USUAL_AREA = (0.035, 3.66), (6.5e-4, 0.017)
USUAL_MODULUS, USUAL_DENSITY = (200e9, 215e9), (7700.0, 8000.0)
# From the HC 25 to the HLX5T, the same page.
USUAL_CASING = (72.0, 218.0)


class Section(Parameters):
    """A length of bar with one cross-section and one material."""

    key = "section"
    length: float = quantity(..., "m", "length", typical=USUAL_LENGTH, gt=0, le=1000)
    area: float = quantity(..., "m^2", "cross-section", typical=USUAL_AREA, gt=0, le=10)
    youngs_modulus: float = quantity(
        STEEL_YOUNGS_MODULUS, "Pa", "Young's modulus E", typical=USUAL_MODULUS, gt=0, le=1e13
    )
    density: float = quantity(
        STEEL_DENSITY, "kg/m^3", "density rho", typical=USUAL_DENSITY, gt=0, le=1e5
    )

    @property
    def numbers(self) -> tuple[float, float, float, float]:
        """Length [m], area [m^2], Young's modulus [Pa] and density [kg/m^3]."""
        return self.length, self.area, self.youngs_modulus, self.density

    @property
    def wave_speed(self) -> float:
        """Speed of longitudinal waves, sqrt(E/rho) [m/s]."""
        return bars.section_wave_speed(self.numbers)

    @property
    def impedance(self) -> float:
        """Force per particle velocity of a wave, A sqrt(E rho) [N s/m]."""
        return bars.section_impedance(self.numbers)

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return bars.section_mass(self.numbers)

    @property
    def transit_time(self) -> float:
        """Time a wave takes from end to end [s]."""
        return bars.section_transit_time(self.numbers)


REFERENCE_PISTON = (Section(length=REFERENCE_PISTON_LENGTH, area=REFERENCE_AREA),)
REFERENCE_BIT = (Section(length=REFERENCE_BIT_LENGTH, area=REFERENCE_AREA),)


class Bar(Parameters):
    """Sections one below the other; base of all bars."""

    if TYPE_CHECKING:
        sections: tuple[Section, ...]

    @property
    def numbers(self) -> tuple[tuple[float, float, float, float], ...]:
        """Numbers of each section."""
        return tuple(section.numbers for section in self.sections)

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return bars.bar_mass(self.numbers)

    @property
    def length(self) -> float:
        """Length [m]."""
        return bars.bar_length(self.numbers)

    @property
    def transit_time(self) -> float:
        """Time a wave takes from end to end [s]."""
        return bars.bar_transit_time(self.numbers)


class PistonBar(Bar):
    """The piston; the reference one if no sections are given."""

    model: str = choice("elastic", ("elastic", "rigid", "absent"), "how the piston is modelled")
    sections: tuple[Section, ...] = section_list(REFERENCE_PISTON, HAS_PISTON)


class BitBar(Bar):
    """The bit; the reference one if no sections are given."""

    model: str = choice("elastic", ("elastic", "rigid"), "how the bit is modelled")
    sections: tuple[Section, ...] = section_list(REFERENCE_BIT)


class Rod(Bar):
    """A bar between piston and bit, and its joint to the bar below."""

    key = "rod"
    sections: tuple[Section, ...] = section_list(...)  # type: ignore[arg-type]
    joint: str = choice(
        "perfect",
        ("perfect", "contact", "lossy", "threaded"),
        "joint to the bar below: none to be felt, a contact that only pushes, one that reflects "
        "and takes a part, or shoulders that a thread pulls together",
        JOINTS_ON,
    )
    transmission: float = quantity(
        0.95, "-", "share of a short wave's force that passes a lossy joint", JOINTS_ON, gt=0, le=1
    )
    relaxation: float = quantity(
        1e-3, "s", "time after which a lossy joint carries a lasting force", JOINTS_ON, gt=0, le=10
    )
    gap: float = quantity(0.0, "m", "gap of contact or thread at the start", JOINTS_ON, ge=0, le=1)
    preload: float = quantity(
        0.0,
        "N",
        "preload that pulls a thread's shoulders together",
        JOINTS_ON,
        ge=0,
        le=1e9,
    )
    thread_stiffness: float = quantity(
        0.0, "N/m", "stiffness of a thread whose shoulders have parted", JOINTS_ON, ge=0, le=1e13
    )

    @property
    def telling(self) -> tuple[str, ...]:
        """Names of the parameters that matter to a joint of this kind."""
        return ("sections", "joint", *_OF_JOINT.get(self.joint, ()))


# Parameters that joints of a kind have.
_OF_JOINT = {
    "contact": ("gap",),
    "lossy": ("transmission", "relaxation"),
    "threaded": ("gap", "preload", "thread_stiffness"),
}


class DrillString(Parameters):
    """Bars between piston and bit, shank and rods; feed and damper act on the topmost."""

    top: str = choice(
        "free", ("free", "open"), "top end without a piston: free, or without reflection", NO_PISTON
    )
    bottom: str = choice(
        "rock",
        ("rock", "open"),
        "lower end of the bit: on the rock, or without reflection",
        STRING_ON,
    )
    pulse_force: float = quantity(
        0.0,
        "N",
        "force of a rectangular wave that comes down the topmost bar",
        NO_PISTON,
        ge=-1e9,
        le=1e9,
    )
    pulse_duration: float = quantity(1e-4, "s", "duration of that wave", NO_PISTON, gt=0, le=10)
    rods: tuple[Rod, ...] = rod_list(STRING_ON)


class Damper(Parameters):
    """Recoil damper between the casing of the drill and the topmost bar."""

    stiffness: float = quantity(1e7, "N/m", "stiffness of its spring", DAMPER_ON, ge=0, le=1e13)
    damping: float = quantity(2e4, "N s/m", "damping of its dashpot", DAMPER_ON, ge=0, le=1e9)
    preload: float = quantity(0.0, "N", "force at the start", DAMPER_ON, ge=0, le=1e9)
    casing_mass: float = quantity(
        150.0,
        "kg",
        "mass of the casing, which feed and recoil act on",
        DAMPER_ON,
        typical=USUAL_CASING,
        gt=0,
        le=1e6,
    )


# Sections of a bar, each takes a cell at least; and bars between piston and bit.
MOST_SECTIONS, MOST_RODS = 1000, 100
LISTED |= {"sections": Section, "rods": Rod}
MOST_LISTED |= {"sections": MOST_SECTIONS, "rods": MOST_RODS}
