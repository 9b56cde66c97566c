"""Fields that the parameters and states of all solvers have in common.

Symbols as in the paper. Modes, inputs, rock law, running sums and the blow under way:
what `rock`, `loads` and `blows` read and write, whoever moves the bodies. A solver
puts its own fields first: numba takes a record that only has more at its end for the shorter.
"""

from __future__ import annotations

from percussion_model.components import COMPONENTS, FORCES
from percussion_model.physics.records import LEDGER_ENTRIES, Mode

# Checkpoints of the running bit impulse during standstill.
CHECKPOINTS = 32

# What stays fixed during a run.
COMMON_PARAMETERS = [
    ("gravity", "f8"),  # [m/s2], 0 where it is off
    ("mass_p", "f8"),  # [kg]
    ("mass_b", "f8"),
    ("rearm_time", "f8"),  # without a pressure law a gap open this long ends a blow [s]
    ("piston", "i8"),  # Piston
    ("drive", "i8"),  # DriveKind
    ("rock", "i8"),  # RockKind
    ("barrier", "i8"),  # 1: the energy barrier is on
    ("threshold", "f8"),  # energy above which a cycle begins, by W_R
    ("power", "i8"),  # 1: the rock is loaded by a power law
    ("by_component", "i8"),  # 1: or by the curve of a component in its place
    ("exponent", "f8"),  # n and q of the power law
    ("unloading_exponent", "f8"),
    ("reference_penetration", "f8"),  # [m]
    ("buttons", "f8"),  # that share the load of a power law
    ("chipping_force", "f8"),  # of all buttons [N]
    ("chipping_penetration", "f8"),  # over which they chip, 0 where they do not [m]
    ("cuttings", "i8"),  # Cuttings
    ("left", "i8"),  # 1: during a blow all of them stay
    ("removed_share", "f8"),  # of a crater of 1 mm
    ("removal_exponent", "f8"),
    ("release", "i8"),  # 1: standstill leaves to free flight when F_R reaches 0
    ("throttled", "i8"),  # a Throttled
    ("on_casing", "i8"),  # 1: feed acts on the casing
    ("feed_taken", "i8"),  # 1: or on the body of a component
    ("casing_weight", "f8"),  # [N]
    ("hole_area", "f8"),  # [m2], 0 where it is not known
    ("places", "i8"),  # 1: from blow to blow the bit climbs out of its craters, or turns
    ("effects", "i8"),  # 1: there are components that push
    ("steps", "i8"),  # 1: forces of one of them hold for no longer than a step
    *[(f"with_{one.name}", "i8") for one in COMPONENTS],
    *[(f"{one.name}_{name}", "f8") for one in COMPONENTS for name in one.parameters],
]

_SWITCHES = [
    ("mode", "i8"),  # Mode
    ("alpha", "i8"),  # direction of the drive, +1 down
    ("closed", "i8"),  # 1: piston and bit touch
    ("live", "i8"),  # 0: a copy that is only read: writes no rows
    ("events_on", "i8"),
    ("n_blows", "i8"),  # rows written into the buffers of the present call
    ("n_events", "i8"),
    ("cycle_counted", "i8"),
    ("count_locked", "i8"),  # steps in which the rock law did not settle
    ("count_steps", "i8"),
    ("count_events", "i8"),
    ("count_contacts", "i8"),
    ("count_cycles", "i8"),
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
    ("f_on_bit", "f8"),  # sums of the forces of components [N]
    ("f_on_piston", "f8"),
    *[(f"f_{one.name}_{body}", "f8") for one in FORCES for body in one.pushes],
    *[(f"{one.name}_{name}", "f8") for one in COMPONENTS for name in one.inputs],
    *[(field, "f8") for one in COMPONENTS for field in one.fields],
    *[(f"{one.name}_{field}", "f8") for one in COMPONENTS for field in one.hidden],
]

