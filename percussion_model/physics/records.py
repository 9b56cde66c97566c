"""Enumerations, and the records of a blow, an event and a reading.

Plain data only. The kernels fill these records; Python reads them.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from percussion_model.components import COMPONENTS


class Mode(IntEnum):
    """Drilling mode of the bit/rock interface (docs/model.md, table 1)."""

    FF = 0  # free flight
    DFC = 1  # dissipative forward contact
    FC = 2  # forward contact
    BC = 3  # backward contact
    SS = 4  # standstill


class EventKind(IntEnum):
    """What happened at an event; a change of mode is MODE_FF + the new mode."""

    MODE_FF = 0
    MODE_DFC = 1
    MODE_FC = 2
    MODE_BC = 3
    MODE_SS = 4
    CONTACT_CLOSED = 10
    CONTACT_OPENED = 11
    DRIVE_UP = 12  # the drive starts to lift the piston (alpha = -1)
    DRIVE_DOWN = 13  # the drive starts to push the piston down (alpha = +1)


class Status(IntEnum):
    """Why a kernel came back."""

    DONE = 0
    BLOWS_FULL = 1  # room for blows used up: read them out, call again
    EVENTS_FULL = 2  # room for events used up: read them out, call again
    NOT_FINITE = 3  # the state is no longer finite
    LOCKED = 4  # more crossings inside one step than the law can make


class Piston(IntEnum):
    """How the piston is modelled."""

    ABSENT = 0
    RIGID = 1
    ELASTIC = 2


class DriveKind(IntEnum):
    """What pushes the piston."""

    NONE = 0
    PRESSURE = 1  # switching pressure law, docs/model.md eq. 13
    EXTERNAL = 2  # a force from outside
    COMPONENT = 3  # one of the components that are drives


# Drives by the choice of `effects.drive`.
BUILT_IN_DRIVES = (DriveKind.PRESSURE, DriveKind.EXTERNAL, DriveKind.NONE)
DRIVES = (*BUILT_IN_DRIVES, *(DriveKind.COMPONENT for one in COMPONENTS if one.is_drive))


class RockKind(IntEnum):
    """What the bit meets."""

    NONE = 0
    BILINEAR = 1
    SPRING = 2
    WALL = 3


class Cuttings(IntEnum):
    """What is left of a crater where a drilling cycle begins in it."""

    NONE = 0
    BY_CYCLE = 1  # what flushing leaves
    BY_BLOW = 2  # all, of which flushing leaves a share from blow to blow
    INDEXED = 3  # all, of which rotation leaves a share from blow to blow


class Column(NamedTuple):
    """A column of what a run finds, as files and documents name it.

    Attributes
    ----------
    name : str
    unit : str
        SI; empty where there is none.
    meaning : str
        For the list of columns.
    kind : str
        Type of its numbers.
    of : str
        Field of a state that it is as it stands; empty where a kernel computes it.
    """

    name: str
    unit: str
    meaning: str
    kind: str = "f8"
    of: str = ""


# One blow: from the first closure of the piston/bit gap after the downward
# switch of the drive to the next such closure.
BLOW_COLUMNS = (
    Column("time", "s", "start of the blow"),
    Column("period", "s", "time to the start of the next blow"),
    Column("impact_velocity", "m/s", "mean velocity of the piston at the start"),
    Column("rebound_velocity", "m/s", "mean velocity of the piston when the last contact opens"),
    Column("stroke", "m", "greatest upward displacement of the piston relative to the bit"),
    Column("blow_energy", "J", "kinetic energy of the piston's mean motion at the start"),
    Column("rock_energy", "J", "work done on the rock during the blow"),
    Column("penetration", "m", "advance of the bit's mean position over the blow"),
    Column("bit_position", "m", "mean displacement of the bit at the start, since the run began"),
    Column("hole_advance", "m", "growth of the hole depth over the blow"),
    Column("hole_depth", "m", "hole depth at the start of the blow"),
    Column("peak_contact_force", "N", "greatest elastic force of the piston on the bit"),
    Column("peak_bit_force", "N", "greatest force of the bit on the rock"),
    Column(
        "standstill_force",
        "N",
        "mean bit force in the last tenth of the standstill before it",
    ),
    Column("contact_impulse", "N s", "impulse of the contact force over the blow"),
    Column("bit_impulse", "N s", "impulse of the bit force over the blow"),
    Column("drive_impulse", "N s", "impulse of the drive on the piston over the blow"),
    Column("contacts", "", "how often the gap of piston and bit closed", "i8"),
    Column("drilling_cycles", "", "cycles of the rock law that crushed more than W_R/100", "i8"),
    Column(
        "barrier_margin",
        "",
        "energy of the bit divided by the barrier, less 1, where it came closest to 0",
    ),
    Column(
        "counting_margin",
        "",
        "energy crushed by a cycle divided by W_R/100, less 1, where it came closest to 0",
    ),
    Column("closing_speed", "m/s", "least speed at which the gap of piston and bit closed"),
    *(
        Column(f"{one.name}_{name}", *one.state[name][:2], of=f"{one.name}_{name}")
        for one in COMPONENTS
        for name in one.of_blow
    ),
)
BLOW = np.dtype([(column.name, column.kind) for column in BLOW_COLUMNS], align=True)

EVENT_COLUMNS = (
    Column("time", "s", "when it happened"),
    Column(
        "value",
        "m/s, N, m",
        "closing speed of a contact [m/s], bit force at a change of mode [N], "
        "relative displacement at a turn of the drive [m]",
    ),
    Column("bit_position", "m", "mean displacement of the bit since the run began"),
    Column("kind", "", "what happened: a mode of the rock law, contact or drive", "i8"),
)
EVENT = np.dtype([(column.name, column.kind) for column in EVENT_COLUMNS], align=True)

# What is seen of a state at a time, in the order of the columns of a sample.
SAMPLE_COLUMNS = (
    Column("time", "s", "time of the sample"),
    Column("piston_position", "m", "mean displacement of the piston since the run began"),
    Column("piston_velocity", "m/s", "mean velocity of the piston", of="v_p"),
    Column("bit_position", "m", "mean displacement of the bit since the run began"),
    Column("bit_velocity", "m/s", "mean velocity of the bit", of="v_b"),
    Column("bit_end_position", "m", "displacement of the bit's end at the rock"),
    Column("bit_end_velocity", "m/s", "velocity of the bit's end at the rock"),
    Column("gap", "m", "distance between the faces of piston and bit", of="gap"),
    Column("relative_displacement", "m", "u_r of the pressure law", of="u_r"),
    Column("penetration", "m", "p of the rock law, in the present drilling cycle", of="p"),
    Column("hole_depth", "m", "surface of the rock if the bit were unloaded now"),
    Column("bit_force", "N", "force of the bit on the rock"),
    Column("contact_force", "N", "force of the piston on the bit"),
    Column("drive_force", "N", "force of the drive on the piston, positive down"),
    Column("recoil_force", "N", "force of the drive on piston and bit: up on the casing"),
    Column("recoil_impulse", "N s", "integral of the recoil since the run began"),
    Column("drilling_mode", "", "mode of the rock law, by its number", of="mode"),
    Column("bit_kinetic_energy", "J", "kinetic energy of the whole bit"),
    Column("bit_impulse", "N s", "integral of the bit force since the run began", of="i_bit"),
    Column(
        "contact_impulse",
        "N s",
        "integral of the contact force since the run began",
        of="i_contact",
    ),
    Column("drive_impulse", "N s", "integral of the drive force since the run began", of="i_drive"),
    *(
        Column(field, unit, text, of=field)
        for one in COMPONENTS
        for field, (unit, text, _) in zip(one.fields, one.state.values(), strict=True)
    ),
)
SAMPLE_FIELDS = tuple(column.name for column in SAMPLE_COLUMNS)

# Running entries of the energy ledger, all since the start of the run.
LEDGER_COLUMNS = (
    Column("drive", "J", "work of the drive on the piston"),
    Column("feed", "J", "work of the feed force on the bit"),
    Column("gravity", "J", "work of gravity on piston and bit"),
    Column("crushing", "J", "given to the rock and not recoverable"),
    Column("barrier", "J", "taken by the dashpot of mode DFC"),
    Column("standstill", "J", "taken by the dashpot of mode SS"),
    Column("loss", "J", "structural loss in the bars"),
    Column("contact", "J", "lost in impacts of rigid bodies"),
    Column("numerical", "J", "dissipated by the discretisation"),
    Column("joints", "J", "taken by joints and the damper"),
    Column("ends", "J", "leaves by ends without reflection, less what comes in there"),
    Column("overshoot", "J", "lost by springs where an event is found just past its place"),
    Column("climb", "J", "work of the rotation that lifts the bit out of its craters"),
    Column("refill", "J", "work of cuttings in old craters, which carry the bit as if lifted"),
    *(
        Column(name, "J", meaning)
        for one in COMPONENTS
        for name, (_, meaning) in one.ledger.items()
    ),
)
LEDGER_FIELDS = tuple(column.name for column in LEDGER_COLUMNS)

# Stored energies [J]: at the start, and now.
STORED_FIELDS = ("start", "kinetic", "elastic", "recoverable")

# Greatest forces since the time that a state carries as `peak_from` [N]. Contact: the
# elastic part of the force; rigid bodies have none but where they rest on each other.
PEAK_FIELDS = ("peak_bit_force", "peak_contact_force")

# All that is read of a state; the ledger is that of the last grid point before.
READING_FIELDS = (*SAMPLE_FIELDS, *PEAK_FIELDS, *LEDGER_FIELDS, *STORED_FIELDS)

# The same as a record, in the same order; entries of the ledger are called as in a state.
LEDGER_ENTRIES = tuple(f"e_{name}" for name in (*LEDGER_FIELDS, "start"))
READING = np.dtype(
    [(name, "f8") for name in (*SAMPLE_FIELDS, *PEAK_FIELDS, *LEDGER_ENTRIES, *STORED_FIELDS[1:])],
    align=True,
)
