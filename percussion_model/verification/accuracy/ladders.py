"""Ladders of methods: each method at rising effort.

Along a ladder one setting changes; where two must change together, as the penalty of the
finite elements with their mesh, the ladder's note says so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from percussion_model.scene.scene import Scene, SceneError
from percussion_model.solvers.base import Solver
from percussion_model.verification.accuracy.cvode import CvodeSolver, missing
from percussion_model.verification.accuracy.exact_flow import ExactFlowSolver
from percussion_model.verification.accuracy.explicit import ExplicitSolver
from percussion_model.verification.accuracy.problems import APERIODIC, Problem
from percussion_model.verification.accuracy.semidiscrete import refusal

__all__ = ["LADDERS", "Ladder", "Rung", "chosen_ladders", "fem_scene", "ladders"]

# K_C that goes with ten elements in the piston [N/m]; it rises with the square of their
# number, so that the error of the penalty falls like that of the mesh.
STIFFNESS_OF_TEN = 1e12
PAPER_STIFFNESS = 1e12
# Mean transit time of a cell: the finite elements of a long bar get as many as the waves.
WAVE_CELLS = (3, 4, 5, 7, 10, 13, 20, 40, 60, 80, 120)
WAVE_CELLS_FULL = (*WAVE_CELLS, 160, 200)
MESHES, MESHES_FULL = (10, 20, 30, 50, 70), (10, 20, 30, 50, 70, 100)
# Meshes of the peers that are compiled; the matrices of the exact flow are dense.
EXPLICIT, EXPLICIT_FULL = (10, 15, 20, 25, 30, 40, 60, 80), (10, 15, 20, 25, 30, 40, 60, 80, 120)
EXACT_FLOW = (5, 7, 10, 15, 20, 30)
CVODE, TOLERANCE_OF_TEN = (5, 7, 10, 15), 1e-4
FEW = (3, 5, 10, 20)  # of a bar so long that no four of the others are affordable
STEPS = (20.0, 10.0, 5.0, 3.0, 2.0, 1.0)
COURANT = 2.0
# A bar has at most so many elements in a ladder; a long rod gets coarser ones.
MOST_ELEMENTS = 400
DURATIONS = (4.0, 16.0, 64.0, 256.0)  # of aperiodic runs, in sixteenths of the scene's


@dataclass(frozen=True)
class Ladder:
    """A method and the setting that is refined.

    Attributes
    ----------
    name : str
    title : str
        For tables and legends.
    knob : str
        What is refined, and what the order is measured against.
    note : str
        What else there is to know.
    """

    name: str
    title: str
    knob: str
    note: str


LADDERS = {
    one.name: one
    for one in (
        Ladder("wave", "wave", "cell size", "cells in the piston"),
        Ladder(
            "fem",
            "fem",
            "element size",
            "elements in the piston, CFL 2, K_C raised with the square of the mesh",
        ),
        Ladder("fem-time", "fem, time step", "time step", "50 elements, K_C 2.5e13 N/m"),
        Ladder("fem-paper", "fem, paper's K_C", "element size", "CFL 2, K_C 1e12 N/m throughout"),
        Ladder(
            "fem-gauss",
            "fem, fourth order",
            "element size",
            "as fem at CFL 1, with spectral radius 1 (Gauss's scheme)",
        ),
        Ladder(
            "explicit",
            "explicit elements",
            "element size",
            "lumped masses, hard contact, leapfrog at 0.9 of the longest stable step",
        ),
        Ladder(
            "exact-flow",
            "exact flow",
            "element size",
            "elements of mixed mass, hard contact, matrix exponentials between events",
        ),
        Ladder(
            "cvode",
            "CVODE",
            "element size",
            "as exact flow; tolerance 1e-4 at 10 elements, falling with the square of the mesh",
        ),
        Ladder("rigid", "rigid", "", "an error of the model: there is nothing to refine"),
        Ladder("lsoda", "scipy LSODA", "element size", "relative tolerance 1e-4, K_C as fem"),
        Ladder("lsoda-tol", "scipy LSODA, tolerance", "tolerance", "30 elements, K_C as fem"),
        Ladder("radau", "scipy Radau", "element size", "relative tolerance 1e-3, K_C as fem"),
        Ladder("rk45", "scipy RK45", "element size", "relative tolerance 1e-3, K_C as fem"),
        Ladder("dop853", "scipy DOP853", "element size", "relative tolerance 1e-3, K_C as fem"),
        Ladder("bdf", "scipy BDF", "element size", "relative tolerance 1e-4, K_C as fem"),
    )
}

# Integrator, tolerance and meshes of the general methods; where the third is one, tolerances.
_GENERAL: dict[str, tuple[str, tuple[float, ...], tuple[int, ...]]] = {
    "lsoda": ("LSODA", (1e-4,), (5, 10, 20, 30, 50)),
    "lsoda-tol": ("LSODA", (1e-2, 1e-3, 1e-4, 1e-5, 1e-6), (30,)),
    "radau": ("Radau", (1e-3,), (3, 5, 10, 20)),
    "rk45": ("RK45", (1e-3,), (3, 4, 6, 8)),
    "dop853": ("DOP853", (1e-3,), (3, 4, 6, 8)),
    "bdf": ("BDF", (1e-4,), (3, 5, 10, 20)),
}
_FULL_ONLY = ("dop853", "bdf")


@dataclass(frozen=True)
class Rung:
    """A method at one effort.

    Attributes
    ----------
    ladder : str
        Name of the ladder.
    label : str
        As in "20 cells".
    size : float
        What the order is measured against: cell or element size by that of
        the piston, CFL number, or tolerance; simulated time where motion is
        aperiodic.
    scene : Scene
    integrator : str
        Of scipy; empty for the solvers of the package.
    relative : float
        Its tolerance.
    duration : float or None
        Simulated time, where it is not that of the problem [s].
    peer : callable or None
        Makes the solver of a scene where it is none that scenes name.
    """

    ladder: str
    label: str
    size: float
    scene: Scene
    integrator: str = ""
    relative: float = 0.0
    duration: float | None = None
    peer: Callable[[Scene], Solver] | None = None


def chosen_ladders(words: Sequence[str] | None) -> tuple[str, ...]:
    """Names of ladders from words; "scipy" stands for all general integrators.

    Raises
    ------
    SceneError
        If one is not known.
    """
    if words is None:
        return tuple(LADDERS)
    general = tuple(name for name in LADDERS if LADDERS[name].title.startswith("scipy"))
    chosen: list[str] = []
    for word in words:
        if word != "scipy" and word not in LADDERS:
            known = ", ".join([*LADDERS, "scipy"])
            raise SceneError(f"--methods: {word!r} is no method: {known}")
        chosen += general if word == "scipy" else [word]
    return tuple(chosen)


def fem_scene(
    scene: Scene, elements: int, courant: float, stiffness: float, radius: float = 0.0
) -> Scene:
    """Return a scene for the finite elements."""
    changes: dict[str, Any] = {
        "fem.elements": elements,
        "fem.courant": courant,
        "fem.spectral_radius": radius,
    }
    if scene.piston.model != "absent" or scene.effects.rock == "wall":
        changes["fem.contact_stiffness"] = stiffness
    return scene.computed_by("fem", **changes)


def stiffness_of(elements: int) -> float:
    """K_C that goes with a mesh [N/m]."""
    return STIFFNESS_OF_TEN * (elements / 10.0) ** 2


def ladders(problem: Problem, full: bool = False) -> list[Rung]:
    """All rungs that can do a problem.

    Parameters
    ----------
    problem : Problem
    full : bool
        Whether to take the costly rungs as well.
    """
    if problem.kind == APERIODIC:
        return list(_rising_durations(problem, full))
    rungs = [*_waves(problem, full), *_elements(problem, full), *_peers(problem, full)]
    rungs.append(Rung("rigid", "", 1.0, problem.scene.computed_by("rigid")))
    if not refusal(problem.scene):
        rungs += _general(problem, full)
    return rungs


def total_length(scene: Scene) -> float:
    """Length of all bars in lengths of the one whose cells are counted."""
    if scene.piston.model == "absent":
        return 1.0
    return 1.0 + scene.bit.transit_time / scene.piston.transit_time


def _affordable(scene: Scene, counts: tuple[int, ...], most: float) -> list[int]:
    """Numbers of cells that do not make more than `most` in all bars."""
    chosen = [count for count in counts if count * total_length(scene) <= most]
    return chosen if len(chosen) > 3 else list(FEW)


def _waves(problem: Problem, full: bool) -> Iterator[Rung]:
    scene = problem.scene
    counts = WAVE_CELLS_FULL if full else WAVE_CELLS
    for cells in _affordable(scene, counts, 450.0 if full else 270.0):
        chosen = scene.computed_by("wave", **{"solver.cells": cells})
        yield Rung("wave", f"{cells} cells", 1.0 / cells, chosen)


def _elements(problem: Problem, full: bool) -> Iterator[Rung]:
    scene = problem.scene
    meshes = MESHES_FULL if full else MESHES
    counts = _affordable(scene, (5, *meshes), MOST_ELEMENTS if full else MOST_ELEMENTS / 2)
    for count in counts:
        chosen = fem_scene(scene, count, COURANT, stiffness_of(count))
        yield Rung("fem", f"{count} elements", 1.0 / count, chosen)
    middle = max(count for count in counts if count <= 50)
    for courant in STEPS:
        chosen = fem_scene(scene, middle, courant, stiffness_of(middle))
        yield Rung("fem-time", f"CFL {courant:g}", courant, chosen)
    for count in counts if scene.piston.model != "absent" else ():
        chosen = fem_scene(scene, count, COURANT, PAPER_STIFFNESS)
        yield Rung("fem-paper", f"{count} elements", 1.0 / count, chosen)
    for count in counts[: -1 if len(counts) > 4 else None]:
        chosen = fem_scene(scene, count, 1.0, stiffness_of(count), 1.0)
        yield Rung("fem-gauss", f"{count} elements", 1.0 / count, chosen)


def _peers(problem: Problem, full: bool) -> Iterator[Rung]:
    scene, most = problem.scene, MOST_ELEMENTS if full else MOST_ELEMENTS / 2
    for name, solver, meshes, limit in (
        ("explicit", ExplicitSolver, EXPLICIT_FULL if full else EXPLICIT, most),
        ("exact-flow", ExactFlowSolver, EXACT_FLOW, most / 2),
    ):
        for count in _affordable(scene, meshes, limit):
            peer = partial(solver, elements=count)
            yield Rung(name, f"{count} elements", 1.0 / count, scene, peer=peer)
    for count in CVODE[:1] if missing() else CVODE:
        tolerance = TOLERANCE_OF_TEN * (10.0 / count) ** 2
        if count * total_length(scene) < MOST_ELEMENTS / 4:
            general = partial(CvodeSolver, elements=count, tolerance=tolerance)
            yield Rung("cvode", f"{count} elements", 1.0 / count, scene, peer=general)


def _general(problem: Problem, full: bool) -> Iterator[Rung]:
    scene = problem.scene
    for name, (method, tolerances, meshes) in _GENERAL.items():
        if name in _FULL_ONLY and not full:
            continue
        for count in meshes:
            if count * total_length(scene) > MOST_ELEMENTS / 3:
                continue
            chosen = fem_scene(scene, count, COURANT, stiffness_of(count))
            for tolerance in tolerances:
                many = len(tolerances) > 1
                label = f"rtol {tolerance:g}" if many else f"{count} elements"
                size = tolerance if many else 1.0 / count
                yield Rung(name, label, size, chosen, method, tolerance)


def _rising_durations(problem: Problem, full: bool) -> Iterator[Rung]:
    """Aperiodic motion: what costs is the length of the run."""
    scene = problem.scene
    solvers = {
        "wave": (scene.computed_by("wave", **{"solver.cells": 20}), 1.0),
        "fem": (fem_scene(scene, 20, COURANT, stiffness_of(20)), 0.25),
        "rigid": (scene.computed_by("rigid"), 1.0),
    }
    for name, (chosen, share) in solvers.items():
        for factor in DURATIONS:
            duration = share * factor / 16.0 * problem.duration * (4.0 if full else 1.0)
            yield Rung(name, f"{duration:g} s", duration, chosen, duration=duration)
