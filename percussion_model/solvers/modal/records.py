"""Records of the modal solver: parameters and state, plain data."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from percussion_model.physics.state import COMMON_PARAMETERS, COMMON_STATE, COUNT, FLAG, MOST
from percussion_model.solvers.state import Limits

# A step has 2^STEP ticks, to one of which events are found; carries go up to 2^(LEVELS - 1).
STEP, LEVELS = 10, 28


class Move(IntEnum):
    """Rows of a table: what a mode does over 2^level ticks, and what it loses [J]."""

    Q_BY_Q = 0
    Q_BY_V = 1
    V_BY_Q = 2
    V_BY_V = 3
    LOSS_QQ = 4
    LOSS_QV = 5
    LOSS_VV = 6


class Shape(IntEnum):
    """Rows of what else is known of each mode."""

    TOP = 0  # offset of the top end [1/kg^0.5]
    LOW = 1
    SOFT = 2  # 1 / frequency^2 [s2]
    STIFF = 3


class Reply(IntEnum):
    """What an end does by a force of 1 N over 2^level ticks; offsets in m, velocities in m/s."""

    TOP = 0  # of the top end, by a force there
    LOW = 1
    CROSS = 2  # of one end, by a force at the other
    LOW_SPEED = 3  # of the low end, by a force there
    CROSS_SPEED = 4
    TOP_REST = 5  # share of TOP that no mode of the set has
    LOW_REST = 6
    TOP_KEPT = 7  # what is left of an offset beyond the modes
    LOW_KEPT = 8


class ModalBar(NamedTuple):
    """What does not change of a bar.

    Attributes
    ----------
    shape : ndarray, shape (len(Shape), n)
    move : ndarray, shape (LEVELS, len(Move), n)
    reply : ndarray, shape (sets, levels, len(Reply))
    sizes : int array, shape (sets,)
        Modes of each set, falling.
    beyond : ndarray, shape (sets, 2)
        Compliance at top and low end beyond the modes of a set [m/N].
    levels : int array, shape (sets,)
        A step of the set has 2^level ticks.
    """

    shape: np.ndarray
    move: np.ndarray
    reply: np.ndarray
    sizes: np.ndarray
    beyond: np.ndarray
    levels: np.ndarray


class Bars(NamedTuple):
    """Modes of piston and bit: offsets and velocities, rows that change; and what does not."""

    wp: np.ndarray
    cp: ModalBar
    wb: np.ndarray
    cb: ModalBar


class Standstill(NamedTuple):
    """Powers 1, 2, 4, ... of the map of a step in standstill, and what is lost over them.

    Attributes
    ----------
    powers : ndarray, shape (POWERS, m, wide)
        By columns, filled up with zeros to whole lanes; m = 2 n + 4 numbers: offsets and
        velocities of n modes, mean offset and velocity, offset beyond the modes, penetration;
        all about their values at rest.
    loss, dashpot : ndarray, shape (POWERS, m, wide)
        Forms: what bar and dashpot take [J].
    rest : ndarray, shape (m,)
        Values at rest under a force of 1 N.
    x, y : ndarray, shape (1, wide)
        Room.
    rows : ndarray, shape (2, n)
        Room for the modes of the bit.
    """

    powers: np.ndarray
    loss: np.ndarray
    dashpot: np.ndarray
    rest: np.ndarray
    x: np.ndarray
    y: np.ndarray
    rows: np.ndarray


class LeapKind(IntEnum):
    """How the bit is carried over a leap."""

    FLIGHT = 0
    STANDSTILL = 1


class Task(IntEnum):
    """What the kernels are to do with a state."""

    ADVANCE = 0
    COMMIT = 1
    READ = 2


MODAL_PAR = np.dtype(
    [
        ("tick", "f8"),  # unit of time [s]
        ("dt", "f8"),  # 2^STEP ticks
        ("start_gap", "f8"),  # [m]
        ("bound_p", "f8"),  # |offset of the low end| <= bound_p sqrt(2 E) [m/J^0.5]
        ("bound_t", "f8"),
        ("bound_b", "f8"),
        ("end_speed", "f8"),  # |velocity of the rock end| <= end_speed sqrt(2 E) [1/kg^0.5]
        ("ss_stiffness", "f8"),  # gamma K_R for which standstill leaps were made [N/m]
        ("ss_damping", "f8"),
        ("leaps", "i8"),  # 0: none
        *COMMON_PARAMETERS,
    ],
    align=True,
)

MODAL_STATE = np.dtype(
    [
        ("time", "i8"),  # [ticks]
        ("leap_end", "i8"),  # when the pending leap ends, or -1
        ("leap_kind", "i8"),
        ("no_plan", "i8"),  # plan no leap before
        ("look", "i8"),  # when to look again at which modes are needed
        ("parked", "i8"),  # 1: the vibration of the piston is that of an earlier time
        ("piston_time", "i8"),
        ("no_park", "i8"),
        ("alert", "i8"),  # 1: standstill may end by the energy of the bit
        ("set", "i8"),  # of the bit's modes
        ("count_leaps", "i8"),
        ("u_p", "f8"),  # mean displacements [m]
        ("u_b", "f8"),
        ("r_p", "f8"),  # offsets beyond the modes: piston's low end, bit's top and low end [m]
        ("r_t", "f8"),
        ("r_b", "f8"),
        ("spread_p", "f8"),  # bound of the offset of the parked piston's low end [m]
        ("offset", "f8"),  # of ends that touch, found within a tick [m]
        ("peak_time", "f8"),  # of contact, since the last mean force for a peak [s]
        ("peak_impulse", "f8"),  # [N s]
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
        "leap_kind": (min(LeapKind), max(LeapKind)),
        "no_plan": COUNT,
        "look": COUNT,
        "parked": FLAG,
        "piston_time": COUNT,
        "no_park": COUNT,
        "alert": FLAG,
        "set": (0, 8),
        "count_leaps": COUNT,
    },
)
