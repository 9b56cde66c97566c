"""What the states of the solvers with elastic bars have in common.

Modes, inputs, rock law, running sums and the blow under way: the fields that
`blows`, `drive` and `rock_law` read and write, whoever moves the bars.
"""

from __future__ import annotations

from percussion_model.physics.records import LEDGER_FIELDS

# Checkpoints of the running bit impulse during standstill.
CHECKPOINTS = 32

_SWITCHES = [
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
    ("count_events", "i8"),
    ("count_blows", "i8"),
]

_INPUTS = [  # changed from outside at grid points
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
]

_MOTION = [
    ("gap", "f8"),  # [m]
    ("p", "f8"),  # penetration while drilling [m]
    ("p_u", "f8"),  # P_u [m]
    ("x_r", "f8"),  # position of the moving datum of p since the start [m]
    ("w", "f8"),  # work of the barrier dashpot in this cycle [J]
    ("crushed", "f8"),  # by this drilling cycle [J]
    ("v_p", "f8"),  # mean velocities [m/s]
    ("v_b", "f8"),
    ("u_r", "f8"),  # relative mean displacement of the pressure law [m]
    ("t_open", "f8"),  # when the gap opened last [s]
    ("t_standstill", "f8"),  # when standstill began [s]
    ("n_check", "i8"),
    ("check_time", "f8", (CHECKPOINTS,)),
    ("check_impulse", "f8", (CHECKPOINTS,)),
]

_SUMS = [
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
]

_BLOW = [
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

COMMON_STATE = [*_SWITCHES, *_INPUTS, *_MOTION, *_SUMS, *_BLOW]
