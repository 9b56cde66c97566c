"""How a scene is computed: a part of the table of parameters."""

from __future__ import annotations

from typing import Literal

from percussion_model.parameter_fields import (
    LOSS_ON,
    SOLVER_FEM,
    SOLVER_WAVE,
    Flag,
    Parameters,
    choice,
    quantity,
)

SolverName = Literal["auto", "wave", "fem", "rigid"]

# Elements that the paper gives the piston.
PAPER_PISTON_ELEMENTS = 50


class SolverOptions(Parameters):
    """How the scene is computed."""

    name: SolverName = choice("auto", "solver; auto: wave for an elastic bit, else rigid")
    cells: int | None = quantity(
        None,
        "-",
        "cells in the piston, or in the bit where no piston is elastic; left out: by the solver",
        SOLVER_WAVE,
        ge=1,
        le=100_000,
    )
    leaps: Flag = choice(True, "cross quiet phases in leaps", SOLVER_WAVE)


class FemOptions(Parameters):
    """Finite elements, with the paper's settings as defaults."""

    elements: int = quantity(
        PAPER_PISTON_ELEMENTS,
        "-",
        "elements in the piston, or in the bit where no piston is elastic",
        SOLVER_FEM,
        ge=1,
        le=100_000,
    )
    courant: float = quantity(
        5.0,
        "-",
        "time step, in transit times of the smallest element (CFL number)",
        SOLVER_FEM,
        ge=1e-3,
        le=1e4,
    )
    contact_stiffness: float = quantity(
        1e12,
        "N/m",
        "K_C of the penalty contact of piston and bit, and of the bit with a wall",
        SOLVER_FEM,
        ge=1,
        le=1e18,
    )
    damping_ratio: float | None = quantity(
        None,
        "-",
        "zeta_K of the bit's highest mode on its mesh, in place of loss.time",
        {**SOLVER_FEM, **LOSS_ON},
        ge=0,
        le=1e3,
    )
    spectral_radius: float = quantity(
        0.0,
        "-",
        "of the time scheme at infinite frequency: 0 annihilates, 1 conserves",
        SOLVER_FEM,
        ge=0,
        le=1,
    )
    event_tolerance: float = quantity(
        1e-6,
        "-",
        "qTol: overshoot of an event function, by its values over the step",
        SOLVER_FEM,
        gt=0,
        le=1,
    )
    time_tolerance: float = quantity(
        1e-4,
        "-",
        "tTol: bracket of an event that is narrow enough, by the time step",
        SOLVER_FEM,
        gt=0,
        le=1,
    )


class RunOptions(Parameters):
    """How long the scene runs."""

    duration: float = quantity(4.0, "s", "simulated time", gt=0, le=1e6)
    settle: float = quantity(
        1.0, "s", "time before blows count for the rate of penetration", ge=0, le=1e6
    )
