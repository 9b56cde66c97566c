"""How a scene is computed: a part of the table of parameters."""

from __future__ import annotations

from typing import Literal

from percussion_model.scene.fields import (
    BLOW_MAP,
    HAS_WAVES,
    LOSS_ON,
    SOLVER_FEM,
    SOLVER_WAVE,
    Flag,
    Parameters,
    choice,
    quantity,
)

SolverName = Literal["auto", "wave", "fem", "rigid"]
Fidelity = Literal["wave", "rigid", "blow-map"]

# Elements that the paper gives the piston.
PAPER_PISTON_ELEMENTS = 50


class SolverOptions(Parameters):
    """How the scene is computed."""

    name: SolverName = choice("auto", "solver; auto: wave for an elastic bit, else rigid")
    fidelity: Fidelity = choice(
        "wave",
        "elastic waves, rigid bodies in place of elastic ones, or a table of blows",
        HAS_WAVES,
    )
    cells: int | None = quantity(
        None,
        "-",
        "cells in the piston, or in the bit where no piston is elastic; left out: by the solver",
        SOLVER_WAVE,
        ge=1,
        le=100_000,
    )
    leaps: Flag = choice(True, "cross quiet phases in leaps", SOLVER_WAVE)
    accuracy: float | None = quantity(
        None,
        "-",
        "wanted relative error of the rate of penetration, in place of cells; "
        "left out: none is asked for",
        ge=1e-4,
        le=0.1,
    )


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


def _edge(default: float, unit: str, description: str) -> float:
    """Declare an edge of the blow map."""
    found: float = quantity(default, unit, description, BLOW_MAP, gt=0, le=1e13)
    return found


class BlowMapOptions(Parameters):
    """What the table of blows covers."""

    velocity_from: float = _edge(4.0, "m/s", "least impact velocity")
    velocity_to: float = _edge(12.0, "m/s", "greatest impact velocity")
    feed_from: float = _edge(1000.0, "N", "least feed force")
    feed_to: float = _edge(8000.0, "N", "greatest feed force")
    force_from: float = _edge(1500.0, "N", "least drive force")
    force_to: float = _edge(5000.0, "N", "greatest drive force")
    stiffness_from: float = _edge(3e8, "N/m", "least loading stiffness of the rock")
    stiffness_to: float = _edge(2e9, "N/m", "greatest loading stiffness of the rock")
    density: float = quantity(
        1.0, "-", "nodes along each axis, by the usual number", BLOW_MAP, gt=0, le=10
    )


class RunOptions(Parameters):
    """How long the scene runs."""

    duration: float = quantity(4.0, "s", "simulated time", gt=0, le=1e6)
    settle: float = quantity(
        1.0, "s", "time before blows count for the rate of penetration", ge=0, le=1e6
    )
    check: Flag = choice(False, "verify solver.accuracy by runs at half the step")
