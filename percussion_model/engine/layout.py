"""Views of the memory of a motion (`percussion_model.engine.records`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from percussion_model.engine.memory import allocate, lines, records_at, viewing, words_at, words_in
from percussion_model.engine.records import (
    BLOW_BYTES,
    BLOW_ROOM,
    ENTRIES,
    ENTRIES_AT,
    ENTRY_WORDS,
    EVENT_BYTES,
    HEAD,
    MOTION,
    MOTION_BYTES,
    READING_BYTES,
    RECORD,
)
from percussion_model.physics.kernel import preparing
from percussion_model.physics.records import BLOW, EVENT, READING

head_records = records_at(HEAD)
motion_records = records_at(MOTION)
blow_records = records_at(BLOW)
event_records = records_at(EVENT)
reading_records = records_at(READING)


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
    """Where the arrays of a solver lie: rows as in `percussion_model.engine.memory`."""
    return words_in(base + ENTRIES_AT, (ENTRIES, ENTRY_WORDS))


@viewing
def blow_rows(base):
    """Room for blows."""
    return blow_records(base + head_records(base, 1)[0].blows_at, BLOW_ROOM)


@viewing
def event_rows(base):
    """Room for an event, which is never filled."""
    return event_records(base + head_records(base, 1)[0].blows_at + BLOW_ROOM * BLOW_BYTES, 1)


@viewing
def reading_at(base):
    """Address of what was read of the present state."""
    at = head_records(base, 1)[0].blows_at + BLOW_ROOM * BLOW_BYTES + EVENT_BYTES
    return base + at


@viewing
def other_reading_at(base):
    """Address of what is read beside it."""
    return reading_at(base) + READING_BYTES


@viewing
def reading_of(base):
    """What was read of the present state."""
    return reading_records(reading_at(base), 1)


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


@viewing
def copy_words(source, to, count):
    """Copy so many words of eight bytes from one address to another."""
    there, here = words_at(to, count), words_at(source, count)
    for k in range(count):  # an assignment of all would look first whether they overlap
        there[k] = here[k]


@viewing
def copy_moving(base, moving, copy):
    """Copy what moves to where it may be carried on: all behind what a host keeps there."""
    count = (head_records(base, 1)[0].state_bytes - RECORD) // 8
    copy_words(moving + RECORD, copy + RECORD, count)


@preparing
def describe(base, listed, rows, time_step, misfit):
    """Enter what hosts are told of a motion.

    Parameters
    ----------
    listed : (int, int)
        Words of the record that count the blows and events of a call.
    rows : (int, int)
        Of the directory: the first of the arrays that move, and how many.
    time_step, misfit : float
        0 where there is no grid [s]; largest relative error of a wave speed.
    """
    head = head_records(base, 1)[0]
    head.blow_count_at, head.event_count_at = listed
    head.moving_row, head.moving_rows = rows
    head.time_step, head.wave_speed_error = time_step, misfit