_MOTION = [
    ("gap", "f8"),  # [m]
    ("p", "f8"),  # penetration while drilling [m]
    ("p_u", "f8"),  # P_u [m]
    ("x_r", "f8"),  # position of the moving datum of p since the start [m]
    ("hole_start", "f8"),  # surface of the rock from which the depth of the hole counts [m]
    ("w", "f8"),  # work of the barrier dashpot in this cycle [J]
    ("chipping_from", "f8"),  # penetration at which this cycle begins to chip [m]
    ("reload_from", "f8"),  # penetration in which cuttings are compressed again, from and to [m]
    ("reload_to", "f8"),
    ("reload_stiffness", "f8"),  # [N/m]
    ("resumed_force", "f8"),  # under which this cycle began [N]
    ("resumed_share", "f8"),  # of what it would give back of its own then
    ("crushed", "f8"),  # by this drilling cycle [J]
    ("crushed_before", "f8"),  # by it before the bit came to this place
    ("cycle_from", "f8"),  # what fresh rock takes until it has the force of its start
    ("cycle_depth", "f8"),  # depth pressed in at which it began [m]
    ("pit", "f8"),  # depth of the craters in which the bit is [m]
    ("climb", "f8"),  # how far it has climbed out of craters [m]
    ("place_time", "f8"),  # when it came to this place [s]
    ("place_drive", "f8"),  # impulse of the drive then [N s]
    ("recoil_share", "f8"),  # recoil of the last blow, by the force of a pressure law
    ("v_p", "f8"),  # mean velocities [m/s]
    ("v_b", "f8"),
    ("u_r", "f8"),  # relative mean displacement of the pressure law [m]
    ("path_p", "f8"),  # of the piston's mean, where components act [m]
    ("path_b", "f8"),  # of the bit's
    ("t_open", "f8"),  # when the gap opened last [s]
    ("t_standstill", "f8"),  # when standstill began [s]
    ("watched_energy", "f8"),  # of the bit's motion, when that was last compared with W_R [J]
    ("n_check", "i8"),
    ("check_time", "f8", (CHECKPOINTS,)),
    ("check_impulse", "f8", (CHECKPOINTS,)),
]

_SUMS = [
    ("i_contact", "f8"),  # impulses [N s]
    ("i_bit", "f8"),
    ("i_drive", "f8"),
    ("i_on_bit", "f8"),  # of drives on the bit
    ("rock_work", "f8"),  # [J]
    *[(name, "f8") for name in LEDGER_ENTRIES],  # [J]
    # greatest forces since a time that the observer sets; infinite: nobody asks
    ("peak_from", "f8"),  # [s]
    ("peak_bit_force", "f8"),  # [N]
    ("peak_contact_force", "f8"),
]

_BLOW = [  # the blow under way: what it began with, and what it has come to
    ("b_time", "f8"),
    ("b_impact", "f8"),
    ("b_rebound", "f8"),
    ("b_stroke", "f8"),
    ("b_peak_contact", "f8"),
    ("b_peak_bit", "f8"),
    ("b_standstill", "f8"),
    ("b_barrier", "f8"),  # closest decisions, NaN before the first: see BLOW_COLUMNS
    ("b_counting", "f8"),
    ("b_closing", "f8"),
    ("b_position", "f8"),
    ("b_hole", "f8"),
    ("b_rock0", "f8"),
    ("b_contact0", "f8"),
    ("b_bit0", "f8"),
    ("b_drive0", "f8"),
    ("b_contacts", "i8"),
    ("b_cycles", "i8"),
    ("b_started", "i8"),
    ("armed", "i8"),  # the next closure starts a blow
]

# What changes; every field is a word of eight bytes or a row of such.
COMMON_STATE = [*_SWITCHES, *_INPUTS, *_MOTION, *_SUMS, *_BLOW]


def _refuse_unknown_names() -> None:
    """Raise `ValueError` for a misspelt parameter or field in a component's kernels."""
    known = {str(one[0]) for one in (*COMMON_PARAMETERS, *COMMON_STATE)}
    for one in COMPONENTS:
        for file, name in one.named:
            if name not in known:
                must = ", ".join(sorted(own for own in known if own.startswith(f"{one.name}_")))
                raise ValueError(f"{file.replace('.', '/')}.py: {name} must be one of {must}")


_refuse_unknown_names()

# What a state from outside may hold; kernels index arrays, count and loop by these numbers.
# Numbers in SI stay below this, so that no product of a few of them overflows.
LARGEST = 1e60
MOST = 2**53  # of what is counted
INFINITE = float("inf")

FLAG = (0, 1)
COUNT = (0, MOST)
POSITIVE = (0.0, LARGEST)
NUMBER = (-LARGEST, LARGEST)

# Lowest and highest value of each field; of a number that is not named, NUMBER.
COMMON_LIMITS: dict[str, tuple[float, float]] = {
    "mode": (min(Mode), max(Mode)),
    "alpha": (-1, 1),
    "closed": FLAG,
    "live": (1, 1),
    "events_on": FLAG,
    "n_blows": COUNT,
    "n_events": COUNT,
    "cycle_counted": FLAG,
    **{name: COUNT for name, _ in _SWITCHES if name.startswith("count_")},
    "reversal": POSITIVE,
    **{
        name: POSITIVE
        for symbol in ("k_r", "gamma", "c_r", "w_r")
        for name in (symbol, f"next_{symbol}")
    },
    "gap": (-LARGEST, INFINITE),  # without a piston
    "t_open": (-INFINITE, LARGEST),
    "n_check": COUNT,
    "peak_from": (-LARGEST, INFINITE),
    "b_contacts": COUNT,
    "b_cycles": COUNT,
    "b_started": FLAG,
    "armed": FLAG,
}
# Numbers that may be undefined.
COMMON_UNDEFINED = (
    *("b_rebound", "b_standstill", "b_peak_contact", "b_barrier", "b_counting", "b_closing"),
)
