"""What the memory of a motion holds: a head, what moves, and what does not.

The shell knows the first four words. What moves stands in one part, which is all of a saved
state; copies of it are read, since to read a state means to carry it on.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numba import carray

from fmu_src.native.memory import (
    ENTRY_WORDS,
    LINE,
    allocate,
    lines,
    records_at,
    viewing,
    word_pointer,
)
from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import BLOW, EVENT, READING
from percussion_model.scene.inputs import INPUTS

# Rows of blows that one call of a solver can fill.
BLOW_ROOM = 64
# What a solver is asked for.
ADVANCE, COMMIT = 0, 1
# Most arrays of a solver.
ENTRIES = 40


class Kind(IntEnum):
    """Solvers that a motion may have."""

    MODAL = 1
    WAVE = 2
    FEM = 3
    RIGID = 4


# By the names of solvers.
KINDS = {
    "modal": Kind.MODAL, "wave": Kind.WAVE, "fem": Kind.FEM, "rigid": Kind.RIGID,
}  # fmt: skip


class GaugeBar(IntEnum):
    """Bars that carry the gauge: numbers of the FMU's enumeration."""

    NONE = 0  # none that has waves
    PISTON = 1
    BIT = 2
    ROD = 3  # and the following: one for each rod


class Left(IntEnum):
    """Where the state stands from which the impulses at the start of the last step follow."""

    NOWHERE = 0  # they are known
    HERE = 1  # in the present state, which has not changed since
    COPY = 2


HEAD = np.dtype(
    [
        ("bytes", "i8"),  # of all
        ("state_at", "i8"),  # where what moves begins [bytes]
        ("state_bytes", "i8"),
        ("kind", "i8"),  # Kind
        ("shared_at", "i8"),  # where tables begin that equal motions share: they never change
        ("directory_at", "i8"),  # whose offsets the shell moves to shared tables
        ("directory_rows", "i8"),
        ("directory_words", "i8"),  # of a row
        ("shared", "i8"),  # address of what the shell notes of shared tables; 0: none are
        # below, the shell looks no more
        ("par_at", "i8"),
        ("record_at", "i8"),  # of the solver's state, from the begin of what moves
        ("left_at", "i8"),  # copies of what moves: at the start of the last step,
        ("here_at", "i8"),  # at the present time,
        ("trial_at", "i8"),  # and for what is read beside them
        ("blows_at", "i8"),
        ("acts", "i8", (len(INPUTS),)),  # 1: an input has an effect
        ("inputs_at", "i8", (len(INPUTS),)),  # words of the record that hold the inputs
        ("peak_from_at", "i8"),  # and when peaks began, the peaks, counts of guards
        ("peak_bit_at", "i8"),
        ("peak_contact_at", "i8"),
        ("locked_at", "i8"),  # -1: there is none
        ("storms_at", "i8"),
        ("rock", "i8"),  # RockKind
        ("gauge_bar", "i8"),  # GaugeBar
        ("gauge_cell", "i8"),
        ("gauge_above", "f8"),  # mass of the bar above the gauge [kg]
        ("gauge_impedance", "f8"),  # of its cell [N s/m]
        ("gauge_area", "f8"),  # [m2]
        ("time_share", "f8"),  # of the barrier, T_5/T_4
        ("energy_share", "f8"),  # W_R/(F_0 D_1)
        ("buttons", "f8"),
        ("exponent", "f8"),  # of loading, 1 but for the power law
        ("reference_penetration", "f8"),  # [m]
        # of what was read last
        ("has_peaks", "i8"),
        ("has_stress", "i8"),
        ("stress", "f8"),
        # of the warnings
        ("told", "i8"),  # bits of those that were told
        ("scene_seen", "i8"),
        ("blows_seen", "i8"),
        ("check_at", "f8"),  # time of the next check [s]
        ("pushed_at", "f8"),  # when the rock was last seen to be pushed [s]
        ("impulse_seen", "f8"),  # of the bit force, then [N s]
    ],
    align=True,
)

# What moves, besides the solver's state; it begins with what the shell sets to 0.
MOTION = np.dtype(
    [
        ("is_read", "i8"),  # 1: what was read belongs to the state
        ("time", "f8"),  # [s]
        ("step_size", "f8"),
        ("blow_count", "i8"),
        ("left", "i8"),  # Left
        ("left_time", "f8"),
        ("before", "f8", (3,)),  # impulses at the start of the last step [N s]
        ("acting", "f8", (len(INPUTS),)),  # inputs as the solver has them
    ],
    align=True,
)

head_records = records_at(HEAD)
motion_records = records_at(MOTION)
blow_records = records_at(BLOW)
event_records = records_at(EVENT)
reading_records = records_at(READING)

