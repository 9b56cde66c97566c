"""Records of the travelling-wave solver: parameters and state, plain data.

A bar is kept in two arrays. ``w`` (rows of `Row`) holds what changes, ``c``
(rows of `Coef`) what does not. Cell `i` of a bar lies between its interfaces
`i` and `i + 1`; interface 0 is the top end, interface `n` the bottom end.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from percussion_model.physics.state import COMMON_PARAMETERS, COMMON_STATE, COUNT, FLAG, MOST
from percussion_model.solvers.state import Limits


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
    COMMIT = 1
    READ = 2


class Bars(NamedTuple):
    """Arrays of piston and bit: rows of `Row`, which change, and rows of `Coef`."""

    wp: np.ndarray
    cp: np.ndarray
    wb: np.ndarray
    cb: np.ndarray


class Scratch(NamedTuple):
    """Room for the products of leaps."""

    x: np.ndarray
    v: np.ndarray
    y: np.ndarray


class LeapKind(IntEnum):
    """How the bit is carried over a leap."""

    FLIGHT = 0  # free flight
    STANDSTILL = 1  # standstill too quiet to end by itself
    CONTACT = 2  # contact whose every step was looked at beforehand


class LeapOperators(NamedTuple):
    """Powers of the step map, and what can be seen of the next steps.

    Maps are stored column by column and padded with zeros, forms as
    their upper triangles; `size` is the padded number of waves, with the
    penetration for the bit.

    Attributes
    ----------
    piston : ndarray, shape (powers, size, size)
        Powers 1, 2, 3, 4, 8, 12, 16, 32, 48, ... of the free piston's step map.
    bit : ndarray, shape (5, powers, size, size)
        The same for the bit by `Mode`.
    lookahead : ndarray, shape (5, size, LOOKAHEAD)
        By mode: strain offset of the rock end at the end of the next steps in
        FF, its velocity at their start in DFC, FC, BC and SS.
    sums : ndarray, shape (5, size)
        By contact mode: path of the bit's mean motion until it rests.
    top : ndarray, shape (5, size, LOOKAHEAD)
        By mode: motion of the bit's top end by the end of the next steps, in
        FF its strain offset.
    bottom : ndarray, shape (size, LOOKAHEAD)
        Strain offset of the piston's bottom end.
    piston_loss : ndarray, shape (powers, size, size)
        Structural loss of the free piston over as many steps as the powers are of [J].
    loss : ndarray, shape (5, powers, size, size)
        The same of the bit by `Mode`.
    squares : ndarray, shape (powers, size, size)
        In standstill, sum over so many steps of the square of the rock end's
        velocity at the start of each [m2/s2].
    """

    piston: np.ndarray
    bit: np.ndarray
    lookahead: np.ndarray
    sums: np.ndarray
    top: np.ndarray
    bottom: np.ndarray
    piston_loss: np.ndarray
    loss: np.ndarray
    squares: np.ndarray


def no_operators() -> LeapOperators:
    """Stand-ins where no leaps are made."""
    return LeapOperators(
        np.zeros((1, 1, 1)), np.zeros((1, 1, 1, 1)), np.zeros((1, 1, 1)), np.zeros((1, 1)),
        np.zeros((1, 1, 1)), np.zeros((1, 1)), np.zeros((1, 1, 1)), np.zeros((1, 1, 1, 1)),
        np.zeros((1, 1, 1)),
    )  # fmt: skip


# Parameters: what stays fixed during a run.
WAVE_PAR = np.dtype(
    [
        ("dt", "f8"),  # time step = transit time of a cell [s]
        # ends that meet something: piston bottom (p), bit top (t), bit bottom (b)
        ("z_p", "f8"),  # impedance of the end cell [N s/m]
        ("z_t", "f8"),
        ("z_b", "f8"),
        ("z_f", "f8"),  # free top end of the piston
        ("kappa_p", "f8"),  # viscous number of the end cell, docs/numerics.md
        ("kappa_t", "f8"),
        ("kappa_b", "f8"),
        ("kappa_f", "f8"),
        ("front", "f8"),  # share of a step before its closure, docs/numerics.md, eq. 14b
        ("ss_stiffness", "f8"),  # gamma K_R for which standstill leaps were made [N/m]
        ("ss_loading", "f8"),  # K_R for which leaps in contact were made, 0: none were
        ("ss_damping", "f8"),  # C_R for the same
        ("bound_p", "f8"),  # |S_p| <= bound_p sqrt(2 E): piston strain offset [m/J^0.5]
        ("bound_t", "f8"),
        ("bound_b", "f8"),
        ("n_p", "i8"),  # cells in the piston, 0 when it is rigid or absent
        ("n_b", "i8"),
        ("loss", "i8"),  # sub-steps of the loss operator, 0: no loss
        ("leaps", "i8"),  # levels of the leap operators, four to one: 0: no leaps
        ("most_changes", "i8"),  # of the rock law within a step; more are a loop
        ("size_p", "i8"),  # padded size of the leap operators: piston
        ("size_r", "i8"),  # bit on the rock
        *COMMON_PARAMETERS,
    ],
    align=True,
)

# So many steps at most are cut for a closure that the bars put off.
MOST_CUTS = 2

WAVE_STATE = np.dtype(
    [
        ("step", "i8"),  # number of steps done
        ("leap_end", "i8"),  # step at which the pending leap ends, or -1
        ("leap_kind", "i8"),  # LeapKind of it
        ("no_plan", "i8"),  # do not plan a leap before this step
        ("dormant", "i8"),  # 1: the piston waits at an earlier step
        ("piston_step", "i8"),  # the step at which it waits
        ("piston_parity", "i8"),  # and which pair of its wave rows is the present one
        ("wake", "i8"),  # step before which it can meet nothing
        ("no_dormancy", "i8"),  # do not let it wait before this step
        ("parity", "i8"),  # which pair of wave rows is the present one (0 or 1)
        ("cuts", "i8"),  # steps cut for a closure that has not come yet
        ("count_wakes", "i8"),
        ("count_leaps", "i8"),
        ("count_leap_steps", "i8"),
        ("t_base", "f8"),  # time = t_base + step * dt [s]
        ("moved", "f8"),  # what the bit's mean displacement counts from, piston dormant [m]
        ("spread_p", "f8"),  # bound of the dormant piston's strain offset [m]
        ("x_dormant", "f8"),  # datum of p when it began to wait [m]
        ("u_start", "f8"),  # u_r - u_p + u_b at the start [m]
        ("offset_start", "f8"),  # (bottom end - mean) of the bit at the start [m]
        *COMMON_STATE,
    ],
    align=True,
)

WAVE_LIMITS = Limits(
    WAVE_STATE,
    {
        "step": COUNT,
        "leap_end": (-1, MOST),
        "leap_kind": (min(LeapKind), max(LeapKind)),
        "no_plan": (-MOST, MOST),
        "dormant": FLAG,
        "piston_step": COUNT,
        "piston_parity": FLAG,
        "wake": (-MOST, MOST),
        "no_dormancy": (-MOST, MOST),
        "parity": FLAG,
        "cuts": (0, MOST_CUTS),
        "count_wakes": COUNT,
        "count_leaps": COUNT,
        "count_leap_steps": COUNT,
    },
)
