"""Enumerations, and the records of a blow, an event and a reading.

Plain data only. The kernels fill these records; Python reads them.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from percussion_model.physics.effects import EFFECTS


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
    REFUSED = 5  # the blow map does not answer; the solver says why


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


class RockKind(IntEnum):
    """What the bit meets."""

    NONE = 0
    BILINEAR = 1
    SPRING = 2
    WALL = 3


# One blow: from the first closure of the piston/bit gap after the downward
# switch of the drive to the next such closure. SI units.
BLOW = np.dtype(
    [
        ("time", "f8"),  # start [s]
        ("period", "f8"),  # to the start of the next blow [s]
        ("impact_velocity", "f8"),  # mean piston velocity at the start [m/s]
        ("rebound_velocity", "f8"),  # mean piston velocity after the last contact [m/s]
        ("stroke", "f8"),  # greatest upward relative mean displacement [m]
        ("blow_energy", "f8"),  # kinetic energy of the mean piston motion at the start [J]
        ("rock_energy", "f8"),  # work done on the rock during the blow [J]
        ("penetration", "f8"),  # advance of the mean bit position over the blow [m]
        ("bit_position", "f8"),  # mean bit displacement since the start of the run [m]
        ("hole_advance", "f8"),  # of the depth of the hole over the blow [m]
        ("hole_depth", "f8"),  # at the start [m]
        ("peak_contact_force", "f8"),  # [N]
        ("peak_bit_force", "f8"),  # [N]
        ("standstill_force", "f8"),  # mean bit force in the last tenth of standstill before [N]
        ("contact_impulse", "f8"),  # [N s]
        ("bit_impulse", "f8"),  # [N s]
        ("drive_impulse", "f8"),  # [N s]
        ("contacts", "i8"),  # closures of the gap
        ("drilling_cycles", "i8"),  # cycles that crushed more than W_R/100
    ],
    align=True,
)

EVENT = np.dtype(
    [
        ("time", "f8"),  # [s]
        ("value", "f8"),  # closing speed [m/s]; bit force [N] for modes; u_r [m] for the drive
        ("bit_position", "f8"),  # mean bit displacement since the start of the run [m]
        ("kind", "i8"),  # EventKind
    ],
    align=True,
)

# What is seen of a state at a time, in the order of the columns of a sample.
SAMPLE_FIELDS = (
    "time",  # [s]
    "piston_position",  # mean displacement since the start of the run [m], down positive
    "piston_velocity",  # mean [m/s]
    "bit_position",  # mean displacement since the start of the run [m]
    "bit_velocity",  # mean [m/s]
    "bit_end_position",  # displacement of the bit's rock end since the start of the run [m]
    "bit_end_velocity",  # [m/s]
    "gap",  # between piston and bit [m]
    "relative_displacement",  # u_r of the pressure law [m]
    "penetration",  # p, of the present drilling cycle [m]
    "hole_depth",  # surface of the rock once the bit is unloaded, since the start of the run [m]
    "bit_force",  # force on the rock, compression positive [N]
    "contact_force",  # piston on bit, compression positive [N]
    "drive_force",  # on the piston, down positive [N]
    "drilling_mode",  # Mode
    "bit_kinetic_energy",  # of the whole elastic bit [J]
    "bit_impulse",  # running integral of the bit force [N s]
    "contact_impulse",  # [N s]
    "drive_impulse",  # [N s]
)

# Running entries of the energy ledger [J], all since the start of the run.
LEDGER_FIELDS = (
    "drive",  # work of the drive on the piston
    "feed",  # work of the feed force on the bit
    "gravity",  # work of gravity on piston and bit
    "crushing",  # into the rock, not recoverable
    "barrier",  # dashpot in DFC
    "standstill",  # dashpot in SS
    "loss",  # structural loss in the bars
    "contact",  # restitution of rigid contact
    "numerical",  # what the discretisation dissipates
    "joints",  # what joints and the damper take
    "ends",  # what leaves by ends without reflection, less what comes in there
    "overshoot",  # what springs lose where an event is found just past its place
    *(effect.name for effect in EFFECTS),  # what their forces take from the bit
)

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
