"""Records of the travelling-wave solver: parameters, state and arrays, plain data.

A section carries a down-going and an up-going velocity wave, d and u, so that v = d + u and
F = Z (d - u) (docs/model.md, eqs 5-6). What is sent into a section at one end is kept in a ring
until it arrives at the other. Section `k` lies between its nodes `k` and `k + 1`.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from percussion_model.physics.state import COMMON_PARAMETERS, COMMON_STATE, COUNT
from percussion_model.solvers.state import Limits


class Place(IntEnum):
    """Rows of whole numbers of a section."""

    BAR = 0  # the bar that it belongs to
    RING = 1  # where the ring of its down-going wave begins; that of the up-going follows, and q
    SIZE = 2  # of the ring, a power of two; each holds everything twice
    DELAY = 3  # whole steps that a wave waits at least before the one in which it arrives
    TAPS = 4  # how many weights it arrives by
    WEIGHTS = 5  # where these begin; of a wave that arrives as it is -1, of q its two weights
    CELLS = 6  # in which it is read
    PASSAGE = 7  # where the weights begin by which loss has spread a wave in each cell
    REACH = 8  # these are of so many steps before and after its own


class Steel(IntEnum):
    """Rows of numbers of a section."""

    IMPEDANCE = 0  # [N s/m]
    ALPHA = 1  # weights of the waves in the velocity of its upper end (docs/model.md, eq. 8)
    BETA = 2
    CELL_MASS = 3  # [kg]
    BY_LOSS = 4  # Z dt of what structural loss takes of a wave that arrives [N s2/m]
    BY_MIXING = 5  # of what fitting its length to steps takes


class Joint(IntEnum):
    """Kinds of joint between two bars."""

    PERFECT = 0
    CONTACT = 1
    LOSSY = 2
    THREADED = 3


class Fit(IntEnum):
    """Rows of numbers of a joint."""

    KIND = 0  # Joint
    YIELD = 1  # Y = 1/Z above + 1/Z below [m/(N s)]
    PRELOAD = 2  # [N]
    STIFFNESS = 3  # of the thread, or of the spring of a lossy joint [N/m]
    DAMPING = 4  # of a lossy joint [N s/m]
    SECTION = 5  # the one below it
    STIFF = 6  # 1 / Y [N s/m]
    ABOVE = 7  # 1 / Z of the end above [m/(N s)]
    BELOW = 8


class Has(IntEnum):
    """Rows of what changes at a joint."""

    CLOSED = 0  # 1: its shoulders touch
    GAP = 1  # between them [m]; shortening of a lossy joint
    FORCE = 2  # mean over the last step, compression positive [N]
    LEAST = 3  # least force so far [N]
    CAME = 4  # energy that came down to it [J]
    PASSED = 5  # that went on downward
    RETURNED = 6  # that was sent back up
    BY_WAVES = 7  # force by the waves alone at the end of its last step [N]


class Bar(IntEnum):
    """Rows of what changes of a bar."""

    VELOCITY = 0  # mean [m/s]
    POSITION = 1  # mean displacement since the start [m]
    GIVEN = 2  # velocity that body forces gave its waves since they were written [m/s]
    BY_LOSS = 3  # mean velocity by the impulses of loss at its ends, beside its waves [m/s]


class Body(IntEnum):
    """Rows of numbers of a bar."""

    MASS = 0  # [kg]
    FIRST = 1  # section
    LAST = 2
    INV_MASS = 3  # 1 / mass [1/kg]
    LATE = 4  # half the spread of waves by their time: so late the mean follows an end [s]


class Task(IntEnum):
    """What the kernels are to do with a state."""

    ADVANCE = 0
    READ = 1
    SAMPLE = 2


class Chain(NamedTuple):
    """What does not change: rows of `Place`, `Steel`, `Fit`, `Body`; weights of all sections.

    Weights by which waves arrive, and by which they have been spread in the cells on their way.
    """

    places: np.ndarray
    steel: np.ndarray
    weights: np.ndarray
    passage: np.ndarray
    fits: np.ndarray
    bodies: np.ndarray


class Waves(NamedTuple):
    """What changes: all rings in a row; rows of `Bar`, `Has`; what arrives at either end."""

    rings: np.ndarray
    bars: np.ndarray
    joints: np.ndarray
    came: np.ndarray


WAVE_PAR = np.dtype(
    [
        ("dt", "f8"),  # time step [s]
        ("viscous", "f8"),  # eta / (2 dt): share of the loss in the force at an end
        ("lag", "f8"),  # viscous / (1 + viscous)
        ("most_given", "f8"),  # velocity that body forces may give waves before they are written
        ("cuts_all", "i8"),  # 1: loss spreads fronts, so that any step before a closure is cut
        ("sections", "i8"),
        ("bars", "i8"),
        ("joints", "i8"),  # but for that of the piston
        ("struck", "i8"),  # the bar that the piston strikes, or the topmost
        ("most_changes", "i8"),  # of the rock law within a step; more are a loop
        ("open_top", "i8"),  # 1: the top end of a string without a piston reflects nothing
        ("open_bottom", "i8"),  # 1: nor does the lower end of the bit
        ("pulse", "f8"),  # force of a wave that comes down from there [N]
        ("pulse_end", "f8"),  # [s]
        ("damper", "i8"),  # 1: there is one
        ("damper_stiffness", "f8"),
        ("damper_damping", "f8"),
        ("damper_preload", "f8"),
        ("casing_mass", "f8"),
        *COMMON_PARAMETERS,
    ],
    align=True,
)

WAVE_STATE = np.dtype(
    [
        ("step", "i8"),  # number of steps done
        ("cuts", "i8"),  # steps cut since the last closure below the piston
        ("t_base", "f8"),  # time of step 0 if none had been cut [s]
        ("held_feed", "f8"),  # feed force on the bit in this step [N]
        ("v_c", "f8"),  # velocity of the casing [m/s]
        ("u_c", "f8"),  # its displacement [m]
        ("x_c", "f8"),  # shortening of the damper since the start [m]
        ("e_stored", "f8"),  # in joints and damper [J]
        ("u_0", "f8"),  # u_r at the start [m]
        ("g_contact", "f8"),  # force by the waves alone below the piston after the last step [N]
        ("g_rock", "f8"),  # and at the rock
        ("i_came", "f8"),  # energy that came down to the rock [J]
        ("i_returned", "f8"),  # that it sent back
        *COMMON_STATE,
    ],
    align=True,
)

# Steps that are cut at most for a closure to come.
MOST_CUTS = 2
WAVE_LIMITS = Limits(WAVE_STATE, {"step": COUNT, "cuts": (0, MOST_CUTS)})