MOTION_BYTES, BLOW_BYTES, READING_BYTES = MOTION.itemsize, BLOW.itemsize, READING.itemsize
HEAD_BYTES, EVENT_BYTES = HEAD.itemsize, EVENT.itemsize
# Place of the solver's record in what moves; its arrays follow at whole lines.
RECORD = MOTION_BYTES + BLOW_BYTES
ENTRIES_AT = (HEAD_BYTES + LINE - 1) // LINE * LINE


def work_at(dtype: np.dtype) -> int:
    """Place of a solver's first array in what moves, behind a record of a type."""
    return (RECORD + dtype.itemsize + LINE - 1) // LINE * LINE


@viewing
def motion_of(base):
    """The MOTION record."""
    return motion_records(base + head_records(base, 1)[0].state_at, 1)[0]


@viewing
def last_blow(base):
    """The last whole blow: it moves too, behind the MOTION record."""
    return blow_records(base + head_records(base, 1)[0].state_at + MOTION_BYTES, 1)


def views_of(par: np.dtype, state: np.dtype) -> tuple[Any, Any]:
    """Views of a solver's parameters and of its state, as arrays of one record.

    The first takes the address of a motion, the second that of what moves or of a copy of it.
    """
    parameters_at, states_at = records_at(par), records_at(state)

    @viewing
    def parameters(base):
        return parameters_at(base + head_records(base, 1)[0].par_at, 1)

    @viewing
    def state_in(moving):
        return states_at(moving + RECORD, 1)

    return parameters, state_in


@viewing
def directory(base):
    """Where the arrays of a solver lie: rows as in `fmu_src.native.memory`."""
    return carray(word_pointer(base + ENTRIES_AT), (ENTRIES, ENTRY_WORDS))


@viewing
def blow_rows(base, room):
    """Room for so many blows."""
    return blow_records(base + head_records(base, 1)[0].blows_at, room)


@viewing
def event_rows(base):
    """Room for an event, which is never filled."""
    return event_records(base + head_records(base, 1)[0].blows_at + BLOW_ROOM * BLOW_BYTES, 1)


@viewing
def reading_of(base):
    """What was read of the present state."""
    at = head_records(base, 1)[0].blows_at + BLOW_ROOM * BLOW_BYTES + EVENT_BYTES
    return reading_records(base + at, 1)


@viewing
def other_reading(base):
    """What is read beside it."""
    at = head_records(base, 1)[0].blows_at + BLOW_ROOM * BLOW_BYTES + EVENT_BYTES
    return reading_records(base + at + READING_BYTES, 1)


@preparing
def make_memory(kind, par_bytes, moving_bytes, room_bytes, tables_bytes):
    """Memory of zeros for a motion, with its head.

    Parameters
    ----------
    kind : int
        `Kind`.
    par_bytes : int
        Of the solver's parameters.
    moving_bytes : int
        Of all that moves.
    room_bytes : int
        Of the room that a step works in.
    tables_bytes : int
        Of tables that never change: equal motions share them.

    Returns
    -------
    base : int
        Address; 0 where there is no memory left.
    room_at, tables_at : int
        Offsets of the room and of the tables.
    """
    par_at = ENTRIES_AT + lines(8 * ENTRIES * ENTRY_WORDS)
    state_at = par_at + lines(par_bytes)
    moving_bytes = lines(moving_bytes)
    left_at = state_at + moving_bytes
    blows_at = left_at + 3 * moving_bytes
    room_at = blows_at + lines(BLOW_ROOM * BLOW_BYTES + EVENT_BYTES + 2 * READING_BYTES)
    tables_at = room_at + room_bytes
    total = tables_at + tables_bytes
    base = allocate(total)
    if base == 0:
        return base, room_at, tables_at
    head = head_records(base, 1)[0]
    head.shared_at, head.directory_at = tables_at, ENTRIES_AT
    head.directory_rows, head.directory_words = ENTRIES, ENTRY_WORDS
    head.bytes, head.state_at, head.state_bytes, head.kind = total, state_at, moving_bytes, kind
    head.par_at, head.blows_at, head.record_at = par_at, blows_at, RECORD
    head.left_at, head.here_at = left_at, left_at + moving_bytes
    head.trial_at = left_at + 2 * moving_bytes
    return base, room_at, tables_at


@preparing
def set_gauge(base, bar, cell, above, impedance, area):
    """Enter where stress is read, and what is there."""
    head = head_records(base, 1)[0]
    head.gauge_bar, head.gauge_cell, head.gauge_above = bar, cell, above
    head.gauge_impedance, head.gauge_area = impedance, area
