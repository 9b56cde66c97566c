"""Parameters of the model: the one table.

Each parameter is declared once, as a field with its default, unit, bounds, description
and what must hold for it to matter. Rows, error messages, the TOML schema, the command
line's help, the FMU's variables and the docs are read off these fields.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from typing import Any, Self

from percussion_model.components import COMPONENTS, Component
from percussion_model.scene.bar_groups import (
    REFERENCE_BIT_LENGTH,
    STEEL_DENSITY,
    STEEL_YOUNGS_MODULUS,
    BitBar,
    Damper,
    DrillString,
    PistonBar,
)
from percussion_model.scene.group import (
    ALL_RIGID,
    BARRIER_ON,
    CUTTINGS_ON,
    DRIVE_EXTERNAL,
    DRIVE_PRESSURE,
    FEED_ON,
    FEED_ON_CASING,
    GRAVITY_ON,
    HAS_PISTON,
    HAS_WAVES,
    LOSS_ON,
    ROCK_CRUSHED,
    ROCK_POWER,
    ROCK_PRESENT,
    ROCK_SPRINGY,
    SOLVER_FEM,
    SOLVER_MODAL,
    SOLVER_WAVE,
    STRING_ON,
    Parameters,
    table_of,
)
from percussion_model.scene.retired import BLOW_MAP, BLOW_MAP_TABLE
from percussion_model.scene.rows import (
    REFUSED,
    SIMILAR_ENOUGH,
    Needs,
    ParameterRow,
    SceneError,
    choice,
    count,
    flag,
    generic_key,
    nearest,
    quantity,
    shortened,
)
from percussion_model.scene.solver_names import SOLVER_NAMES
from percussion_model.scene.units import UnitError, in_si, refuse

# The paper damps the highest frequency of its 58-element bit by this ratio.
_PAPER_DAMPING_RATIO = 0.5
_PAPER_BIT_ELEMENTS = 58


def _reference_loss_time() -> float:
    """Return the Kelvin-Voigt time 2 zeta/omega_cr of the paper's bit mesh [s]."""
    wave_speed = math.sqrt(STEEL_YOUNGS_MODULUS / STEEL_DENSITY)
    critical = math.sqrt(12.0) * wave_speed / (REFERENCE_BIT_LENGTH / _PAPER_BIT_ELEMENTS)
    return 2.0 * _PAPER_DAMPING_RATIO / critical


# What is usual, from the sources that docs/data/hammer_sources.md lists.
GRAVITY = (9.78, 10.0)  # on the surface of the earth, and that of the paper
FEED = (2500.0, 18100.0)  # the paper, 3 1/4 inch; hammers of 3 to 6 inch by a trade page
DRIVE = (3000.0, 13100.0)  # the paper; tuned to the blow energies of hammers on the market
REVERSAL = (0.0148, 0.04)  # the same; the greatest is the paper's
# Three buttons on Kuru granite, Saksala et al. (2014); the paper's by the diameter, 6 inch.
STIFFNESS = (1.62e8, 1.5e9)
# From a flat button under a wave of 200 MPa to Kuru granite at 13 m/s (docs/data/validation.md).
PENETRATION = (3.5e-4, 2.1e-3)
HOLE = (0.048, 0.165)  # bits of those hammers


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
    barrier: bool = flag(True, "energy barrier of the rock law, bilinear or power", ROCK_CRUSHED)
    rock: str = choice(
        "bilinear",
        ("bilinear", "spring", "wall", "none", "power"),
        "what the bit meets: bilinear law, linear spring, rigid wall, nothing, or power law",
    )
    cuttings: bool = flag(False, "cuttings that flushing leaves in the crater", ROCK_CRUSHED)
    standstill_tension: str = choice(
        "release",
        ("release", "paper"),
        "in standstill: let go of the rock when the force vanishes, or pull as in the paper",
        ROCK_CRUSHED,
    )
    string: bool = flag(False, "bars between piston and bit (string.rods)", HAS_WAVES)
    joints: bool = flag(True, "joints of the drill string; off: all are perfect", STRING_ON)
    damper: bool = flag(False, "damper between the casing and the topmost bar", STRING_ON)


