"""Records of the rigid-body solver: parameters, state, and the kinds of its next event."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from percussion_model.physics.state import (
    COMMON_PARAMETERS,
    COMMON_STATE,
    COUNT,
    FLAG,
    INFINITE,
    LARGEST,
)
from percussion_model.solvers.state import Limits


class Next(IntEnum):
    """What ends the present stretch of closed-form motion."""

    NOTHING = 0
    SWITCH = 1  # the drive turns downward, u_r = -D_1
    CLOSE = 2  # the piston/bit gap closes
    RELEASE = 3  # a piston held on the bit lets go, F_C = 0
    TOUCH = 4  # the bit reaches the surface of the rock
    TOUCH_INSIDE = 5  # released below P_u, the bit turns downward
    BARRIER = 6  # the dashpot has taken W_R: DFC to FC
    PEAK = 7  # the bit turns upward: loading ends
    LIFT = 8  # the rock no longer pushes: free flight
    TURN = 9  # the bit turns downward while unloading
    LEAVE_DOWN = 10  # KE_b > W_R in standstill, bit moves down or rests
    LEAVE_UP = 11  # the same, bit moves up
    LINE = 12  # none, but another line of the power law begins
    HOLD = 13  # none, but forces that effects hold are taken anew


# Rows that one event can add to the list: closed, drive up, opened, change of mode.
ROWS_AN_EVENT = 4

RIGID_PAR = np.dtype(
    [
        ("restitution", "f8"),  # of piston and bit
        ("window", "f8"),  # events are counted over this time [s]
        ("most_events", "i8"),  # more within it are a storm
        *COMMON_PARAMETERS,
    ],
    align=True,
)

# The state sits at the last event.
RIGID_STATE = np.dtype(
    [
        ("time", "f8"),  # [s]
        ("next_time", "f8"),  # of the next event [s]
        ("next_tau", "f8"),  # the same, from `time` [s]
        ("next_kind", "i8"),  # Next
        ("scheduled", "i8"),  # 1: the three above are valid
        ("held", "i8"),  # 1: the piston is held on the bit, they move as one
        ("standing_events", "i8"),  # events since time last moved on
        ("window_from", "f8"),  # when the present count of events began [s]
        ("window_events", "i8"),  # events since then
        ("last_event", "f8"),  # [s]
        ("late", "i8"),  # 1: the next change of mode is postponed
        ("ss_from", "f8"),  # since when standstill has been undisturbed [s]
        ("ss_p", "f8"),  # position [m] and velocity [m/s] of the bit then
        ("ss_v", "f8"),
        ("ss_force", "f8"),  # mean bit force at the end of the last standstill [N]
        ("start_gap", "f8"),  # g_0 [m]
        ("line_stiffness", "f8"),  # of the line of the power law [N/m]
        ("line_origin", "f8"),  # where its force would be 0 [m]
        ("line_end", "f8"),  # [m]
        ("count_storms", "i8"),
        *COMMON_STATE,
    ],
    align=True,
)

RIGID_LIMITS = Limits(
    RIGID_STATE,
    {
        "next_time": (-LARGEST, INFINITE),
        "next_tau": (0.0, INFINITE),
        "next_kind": (min(Next), max(Next)),
        "scheduled": FLAG,
        "held": FLAG,
        "standing_events": COUNT,
        "window_events": COUNT,
        "late": FLAG,
        "line_end": (-LARGEST, INFINITE),
        "count_storms": COUNT,
    },
    undefined=("ss_force", "peak_contact_force"),
)
