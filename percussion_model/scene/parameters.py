"""Parameters of the model: the one table.

Each parameter is declared once, as a field with its default, unit, bounds, description
and what must hold for it to matter. Rows, error messages, the TOML schema, the command
line's help, the FMU's variables and the docs are read off these fields.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from typing import Any, ClassVar, Self

from percussion_model.physics.effects import EFFECTS, Effect
from percussion_model.scene import bars
from percussion_model.scene.rows import (
    REFUSED,
    Faults,
    Needs,
    Row,
    choice,
    count,
    flag,
    generic_key,
    quantity,
    refuse_value,
    rod_list,
    section_list,
    shortened,
    show_value,
)
from percussion_model.scene.solver_names import SOLVER_NAMES

# Below this similarity a guess at a misspelt key misleads more than it helps.
_SIMILAR_ENOUGH = 0.6

# Sections of a bar, each takes a cell at least; and bars between piston and bit.
MOST_SECTIONS, MOST_RODS = 1000, 100

# What must hold, key by key, for a parameter to have any influence.
HAS_PISTON: Needs = {"piston.model": ("elastic", "rigid")}
HAS_WAVES: Needs = {"bit.model": ("elastic",)}
SOLVER_WAVE: Needs = {"solver.name": ("auto", "wave", "modal", "chain"), **HAS_WAVES}
SOLVER_FEM: Needs = {"solver.name": ("fem",)}
BLOW_MAP: Needs = {"solver.fidelity": ("blow-map",), **HAS_WAVES}
ALL_RIGID: Needs = {"piston.model": ("rigid",), "bit.model": ("rigid",)}
GRAVITY_ON: Needs = {"effects.gravity": (True,)}
FEED_ON: Needs = {"effects.feed": (True,)}
DRIVE_PRESSURE: Needs = {"effects.drive": ("pressure",)}
DRIVE_EXTERNAL: Needs = {"effects.drive": ("external",)}
LOSS_ON: Needs = {"effects.loss": (True,), **HAS_WAVES}
ROCK_BILINEAR: Needs = {"effects.rock": ("bilinear",)}
ROCK_SPRINGY: Needs = {"effects.rock": ("bilinear", "spring")}
ROCK_PRESENT: Needs = {"effects.rock": ("bilinear", "spring", "wall")}
BARRIER_ON: Needs = {"effects.barrier": (True,), **ROCK_BILINEAR}
STRING_ON: Needs = {"effects.string": (True,), **HAS_WAVES}
JOINTS_ON: Needs = {"effects.joints": (True,), **STRING_ON}
DAMPER_ON: Needs = {"effects.damper": (True,), **STRING_ON}
NO_PISTON: Needs = {"piston.model": ("absent",), **STRING_ON}


class Parameters:
    """A group of parameters: plain frozen values, checked when they are given.

    Bad values raise `SceneError`.
    """

    key: ClassVar[str] = ""  # of the group in a scene
    rows: ClassVar[dict[str, Row]] = {}  # by the name of the field
    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]
    _defaults: ClassVar[dict[str, Any]] = {}
    _given: frozenset[str]

    def __init_subclass__(cls) -> None:
        dataclasses.dataclass(frozen=True, init=False)(cls)
        fields = dataclasses.fields(cls)
        cls.rows = {one.name: one.metadata["row"] for one in fields if one.metadata}
        cls._defaults = {name: row.default for name, row in cls.rows.items()}

    def __init__(self, **values: Any) -> None:
        faults = Faults()
        self._fill(values, self.key, faults)
        faults.refuse()

    @classmethod
    def read(cls, value: Any, key: str, faults: Faults) -> Self:
        """Return a group as it is, or make it of a table of values."""
        if isinstance(value, cls):
            return value
        group = cls.__new__(cls)
        if isinstance(value, (dict, Mapping)):  # mostly the first, which is quick to see
            group._fill(value, key, faults)
        elif generic_key(key).endswith(".*"):
            faults.add(_refuse_table, key, value, "a table with length and area")
        else:
            faults.add(_refuse_table, key, value, f"a table, written [{key}]")
        return group

    def _fill(self, values: Mapping[str, Any], key: str, faults: Faults) -> None:
        kept, rows = self.__dict__, self.rows
        kept.update(self._defaults)
        kept["_given"] = frozenset(values)
        for name, row in rows.items():
            if name not in values:
                if row.required:
                    faults.add(_refuse_missing, row, f"{key}.{name}")
            elif row.kind == "sections":
                found = _listed(row, f"{key}.{name}", values[name], MOST_SECTIONS, faults)
                if not found:
                    faults.add(refuse_value, row, f"{key}.{name}", values[name])
                kept[name] = tuple(
                    Section.read(one, f"{key}.{name}.{k}", faults) for k, one in enumerate(found)
                )
            elif row.kind == "rods":
                found = _listed(row, f"{key}.{name}", values[name], MOST_RODS, faults)
                kept[name] = tuple(
                    Rod.read(one, f"{key}.{name}.{k}", faults) for k, one in enumerate(found)
                )
            else:
                kept[name] = found = row.read(values[name])
                if found is REFUSED:
                    faults.add(refuse_value, row, f"{key}.{name}", values[name])
        for name in values:
            if name not in rows:
                faults.add(unknown_key, f"{key}.{name}")

    @property
    def telling(self) -> tuple[str, ...]:
        """Names of the parameters that matter in an entry of a list."""
        return tuple(self.rows)

    def given_values(self) -> dict[str, Any]:
        """Return the values that were given, not left to their defaults."""
        return {name: self.__dict__[name] for name in self.rows if name in self._given}


def _listed(row: Row, key: str, value: Any, most: int, faults: Faults) -> list[Any]:
    """Return what stands in a list of tables; nothing where it is none, or too long."""
    try:
        found = [] if isinstance(value, (str, bytes, Mapping)) else list(value)
    except TypeError:  # no list of anything
        faults.add(refuse_value, row, key, value)
        return []
    if len(found) > most:
        faults.add(_refuse_many, row, key, len(found), most)
        return found[:1]
    return found


def _refuse_many(row: Row, key: str, count: int, most: int) -> str:
    return f"{key}: {count} {row.kind}: must be at most {most}"


def _refuse_table(key: str, value: Any, wanted: str) -> str:
    return f"{key} = {show_value(value)}: must be {wanted}"


def _refuse_missing(row: Row, key: str) -> str:
    return f"{key} is missing: must be {row.allowed}"


# ------------------------------------------------------------------------- the groups

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


class Section(Parameters):
    """A length of bar with one cross-section and one material."""

    key = "section"
    length: float = quantity(..., "m", "length", gt=0, le=1000)
    area: float = quantity(..., "m^2", "cross-section", gt=0, le=10)
    youngs_modulus: float = quantity(STEEL_YOUNGS_MODULUS, "Pa", "Young's modulus E", gt=0, le=1e13)
    density: float = quantity(STEEL_DENSITY, "kg/m^3", "density rho", gt=0, le=1e5)

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
        1.0, "-", "share of a short wave's force that passes a lossy joint", JOINTS_ON, gt=0, le=1
    )
    relaxation: float = quantity(
        1e-3, "s", "time after which a lossy joint carries a lasting force", JOINTS_ON, gt=0, le=10
    )
    gap: float = quantity(0.0, "m", "of a contact or a thread at the start", JOINTS_ON, ge=0, le=1)
    preload: float = quantity(
        0.0, "N", "with which a thread pulls its shoulders together", JOINTS_ON, ge=0, le=1e9
    )
    thread_stiffness: float = quantity(
        0.0, "N/m", "of a thread whose shoulders have parted", JOINTS_ON, ge=0, le=1e13
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

    rods: tuple[Rod, ...] = rod_list(STRING_ON)
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
        "of a rectangular wave that comes down the topmost bar",
        NO_PISTON,
        ge=-1e9,
        le=1e9,
    )
    pulse_duration: float = quantity(1e-4, "s", "of that wave", NO_PISTON, gt=0, le=10)


class Damper(Parameters):
    """Recoil damper between the casing of the drill and the topmost bar."""

    stiffness: float = quantity(1e7, "N/m", "of its spring", DAMPER_ON, ge=0, le=1e13)
    damping: float = quantity(2e4, "N s/m", "of its dashpot", DAMPER_ON, ge=0, le=1e9)
    preload: float = quantity(0.0, "N", "force at the start", DAMPER_ON, ge=0, le=1e9)
    casing_mass: float = quantity(
        150.0, "kg", "of the casing, which feed and recoil act on", DAMPER_ON, gt=0, le=1e6
    )


class Effects(Parameters):
    """Which effects are on; only those are computed."""

    gravity: bool = flag(True, "weight of piston and bit")
    feed: bool = flag(True, "feed force on the bit")
    drive: str = choice(
        "pressure",
        ("pressure", "external", "none"),
        "force on the piston: switching pressure law, a given force or none",
    )
    loss: bool = flag(True, "structural (Kelvin-Voigt) loss in the elastic bars", HAS_WAVES)
    barrier: bool = flag(True, "energy barrier of the bilinear rock law", ROCK_BILINEAR)
    rock: str = choice(
        "bilinear",
        ("bilinear", "spring", "wall", "none"),
        "what the bit meets: bilinear law, linear spring, rigid wall or nothing",
    )
    standstill_tension: str = choice(
        "release",
        ("release", "paper"),
        "in standstill: let go of the rock when the force vanishes, or pull as in the paper",
        ROCK_BILINEAR,
    )
    string: bool = flag(False, "bars between piston and bit (string.rods)", HAS_WAVES)
    joints: bool = flag(True, "joints of the drill string; off: all are perfect", STRING_ON)
    damper: bool = flag(False, "damper between the casing and the topmost bar", STRING_ON)


class Gravity(Parameters):
    """Weight."""

    acceleration: float = quantity(
        10.0, "m/s^2", "acceleration, down positive", GRAVITY_ON, ge=-1000, le=1000
    )


class Feed(Parameters):
    """Force from the surface on the bit."""

    force: float = quantity(
        2500.0, "N", "feed force F_S on the bit, down positive", FEED_ON, ge=-1e9, le=1e9
    )


class Drive(Parameters):
    """Force on the piston."""

    force: float = quantity(
        3000.0, "N", "drive force F_0 of the pressure law", DRIVE_PRESSURE, ge=0, le=1e9
    )
    reversal_distance: float = quantity(
        0.040, "m", "D_1: piston this far up turns the drive downward", DRIVE_PRESSURE, gt=0, le=100
    )
    external_force: float = quantity(
        0.0, "N", "force on the piston, down positive", DRIVE_EXTERNAL, ge=-1e9, le=1e9
    )


class Loss(Parameters):
    """Structural loss, stress = E (strain + time * strain rate)."""

    time: float = quantity(
        _reference_loss_time(), "s", "Kelvin-Voigt time eta of the bars", LOSS_ON, ge=0, le=1e-3
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
        None, "-", "coefficient of restitution; St Venant value if left out", ALL_RIGID, ge=0, le=1
    )


class Start(Parameters):
    """The state at time zero."""

    piston_velocity: float = quantity(
        10.0, "m/s", "velocity of the piston, down positive", HAS_PISTON, ge=-1000, le=1000
    )
    bit_velocity: float = quantity(
        0.0, "m/s", "velocity of the bit, down positive", ge=-1000, le=1000
    )
    gap: float = quantity(1e-5, "m", "gap g_0 between piston and bit", HAS_PISTON, ge=0, le=100)
    rock_gap: float = quantity(
        1e-5, "m", "gap P_u between bit and rock", ROCK_PRESENT, ge=0, le=100
    )
    depth: float = quantity(0.0, "m", "depth of the hole", ge=0, le=20000)
    drive_direction: int = choice(
        1, (1, -1), "alpha of the pressure law: 1 down, -1 up", DRIVE_PRESSURE
    )


# Elements that the paper gives the piston.
PAPER_PISTON_ELEMENTS = 50


class SolverOptions(Parameters):
    """How the scene is computed."""

    name: str = choice(
        "auto",
        SOLVER_NAMES,
        "solver; auto: modal for an elastic bit, wave where loss is off, slight or strong, the "
        "piston rigid, the rock a wall or one bar far longer; rigid for a rigid bit",
    )
    fidelity: str = choice(
        "wave",
        ("wave", "rigid", "blow-map"),
        "elastic waves, rigid bodies in place of elastic ones, or a table of blows",
        HAS_WAVES,
    )
    cells: int | None = count(
        None,
        "-",
        "cells or modes of the piston, or of the bit where no piston is elastic; "
        "left out: by the solver",
        SOLVER_WAVE,
        ge=1,
        le=100_000,
    )
    leaps: bool = flag(True, "cross quiet phases in leaps", SOLVER_WAVE)
    accuracy: float | None = quantity(
        None,
        "-",
        "wanted relative error of the rate of penetration, in place of cells; "
        "left out: none is asked for",
        ge=1e-4,
        le=0.1,
    )


class FemOptions(Parameters):
    """Finite elements, with the paper's settings as defaults."""

    elements: int = count(
        PAPER_PISTON_ELEMENTS,
        "-",
        "elements in the piston, or in the bit where no piston is elastic",
        SOLVER_FEM,
        ge=1,
        le=100_000,
    )
    courant: float = quantity(
        5.0,
        "-",
        "time step, in transit times of the smallest element (CFL number)",
        SOLVER_FEM,
        ge=1e-3,
        le=1e4,
    )
    contact_stiffness: float = quantity(
        1e12,
        "N/m",
        "K_C of the penalty contact of piston and bit, and of the bit with a wall",
        SOLVER_FEM,
        ge=1,
        le=1e18,
    )
    damping_ratio: float | None = quantity(
        None,
        "-",
        "zeta_K of the bit's highest mode on its mesh, in place of loss.time",
        {**SOLVER_FEM, **LOSS_ON},
        ge=0,
        le=1e3,
    )
    spectral_radius: float = quantity(
        0.0,
        "-",
        "of the time scheme at infinite frequency: 0 annihilates, 1 conserves",
        SOLVER_FEM,
        ge=0,
        le=1,
    )
    event_tolerance: float = quantity(
        1e-6,
        "-",
        "qTol: overshoot of an event function, by its values over the step",
        SOLVER_FEM,
        gt=0,
        le=1,
    )
    time_tolerance: float = quantity(
        1e-4,
        "-",
        "tTol: bracket of an event that is narrow enough, by the time step",
        SOLVER_FEM,
        gt=0,
        le=1,
    )


