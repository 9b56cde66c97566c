"""Records of the travelling-wave solver: parameters and state, plain data.

A bar is kept in two arrays. ``w`` (rows of `Row`) holds what changes, ``c``
(rows of `Coef`) what does not. Cell `i` of a bar lies between its interfaces
`i` and `i + 1`; interface 0 is the top end, interface `n` the bottom end.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from percussion_model.core.records import LEDGER_FIELDS


class Row(IntEnum):
    """Rows of the array of a bar that changes, each of length n + 1.

    The two pairs of wave rows take turns: a step reads one pair and writes the
    other, so that no value is overwritten before it is used.
    """

    DOWN = 0  # down-going velocity wave of each cell [m/s]
    UP = 1  # up-going
    DOWN_OTHER = 2
    UP_OTHER = 3
    FACE = 4  # velocity of each interface over the step [m/s]
    LOSS = 5  # energy lost at each interface so far, divided by the time step [W]
    SCRATCH = 6


class Coef(IntEnum):
    """Rows of the array of a bar that does not change, each of length n + 1."""

    ALPHA = 0  # weight of the down-going wave in an interface's velocity
    BETA = 1  # weight of the up-going wave
    INV_Z = 2  # 1 / (Z above + Z below) of an interface [m/(N s)]
    VISCOUS = 3  # viscous number times Z of a cell, for one sub-step [N s/m]
    MASS = 4  # mass of a cell [kg]
    TOP = 5  # weight of a cell's strain in (mean - top end) [s]
    BOTTOM = 6  # weight of a cell's strain in (bottom end - mean) [s]
    STATIC = 7  # down-going wave of a cell at rest under unit body acceleration [s]
    FROM_TOP = 8  # response of interface velocities to a unit viscous force of cell 0
    FROM_BOTTOM = 9  # the same for the last cell
    BETWEEN = 10  # viscous number times Z between a cell and the next [N s/m]
    INV_CELL_Z = 11  # 1 / Z of a cell [m/(N s)]


class Task(IntEnum):
    """What the kernels are to do with a state."""

    ADVANCE = 0
    BRING = 1
    SAMPLE = 2
    STEP = 3


class LeapKind(IntEnum):
    """How the bit is carried over a leap."""

    FLIGHT = 0  # free flight
    STANDSTILL = 1  # standstill too quiet to end by itself
    CONTACT = 2  # contact whose every step was looked at beforehand


# Parameters: what stays fixed during a run.
WAVE_PAR = np.dtype(
    [
        ("dt", "f8"),  # time step = transit time of a cell [s]
        ("gravity", "f8"),  # [m/s2]
        ("mass_p", "f8"),  # [kg]
        ("mass_b", "f8"),
        # ends that meet something: piston bottom (p), bit top (t), bit bottom (b)
        ("z_p", "f8"),  # impedance of the end cell [N s/m]
        ("z_t", "f8"),
        ("z_b", "f8"),
        ("z_f", "f8"),  # free top end of the piston
        ("kappa_p", "f8"),  # viscous number of the end cell, docs/numerics.md
        ("kappa_t", "f8"),
        ("kappa_b", "f8"),
        ("kappa_f", "f8"),
        ("ss_stiffness", "f8"),  # gamma K_R for which standstill leaps were made [N/m]
        ("ss_loading", "f8"),  # K_R for which loading leaps were made
        ("ss_damping", "f8"),  # C_R for the same
        ("bound_p", "f8"),  # |S_p| <= bound_p sqrt(2 E): piston strain offset [m/J^0.5]
        ("bound_t", "f8"),
        ("bound_b", "f8"),
        ("rearm_time", "f8"),  # an open gap this long ends a blow (no pressure law) [s]
        ("n_p", "i8"),  # cells in the piston, 0 when it is rigid or absent
        ("n_b", "i8"),
        ("piston", "i8"),  # Piston
        ("drive", "i8"),  # DriveKind
        ("rock", "i8"),  # RockKind
        ("barrier", "i8"),  # 1: the energy barrier is on
        ("release", "i8"),  # 1: standstill leaves to free flight when F_R reaches 0
        ("loss", "i8"),  # sub-steps of the loss operator, 0: no loss
        ("leaps", "i8"),  # levels of the leap operators, four to one: 0: no leaps
        ("size_p", "i8"),  # padded size of the leap operators: piston
        ("size_r", "i8"),  # bit on the rock
    ],
    align=True,
)

_BLOW_STATE = [
    ("b_time", "f8"),
    ("b_impact", "f8"),
    ("b_rebound", "f8"),
    ("b_stroke", "f8"),
    ("b_peak_contact", "f8"),
    ("b_peak_bit", "f8"),
    ("b_standstill", "f8"),
    ("b_position", "f8"),
    ("b_rock0", "f8"),
    ("b_contact0", "f8"),
    ("b_bit0", "f8"),
    ("b_drive0", "f8"),
    ("b_contacts", "i8"),
    ("b_cycles", "i8"),
    ("b_started", "i8"),
    ("armed", "i8"),  # the next closure starts a blow
]

# Checkpoints of the running bit impulse during standstill.
CHECKPOINTS = 32

WAVE_STATE = np.dtype(
    [
        ("step", "i8"),  # number of steps done
        ("leap_end", "i8"),  # step at which the pending leap ends, or -1
        ("leap_kind", "i8"),  # LeapKind of it
        ("no_plan", "i8"),  # do not plan a leap before this step
        ("asleep", "i8"),  # 1: the piston waits at an earlier step
        ("piston_step", "i8"),  # the step at which it waits
        ("piston_parity", "i8"),  # and which pair of its wave rows is the present one
        ("wake", "i8"),  # step before which it can meet nothing
        ("no_sleep", "i8"),  # do not put it to sleep before this step
        ("parity", "i8"),  # which pair of wave rows is the present one (0 or 1)
        ("mode", "i8"),  # Mode
        ("alpha", "i8"),  # direction of the drive, +1 down
        ("closed", "i8"),  # 1: piston and bit touch
        ("live", "i8"),  # 0: a copy that is only read: writes no rows
        ("events_on", "i8"),
        ("n_blows", "i8"),  # rows written into the buffers of the present call
        ("n_events", "i8"),
        ("cycle_counted", "i8"),
        ("locked", "i8"),  # steps in which the rock law did not settle
        ("count_steps", "i8"),
        ("count_wakes", "i8"),
        ("count_leaps", "i8"),
        ("count_leap_steps", "i8"),
        ("count_events", "i8"),
        ("count_blows", "i8"),
        # inputs, changed from outside at grid points
        ("feed", "f8"),  # [N]
        ("drive_force", "f8"),  # F_0 [N]
        ("reversal", "f8"),  # D_1 [m]
        ("external", "f8"),  # [N]
        ("k_r", "f8"),  # rock law in force
        ("gamma", "f8"),
        ("c_r", "f8"),
        ("w_r", "f8"),
        ("next_k_r", "f8"),  # rock law from the next drilling cycle on
        ("next_gamma", "f8"),
        ("next_c_r", "f8"),
        ("next_w_r", "f8"),
        # motion
        ("t_base", "f8"),  # time = t_base + step * dt [s]
        ("gap", "f8"),  # [m]
        ("p", "f8"),  # penetration while drilling [m]
        ("p_u", "f8"),  # P_u [m]
        ("x_r", "f8"),  # position of the moving datum of p since the start [m]
        ("w", "f8"),  # work of the barrier dashpot in this cycle [J]
        ("crushed", "f8"),  # by this drilling cycle [J]
        ("v_p", "f8"),  # mean velocities [m/s]
        ("v_b", "f8"),
        ("u_r", "f8"),  # relative mean displacement of the pressure law [m]
        ("moved", "f8"),  # what the bit's mean displacement counts from, piston asleep [m]
        ("spread_p", "f8"),  # bound of the sleeping piston's strain offset [m]
        ("x_sleep", "f8"),  # datum of p when the piston went to sleep [m]
        ("u_start", "f8"),  # u_r - u_p + u_b at the start [m]
        ("offset_start", "f8"),  # (bottom end - mean) of the bit at the start [m]
        ("t_open", "f8"),  # when the gap opened last [s]
        ("t_standstill", "f8"),  # when standstill began [s]
        ("n_check", "i8"),
        ("check_time", "f8", (CHECKPOINTS,)),
        ("check_impulse", "f8", (CHECKPOINTS,)),
        # running integrals
        ("i_contact", "f8"),  # impulses [N s]
        ("i_bit", "f8"),
        ("i_drive", "f8"),
        ("rock_work", "f8"),  # [J]
        *[(f"e_{name}", "f8") for name in LEDGER_FIELDS],
        ("e_start", "f8"),  # stored energy at the start [J]
        # greatest forces since a time that the observer sets; infinite: nobody asks
        ("peak_from", "f8"),  # [s]
        ("peak_bit", "f8"),  # [N]
        ("peak_contact", "f8"),
        *_BLOW_STATE,
    ],
    align=True,
)
