"""Records of the blow map: its table of single blows, and the state between blows."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from percussion_model.physics.state import (
    COMMON_PARAMETERS,
    COMMON_STATE,
    INFINITE,
    LARGEST,
    POSITIVE,
)
from percussion_model.solvers.state import Limits

# Times after the start of a blow at which the table has the bit's position [s].
PATH_TIMES = (0.5e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6.5e-3, 9e-3, 14e-3)


class Axis(IntEnum):
    """Coordinates of the table, as logarithms; the last one runs fastest."""

    STIFFNESS = 0  # K_R [N/m]
    VELOCITY = 1  # impact velocity v [m/s]
    LOAD = 2  # (F_S + M_b G)/v [N s/m]
    DRIVE = 3  # F_0/v [N s/m]


class Entry(IntEnum):
    """What the table has of a blow; lengths, forces and speeds by v, energies by v squared."""

    PENETRATION = 0
    REBOUND = 1  # velocity of the flight after the blow, carried back to its start
    OFFSET = 2  # u_r of the flight after the blow, carried back to its start
    REST = 3  # time until the bit stands still [s], infinite where it does not
    OPENED = 4  # time at which the last contact opens [s]
    CONTACTS = 5
    CYCLES = 6
    PEAK_CONTACT = 7
    PEAK_BIT = 8
    CRUSHING = 9
    BARRIER = 10
    STANDSTILL = 11
    LOSS = 12
    NUMERICAL = 13
    PATH = 14  # the bit's advance at PATH_TIMES


ENTRIES = int(Entry.PATH) + len(PATH_TIMES)


class Next(IntEnum):
    """What ends the present piece of the piston's flight."""

    NOTHING = 0
    TURN = 1  # the drive turns downward
    IMPACT = 2
    FALL = 3  # the piston falls back though the drive lifts it


class Refusal(IntEnum):
    """Why the map does not answer."""

    NONE = 0
    STIFFNESS = 1  # outside the table
    VELOCITY = 2
    FEED = 3
    DRIVE = 4
    MOVING = 5  # the bit does not stand still at impact
    TURNED = 6  # the drive turns before the last contact has opened
    FALLEN = 7  # the piston falls back on the bit


# Parameters: what stays fixed during a run.
MAP_PAR = np.dtype(
    [
        ("start_gap", "f8"),  # g_0 [m]
        ("gamma", "f8"),
        ("lowest", "f8", (len(Axis),)),  # of K_R, v, F_S and F_0: what is answered
        ("highest", "f8", (len(Axis),)),
        ("origin", "f8", (len(Axis),)),  # of the axes of the table
        ("step", "f8", (len(Axis),)),
        *COMMON_PARAMETERS,
    ],
    align=True,
)

# The bit's datum x_r is where it stood before the blow, and p its way since then.
MAP_STATE = np.dtype(
    [
        # the present piece of the flight
        ("t", "f8"),  # its start [s]
        ("y", "f8"),  # piston from where it struck the resting bit last, at t [m]
        ("t_next", "f8"),  # its end [s]
        ("next", "i8"),  # Next
        # what the last blow does to the bit
        ("t_blow", "f8"),  # [s]
        ("penetration", "f8"),  # [m]
        ("rest", "f8"),  # [s]
        ("opened", "f8"),  # [s]
        ("path", "f8", (len(PATH_TIMES),)),  # [m]
        ("refusal", "i8"),  # Refusal of the last call
        ("refused_value", "f8"),
        *COMMON_STATE,
    ],
    align=True,
)

MAP_LIMITS = Limits(
    MAP_STATE,
    {
        "t_next": (-LARGEST, INFINITE),
        "next": (min(Next), max(Next)),
        "rest": (0.0, INFINITE),
        "opened": POSITIVE,
        "refusal": (min(Refusal), max(Refusal)),
        "refused_value": (-INFINITE, INFINITE),
    },
    undefined=("refused_value",),
)