def _edge(default: float, unit: str, description: str) -> float:
    """Declare an edge of the blow map."""
    found: float = quantity(default, unit, description, BLOW_MAP, gt=0, le=1e13)
    return found


class BlowMapOptions(Parameters):
    """What the table of blows covers."""

    velocity_from: float = _edge(4.0, "m/s", "least impact velocity")
    velocity_to: float = _edge(12.0, "m/s", "greatest impact velocity")
    feed_from: float = _edge(1000.0, "N", "least feed force")
    feed_to: float = _edge(8000.0, "N", "greatest feed force")
    force_from: float = _edge(1500.0, "N", "least drive force")
    force_to: float = _edge(5000.0, "N", "greatest drive force")
    stiffness_from: float = _edge(3e8, "N/m", "least loading stiffness of the rock")
    stiffness_to: float = _edge(2e9, "N/m", "greatest loading stiffness of the rock")
    density: float = quantity(
        1.0, "-", "nodes along each axis, by the usual number", BLOW_MAP, gt=0, le=10
    )


class RunOptions(Parameters):
    """How long the scene runs."""

    duration: float = quantity(4.0, "s", "simulated time", gt=0, le=1e6)
    settle: float = quantity(
        1.0, "s", "time before blows count for the rate of penetration", ge=0, le=1e6
    )
    check: bool = flag(False, "verify solver.accuracy by a finer run")
    error_estimate: bool = flag(
        True, "estimate the error of the rate of penetration by short runs on coarser cells"
    )


