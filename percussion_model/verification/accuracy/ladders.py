"""Ladders of methods: each method at rising effort.

Along a ladder one setting changes; where two must change together, as the penalty of the
finite elements with their mesh, the ladder's note says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from percussion_model.engine.solvers import ModalSolver
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.solvers.base import Solver
from percussion_model.solvers.modal.resolution import most_modes
from percussion_model.solvers.setup import elastic_times, kelvin_voigt_time
from percussion_model.verification.accuracy.exact_flow import ExactFlowSolver
from percussion_model.verification.accuracy.explicit import COURANT as COURANT_OF_PEER
from percussion_model.verification.accuracy.explicit import ExplicitSolver, stable_step
from percussion_model.verification.accuracy.problems import (
    APERIODIC,
    PILOT_MODES,
    Problem,
    by_modes,
)

# K_C that goes with ten elements in the piston [N/m]; it rises with the square of their
# number, so that the error of the penalty falls like that of the mesh.
STIFFNESS_OF_TEN = 1e12
PAPER_STIFFNESS = 1e12
# Steps in which a wave crosses the first elastic bar.
WAVE_STEPS = (6, 10, 16, 24, 40, 60)
WAVE_STEPS_FULL = (*WAVE_STEPS, 90)
# Modes in the bar of the shortest transit time. They are computed in eights: of numbers that
# fill as many eights the largest is taken.
MODES = (2, 4, 6, 8, 14, 20, 28, 40, 56)
MODES_FULL = (*MODES, 80)
EIGHT = 8
# Modes of the longer bar: with more, each rung takes half a minute to be prepared.
MOST_MODES = 400
# Explicit elements in the piston of a drill string.
STRING_MESHES = (5, 7, 10, 15, 20, 30)
STRING_MESHES_FULL = (*STRING_MESHES, 45)
# Steps and elements of aperiodic motion: with rods, and of two bars.
STRING_STEPS_LONG, STEPS_LONG, MESH_LONG = 16, 20, 20
MESHES = (10, 20, 30, 50, 70)
MESHES_FULL = (*MESHES, 100)

# Compiled peers, their meshes, and the most elements in all bars: those of the exact flow
# have dense matrices.
COMPILED: dict[str, tuple[Callable[..., Solver], tuple[int, ...], float]] = {
    "explicit": (ExplicitSolver, (2, 3, 4, 5, 7, 10, 15, 20, 25, 30, 40, 60, 80, 120), 260.0),
    "exact-flow": (ExactFlowSolver, (2, 3, 5, 7, 10, 15, 20, 30), 100.0),
}
FEW = (3, 5, 10, 20)  # of a bar so long that no four of the others are affordable
STEPS = (20.0, 10.0, 5.0, 3.0, 2.0, 1.0)
COURANT = 2.0
# Near a number of explicit elements, up to this factor off it, the most even mesh is taken.
EVEN_NEAR = 1.15
# A bar has at most so many elements in a ladder; a long rod gets coarser ones.
MOST_ELEMENTS = 400
DURATIONS = (4.0, 16.0, 64.0, 256.0)  # of aperiodic runs, in sixteenths of the scene's


@dataclass(frozen=True)
class Ladder:
    """A method and the setting that is refined."""

    name: str
    title: str  # for tables and legends
    knob: str  # what is refined, and what the order is measured against
    note: str  # what else there is to know
    # "modal", "wave", "fem", "peer" or "rigid", which has another model; a family shares a colour
    family: str = "peer"


LADDERS = {
    one.name: one
    for one in (
        Ladder(
            "modal",
            "modal",
            "number of modes",
            "modes in the bar of the shorter transit time, the longer has more",
            "modal",
        ),
        Ladder("wave", "wave", "step", "steps in which a wave crosses the piston", "wave"),
        Ladder(
            "explicit",
            "explicit elements",
            "element size",
            "lumped masses, hard contact, leapfrog at 0.9 of the longest stable step; near each "
            "number of elements that whose lengths fit the sections best",
        ),
        Ladder(
            "exact-flow",
            "exact flow",
            "element size",
            "elements of mixed mass, hard contact, matrix exponentials between events",
        ),
        Ladder(
            "fem",
            "fem",
            "element size",
            "elements in the piston, CFL 2, K_C raised with the square of the mesh",
            "fem",
        ),
        Ladder("fem-time", "fem, time step", "time step", "50 elements, K_C 2.5e13 N/m", "fem"),
        Ladder(
            "fem-paper",
            "fem, paper's K_C",
            "element size",
            "CFL 2, K_C 1e12 N/m throughout",
            "fem",
        ),
        Ladder(
            "fem-gauss",
            "fem, fourth order",
            "element size",
            "as fem at CFL 1, with spectral radius 1 (Gauss's scheme)",
            "fem",
        ),
        Ladder("rigid", "rigid", "", "an error of the model: there is nothing to refine", "rigid"),
    )
}

# What several scenes are compared by, where no methods are asked for.
COMPARED = "compared"
QUICK = (
    *("modal", "wave"),
    *("explicit", "exact-flow", "fem", "rigid"),
)


@dataclass(frozen=True)
class Rung:
    """A method at one effort."""

    ladder: str  # name of the ladder
    label: str  # as in "24 steps"
    # what the order is measured against: step or element size by that of the piston, or CFL
    # number; simulated time where motion is aperiodic
    size: float
    scene: Scene
    duration: float | None = None  # simulated time, where it is not that of the problem [s]
    # makes a peer's solver of the scene; None for the solver that the scene names
    peer: Callable[[Scene], Solver] | None = None

    @property
    def name(self) -> str:
        """Method and effort, as in "wave, 24 steps"."""
        return f"{self.ladder}, {self.label}"


def chosen_ladders(words: Sequence[str] | None) -> tuple[str, ...]:
    """Names of ladders from words; "compared" stands for own solvers and their quick peers.

    Raises
    ------
    SceneError
        If one is not known.
    """
    if words is None:
        return tuple(LADDERS)
    chosen: list[str] = []
    for word in words:
        if word != COMPARED and word not in LADDERS:
            known = ", ".join([*LADDERS, COMPARED])
            raise SceneError(f"--methods: {word!r} is no method: {known}")
        chosen += QUICK if word == COMPARED else (word,)
    return tuple(dict.fromkeys(chosen))


def refuse_asked(scene: Scene, names: Sequence[str]) -> None:
    """Raise `SceneError`, before anything is computed, where one of the methods refuses a scene."""
    for name in names:
        if name in COMPILED:
            make, meshes, _ = COMPILED[name]
            make(scene, meshes[0])
        elif LADDERS[name].family in ("wave", "fem"):
            scene.computed_by(LADDERS[name].family)
        elif name == "modal":
            by_modes(scene, PILOT_MODES)


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
    scene = problem.scene
    waves = [wave_rung(scene, steps) for steps in (WAVE_STEPS_FULL if full else WAVE_STEPS)]
    if scene.effects.string:
        meshes = STRING_MESHES_FULL if full else STRING_MESHES
        return waves + [peer_rung("explicit", scene, count) for count in meshes]
    return [
        *_modes(scene, full),
        *waves,
        *_compiled(scene, full),
        *_elements(scene, full),
        Rung("rigid", "", 1.0, scene.computed_by("rigid")),
    ]


def wave_rung(scene: Scene, steps: int) -> Rung:
    """Waves that cross the first elastic bar in so many steps."""
    chosen = scene.computed_by("wave", **{"solver.cells": steps})
    return Rung("wave", f"{steps} steps", 1.0 / steps, chosen)


def modal_rung(scene: Scene, modes: int) -> Rung:
    """So many modes in the bar of the shortest transit time."""
    return Rung("modal", f"{modes} modes", 1.0 / modes, by_modes(scene, modes))


def peer_rung(name: str, scene: Scene, elements: int) -> Rung:
    """So many elements of a compiled peer in the first bar."""
    peer = partial(COMPILED[name][0], elements=elements)
    return Rung(name, f"{elements} elements", 1.0 / elements, scene, peer=peer)


def total_length(scene: Scene) -> float:
    """Length of piston and bit in lengths of the one whose elements are counted."""
    if scene.piston.model == "absent":
        return 1.0
    return 1.0 + scene.bit.transit_time / scene.piston.transit_time


def _affordable(scene: Scene, counts: tuple[int, ...], most: float) -> list[int]:
    """Numbers of elements that do not make more than `most` in all bars."""
    chosen = [count for count in counts if count * total_length(scene) <= most]
    return chosen if len(chosen) > 3 else list(FEW)


def _modal(scene: Scene, modes: int) -> Solver:
    return ModalSolver(by_modes(scene, modes))


def affordable_modes(scene: Scene, wished: Sequence[int]) -> list[int]:
    """Numbers of modes in the bar of the shortest transit time that are soon prepared."""
    numbers = numbers_of(scene)
    first, shortest = elastic_times(numbers)
    longest = max(first, scene.bit.transit_time)
    most = min(MOST_MODES * shortest / longest, most_modes(numbers) * shortest / first)
    by_eights = {
        (math.ceil(count / EIGHT), math.ceil(count * longest / shortest / EIGHT)): count
        for count in wished
        if count <= most
    }
    return list(by_eights.values()) or [wished[0]]


def _modes(scene: Scene, full: bool) -> list[Rung]:
    counts = affordable_modes(scene, MODES_FULL if full else MODES)
    try:
        _modal(scene, PILOT_MODES)
    except SceneError:  # its note will tell why
        return [Rung("modal", "", 1.0, scene, peer=partial(_modal, modes=PILOT_MODES))]
    return [modal_rung(scene, count) for count in counts]


def even_mesh(scene: Scene, about: int) -> int:
    """Number of explicit elements near `about` whose smallest, which sets the step, is not small.

    All elements would be alike at the step that the mean of their transit times allows.
    """
    loss = kelvin_voigt_time(numbers_of(scene))
    bars = [bar.transit_time for bar in scene.bars.values()]

    def unevenness(count: int) -> tuple[float, int]:
        made = ExplicitSolver(scene, count)
        longest = COURANT_OF_PEER * stable_step(sum(bars) / sum(made.cells.values()), loss)
        return round(longest / made.time_step, 2), abs(count - about)

    counts = range(math.ceil(about / EVEN_NEAR), math.floor(about * EVEN_NEAR) + 1)
    return min(counts or [about], key=unevenness)


def _elements(scene: Scene, full: bool) -> Iterator[Rung]:
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


def _compiled(scene: Scene, full: bool) -> Iterator[Rung]:
    for name, (make, meshes, most) in COMPILED.items():
        try:
            make(scene, meshes[0])
            counts = _affordable(scene, meshes, most * (2.0 if full else 1.0))
        except SceneError:
            counts = [meshes[0]]  # its note will tell why
        if name == "explicit" and len(counts) > 1:
            counts = sorted({even_mesh(scene, count) for count in counts})
        yield from (peer_rung(name, scene, count) for count in counts)


def _rising_durations(problem: Problem, full: bool) -> Iterator[Rung]:
    """Aperiodic motion: what costs is the length of the run."""
    scene = problem.scene
    steps = STRING_STEPS_LONG if scene.effects.string else STEPS_LONG
    solvers = {
        "wave": (scene.computed_by("wave", **{"solver.cells": steps}), 1.0),
        "explicit": (scene, 1.0),
    }
    if not scene.effects.string:
        solvers = {
            "modal": (by_modes(scene, 20), 1.0),
            **solvers,
            "fem": (fem_scene(scene, 20, COURANT, stiffness_of(20)), 0.25),
            "rigid": (scene.computed_by("rigid"), 1.0),
        }
    for name, (chosen, share) in solvers.items():
        peer = partial(ExplicitSolver, elements=MESH_LONG) if name == "explicit" else None
        for factor in DURATIONS:
            duration = share * factor / 16.0 * problem.duration * (4.0 if full else 1.0)
            yield Rung(name, f"{duration:g} s", duration, chosen, duration=duration, peer=peer)
