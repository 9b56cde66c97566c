"""What the memory of a motion holds: a head, what moves, and what does not.

Hosts know the first words of the head. What moves stands in one part, which is all of a saved
state; copies of it are read, since to read a state means to carry it on.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from percussion_model.physics.records import BLOW, EVENT, READING
from percussion_model.scene.inputs import INPUTS

# Of a line of a processor's cache: parts of a memory begin at whole lines [bytes].
LINE = 64
# Words of a row of the directory: an offset [bytes], and up to four dimensions.
ENTRY_WORDS = 5
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
KINDS = {kind.name.lower(): kind for kind in Kind}


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
        ("changed_at", "i8"),  # -1: the solver need not know that inputs have changed
        ("blow_count_at", "i8"),  # words of the record with rows that a call has listed
        ("event_count_at", "i8"),
        ("moving_row", "i8"),  # of the directory: first of the arrays that move, how many
        ("moving_rows", "i8"),
        ("time_step", "f8"),  # 0: there is none [s]
        ("wave_speed_error", "f8"),
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

MOTION_BYTES, BLOW_BYTES, READING_BYTES = MOTION.itemsize, BLOW.itemsize, READING.itemsize
HEAD_BYTES, EVENT_BYTES = HEAD.itemsize, EVENT.itemsize
# Place of the solver's record in what moves; its arrays follow at whole lines.
RECORD = MOTION_BYTES + BLOW_BYTES
ENTRIES_AT = (HEAD_BYTES + LINE - 1) // LINE * LINE


def work_at(dtype: np.dtype) -> int:
    """Place of a solver's first array in what moves, behind a record of a type."""
    return (RECORD + dtype.itemsize + LINE - 1) // LINE * LINE