class Gravity(Parameters):
    """Weight."""

    acceleration: float = quantity(
        10.0, "m/s^2", "acceleration, down positive", GRAVITY_ON, GRAVITY, ge=-1000, le=1000
    )


class Feed(Parameters):
    """Force from the surface on the bit or on the casing above it."""

    force: float = quantity(
        2500.0, "N", "feed force F_S, down positive", FEED_ON, FEED, ge=-1e9, le=1e9
    )
    on: str = choice(
        "bit",
        ("bit", "casing"),
        "what it pushes: the bit, or the casing, whose recoil it balances first",
        FEED_ON,
    )
    casing_mass: float = quantity(
        0.0, "kg", "mass whose weight holds the casing down too", FEED_ON_CASING, ge=0, le=1e6
    )


class Drive(Parameters):
    """Force on the piston."""

    force: float = quantity(
        3000.0, "N", "drive force F_0 of the pressure law", DRIVE_PRESSURE, DRIVE, ge=0, le=1e9
    )
    reversal_distance: float = quantity(
        0.040,
        "m",
        "D_1: piston this far up turns the drive downward",
        DRIVE_PRESSURE,
        typical=REVERSAL,
        gt=0,
        le=100,
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
        7.5e8,
        "N/m",
        "loading stiffness K_R; by the power law of one button, at P_0",
        ROCK_SPRINGY,
        STIFFNESS,
        ge=1,
        le=1e13,
    )
    unloading_ratio: float = quantity(
        5.0, "-", "gamma: unloading divided by loading stiffness", ROCK_CRUSHED, gt=1, le=1e4
    )
    loading_exponent: float = quantity(
        1.5, "-", "n of the power law: force grows as penetration^n", ROCK_POWER, ge=1, le=4
    )
    reference_penetration: float = quantity(
        1e-3,
        "m",
        "P_0, at which K_R and gamma of the power law hold",
        ROCK_POWER,
        typical=PENETRATION,
        ge=1e-6,
        le=1,
    )
    unloading_exponent: float = quantity(
        0.0,
        "-",
        "q of the power law: gamma grows as (peak force)^q",
        ROCK_POWER,
        ge=0,
        le=12,
    )
    buttons: int = count(
        1, "-", "buttons that share the force; K_R is that of one", ROCK_POWER, ge=1, le=1000
    )
    chipping_force: float = quantity(
        1e5, "N", "force on one button at which the rock chips", ROCK_POWER, gt=0, le=1e9
    )
    chipping_penetration: float = quantity(
        0.0,
        "m",
        "penetration gained while it chips; 0 without chipping",
        ROCK_POWER,
        ge=0,
        le=1,
    )
    removed_share: float = quantity(
        0.5,
        "-",
        "share that flushing removes of a crater 1 mm deep, or of any with removal_exponent 1",
        CUTTINGS_ON,
        ge=0,
        le=1,
    )
    removal_exponent: float = quantity(
        1.0, "-", "removed depth grows as (depth of the crater)^this", CUTTINGS_ON, ge=0, le=4
    )
    removed_by: str = choice(
        "blow",
        ("blow", "cycle"),
        "flushing acts from blow to blow, or after each drilling cycle as in the paper",
        CUTTINGS_ON,
    )
    barrier_damping: float = quantity(
        1e4, "N s/m", "damping C_R of the energy barrier", BARRIER_ON, ge=0, le=1e9
    )
    barrier_energy: float = quantity(0.05, "J", "energy barrier W_R", BARRIER_ON, ge=0, le=1e6)
    barrier_threshold: float = quantity(
        1.0,
        "-",
        "energy above which a bit begins a drilling cycle, divided by W_R: 1 in the paper",
        BARRIER_ON,
        ge=1e-3,
        le=1e3,
    )


