"""Records of the finite-element solver: parameters and state, plain data.

Nodes are numbered through: the piston from top to bottom, then the bit. A
piston that is rigid is one node, one that is absent none. Element `i` lies
between the nodes `i` and `i + 1`; between piston and bit there is none.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from percussion_model.physics.state import COMMON_PARAMETERS, COMMON_STATE, COUNT, FLAG
from percussion_model.solvers.state import Limits


class Node(IntEnum):
    """Rows of the array that changes, one column for each node."""

    U = 0  # displacement from the datum of the drilling cycle, less `far` of the state [m]
    V = 1  # velocity [m/s]
    LOSS = 2  # energy lost so far in the element below a node [J]
    NUMERICAL = 3  # energy dissipated by the scheme so far, by node and element [J]


class Mesh(IntEnum):
    """Rows of the array that does not change, one column for each node."""

    MASS = 0  # diagonal of the consistent mass matrix [kg]
    COUPLING = 1  # its entry between a node and the next [kg]
    STIFFNESS = 2  # of the element below a node [N/m]
    SPRINGS = 3  # of the elements above and below a node [N/m]
    SHARE = 4  # mass that moves with a node: row sum of the mass matrix [kg]


class Stage(IntEnum):
    """Rows of scratch: a step that is tried."""

    U = 0  # displacement at its end; the first two rows are as those of `Node`
    V = 1  # velocity at its end
    RE = 2  # complex stage acceleration, docs/numerics.md
    IM = 3
    TARGET_RE = 4  # what the elements are stretched by, before its solution
    TARGET_IM = 5


class Factor(IntEnum):
    """Rows of a factorisation of the stage matrix, from both ends towards the contact."""

    LOW_RE = 0  # entry to the neighbour that was eliminated before
    LOW_IM = 1
    PIVOT_RE = 2  # inverse pivot; at the contact the pivot itself
    PIVOT_IM = 3
    KEY = 4  # what it was made for: columns of `Key`


class Key(IntEnum):
    """Columns of the row KEY of a factorisation."""

    STEP = 0  # length of the step, 0 where nothing was made [s]
    STIFFNESS = 1  # of the rock [N/m]
    DAMPING = 2  # [N s/m]


class Probe(IntEnum):
    """Event functions that are watched; each is positive until its event."""

    CONTACT = 0  # gap, or its negative while it is closed [m]
    DRIVE = 1  # distance of u_r to its threshold [m]
    ROCK = 2  # by position, force or work: what ends the present mode
    TURN = 3  # by the sign of the velocity, or by the energy of the bit


class Column(IntEnum):
    """Columns of the table of event functions."""

    LOW = 0  # value at the start of the bracket
    LOW_SLOPE = 1  # its change a step
    HIGH = 2  # value at the end
    HIGH_SLOPE = 3
    TRIED = 4  # at the end of the step tried last
    TRIED_SLOPE = 5
    SCALE = 6  # size of its values over the whole step


class FemTask(IntEnum):
    """What the kernels are to do with a state."""

    ADVANCE = 0  # commit whole steps
    COMMIT = 1  # the same, and a part of a step up to the time given
    READ = 2  # COMMIT without writing rows, then read it


class Elements(NamedTuple):
    """Arrays of the elements.

    Attributes
    ----------
    w : float array, shape (len(Node), n)
        What changes at each node.
    c : float array, shape (len(Mesh), n)
    f : float array, shape (2 len(Factor), at least n)
        Factorisations, kept from call to call; zero at first.
    x : float array, shape (len(Stage), n)
        Scratch: a step that is tried.
    q : float array, shape (len(Probe), len(Column))
        Scratch: the event functions.
    """

    w: np.ndarray
    c: np.ndarray
    f: np.ndarray
    x: np.ndarray
    q: np.ndarray


FEM_PAR = np.dtype(
    [
        ("dt", "f8"),  # time step [s]
        ("mu_re", "f8"),  # eigenvalue of the scheme, docs/numerics.md
        ("mu_im", "f8"),
        ("dissipation", "f8"),  # its defect s / 36, docs/numerics.md
        ("k_c", "f8"),  # contact stiffness K_C [N/m]
        ("eta", "f8"),  # Kelvin-Voigt time [s]
        ("q_tol", "f8"),  # of an event function, by its change over the step
        ("t_tol", "f8"),  # of an event's place in the step
        ("start_gap", "f8"),  # [m]
        ("n_p", "i8"),  # nodes of the piston, 0 when it is absent
        ("n_b", "i8"),
        ("most_changes", "i8"),  # changes of mode at one instant; more are a loop
        ("most_events", "i8"),  # steps cut short by events within a whole one; more are a storm
        *COMMON_PARAMETERS,
    ],
    align=True,
)

FEM_STATE = np.dtype(
    [
        ("time", "f8"),  # [s]
        ("v_end", "f8"),  # velocity of the bit's rock end [m/s]
        ("gap_rate", "f8"),  # opening velocity of the gap [m/s]
        ("kinetic", "f8"),  # energy of the bit while it stands still [J]
        ("mean_p", "f8"),  # mean displacements from the datum [m]
        ("mean_b", "f8"),
        ("next_kinetic", "f8"),  # the same three at the end of the step tried last
        ("next_p", "f8"),
        ("next_b", "f8"),
        ("far", "f8"),  # of these means and of the penetration, what the nodes do not have [m]
        ("line_stiffness", "f8"),  # of the power law in the present step [N/m]
        ("line_origin", "f8"),  # [m]
        ("rebounding", "i8"),  # 1: in flight, rock still pressed in
        ("inputs_changed", "i8"),  # 1: inputs were changed, modes may have to follow
        ("skip_events", "i8"),  # modes did not settle: no events in the next step
        ("count_trials", "i8"),
        ("window_events", "i8"),  # steps cut short by events since `window_from`
        ("window_from", "f8"),  # [s]
        ("count_storms", "i8"),
        *COMMON_STATE,
    ],
    align=True,
)

FEM_LIMITS = Limits(
    FEM_STATE,
    {
        "rebounding": FLAG,
        "inputs_changed": FLAG,
        "skip_events": FLAG,
        "count_trials": COUNT,
        "window_events": COUNT,
        "count_storms": COUNT,
    },
)
