"""Cost estimate of a run, from measurements on its first blows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from percussion_model.analysis.stationary import MOST_BLOWS
from percussion_model.scene.rocks.breaking import rock_of
from percussion_model.scene.scales import scales
from percussion_model.scene.scene import Scene
from percussion_model.simulation.accuracy_control import has_grid, planned_cells, with_cells
from percussion_model.simulation.simulate import MOST_ROW_BYTES, Simulation
from percussion_model.solvers.base import Solver

# A probe ends after so many blows once it took so long [s]; a run that is over sooner is
# measured, not predicted.
PROBE_BLOWS, PROBE_WALL = 4, 1.0
# Without blows, or where they are dear, it ends after so long [s].
LONGEST_PROBE = 8.0
# Blows have ceased where none came for so many mean periods.
CEASED = 4.0
# The first piece of it [s]. Pieces double while they take less than this [s], so that
# calling costs little beside what is measured, up to a share of the run.
FIRST_PIECE, QUICK, LARGEST_PIECE = 1e-6, 3e-3, 0.025

# It ends at this share of the rows that a run may have, too.
ROWS_OF_PROBE = 0.25

# Predictions were within this factor of what was measured (benchmarks/RECORD.md).
FACTOR = 2.0

COUNTED = ("steps", "leaps", "events")


@dataclass(frozen=True)
class Mark:
    """Progress of a probe: simulated time and wall time [s], and counts of the solver."""

    time: float
    wall: float
    counts: dict[str, int]

    @property
    def blows(self) -> int:
        """Blows finished."""
        return self.counts.get("blows", 0)


@dataclass(frozen=True)
class Forecast:
    """Cost estimate of a run."""

    solver: Solver
    setup_time: float  # time to make the solver, compilation included [s]
    wall_time: float  # predicted time of the whole run without set-up [s]
    duration: float  # simulated time of that run [s]
    per_second: float  # time for a simulated second, once blows follow each other [s]
    per_blow: float | None  # time for a blow [s]; None where there were fewer than two
    counts: dict[str, float]  # steps, leaps and events a blow, as far as the solver has them
    probed: float  # simulated time that it rests on [s]
    runs: int = 1  # runs that `setup_time` and `wall_time` are the sum of
    # rows of blows and events of the whole run, as the probe goes on [bytes]
    row_bytes: float = 0.0

    @property
    def refused(self) -> str:
        """Say what ceiling the run is going to meet; empty if none is foreseen."""
        if self.row_bytes <= MOST_ROW_BYTES:
            return ""
        return (
            f"the rows of its blows and events would take about {self.row_bytes:.2g} bytes: the "
            f"run ends with an error at {MOST_ROW_BYTES:.2g}; shorten run.duration"
        )

    @property
    def settled_time(self) -> float | None:
        """Most that `settled` takes, for all its blows [s]; None where a blow's cost is unknown."""
        return None if self.per_blow is None else self.per_blow * MOST_BLOWS


def forecast(scene: Scene) -> Forecast:
    """Estimate the cost of a whole run from the first blows of a scene.

    A wanted accuracy takes several runs: times are those of all, the rest is
    that of the finest. What aperiodic motion or a doubt adds is not foreseen.
    """
    scenes = [scene]
    if scene.solver.accuracy is not None and has_grid(scene):
        scenes = [with_cells(scene, cells) for cells in planned_cells(scene)]
    found = []
    for chosen in scenes:
        simulation = Simulation(chosen)
        marks = probe(simulation, chosen.run.duration)
        one = predict(simulation.solver, simulation.setup_time, marks, chosen.run.duration)
        growth = chosen.run.duration / simulation.time
        found.append(replace(one, row_bytes=growth * simulation.row_bytes))
    return replace(
        found[-1],
        setup_time=sum(one.setup_time for one in found),
        wall_time=sum(one.wall_time for one in found),
        runs=len(found),
    )


def probe(simulation: Simulation, duration: float) -> list[Mark]:
    """Advance piece by piece through the first blows of a run; a mark after each piece."""
    marks = [_mark(simulation)]
    piece = FIRST_PIECE
    while simulation.time < duration:
        simulation.advance(min(simulation.time + piece, duration))
        marks.append(_mark(simulation))
        wall, blows = marks[-1].wall, marks[-1].blows
        if wall - marks[-2].wall < QUICK:
            piece = min(2.0 * piece, LARGEST_PIECE * duration)
        elif piece > FIRST_PIECE:
            piece *= 0.5
        too_many = simulation.row_bytes > ROWS_OF_PROBE * MOST_ROW_BYTES
        if wall > LONGEST_PROBE or too_many or (wall > PROBE_WALL and blows >= PROBE_BLOWS):
            break
    return marks


def _mark(simulation: Simulation) -> Mark:
    return Mark(simulation.time, simulation.wall_time, simulation.statistics())


def predict(solver: Solver, setup_time: float, marks: list[Mark], duration: float) -> Forecast:
    """Predict a whole run from the marks of a probe.

    The rest costs as much as the whole blows of the probe, but for the first, which
    begins in its own way; without two blows as much as the probe.
    """
    last = marks[-1]
    start, end = _steady_part(marks)
    span = end.time - start.time
    per_second = (end.wall - start.wall) / span if span > 0 else 0.0
    blows = end.blows - start.blows
    return Forecast(
        solver=solver,
        setup_time=setup_time,
        wall_time=last.wall + max(duration - last.time, 0.0) * per_second,
        duration=duration,
        per_second=per_second,
        per_blow=(end.wall - start.wall) / blows if blows > 0 else None,
        counts={
            name: (end.counts[name] - start.counts[name]) / blows
            for name in COUNTED
            if blows > 0 and name in end.counts
        },
        probed=last.time,
    )


def _steady_part(marks: list[Mark]) -> tuple[Mark, Mark]:
    """Marks around the part that continues: whole blows, or else all of the probe.

    Where blows have ceased, it is what took the later half of the time since then.
    """
    rises = [mark for before, mark in pairwise(marks) if mark.blows > before.blows]
    if len(rises) < 2:
        return marks[0], marks[-1]
    first, last, end = rises[0], rises[-1], marks[-1]
    period = (last.time - first.time) / (last.blows - first.blows)
    if end.time - last.time < CEASED * period:
        return first, last
    half = 0.5 * (last.wall + end.wall)
    return next((mark for mark in marks[:-1] if mark.wall >= half), last), end


def explained(scene: Scene, found: Forecast) -> dict[str, Any]:
    """Numbers of `percussion explain`, as plain values for JSON, SI units."""
    solver = found.solver
    return {
        "title": scene.title,
        "effects_on": list(scene.effects_on),
        "effects_off": list(scene.effects_off),
        "without_effect": list(scene.unused),
        "rock": rock_of(scene) or None,
        "scales": {name: scale.value for name, scale in scales(scene).items()},
        "solver": solver.name,
        "cells": solver.cells or None,
        "time_step": solver.time_step,
        "wave_speed_error": solver.wave_speed_error,
        "accuracy": scene.solver.accuracy,
        "setup_time": found.setup_time,
        "operator_bytes": solver.operator_bytes,
        "predicted_wall_time": found.wall_time,
        "predicted_within_factor": FACTOR,
        "duration": found.duration,
        "wall_time_per_second": found.per_second,
        "wall_time_per_blow": found.per_blow,
        "per_blow": found.counts,
        "probed": found.probed,
        "runs": found.runs,
        "row_bytes": found.row_bytes,
        "refused": found.refused or None,
        "longest_settled_time": found.settled_time,
    }