class Contact(Parameters):
    """Contact between a rigid piston and a rigid bit."""

    restitution: float | None = quantity(
        None, "-", "coefficient of restitution; default: St Venant's value", ALL_RIGID, ge=0, le=1
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
    depth: float = quantity(
        0.0,
        "m",
        "depth of the hole at the start; only a note, nothing computed depends on it",
        ge=0,
        le=20000,
    )
    drive_direction: int = choice(
        1, (1, -1), "alpha of the pressure law: 1 down, -1 up", DRIVE_PRESSURE
    )


# Of the scene itself, beside its title.
HOLE_DIAMETER: ParameterRow = dataclasses.replace(
    quantity(
        None,
        "m",
        "diameter of the hole, for specific energy and advance by breaking; default: not known",
        typical=HOLE,
        ge=1e-3,
        le=10,
    ).metadata["row"],
    key="hole_diameter",
)
# Elements that the paper gives the piston.
PAPER_PISTON_ELEMENTS = 50


class SolverOptions(Parameters):
    """How the scene is computed."""

    name: str = choice(
        "auto",
        SOLVER_NAMES,
        "solver; auto: modal for an elastic bit, wave for a drill string and where loss is off "
        "or slight, the rock a wall or one bar far longer; rigid for a rigid bit",
    )
    fidelity: str = choice(
        "wave",
        ("wave", "rigid"),
        "elastic waves, or rigid bodies in place of elastic ones",
        HAS_WAVES,
    )
    cells: int | None = count(
        None,
        "-",
        "modes of the first elastic bar, or steps in which a wave crosses it; "
        "default: by the solver",
        SOLVER_WAVE,
        ge=1,
        le=100_000,
    )
    leaps: bool = flag(True, "cross quiet phases in leaps", SOLVER_MODAL)
    accuracy: float | None = quantity(
        None,
        "-",
        "wanted relative error of the rate of penetration, in place of cells; "
        "default: none is asked for",
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
        "qTol: overshoot of an event function, divided by its size in the step",
        SOLVER_FEM,
        gt=0,
        le=1,
    )
    time_tolerance: float = quantity(
        1e-4,
        "-",
        "tTol: bracket of an event that is narrow enough, divided by the time step",
        SOLVER_FEM,
        gt=0,
        le=1,
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


class BlowMapOptions:
    """A group of earlier versions, which their pickles name: these are refused."""

    def __new__(cls) -> Self:
        """Refuse."""
        raise SceneError("a scene or a state pickled by an earlier version: compute it anew")


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
    "run": RunOptions,
}


def groups_with(components: Sequence[Component]) -> dict[str, type[Parameters]]:
    """Return the groups of a scene, the built-in ones and those that components add.

    Parameters
    ----------
    components : sequence of Component
        Each gets a switch in `effects` and, for its parameters, a group of its own.
    """
    groups = dict(_BUILT_IN)
    plain, switches, drives = _BUILT_IN["effects"], dict[str, Any](), dict[str, str]()
    for one in components:
        if one.name in groups or one.name in switches or one.name in plain.rows:
            raise ValueError(f"component {one.name}: there is a group or a switch of this name")
        if both := set(one.parameters) & set(one.state):
            raise ValueError(f"component {one.name}: {both.pop()} is a parameter and a field")
        key, value = one.switch
        needs: Needs = {key: (value,), **one.needs}
        if one.is_drive:
            drives[one.name] = one.description
        else:
            switches[one.name] = flag(False, one.description, dict(one.needs))
        usual = one.usual.get
        fields = {name: _parameter(*of, needs, usual(name)) for name, of in one.parameters.items()}
        if fields:
            name_of_class = one.name.title().replace("_", "") + "Group"
            groups[one.name] = _group(name_of_class, Parameters, one.description, fields)
    if drives:
        row = plain.rows["drive"]
        told = (f"; {name}: {description}" for name, description in drives.items())
        switches["drive"] = choice(
            row.default, (*row.choices, *drives), "".join((row.description, *told))
        )
    if switches:
        groups["effects"] = _group("Effects", plain, plain.__doc__, switches)
    for key, group in groups.items():
        group.key = key
    rows = {row.key: row for row in table_of(groups)}
    for one in components:
        for key, values in one.needs.items():
            if key not in rows or REFUSED in map(rows[key].read, values):
                must = f"must be {rows[key].allowed}" if key in rows else "there is no such key"
                raise ValueError(f"component {one.name}: needs {key} = {values!r}: {must}")
    return groups


def _parameter(default: Any, unit: str, description: str, *of: Any) -> Any:
    """Field of a component's parameter: a flag, a whole number or a number."""
    lower, upper, needs, usual = of
    if isinstance(default, bool):
        return flag(default, description, needs)
    if isinstance(lower, int):
        return count(default, unit, description, needs, ge=lower, le=upper)
    return quantity(default, unit, description, needs, usual, ge=lower, le=upper)


def _group(
    name: str, base: type[Parameters], doc: str | None, fields: Mapping[str, Any]
) -> type[Parameters]:
    about = {"__module__": __name__, "__doc__": doc, "__annotations__": dict.fromkeys(fields, Any)}
    return type(name, (base,), {**about, **fields})


# The groups of a scene, in the order in which they are written.
GROUPS = groups_with(COMPONENTS)
# Objects of the added ones are found here by name, when they come from another process.
globals().update({group.__name__: group for group in GROUPS.values()})


@cache
def parameter_table() -> tuple[ParameterRow, ...]:
    """Return a row for each parameter, in the order of a scene file."""
    return (HOLE_DIAMETER, *table_of(GROUPS))


@cache
def rows_by_key() -> Mapping[str, ParameterRow]:
    """Return the rows of `parameter_table` by their dotted keys."""
    return {row.key: row for row in parameter_table()}


def find_row(key: str) -> ParameterRow | None:
    """Find the row of a dotted key, `piston.sections.0.length` included."""
    return rows_by_key().get(generic_key(key))


def row_of(key: str) -> ParameterRow:
    """Return the row of a dotted key; `SceneError` if there is none."""
    row = find_row(key)
    if row is None:
        raise SceneError(unknown_key(key))
    return row


def read_number(key: str, text: str, name: str = "") -> float:
    """Read a number of a parameter: of SI, or with its unit. Bounds are not looked at.

    Parameters
    ----------
    key : str
        Dotted.
    text : str
        As "5000" or "5 kN".
    name : str
        What an error calls it; default the key.

    Raises
    ------
    SceneError
        If there is no such key, or the text is no such number.
    """
    row = row_of(key)
    with suppress(ValueError):
        return float(text)
    with suppress(UnitError):
        if row.kind == "number":
            return in_si(text, row.unit)
    raise SceneError(refuse(row, name or key, text))


# A key that a message names; beside it stand those that are known.
LONGEST_KEY = 60


def unknown_key(key: str) -> str:
    """Say that a key is not known, and which known one is nearest."""
    # as an FMU writes it, which counts from 1
    counted = re.sub(r"\[([1-9][0-9]{0,3})\]", lambda place: f".{int(place[1]) - 1}", key)
    is_counted = counted != key and find_row(counted) is not None
    parent, _, name = key.rpartition(".")
    is_retired = key.partition(".")[0] == BLOW_MAP_TABLE
    key = shortened(key, LONGEST_KEY)
    if is_retired:
        return f"{key}: {BLOW_MAP}"
    if is_counted:
        return f"unknown key {key}: did you mean {counted}? Scenes count from 0, FMUs from 1"
    if key in ("rock.name", "bit.name"):
        return f"unknown key {key}: --{parent} NAME takes one of `percussion {parent}s`"
    keys, above = rows_by_key(), generic_key(parent)
    siblings = [one.rpartition(".")[2] for one in keys if one.rpartition(".")[0] == above]
    if parent and (meant := nearest(name, siblings)):
        return f"unknown key {key}: did you mean {shortened(parent, LONGEST_KEY)}.{meant}?"
    underlined = {one.replace(".", "_"): one for one in keys}
    if key in underlined:  # as keyword arguments of Python are written
        return f"unknown key {key}: did you mean {underlined[key]}?"
    known = [] if key in GROUPS else keys if parent else ["title", HOLE_DIAMETER.key, *GROUPS]
    if near := difflib.get_close_matches(generic_key(key), known, 1, SIMILAR_ENOUGH):
        return f"unknown key {key}: did you mean {near[0].replace('.*', '.0')}?"
    if siblings and parent:
        parent = shortened(parent, LONGEST_KEY)
        return f"unknown key {key}: [{parent}] has the keys {', '.join(siblings)}"
    if groups := [one for one in GROUPS if one in key.split(".")]:
        of_group = [one for one in keys if one.startswith(f"{groups[-1]}.") and "*" not in one]
        return f"unknown key {key}: did you mean one of {', '.join(of_group)}?"
    return f"unknown key {key}: a scene has a title and the tables {', '.join(GROUPS)}"


Parameters.say_unknown = staticmethod(unknown_key)
