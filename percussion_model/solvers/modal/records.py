"""Records of the modal solver: parameters and state, plain data."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from percussion_model.physics.state import (
    COMMON_PARAMETERS,
    COMMON_STATE,
    COUNT,
    FLAG,
    INFINITE,
    LARGEST,
    MOST,
)
from percussion_model.solvers.state import Limits

# A step has 2^STEP ticks, to one of which events are found; carries go up to 2^(LEVELS - 1).
STEP, LEVELS = 11, 28
# A search looks so many times at once; between two looks are up to 2^(LONGEST_HOP - STEP) steps.
SCAN, LONGEST_HOP = 8, STEP + 4
# Most steps between two looks at which modes are needed, or whether the piston may wait; and at
# which pairs are.
LOOK, LONGEST_STRIDE = 32, 128
# Rows of `Bars.rows` that keep pairs.
KEPT = np.int64(4)
# Forms: the bit free, on K_R, on gamma K_R; the same joined to the piston.
JOINED = 3


class Known(IntEnum):
    """Whether the greatest forces of the pending leap are known."""

    NOT = 0  # they are sought when it is made, if somebody observes it
    YES = 1
    SOUGHT = 2


class Move(IntEnum):
    """Rows of a table: what a mode does over 2^level ticks, and what it loses [J]."""

    Q_BY_Q = 0
    Q_BY_V = 1
    V_BY_Q = 2
    V_BY_V = 3
    YIELD = 4  # offset by a constant force; its velocity is Q_BY_V
    LOSS_QQ = 5
    LOSS_QV = 6
    LOSS_VV = 7


class Shape(IntEnum):
    """Rows of what else is known of each mode."""

    LOW = 0  # offset of the rock end [1/kg^0.5]
    TOP = 1  # of the top of the bit
    SOFT = 2  # 1 / frequency^2 [s2]; 0 of a rigid one
    STIFF = 3
    BIT = 4  # integral over the mass of the bit [kg^0.5]
    PISTON = 5


class Forms(NamedTuple):
    """What does not change of the bars.

    Attributes
    ----------
    sizes : int array, shape (6,)
        Modes of each form, 0 where there is none.
    stiff : ndarray, shape (6,)
        Spring under the rock end [N/m].
    shape : ndarray, shape (6, len(Shape), n)
    move : ndarray, shape (6, LEVELS, len(Move), n)
    yields : ndarray, shape (6, LEVELS, lanes)
        How far the rock end goes over a move by a force of 1 N there, with the modes of so many
        lanes [m/N].
    change : ndarray, shape (6, 3, n, n)
        From a form to those on another spring, and at its own spring's place to the one that is
        joined where this is not, or the reverse; row j is what mode j becomes.
    join : ndarray, shape (3, modes of the piston, n)
        What each elastic mode of the piston becomes in a joined form.
    """

    sizes: np.ndarray
    stiff: np.ndarray
    shape: np.ndarray
    move: np.ndarray
    yields: np.ndarray
    change: np.ndarray
    join: np.ndarray


class Laws(NamedTuple):
    """Motions of the bars of a form with all that the rock end feels: law 2 form, or 2 form + 1.

    The second has the dashpot of the rock besides. Each damped mode is a pair of numbers Q and
    V = dQ/dt (docs/modal.md, section 4).

    Attributes
    ----------
    sizes : int array, shape (12,)
        Pairs of each law, 0 where there is none.
    dashpot : float array, shape (12,)
        Of the rock [N s/m].
    move : ndarray, shape (12, LEVELS, len(Go), n)
    ends : ndarray, shape (12, len(End), n)
    out, into : ndarray, shape (12, 2 n, 2 n)
        From pairs to offsets and velocities of the form's modes, and back; row by number that is
        changed, all Q or offsets first. Empty for free forms, whose pairs are their modes.
    taken : ndarray, shape (12, 2 n, 2 n)
        Form: what a dashpot of 1 N s/m takes from now on [J]; of two numbers in different lanes
        all is at the one of the lower lanes.
    rest : ndarray, shape (6, len(Rest))
        Of a bit alone, as all that follows, with its own n.
    views : ndarray, shape (6, LONGEST_HOP + 1, len(View), n)
        What pairs tell now of the rock end 2^level ticks later.
    scans : ndarray, shape (12, LONGEST_HOP - STEP + 1, n len(View), SCAN)
        The same for 1, 2, ... SCAN times 2^STEP, 2^(STEP + 1), ... ticks later; for all laws.
    sides : ndarray, shape (12, LONGEST_HOP - STEP + 1, 4 n, SCAN)
        What they tell of the bit's other end then, by Q and V: of a bit alone the offset of its
        top; of a piston that touches, what accelerates it, and the integral of its velocity over
        its mass.
    way : int array, shape (6, 6)
        Place in `over` of the table from the pairs of a law to those of another, -1: none.
    over : ndarray, shape (tables, 2 n, 2 n)
        As `into`.
    pushed : ndarray, shape (tables, 2, n)
        What an acceleration of the bit by its loads of 1 m/s2 adds, since it shifts the rest.
    held : ndarray, shape (6, 4, n)
        Where such loads hold the pairs, Q and V; and twice what the form `taken` makes of these
        and of each number.
    """

    sizes: np.ndarray
    dashpot: np.ndarray
    move: np.ndarray
    ends: np.ndarray
    out: np.ndarray
    into: np.ndarray
    taken: np.ndarray
    rest: np.ndarray
    views: np.ndarray
    scans: np.ndarray
    sides: np.ndarray
    way: np.ndarray
    over: np.ndarray
    pushed: np.ndarray
    held: np.ndarray


class Go(IntEnum):
    """Rows of a table: what a pair does over 2^level ticks."""

    Q_BY_Q = 0
    Q_BY_V = 1
    V_BY_Q = 2
    V_BY_V = 3
    YIELD = 4  # offset of a rigid mode by a constant force; its velocity is Q_BY_V


class End(IntEnum):
    """Rows by which pairs tell of places; of each the part of Q, then that of V."""

    LOW = 0  # offset of the rock end
    SPEED = 2  # its velocity
    TOP = 4  # of the top of the bit
    BIT = 6  # integral over the mass of the bit
    BIT_SPEED = 8
    SHIFT = 10  # pairs of a common offset of 1 m
    YIELD = 12  # of an offset of the rock end alone, as the last mode has it
    PISTON = 14  # integral over the mass of the piston
    PISTON_SPEED = 16
    PULL = 18  # what the bit accelerates that mass with [N]
    SQUARE = 20  # Q'' + decay Q' + square Q = 0
    ROWS = 21


class Rest(IntEnum):
    """Where loads that would accelerate a free bit by 1 m/s2 hold the modes."""

    LOW = 0  # rock end [m]
    TOP = 1  # top of the bit
    BIT = 2  # integral over the mass of the bit [kg m]
    TAKEN = 3  # what a dashpot of 1 N s/m would take from there on [J]


class View(IntEnum):
    """Rows by which pairs tell of the rock end later, about rest."""

    LOW_Q = 0
    LOW_V = 1
    SPEED_Q = 2
    SPEED_V = 3


class Bars(NamedTuple):
    """Modes of the present form and of the free piston, what is constant of them, and room.

    Attributes
    ----------
    w : ndarray, shape (8, n)
        Offsets, velocities, and forces of the body loads; pairs about rest, and their loads; pairs
        where a search is, or the pending leap ends.
    wp : ndarray, shape (2, modes of the piston)
    forms : Forms
    laws : Laws
    shape_p, move_p : ndarray
        Of the piston's elastic modes, as one of `Forms`.
    rows : ndarray, shape (8, n)
        Room: a step that is tried, what a search sees, pairs that are kept, what a search sees of
        the other end.
    """

    w: np.ndarray
    wp: np.ndarray
    forms: Forms
    laws: Laws
    shape_p: np.ndarray
    move_p: np.ndarray
    rows: np.ndarray


class Task(IntEnum):
    """What the kernels are to do with a state."""

    ADVANCE = 0
    COMMIT = 1
    READ = 2


MODAL_PAR = np.dtype(
    [
        ("tick", "f8"),  # unit of time [s]
        ("dt", "f8"),  # 2^STEP ticks
        ("asked", "i8"),  # level of the step that goes with the modes asked for
        ("most_bend", "f8"),  # share of its path by which rock may bend a step where it unloads
        ("ringing", "i8"),  # after a closure only the mean of contact counts so long [ticks]
        ("eta", "f8"),  # Kelvin-Voigt time [s]
        ("transit", "i8"),  # of a wave through the bit [ticks]
        ("window", "f8"),  # over which a peak of the contact force is a mean [s]
        ("start_gap", "f8"),  # [m]
        ("bound_p", "f8"),  # |offset of the low end| <= bound_p sqrt(2 E) [m/J^0.5]
        ("bound_t", "f8"),
        ("bound_b", "f8"),
        ("k_r", "f8"),  # rock for which forms and leaps were made
        ("gamma", "f8"),
        ("c_r", "f8"),
        ("leaps", "i8"),  # 0: none
        *COMMON_PARAMETERS,
    ],
    align=True,
)

MODAL_STATE = np.dtype(
    [
        ("time", "i8"),  # [ticks]
        ("leap_end", "i8"),  # when the pending leap ends, or -1
        ("leap_ends", "i8"),  # 1: the mode of the rock ends then
        ("leap_known", "i8"),  # Known
        ("law", "i8"),  # by which the pairs move, or -1: offsets and velocities do
        ("pairs", "i8"),  # that move
        ("stride", "i8"),  # steps before it is looked again which pairs are needed
        ("look", "i8"),  # when to look again at which modes are needed
        ("parked", "i8"),  # 1: the vibration of the piston is that of an earlier time
        ("piston_time", "i8"),
        ("no_park", "i8"),
        ("closed_at", "i8"),
        ("held_from", "i8"),  # mean forces of components are held from then on
        ("held_until", "i8"),
        ("rest_until", "i8"),  # no front of a blow on a bit at rest can be at the rock before
        ("alert", "i8"),  # 1: standstill may end by the energy of the bit
        ("form", "i8"),
        ("active", "i8"),  # modes of it that move
        ("count_leaps", "i8"),
        ("u_p", "f8"),  # mean displacements [m]
        ("u_b", "f8"),
        ("low", "f8"),  # offsets in the present form: rock end, top of the bit [m]
        ("top", "f8"),
        ("low_p", "f8"),  # of the piston's low end, from its mean
        ("at_b", "f8"),  # means of bit and piston in the present form [m]
        ("at_p", "f8"),
        ("a_b", "f8"),  # accelerations that the body loads stand for [m/s2]
        ("a_p", "f8"),
        ("spread_p", "f8"),  # bound of the offset of the parked piston's low end [m]
        ("offset", "f8"),  # between the ends where they parted [m]
        ("peak_time", "f8"),  # of contact, since the last mean force for a peak [s]
        ("peak_impulse", "f8"),  # [N s]
        ("leap_peak", "f8"),  # greatest force of the rock on the leap [N]
        ("leap_contact", "f8"),  # the same of contact, as a mean
        ("late_from", "f8"),  # `peak_from` when it was planned [s]
        ("late_peak", "f8"),  # greatest forces of the leap after that [N]
        ("late_contact", "f8"),
        ("leap_time", "f8"),  # `peak_time` and `peak_impulse` after it
        ("leap_impulse", "f8"),
        ("rest_low", "f8"),  # sums at rest under the loads: rock end, top [m]
        ("rest_top", "f8"),
        ("rest_b", "f8"),  # bit and piston [kg m]
        ("rest_p", "f8"),
        ("rest_pull", "f8"),  # of bit on piston besides what the pairs tell [N]
        ("vibrates", "f8"),  # energy about rest when the pairs were taken [J]
        ("takes", "f8"),  # that a dashpot of 1 N s/m would take from then on [J]
        ("has_place", "i8"),  # 1: where loading along a curve is, is known
        ("place_p", "f8"),  # penetration [m], force [N], work [J]
        ("place_force", "f8"),
        ("place_work", "f8"),
        ("line_stiffness", "f8"),  # of the last line of a step on a curve [N/m]
        ("v_low", "f8"),  # velocity of the rock end [m/s]
        ("f_contact", "f8"),  # mean forces of the last step [N]
        ("f_rock", "f8"),
        *COMMON_STATE,
    ],
    align=True,
)

MODAL_LIMITS = Limits(
    MODAL_STATE,
    {
        "time": COUNT,
        "leap_end": (-1, MOST),
        "leap_ends": FLAG,
        "leap_known": (0, 2),
        "late_from": (-LARGEST, INFINITE),
        "law": (-1, 4 * JOINED - 1),
        "pairs": COUNT,
        "stride": (0, LONGEST_STRIDE),
        "look": COUNT,
        "parked": FLAG,
        "piston_time": COUNT,
        "no_park": COUNT,
        "closed_at": COUNT,
        "held_from": COUNT,
        "held_until": COUNT,
        "rest_until": COUNT,
        "alert": FLAG,
        "form": (0, 5),
        "active": COUNT,
        "has_place": FLAG,
        "count_leaps": COUNT,
    },
)
