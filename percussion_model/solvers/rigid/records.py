"""Records of the rigid option: parameters, state, and the kinds of its next event."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from percussion_model.physics.records import BLOW, LEDGER_FIELDS


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


# Rows that one event can add to the list: closed, drive up, opened, change of mode.
ROWS_AN_EVENT = 4

# Parameters and inputs. Symbols as in the paper.
RIGID_PAR = np.dtype(
    [
        ("M_p", "f8"),  # mass of the piston [kg], 0 where there is none
        ("M_b", "f8"),  # mass of the bit [kg]
        ("G", "f8"),  # gravity, 0 where it is off [m/s^2]
        ("F_S", "f8"),  # feed force [N]
        ("F_0", "f8"),  # force of the pressure law [N]
        ("D_1", "f8"),  # reversal distance [m]
        ("external", "f8"),  # force on the piston from outside [N]
        ("e", "f8"),  # restitution of piston and bit
        ("K_R", "f8"),  # rock law from the next drilling cycle on [N/m]
        ("gamma", "f8"),
        ("C_R", "f8"),  # [N s/m]
        ("W_R", "f8"),  # [J]
        ("blow_gap_time", "f8"),  # without a switching drive a gap open this long ends a blow [s]
        ("storm_window", "f8"),  # events are counted over this time [s]
        ("most_events", "i8"),  # more within it are a storm
        ("piston", "i8"),  # Piston
        ("drive", "i8"),  # DriveKind
        ("rock", "i8"),  # RockKind
        ("barrier", "i8"),  # 1: the energy barrier is on
        ("release", "i8"),  # 1: standstill ends when F_R reaches 0
    ],
    align=True,
)

# The state sits at the last event. Velocities are down positive.
RIGID_STATE = np.dtype(
    [
        ("time", "f8"),  # [s]
        ("next_time", "f8"),  # of the next event [s]
        ("next_tau", "f8"),  # the same, from `time` [s]
        ("next_kind", "i8"),  # Next
        ("scheduled", "i8"),  # 1: the three above are valid
        ("mode", "i8"),  # Mode
        ("alpha", "i8"),  # direction of the pressure law
        ("held", "i8"),  # 1: the piston is held on the bit, they move as one
        ("armed", "i8"),  # 1: the next closure starts a blow
        ("in_blow", "i8"),
        ("standing_events", "i8"),  # events since time last moved on
        ("window", "f8"),  # when the present count of events began [s]
        ("window_events", "i8"),  # events since then
        ("last_event", "f8"),  # [s]
        ("late", "i8"),  # 1: the next change of mode is put off
        ("counted", "i8"),  # 1: the present drilling cycle has been counted
        ("p", "f8"),  # penetration of the present drilling cycle [m]
        ("P_u", "f8"),  # [m]
        ("v_b", "f8"),  # [m/s]
        ("gap", "f8"),  # [m]
        ("v_p", "f8"),  # [m/s]
        ("W", "f8"),  # taken by the dashpot in this cycle [J]
        ("crushed", "f8"),  # in this cycle [J]
        ("K_R", "f8"),  # rock law of the present drilling cycle
        ("gamma", "f8"),
        ("C_R", "f8"),
        ("W_R", "f8"),
        ("bit_position", "f8"),  # since the start of the run [m]
        ("first_gap", "f8"),  # g_0 [m]
        ("opened", "f8"),  # when the gap opened last [s]
        ("ss_time", "f8"),  # when the present standstill began [s]
        ("ss_from", "f8"),  # since when it has been undisturbed [s]
        ("ss_p", "f8"),  # position [m] and velocity [m/s] of the bit then
        ("ss_v", "f8"),
        ("ss_force", "f8"),  # mean bit force at the end of the last standstill [N]
        ("bit_impulse", "f8"),  # running integrals [N s]
        ("contact_impulse", "f8"),
        ("drive_impulse", "f8"),
        *[(name, "f8") for name in LEDGER_FIELDS],  # [J]
        ("initial_energy", "f8"),  # [J]
        # greatest forces since a time that the observer sets; infinite: nobody asks
        ("peak_from", "f8"),  # [s]
        ("peak_bit", "f8"),  # [N]
        ("peak_contact", "f8"),
        ("count_events", "i8"),
        ("count_contacts", "i8"),
        ("count_blows", "i8"),
        ("count_cycles", "i8"),
        ("count_storms", "i8"),
        ("n_rows", "i8"),  # rows that the last event adds to the event list
        ("row_kind", "i8", (ROWS_AN_EVENT,)),
        ("row_value", "f8", (ROWS_AN_EVENT,)),
        ("blow", BLOW),  # the blow under way, all but its period
    ],
    align=True,
)

# Everything that a run needs to go on.
RIGID = np.dtype([("par", RIGID_PAR), ("now", RIGID_STATE)], align=True)