# --------------------------------------------------------------------- the whole table

_BUILT_IN: dict[str, type[Parameters]] = {
    "effects": Effects,
    "piston": PistonBar,
    "string": DrillString,
    "bit": BitBar,
    "damper": Damper,
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


def groups_with(effects: Iterable[Effect]) -> dict[str, type[Parameters]]:
    """Return the groups of a scene, the built-in ones and those that effects add.

    Parameters
    ----------
    effects : iterable of Effect
        Each gets a switch in `effects` and, for its parameters, a group of its own.
    """
    groups = dict(_BUILT_IN)
    switches: dict[str, Any] = {}
    for effect in effects:
        if effect.name in groups or effect.name in switches or effect.name in Effects.rows:
            raise ValueError(f"effect {effect.name}: there is a group or a switch of this name")
        switches[effect.name] = flag(False, effect.description)
        needs: Needs = {f"effects.{effect.name}": (True,)}
        fields = {
            name: quantity(default, unit, description, needs, ge=lower, le=upper)
            for name, (default, unit, description, lower, upper) in effect.parameters.items()
        }
        if fields:
            name_of_class = effect.name.title().replace("_", "") + "Group"
            groups[effect.name] = _group(name_of_class, Parameters, effect.description, fields)
    if switches:
        groups["effects"] = _group("Effects", Effects, Effects.__doc__, switches)
    for key, group in groups.items():
        group.key = key
    return groups


def _group(
    name: str, base: type[Parameters], doc: str | None, fields: Mapping[str, Any]
) -> type[Parameters]:
    about = {"__module__": __name__, "__doc__": doc, "__annotations__": dict.fromkeys(fields, Any)}
    return type(name, (base,), {**about, **fields})


# The groups of a scene, in the order in which they are written.
GROUPS = groups_with(EFFECTS)
# Objects of the added ones are found here by name, when they come from another process.
globals().update({group.__name__: group for group in GROUPS.values()})


# What stands in a list of tables.
_LISTED: dict[str, type[Parameters]] = {"sections": Section, "rods": Rod}


@cache
def parameter_table() -> tuple[Row, ...]:
    """Return a row for each parameter, in the order of a scene file."""
    return tuple(table_of(GROUPS))


def table_of(groups: Mapping[str, type[Parameters]]) -> Iterator[Row]:
    """Go through the rows of groups; keys of sections have a `*` for their number."""
    for key, group in groups.items():
        for name, row in group.rows.items():
            yield dataclasses.replace(row, key=f"{key}.{name}")
            if row.kind in _LISTED:
                yield from table_of({f"{key}.{name}.*": _LISTED[row.kind]})


@cache
def rows_by_key() -> Mapping[str, Row]:
    """Return the rows of `parameter_table` by their dotted keys."""
    return {row.key: row for row in parameter_table()}


def find_row(key: str) -> Row | None:
    """Find the row of a dotted key, `piston.sections.0.length` included."""
    return rows_by_key().get(generic_key(key))


def unknown_key(key: str) -> str:
    """Say that a key is not known, and which known one is nearest."""
    key = shortened(key)
    parent, _, name = key.rpartition(".")
    prefix = generic_key(parent) + "." if parent else ""
    keys = rows_by_key()
    siblings = [one.removeprefix(prefix) for one in keys if one.startswith(prefix)]
    siblings = [one for one in siblings if "." not in one]
    near = [one for one in siblings if one.startswith(name)]  # a shortened name
    near += difflib.get_close_matches(name, siblings, 1, _SIMILAR_ENOUGH)
    if near and parent:
        return f"unknown key {key}: did you mean {parent}.{near[0]}?"
    underlined = {one.replace(".", "_"): one for one in keys}
    if key in underlined:  # as keyword arguments of Python are written
        return f"unknown key {key}: did you mean {underlined[key]}?"
    known = list(keys) if parent else ["title", *GROUPS]
    near = difflib.get_close_matches(generic_key(key), known, 1, _SIMILAR_ENOUGH)
    if near:
        return f"unknown key {key}: did you mean {near[0].replace('.*', '.0')}?"
    if siblings and parent:
        return f"unknown key {key}: [{parent}] has the keys {', '.join(siblings)}"
    groups = [one for one in GROUPS if one in key.split(".")]
    if groups:
        of_group = [one for one in keys if one.startswith(f"{groups[-1]}.") and "*" not in one]
        return f"unknown key {key}: did you mean one of {', '.join(of_group)}?"
    return f"unknown key {key}: a scene has a title and the tables {', '.join(GROUPS)}"
